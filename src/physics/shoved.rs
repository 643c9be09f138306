//! A body that is shoved over a level support by a known force at a known place, fast enough that inertia counts, and that
//! coasts when it is let go.
//!
//! Where the pressure below it is known, its friction is summed over that ([`LimitSurface`]); else
//! `m v' = F - P v/s`, `m rho² w' = (p - c) x F + T - P c² w/s` with `s = sqrt(v² + c² w²)`: Newton and Euler at the centre of
//! mass against the ellipsoidal limit surface (Howe and Cutkosky 1996) with friction force `P = mu (m g - F_z)`; at
//! rest while the load is within the surface. Mass shows where speed changes, friction where nothing pushes, the radius of gyration
//! where the body is turned.

use nalgebra::Vector2;

use super::limit_surface::Sliding;
use super::shove::{Load, Shove, load_at};
use super::{LimitSurface, PlaneMotion, Rubbing, Simulator};
use crate::math::Real;

/// What is shoved, in numbers that may carry derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Shoved<'a, T = f64> {
    /// kg.
    pub mass: T,
    /// Kinetic friction force, N.
    pub friction: T,
    /// Torsional radius of the limit surface, m.
    pub torsional_radius: T,
    /// Radius of gyration about the support's normal, m.
    pub gyration_radius: T,
    /// From the tracked point to the centre of mass, axes of the body at heading nought, m.
    pub centre: Vector2<T>,
    /// Height of the centre of mass above the support, m.
    pub height: f64,
    /// Gravity along the support's normal, m/s².
    pub gravity: f64,
    /// The pressure below it were it even, with the heading at which the body's axes are those of the plane.
    pub surface: Option<(&'a LimitSurface, f64)>,
    /// From the centre of that pressure to the centre of mass, axes of the body at heading nought, m.
    pub off: Vector2<T>,
    /// By how much later than the motion the load was read, s.
    pub late: T,
}

impl<T: Rubbing> Simulator for Shoved<'_, T> {
    type Drive = [Shove];
    /// Motion of the centre of mass.
    type State = PlaneMotion<T>;
    /// Motion of the tracked point.
    type Seen = PlaneMotion<T>;

    const STEP: f64 = 1e-3;

    fn advance(&self, state: &PlaneMotion<T>, drive: &[Shove], t: f64, h: f64) -> PlaneMotion<T> {
        self.after(state, &load_at(drive, self.late + (t + 0.5 * h)), h)
    }

    fn seen(&self, state: &PlaneMotion<T>) -> PlaneMotion<T> {
        self.moved(state, -1.0)
    }
}

