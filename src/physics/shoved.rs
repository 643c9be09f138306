//! A body that is shoved over a level support by a known force at a known place, fast enough that inertia counts, and that
//! coasts when it is let go.
//!
//! Where the pressure below it is known, its friction is summed over that ([`LimitSurface`]); else
//! `m v' = F - P v/s`, `m rho² w' = (p - c) x F + T - P c² w/s` with `s = sqrt(v² + c² w²)`: Newton and Euler at the centre of
//! mass against the ellipsoidal limit surface (Howe and Cutkosky 1996) with friction force `P = mu (m g - F_z)`; at
//! rest while the load is within the surface. Mass shows where speed changes, friction where nothing pushes, the radius of gyration
//! where the body is turned.

use nalgebra::{Point2, Rotation2, Vector2};

use super::limit_surface::Sliding;
use super::simulator::rows_about;
use super::{LimitSurface, PlaneMotion, Simulator};

/// What is shoved.
#[derive(Clone, Copy, Debug)]
pub struct Shoved<'a> {
    /// kg.
    pub mass: f64,
    /// Kinetic friction force, N.
    pub friction: f64,
    /// Torsional radius of the limit surface, m.
    pub torsional_radius: f64,
    /// Radius of gyration about the support's normal, m.
    pub gyration_radius: f64,
    /// From the tracked point to the centre of mass, axes of the body at heading nought, m.
    pub centre: Vector2<f64>,
    /// Height of the centre of mass above the support, m.
    pub height: f64,
    /// Gravity along the support's normal, m/s².
    pub gravity: f64,
    /// The pressure below it were it even, with the heading at which the body's axes are those of the plane.
    pub surface: Option<(&'a LimitSurface, f64)>,
    /// From the centre of that pressure to the centre of mass, axes of the body at heading nought, m.
    pub off: Vector2<f64>,
}

/// What the tool does at one time, in the plane.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shove {
    /// s.
    pub time: f64,
    /// N, on the body.
    pub force: Vector2<f64>,
    /// A point on the force's line, m.
    pub at: Point2<f64>,
    /// Moment beside that of the force, N·m.
    pub moment: f64,
    /// Height above the support at which it acts, m.
    pub height: f64,
    /// Force on the body away from the support, N: what the tool carries does not rub.
    pub lift: f64,
}

impl Simulator for Shoved<'_> {
    type Drive = [Shove];
    /// Motion of the centre of mass.
    type State = PlaneMotion;
    /// Motion of the tracked point.
    type Seen = PlaneMotion;

    const STEP: f64 = 1e-3;

    fn advance(&self, state: &PlaneMotion, drive: &[Shove], t: f64, h: f64) -> PlaneMotion {
        self.after(state, &shove_at(drive, t + 0.5 * h), h)
    }

    fn seen(&self, state: &PlaneMotion) -> PlaneMotion {
        self.moved(state, -1.0)
    }
}

