//! Hidden effects on a body that slides on the table: factors on its friction, and forces on its centre of mass.
//!
//! Most have another functional form than the textbook's: a rational Stribeck curve, a contact that renews itself over
//! the slip length, a disc, a raised cosine, a dipole.

use std::f64::consts::{PI, TAU};

use nalgebra::{Vector2, Vector3};

/// How a body stands, or how heavy it moves, other than it should.
#[derive(Clone, Copy, Debug)]
pub(in crate::lab) enum Make {
    /// The feet far out carry more (or less) by this share.
    Pressure(f64),
    /// Travel before the friction is up, beyond the usual one, m.
    Presliding(f64),
    /// The table gives by so much for each newton, m/N.
    Soft(f64),
}

/// What is around the body in a step.
#[derive(Clone, Copy, Debug)]
pub(in crate::lab) struct Surroundings {
    /// Its centre of mass and the velocity there, m and m/s.
    pub place: Vector3<f64>,
    /// m/s.
    pub velocity: Vector3<f64>,
    /// rad/s.
    pub spin: Vector3<f64>,
    /// m/s², axes of the table.
    pub gravity: Vector3<f64>,
    /// kg, all of it.
    pub mass: f64,
    /// s since the first action began.
    pub clock: f64,
    /// s.
    pub dt: f64,
}

/// A law of sliding with its state. Places are world coordinates (m), directions are angles from +x (rad).
#[derive(Clone, Debug)]
pub(in crate::lab) enum SlideLaw {
    /// `1 + a / (1 + (v/vs)²)`.
    Weakening { amplitude: f64, speed: f64 },
    /// `-b v`.
    Viscous { damping: f64 },
    /// `1 + beta log10(1 + theta)`, `theta' = 1 - v theta / Dc` (Dieterich 1979).
    Ageing { beta: f64, length: f64, theta: f64 },
    /// `1 + A asinh(v/2v0) - B ln(1 + v/v1)` with the memory of a slip length (Ruina 1983, regularised).
    RateState {
        direct: f64,
        evolution: f64,
        length: f64,
        theta: f64,
    },
    /// An ellipse of friction with these unequal axes.
    Anisotropic { amplitude: f64, direction: f64 },
    /// A disc.
    Patch {
        amplitude: f64,
        at: Vector2<f64>,
        radius: f64,
    },
    /// Share a metre.
    Wear { rate: f64, slid: f64 },
    /// A raised cosine.
    Bump { height: f64, at: Vector2<f64>, radius: f64 },
    /// A dipole below the table.
    Magnet { force: f64, at: Vector2<f64>, depth: f64 },
    /// Slack up to its length.
    Tether {
        stiffness: f64,
        at: Vector2<f64>,
        length: f64,
    },
    /// Glue that tears in the first push.
    Bond {
        force: f64,
        length: f64,
        start: Option<Vector2<f64>>,
        /// How far it was drawn out, m: what is torn pulls no more on the way back.
        drawn: f64,
        whole: bool,
    },
    /// A thing in the way: a mass with friction that is met at `at` along `way`.
    Unseen {
        mass: f64,
        friction: f64,
        way: Vector2<f64>,
        at: f64,
        state: [f64; 2],
    },
    /// A mass on a spring inside; state: offset and velocity of the mass, world.
    LooseMass {
        mass: f64,
        rate: f64,
        damping: f64,
        state: Option<[Vector3<f64>; 2]>,
    },
    /// A couple against the turn about level axes: the load acts so far ahead of the middle (m), farther by `rises` of it at 0.1 m/s.
    Rolling { length: f64, rises: f64 },
    /// Mass that does not weigh.
    AddedInertia { mass: f64 },
    /// `1 + a (exp(1 - N/N0) - 1)` of the load `N` that the table bears, smoothed over some steps, and the weight `N0`, N.
    Load { amplitude: f64, weight: f64, load: f64 },
    /// Outside the catalogue: friction that is periodic in place.
    Texture {
        amplitude: f64,
        wave: Vector2<f64>,
        at: Vector2<f64>,
    },
    /// Outside the catalogue: a nap that is rough one way.
    Ratchet { amplitude: f64, direction: f64 },
    /// Outside the catalogue: a table that trembles, m/s² and Hz.
    Shaking {
        acceleration: f64,
        frequency: f64,
        way: Vector2<f64>,
    },
}

/// Turning below which rolling resistance fades out, rad/s.
const TURNS: f64 = 0.05;
/// Share of a step's load that is taken on.
const SMOOTH: f64 = 0.02;