impl<T: Rubbing> Shoved<'_, T> {
    /// The motion of the centre of mass where the tracked point moves like this.
    pub fn centred(&self, tracked: &PlaneMotion<T>) -> PlaneMotion<T> {
        self.moved(tracked, 1.0)
    }

    /// The motion of the point that is `way` times the centre's offset away.
    fn moved(&self, from: &PlaneMotion<T>, way: f64) -> PlaneMotion<T> {
        let arm = turned(from.heading.sin_cos(), self.centre);
        let arm = Vector2::new(arm.x * way, arm.y * way);
        PlaneMotion {
            position: Vector2::new(from.position.x + arm.x, from.position.y + arm.y),
            velocity: swept(from.velocity, from.spin, arm),
            ..*from
        }
    }

    /// The motion of the centre of mass a step `h` later: friction by the implicit rule, which holds still what the load
    /// cannot move and never turns a motion round.
    fn after(&self, now: &PlaneMotion<T>, shove: &Load<T>, h: f64) -> PlaneMotion<T> {
        let arm = Vector2::new(shove.at.x - now.position.x, shove.at.y - now.position.y);
        let turning = cross(arm, shove.force) + shove.moment;
        let step = T::of(h) / self.mass;
        let step_about = step / (self.gyration_radius * self.gyration_radius);
        let velocity = along(now.velocity, shove.force, step);
        let spin = now.spin + turning * step_about;
        // What presses harder than three times the weight is a blow, which this law does not follow.
        let load = (T::of(1.0) - shove.lift / (self.mass * self.gravity)).within(0.0, 3.0);
        let friction = (self.friction * load).larger(T::of(1e-9));
        let ahead = self.ahead(velocity, spin, shove, friction, load);
        let (next, next_spin) = match self.surface {
            Some((surface, aligned)) => {
                let local = (T::of(aligned) - now.heading).sin_cos();
                let stiffer = (self.torsional_radius / self.gyration_radius).larger(T::of(1.0));
                let [x, y, moment] = T::rubbed(
                    surface,
                    &Sliding {
                        velocity: turned(local, velocity),
                        spin,
                        centre: turned(T::of(aligned).sin_cos(), self.off),
                        ahead: turned(local, ahead),
                        scale: self.torsional_radius * surface.radius().recip(),
                        slow: friction * step * stiffer * stiffer,
                    },
                );
                let force = turned((-local.0, local.1), Vector2::new(x, y));
                (
                    along(velocity, force, friction * step),
                    spin + moment * friction * step_about,
                )
            }
            None => self.slowed(velocity, spin, ahead, [friction * step, friction * step_about]),
        };
        let half = 0.5 * h;
        let middle = |a: T, b: T| (a + b) * half;
        PlaneMotion {
            position: Vector2::new(
                now.position.x + middle(now.velocity.x, next.x),
                now.position.y + middle(now.velocity.y, next.y),
            ),
            heading: now.heading + middle(now.spin, next_spin),
            velocity: next,
            spin: next_spin,
        }
    }

    /// Velocity and spin a step later by the ellipsoid, from those before friction; `steps` are what it takes off at most.
    fn slowed(&self, velocity: Vector2<T>, spin: T, ahead: Vector2<T>, steps: [T; 2]) -> (Vector2<T>, T) {
        let c = self.torsional_radius;
        let at_load = swept(velocity, spin, ahead);
        let (a, b) = (steps[0], steps[1] * c * c);
        let (speed, about) = (size(at_load), c * spin.larger(-spin));
        let still = T::of(0.0);
        if (speed / a).value().hypot((about / b).value()) <= 1.0 {
            return (Vector2::new(still, still), still);
        }
        let s = generalised(speed, about, a, b);
        let share = s / (s + a) - 1.0;
        let change = Vector2::new(at_load.x * share, at_load.y * share);
        let next_spin = spin * (s / (s + b)) + cross(ahead, change) * (steps[1] / steps[0]);
        (along(velocity, change, T::of(1.0)), next_spin)
    }

    /// From below the centre of mass to where the load acts: the tool above or below the centre of mass and the friction
    /// below it tip the body.
    fn ahead(&self, velocity: Vector2<T>, spin: T, shove: &Load<T>, friction: T, load: T) -> Vector2<T> {
        let c = self.torsional_radius;
        let about = c * spin;
        let speed = (velocity.x * velocity.x + velocity.y * velocity.y + about * about).sqrt();
        let rub = friction / speed.larger(T::of(1e-9)) * self.height;
        let weight = load.larger(T::of(0.1)) * self.mass * self.gravity;
        let (tool, rub) = ((shove.height - self.height) / weight, rub / weight);
        let ahead = Vector2::new(
            shove.force.x * tool + velocity.x * rub,
            shove.force.y * tool + velocity.y * rub,
        );
        // Beyond the radius the thing would topple: what is pushed on the table stays within.
        let within = c / size(ahead).larger(c);
        Vector2::new(ahead.x * within, ahead.y * within)
    }
}