impl Shoved<'_> {
    /// The motion of the centre of mass where the tracked point moves like this.
    pub fn centred(&self, tracked: &PlaneMotion) -> PlaneMotion {
        self.moved(tracked, 1.0)
    }

    /// The motion of the point that is `way` times the centre's offset away.
    fn moved(&self, from: &PlaneMotion, way: f64) -> PlaneMotion {
        let arm = way * (Rotation2::new(from.heading) * self.centre);
        PlaneMotion {
            position: from.position + arm,
            velocity: from.velocity + from.spin * Vector2::new(-arm.y, arm.x),
            ..*from
        }
    }

    /// The motion of the centre of mass a step `h` later: friction by the implicit rule, which holds still what the load
    /// cannot move and never turns a motion round.
    fn after(&self, now: &PlaneMotion, shove: &Shove, h: f64) -> PlaneMotion {
        let c = self.torsional_radius;
        let arm = shove.at.coords - now.position;
        let turning = arm.x * shove.force.y - arm.y * shove.force.x + shove.moment;
        let inertia = self.mass * self.gyration_radius.powi(2);
        let velocity = now.velocity + shove.force * (h / self.mass);
        let spin = now.spin + turning * (h / inertia);
        // What presses harder than three times the weight is a blow, which this law does not follow.
        let load = (1.0 - shove.lift / (self.mass * self.gravity)).clamp(0.0, 3.0);
        let friction = (self.friction * load).max(1e-9);
        let ahead = self.ahead(&velocity, spin, shove, friction, load);
        if let Some(surface) = self.surface {
            return self.rubbed(now, (velocity, spin), surface, &ahead, friction, h);
        }
        let sweep = spin * Vector2::new(-ahead.y, ahead.x);
        let at_load = velocity + sweep;
        let (a, b) = (friction * h / self.mass, friction * c * c * h / inertia);
        let (along, about) = (at_load.norm(), c * spin.abs());
        let (mut next, mut next_spin) = (Vector2::zeros(), 0.0);
        if (along / a).hypot(about / b) > 1.0 {
            let s = generalised(along, about, a, b);
            let change = at_load * (s / (s + a) - 1.0);
            next = velocity + change;
            next_spin = spin * (s / (s + b)) + ahead.perp(&change) * self.mass / inertia;
        }
        PlaneMotion {
            position: now.position + 0.5 * h * (now.velocity + next),
            heading: now.heading + 0.5 * h * (now.spin + next_spin),
            velocity: next,
            spin: next_spin,
        }
    }

    /// The same where the pressure is known, `pushed` the velocity and spin before friction.
    fn rubbed(
        &self,
        now: &PlaneMotion,
        pushed: (Vector2<f64>, f64),
        (surface, aligned): (&LimitSurface, f64),
        ahead: &Vector2<f64>,
        friction: f64,
        h: f64,
    ) -> PlaneMotion {
        let local = Rotation2::new(aligned - now.heading);
        let stiffer = (self.torsional_radius / self.gyration_radius).max(1.0);
        let (force, moment) = surface.friction(&Sliding {
            velocity: local * pushed.0,
            spin: pushed.1,
            centre: Rotation2::new(aligned) * self.off,
            ahead: local * ahead,
            scale: self.torsional_radius / surface.radius(),
            slow: friction * h / self.mass * stiffer * stiffer,
        });
        let velocity = pushed.0 + local.inverse() * force * (friction * h / self.mass);
        let spin = pushed.1 + moment * (friction * h / (self.mass * self.gyration_radius.powi(2)));
        PlaneMotion {
            position: now.position + 0.5 * h * (now.velocity + velocity),
            heading: now.heading + 0.5 * h * (now.spin + spin),
            velocity,
            spin,
        }
    }

    /// From below the centre of mass to where the load acts: the tool above or below the centre of mass and the friction
    /// below it tip the body.
    fn ahead(&self, velocity: &Vector2<f64>, spin: f64, shove: &Shove, friction: f64, load: f64) -> Vector2<f64> {
        let speed = velocity.norm().hypot(self.torsional_radius * spin).max(1e-9);
        let rubbing = velocity * (friction / speed);
        let tipping = shove.force * (shove.height - self.height) + rubbing * self.height;
        let ahead = tipping / (load.max(0.1) * self.mass * self.gravity);
        // Beyond the radius the thing would topple: what is pushed on the table stays within.
        ahead * (self.torsional_radius / ahead.norm().max(self.torsional_radius))
    }
}

/// The speed `s` with `(along/(s+a))² + (about/(s+b))² = 1`: decreasing in `s`, convex, above one at nought.
fn generalised(along: f64, about: f64, a: f64, b: f64) -> f64 {
    let mut s = (along.hypot(about) - a.max(b)).max(0.0);
    for _ in 0..30 {
        let (x, y) = (along / (s + a), about / (s + b));
        let value = x * x + y * y - 1.0;
        let slope = -2.0 * (x * x / (s + a) + y * y / (s + b));
        let next = (s - value / slope).max(0.0);
        if (next - s).abs() <= 1e-12 + 1e-9 * s {
            return next;
        }
        s = next;
    }
    s
}

fn shove_at(shoves: &[Shove], t: f64) -> Shove {
    let Some((a, b, share)) = rows_about(shoves, t, |s| s.time) else {
        return Shove::default();
    };
    let between = |x: f64, y: f64| x + (y - x) * share;
    Shove {
        time: t,
        force: a.force.lerp(&b.force, share),
        at: a.at + (b.at - a.at) * share,
        moment: between(a.moment, b.moment),
        height: between(a.height, b.height),
        lift: between(a.lift, b.lift),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let end = path(1.4, 0.0, Shoved::STEP)[99];
        assert!((end.position - REST.position).norm() < 1e-12 && end.heading == 0.3);
    }

    #[test]
    fn a_central_shove_goes_as_far_as_the_impulse_says() {
        let end = path(6.0, 0.0, Shoved::STEP)[99];
        let (up, down) = ((6.0 - 1.5) / 0.5, 1.5 / 0.5);
        let top: f64 = up * 0.1;
        let way = 0.5 * top * 0.1 + top * top / (2.0 * down);
        assert!(((end.position - REST.position).norm() - way).abs() < 2e-3 * way);
        assert!((end.heading - 0.3).abs() < 1e-9);
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
