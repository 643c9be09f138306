//! A body that is driven over a level support by known forces and does not turn: inertia against dry friction.
//!
//! `m v' = F(t) - f v/|v|`, at rest while `|F| <= f`. The force over the acceleration tells mass, what is left at any speed
//! tells friction: one fast push parts what slow pushes cannot.

use nalgebra::Vector2;

use super::Simulator;
use super::simulator::rows_about;
use crate::math::Real;

/// What is driven, in numbers that may carry derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Driven<T = f64> {
    /// kg.
    pub mass: T,
    /// Kinetic friction force, N.
    pub friction: T,
    /// By how much later than the motion the force was read, s.
    pub late: T,
}

/// A force in the plane, N, at its time, s; linear between rows, constant beyond.
type Load = (f64, Vector2<f64>);

impl<T: Real> Simulator for Driven<T> {
    type Drive = [Load];
    /// Position, m, and velocity, m/s.
    type State = (Vector2<T>, Vector2<T>);
    type Seen = Vector2<T>;

    const STEP: f64 = 1e-3;

    fn advance(&self, (position, velocity): &Self::State, drive: &[Load], t: f64, h: f64) -> Self::State {
        let t = self.late + (t + 0.5 * h);
        let force = match rows_about(drive, t.value(), |row| row.0) {
            None => Vector2::new(T::of(0.0), T::of(0.0)),
            Some((a, b, share)) => {
                let span = b.0 - a.0;
                let inside = span > 0.0 && (0.0..1.0).contains(&share);
                let share = if inside { (t - a.0) * span.recip() } else { T::of(share) };
                Vector2::new(share * (b.1.x - a.1.x) + a.1.x, share * (b.1.y - a.1.y) + a.1.y)
            }
        };
        let next = after(self, *velocity, force, h);
        let moved = Vector2::new(
            position.x + (velocity.x + next.x) * (0.5 * h),
            position.y + (velocity.y + next.y) * (0.5 * h),
        );
        (moved, next)
    }

    fn seen(&self, state: &Self::State) -> Vector2<T> {
        state.0
    }
}

/// The velocity a step `h` later: Heun's rule for the direction of friction, near rest the impulse that at most stops it.
fn after<T: Real>(body: &Driven<T>, before: Vector2<T>, force: Vector2<T>, h: f64) -> Vector2<T> {
    let gained = T::of(h) / body.mass;
    let lost = body.friction * gained;
    let pushed = Vector2::new(before.x + force.x * gained, before.y + force.y * gained);
    let speed = size(pushed);
    if speed.value() <= lost.value() {
        return Vector2::new(T::of(0.0), T::of(0.0));
    }
    let left = T::of(1.0) - lost / speed;
    let stopped = Vector2::new(pushed.x * left, pushed.y * left);
    let (fast, slow) = (size(before), size(stopped));
    if fast.value().min(slow.value()) <= 2.0 * lost.value() {
        return stopped;
    }
    let half = lost * 0.5;
    let (a, b) = (half / fast, half / slow);
    Vector2::new(
        pushed.x - before.x * a - stopped.x * b,
        pushed.y - before.y * a - stopped.y * b,
    )
}

fn size<T: Real>(v: Vector2<T>) -> T {
    (v.x * v.x + v.y * v.y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Driven = Driven {
        mass: 0.5,
        friction: 1.0,
        late: 0.0,
    };

    const REST: (Vector2<f64>, Vector2<f64>) = (Vector2::new(0.0, 0.0), Vector2::new(0.0, 0.0));

    #[test]
    fn a_constant_force_speeds_up_and_friction_stops() {
        let x = Vector2::x();
        let force = [(0.0, 3.0 * x), (0.5, 3.0 * x), (0.5, 0.0 * x)];
        let path = BODY.simulate(&REST, &force, 0.0, &[0.0, 0.5, 2.0]);
        // 4 m/s² for 0.5 s, then -2 m/s² until it stands.
        assert!((path[1].x - 0.5).abs() < 1e-3, "{}", path[1].x);
        assert!((path[2].x - 1.5).abs() < 3e-3, "{}", path[2].x);
    }

    #[test]
    fn less_than_friction_moves_nothing_and_half_the_step_changes_little() {
        let still = [(0.0, Vector2::new(0.9, 0.0))];
        let path = BODY.simulate(&REST, &still, 0.0, &[0.0, 1.0]);
        assert_eq!(path[1], Vector2::zeros());
        let wave: Vec<(f64, Vector2<f64>)> = (0..1000)
            .map(|i| f64::from(i) * 2e-3)
            .map(|t| (t, Vector2::new(2.0 * (8.0 * t).sin(), 0.5)))
            .collect();
        let error = BODY.solver_error(&REST, &wave, &[0.0, 2.0], 1e-3, |a, b| (a - b).norm());
        assert!(error < 1e-4, "{error}");
    }
}