fn turned<T: Real>((sin, cos): (T, T), v: Vector2<T>) -> Vector2<T> {
    Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// `v + w x arm`.
fn swept<T: Real>(v: Vector2<T>, spin: T, arm: Vector2<T>) -> Vector2<T> {
    Vector2::new(v.x - spin * arm.y, v.y + spin * arm.x)
}

fn cross<T: Real>(a: Vector2<T>, b: Vector2<T>) -> T {
    a.x * b.y - a.y * b.x
}

fn along<T: Real>(v: Vector2<T>, way: Vector2<T>, by: T) -> Vector2<T> {
    Vector2::new(v.x + way.x * by, v.y + way.y * by)
}

fn size<T: Real>(v: Vector2<T>) -> T {
    (v.x * v.x + v.y * v.y).sqrt()
}

/// The speed `s` with `(along/(s+a))² + (about/(s+b))² = 1`: decreasing in `s`, convex, above one at nought. Found in plain
/// numbers; one more step of Newton's gives it the derivatives.
fn generalised<T: Real>(along: T, about: T, a: T, b: T) -> T {
    let value = |s: T| {
        let (x, y) = (along / (s + a), about / (s + b));
        x * x + y * y - 1.0
    };
    let (along, about, a, b) = (along.value(), about.value(), a.value(), b.value());
    let slope = |s: f64| {
        let (x, y) = (along / (s + a), about / (s + b));
        -2.0 * (x * x / (s + a) + y * y / (s + b))
    };
    let mut s = (along.hypot(about) - a.max(b)).max(0.0);
    for _ in 0..30 {
        let next = (s - value(T::of(s)).value() / slope(s)).max(0.0);
        let settled = (next - s).abs() <= 1e-12 + 1e-9 * s;
        s = next;
        if settled {
            break;
        }
    }
    T::of(s) - value(T::of(s)) * slope(s).recip()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Dual;
    use nalgebra::{Point2, Rotation2};

    const BOX: Shoved<'static> = Shoved {
        mass: 0.5,
        friction: 1.5,
        torsional_radius: 0.03,
        gyration_radius: 0.035,
        centre: Vector2::new(0.004, -0.002),
        height: 0.0,
        gravity: 9.81,
        surface: None,
        off: Vector2::new(0.0, 0.0),
        late: 0.0,
    };

    const REST: PlaneMotion = PlaneMotion {
        position: Vector2::new(0.1, 0.2),
        heading: 0.3,
        velocity: Vector2::new(0.0, 0.0),
        spin: 0.0,
    };

    fn pulse(force: f64, offset: f64) -> Vec<Shove> {
        let at = Point2::from(REST.position + Rotation2::new(0.3) * (BOX.centre + Vector2::new(-0.05, offset)));
        let row = |(time, f): (f64, f64)| Shove {
            time,
            force: Rotation2::new(0.3) * Vector2::new(f, 0.0),
            at,
            moment: 0.0,
            height: 0.0,
            lift: 0.0,
        };
        [(0.0, force), (0.1, force), (0.1001, 0.0), (2.0, 0.0)]
            .map(row)
            .to_vec()
    }

    fn path(force: f64, offset: f64, step: f64) -> Vec<PlaneMotion> {
        let times: Vec<f64> = (0..100).map(|k| k as f64 * 0.01).collect();
        BOX.simulate_with_step(&BOX.centred(&REST), &pulse(force, offset), 0.0, &times, step)
    }

    #[test]
    fn less_than_friction_moves_nothing() {
        let end = path(1.4, 0.0, 1e-3)[99];
        assert!((end.position - REST.position).norm() < 1e-12 && end.heading == 0.3);
    }

    #[test]
    fn a_central_shove_goes_as_far_as_the_impulse_says() {
        let end = path(6.0, 0.0, 1e-3)[99];
        let (up, down) = ((6.0 - 1.5) / 0.5, 1.5 / 0.5);
        let top: f64 = up * 0.1;
        let way = 0.5 * top * 0.1 + top * top / (2.0 * down);
        assert!(((end.position - REST.position).norm() - way).abs() < 2e-3 * way);
        assert!((end.heading - 0.3).abs() < 1e-9);
    }

    #[test]
    fn its_derivatives_are_those_of_differences() {
        let points: Vec<(Vector2<f64>, f64)> = (0..64)
            .map(|k| {
                let at = |k: usize, edge: f64| ((k as f64 + 0.5) / 8.0 - 0.5) * edge;
                (Vector2::new(at(k % 8, 0.1), at(k / 8, 0.06)), 1.0 / 64.0)
            })
            .collect();
        let surface = LimitSurface::of(&points).expect("a plate");
        let times: Vec<f64> = (0..25).map(|k| f64::from(k) * 0.01).collect();
        let mut shoves = pulse(6.0, 0.01);
        shoves[1].force *= 0.8;
        fn body<'a, T: Rubbing>(x: [T; 4], surface: Option<(&'a LimitSurface, f64)>) -> Shoved<'a, T> {
            Shoved {
                mass: x[0],
                friction: x[1],
                torsional_radius: T::of(0.03),
                gyration_radius: T::of(0.035),
                centre: Vector2::new(x[2], T::of(-0.002)),
                height: 0.02,
                gravity: 9.81,
                surface,
                off: Vector2::new(x[2], T::of(-0.002)),
                late: x[3],
            }
        }
        for surface in [None, Some((&surface, 0.1))] {
            let at = [0.5, 1.5, 0.004, 0.001];
            let plain = |x: [f64; 4]| {
                let body = body(x, surface);
                body.simulate(&body.centred(&REST), &shoves, 0.0, &times)[24]
            };
            let exact = body([0, 1, 2, 3].map(|k| Dual::<4>::variable(at[k], k)), surface);
            let number = Dual::<4>::of;
            let rest = PlaneMotion {
                position: REST.position.map(number),
                heading: number(REST.heading),
                velocity: REST.velocity.map(number),
                spin: number(REST.spin),
            };
            let end = exact.simulate(&exact.centred(&rest), &shoves, 0.0, &times)[24];
            assert!((end.position.x.value - plain(at).position.x).abs() < 1e-12);
            for k in 0..4 {
                let side = |h: f64| {
                    let mut x = at;
                    x[k] += h;
                    plain(x)
                };
                let h = 1e-6;
                let (up, down) = (side(h), side(-h));
                for (slope, a, b) in [
                    (end.position.x.slopes[k], up.position.x, down.position.x),
                    (end.position.y.slopes[k], up.position.y, down.position.y),
                    (end.heading.slopes[k], up.heading, down.heading),
                ] {
                    let by = (a - b) / (2.0 * h);
                    assert!((slope - by).abs() < 2e-3 * (0.02 + by.abs()), "{k}: {slope} {by}");
                }
            }
        }
    }

    #[test]
    fn halving_the_step_changes_little() {
        let (coarse, fine) = (path(6.0, 0.01, 1e-3), path(6.0, 0.01, 5e-4));
        for (a, b) in coarse.iter().zip(&fine) {
            assert!((a.position - b.position).norm() < 5e-5 && (a.heading - b.heading).abs() < 1e-3);
        }
        assert!((fine[99].heading - 0.3).abs() > 0.02);
    }

    #[test]
    fn under_a_known_pressure_it_goes_as_far_turns_and_stays_where_it_stops() {
        let n = 20;
        let at = |k: usize, edge: f64| ((k as f64 + 0.5) / f64::from(n) - 0.5) * edge;
        let points: Vec<(Vector2<f64>, f64)> = (0..(n * n) as usize)
            .map(|k| (Vector2::new(at(k % 20, 0.1), at(k / 20, 0.06)), 1.0 / f64::from(n * n)))
            .collect();
        let surface = LimitSurface::of(&points).expect("a plate");
        let plate = Shoved {
            surface: Some((&surface, 0.0)),
            torsional_radius: surface.radius(),
            ..BOX
        };
        let path = |offset: f64, step: f64| {
            let times: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.01).collect();
            plate.simulate_with_step(&plate.centred(&REST), &pulse(6.0, offset), 0.0, &times, step)
        };
        let (straight, turned, fine) = (path(0.0, 1e-3), path(0.01, 1e-3), path(0.01, 2.5e-4));
        let way = 0.5 * 0.9 * 0.1 + 0.9 * 0.9 / (2.0 * 3.0);
        assert!(((straight[99].position - REST.position).norm() - way).abs() < 3e-3 * way);
        for (a, b) in turned.iter().zip(&fine) {
            assert!((a.position - b.position).norm() < 2e-4 && (a.heading - b.heading).abs() < 3e-3);
        }
        assert!((turned[99].heading - 0.3).abs() > 0.02 && turned[99].velocity.norm() < 1e-9);
    }
}