impl SlideLaw {
    /// Whether it acts on a body that rests and is left alone.
    pub fn never_rests(&self) -> bool {
        matches!(self, Self::Shaking { acceleration, .. } if *acceleration > 0.0)
    }

    /// Whether it acts on a body that is lifted.
    pub fn acts_in_the_air(&self) -> bool {
        matches!(self, Self::AddedInertia { .. } | Self::LooseMass { .. })
    }

    /// Turns shares of the mass of the body (kg) into masses, and gives the factor on what of it moves with the body.
    pub fn bear(&mut self, whole: f64) -> f64 {
        match self {
            Self::AddedInertia { mass } => {
                let share = *mass;
                *mass *= whole;
                1.0 + share
            }
            Self::LooseMass { mass, .. } => {
                let share = *mass;
                *mass *= whole;
                1.0 - share
            }
            Self::Unseen { mass, .. } => {
                *mass *= whole;
                1.0
            }
            Self::Load { weight, load, .. } => {
                (*weight, *load) = (whole * 9.81, whole * 9.81);
                1.0
            }
            _ => 1.0,
        }
    }

    /// Sets the memory at the beginning of an action: stillness before it (s), way slid before it (m), whether nothing
    /// was moved yet.
    pub fn begin(&mut self, wait: f64, before: f64, first: bool) {
        match self {
            Self::Ageing { theta, .. } | Self::RateState { theta, .. } => *theta = wait,
            Self::Wear { slid, .. } => *slid = before,
            Self::Bond { whole, .. } => *whole = first,
            _ => {}
        }
    }

    /// The factor on the friction of a foot at `at` that slides with `velocity`.
    pub fn factor(&self, at: &Vector3<f64>, velocity: &Vector3<f64>) -> f64 {
        let slip = velocity.xy();
        match self {
            Self::Weakening { amplitude, speed } => 1.0 + amplitude / (1.0 + slip.norm_squared() / (speed * speed)),
            Self::Ageing { beta, theta, .. } => 1.0 + beta * (1.0 + theta).log10(),
            Self::RateState {
                direct,
                evolution,
                length,
                theta,
            } => {
                let slow = 1e-3;
                1.0 + direct * (slip.norm() / (2.0 * slow)).asinh() + evolution * (1.0 + slow * theta / length).ln()
            }
            Self::Anisotropic { amplitude, direction } => {
                let angle = slip.y.atan2(slip.x) - direction;
                let (s, c) = angle.sin_cos();
                let (long, short) = (1.0 + amplitude, 1.0 - amplitude);
                if *amplitude == 0.0 {
                    return 1.0;
                }
                1.0 / ((c / long).powi(2) + (s / short).powi(2)).sqrt()
            }
            Self::Patch {
                amplitude,
                at: p,
                radius,
            } if (at.xy() - p).norm() < *radius => 1.0 + amplitude,
            Self::Wear { rate, slid } => 1.0 + rate * slid / (1.0 + 0.3 * slid),
            Self::Texture { amplitude, wave, at } => 1.0 + amplitude * wave.dot(at).sin(),
            Self::Load {
                amplitude,
                weight,
                load,
            } => 1.0 + amplitude * ((1.0 - load / weight.max(1e-9)).exp() - 1.0),
            Self::Ratchet { amplitude, direction } => {
                let angle = slip.y.atan2(slip.x) - direction;
                1.0 + amplitude * (4.0 * angle.cos()).tanh()
            }
            _ => 1.0,
        }
    }

    /// What the table bears of the body in a step, N.
    pub fn feel(&mut self, bears: f64) {
        if let Self::Load { load, .. } = self {
            *load += SMOOTH * (bears.max(0.0) - *load);
        }
    }

