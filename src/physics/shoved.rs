//! A body that is shoved over a level support by a known force at a known place, fast enough that inertia counts, and that
//! coasts when it is let go.
//!
//! `m v' = F - P v/s`, `m rho² w' = (p - c) x F + T - P c² w/s` with `s = sqrt(v² + c² w²)`: Newton and Euler at the centre of
//! mass against the ellipsoidal limit surface (Howe and Cutkosky 1996) with friction force `P = mu (m g - F_z)`; at
//! rest while the load is within the surface. Mass shows where speed changes, friction where nothing pushes, the radius of gyration
//! where the body is turned.

use nalgebra::{Point2, Rotation2, Vector2};

use super::PlaneMotion;

/// What is shoved.
#[derive(Clone, Copy, Debug)]
pub struct Shoved {
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
    /// Gravity along the support's normal, m/s².
    pub gravity: f64,
}

/// What the tool does at one time, in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Shove {
    /// s.
    pub time: f64,
    /// N, on the body.
    pub force: Vector2<f64>,
    /// A point on the force's line, m.
    pub at: Point2<f64>,
    /// Moment beside that of the force, N·m.
    pub moment: f64,
    /// Force on the body away from the support, N: what the tool carries does not rub.
    pub lift: f64,
}

/// Step of the solver, s.
const STEP: f64 = 1e-3;

/// The motion of the tracked point at each of `times` (s, not decreasing), from `start` at the first of them, under `shoves`
/// (linear between rows, constant beyond).
pub fn predict_shoved(body: &Shoved, start: &PlaneMotion, shoves: &[Shove], times: &[f64]) -> Vec<PlaneMotion> {
    predict_shoved_with_step(body, start, shoves, times, STEP)
}

/// The same with the solver's step given: halving it shows the solver's error.
pub fn predict_shoved_with_step(
    body: &Shoved,
    start: &PlaneMotion,
    shoves: &[Shove],
    times: &[f64],
    step: f64,
) -> Vec<PlaneMotion> {
    let arm = Rotation2::new(start.heading) * body.centre;
    let mut now = PlaneMotion {
        position: start.position + arm,
        velocity: start.velocity + start.spin * Vector2::new(-arm.y, arm.x),
        ..*start
    };
    let mut t = times.first().copied().unwrap_or(0.0);
    let mut row = 0;
    let mut out = Vec::with_capacity(times.len());
    for &goal in times {
        while goal - t > 1e-12 {
            let h = (goal - t).min(step);
            let middle = t + 0.5 * h;
            while row + 1 < shoves.len() && shoves[row + 1].time < middle {
                row += 1;
            }
            now = body.after(&now, &shove_at(shoves, row, middle), h);
            t += h;
        }
        let arm = Rotation2::new(now.heading) * body.centre;
        out.push(PlaneMotion {
            position: now.position - arm,
            velocity: now.velocity - now.spin * Vector2::new(-arm.y, arm.x),
            ..now
        });
    }
    out
}

impl Shoved {
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
        let (a, b) = (friction * h / self.mass, friction * c * c * h / inertia);
        let (along, about) = (velocity.norm(), c * spin.abs());
        let (mut next, mut next_spin) = (Vector2::zeros(), 0.0);
        if (along / a).hypot(about / b) > 1.0 {
            let s = generalised(along, about, a, b);
            (next, next_spin) = (velocity * (s / (s + a)), spin * (s / (s + b)));
        }
        PlaneMotion {
            position: now.position + 0.5 * h * (now.velocity + next),
            heading: now.heading + 0.5 * h * (now.spin + next_spin),
            velocity: next,
            spin: next_spin,
        }
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

fn shove_at(shoves: &[Shove], row: usize, t: f64) -> Shove {
    match (shoves.get(row), shoves.get(row + 1)) {
        (Some(a), Some(b)) if t > a.time && b.time > a.time => {
            let share = ((t - a.time) / (b.time - a.time)).min(1.0);
            Shove {
                time: t,
                force: a.force.lerp(&b.force, share),
                at: a.at + (b.at - a.at) * share,
                moment: a.moment + (b.moment - a.moment) * share,
                lift: a.lift + (b.lift - a.lift) * share,
            }
        }
        (Some(a), _) => *a,
        _ => Shove {
            time: t,
            force: Vector2::zeros(),
            at: Point2::origin(),
            moment: 0.0,
            lift: 0.0,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: Shoved = Shoved {
        mass: 0.5,
        friction: 1.5,
        torsional_radius: 0.03,
        gyration_radius: 0.035,
        centre: Vector2::new(0.004, -0.002),
        gravity: 9.81,
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
            lift: 0.0,
        };
        [(0.0, force), (0.1, force), (0.1001, 0.0), (2.0, 0.0)]
            .map(row)
            .to_vec()
    }

    #[test]
    fn less_than_friction_moves_nothing() {
        let times: Vec<f64> = (0..100).map(|k| k as f64 * 0.01).collect();
        let end = predict_shoved(&BOX, &REST, &pulse(1.4, 0.0), &times)[99];
        assert!((end.position - REST.position).norm() < 1e-12 && end.heading == 0.3);
    }

    #[test]
    fn a_central_shove_goes_as_far_as_the_impulse_says() {
        let times: Vec<f64> = (0..100).map(|k| k as f64 * 0.01).collect();
        let end = predict_shoved(&BOX, &REST, &pulse(6.0, 0.0), &times)[99];
        let (up, down) = ((6.0 - 1.5) / 0.5, 1.5 / 0.5);
        let top: f64 = up * 0.1;
        let way = 0.5 * top * 0.1 + top * top / (2.0 * down);
        assert!(((end.position - REST.position).norm() - way).abs() < 2e-3 * way);
        assert!((end.heading - 0.3).abs() < 1e-9);
    }

    #[test]
    fn halving_the_step_changes_little() {
        let times: Vec<f64> = (0..100).map(|k| k as f64 * 0.01).collect();
        let of = |step: f64| predict_shoved_with_step(&BOX, &REST, &pulse(6.0, 0.01), &times, step);
        let (coarse, fine) = (of(1e-3), of(5e-4));
        for (a, b) in coarse.iter().zip(&fine) {
            assert!((a.position - b.position).norm() < 5e-5 && (a.heading - b.heading).abs() < 1e-3);
        }
        assert!((fine[99].heading - 0.3).abs() > 0.02);
    }
}