    /// Advances the state by a step and gives the force on the centre of mass, N.
    pub fn advance(&mut self, s: &Surroundings) -> Vector3<f64> {
        let (place, velocity) = (s.place.xy(), s.velocity.xy());
        let load = (-s.gravity.z * s.mass).max(0.0);
        let flat = |f: Vector2<f64>| Vector3::new(f.x, f.y, 0.0);
        match self {
            Self::Viscous { damping } => flat(velocity * -*damping),
            Self::Ageing { length, theta, .. } | Self::RateState { length, theta, .. } => {
                let speed = velocity.norm();
                let slip = if speed > 2e-4 { speed } else { 0.0 };
                *theta = (*theta + s.dt) / (1.0 + slip * s.dt / *length);
                Vector3::zeros()
            }
            Self::Wear { slid, .. } => {
                *slid += velocity.norm() * s.dt;
                Vector3::zeros()
            }
            Self::Texture { at, .. } => {
                *at = place;
                Vector3::zeros()
            }
            Self::Bump { height, at, radius } => flat(bump(&(place - *at), *height, *radius) * load),
            Self::Magnet { force, at, depth } => {
                let away = (place - *at) / *depth;
                flat(away * (-*force * 3.5 / (1.0 + away.norm_squared()).powf(2.5)))
            }
            Self::Tether { stiffness, at, length } => {
                let away = place - *at;
                let far = away.norm().max(1e-9);
                flat(away * (-*stiffness * (far - *length).max(0.0) / far))
            }
            Self::Bond {
                force,
                length,
                start,
                drawn,
                whole,
            } => {
                let away = place - *start.get_or_insert(place);
                let far = away.norm();
                let back = far < *drawn - 1e-4;
                *drawn = drawn.max(far);
                if !*whole || back || far < 1e-12 {
                    return Vector3::zeros();
                }
                let size = *force * (far / 1e-4).min(1.0) * (1.0 - far / (2.0 * *length)).max(0.0);
                flat(away * (-size / far))
            }
            Self::Shaking {
                acceleration,
                frequency,
                way,
            } => flat(*way * (s.mass * *acceleration * (TAU * *frequency * s.clock).sin())),
            Self::AddedInertia { mass } => s.gravity * -*mass,
            Self::Unseen { .. } | Self::LooseMass { .. } => self.advance_mass(s),
            _ => Vector3::zeros(),
        }
    }

    /// The couple on the body, N m.
    pub fn couple(&self, s: &Surroundings) -> Vector3<f64> {
        let Self::Rolling { length, rises } = self else {
            return Vector3::zeros();
        };
        let level = Vector3::new(s.spin.x, s.spin.y, 0.0);
        let load = (-s.gravity.z * s.mass).max(0.0);
        let reach = *length * (1.0 + *rises * s.velocity.xy().norm() / 0.1);
        // Rounded where it hardly turns, so that a step does not turn it about.
        level * (-reach * load / level.norm().max(TURNS))
    }

    /// The laws with a mass of their own, by symplectic Euler steps.
    fn advance_mass(&mut self, s: &Surroundings) -> Vector3<f64> {
        match self {
            Self::Unseen {
                mass,
                friction,
                way,
                at,
                state: [x, v],
            } => {
                let (here, speed) = (way.dot(&s.place.xy()), way.dot(&s.velocity.xy()));
                let depth = here - *at - *x;
                if *mass <= 0.0 || (depth <= 0.0 && *v == 0.0) {
                    return Vector3::zeros();
                }
                let push = if depth > 0.0 {
                    (1e4 * depth + 20.0 * (speed - *v)).max(0.0)
                } else {
                    0.0
                };
                let rub = *friction * *mass * 9.81;
                let moving = *v + push / *mass * s.dt;
                *v = moving.signum() * (moving.abs() - rub / *mass * s.dt).max(0.0);
                *x += *v * s.dt;
                Vector3::new(way.x, way.y, 0.0) * -push
            }
            Self::LooseMass {
                mass,
                rate,
                damping,
                state,
            } => {
                let [offset, speed] = state.get_or_insert([s.place, s.velocity]);
                let stretch = s.place - *offset;
                let (k, c) = (*mass * *rate * *rate, 2.0 * *damping * *mass * *rate);
                let pull = Vector3::new(stretch.x, stretch.y, 0.0) * k
                    + Vector3::new(s.velocity.x - speed.x, s.velocity.y - speed.y, 0.0) * c;
                if *mass > 0.0 {
                    let level = Vector3::new(s.gravity.x, s.gravity.y, 0.0);
                    *speed += (pull / *mass + level) * s.dt;
                    *offset += *speed * s.dt;
                }
                Vector3::new(0.0, 0.0, s.gravity.z * *mass) - pull
            }
            _ => Vector3::zeros(),
        }
    }
}

/// Downhill slope of a raised cosine of this height and half width, as force for each newton of weight.
fn bump(away: &Vector2<f64>, height: f64, radius: f64) -> Vector2<f64> {
    let (far, wide) = (away.norm(), 2.2 * radius);
    if far >= wide || far < 1e-12 {
        return Vector2::zeros();
    }
    away * (0.5 * height * PI / wide * (PI * far / wide).sin() / far)
}
