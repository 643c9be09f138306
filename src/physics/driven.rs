//! A body that is driven over a level support by known forces and does not turn: inertia against dry friction.
//!
//! `m v' = F(t) - f v/|v|`, at rest while `|F| <= f`. The force over the acceleration tells mass, what is left at any speed
//! tells friction: one fast push parts what slow pushes cannot.

use nalgebra::Vector2;

use super::Simulator;
use super::simulator::rows_about;

/// What is driven.
#[derive(Clone, Copy, Debug)]
pub struct Driven {
    /// kg.
    pub mass: f64,
    /// Kinetic friction force, N.
    pub friction: f64,
}

/// A force in the plane, N, at its time, s; linear between rows, constant beyond.
type Load = (f64, Vector2<f64>);

impl Simulator for Driven {
    type Drive = [Load];
    /// Position, m, and velocity, m/s.
    type State = (Vector2<f64>, Vector2<f64>);
    type Seen = Vector2<f64>;

    const STEP: f64 = 1e-3;

    fn advance(&self, (position, velocity): &Self::State, drive: &[Load], t: f64, h: f64) -> Self::State {
        let load = rows_about(drive, t + 0.5 * h, |row| row.0);
        let force = load.map_or_else(Vector2::zeros, |(a, b, share)| a.1.lerp(&b.1, share));
        let next = after(self, velocity, &force, h);
        (position + 0.5 * h * (velocity + next), next)
    }

    fn seen(&self, state: &Self::State) -> Vector2<f64> {
        state.0
    }
}

/// The velocity a step `h` later: Heun's rule for the direction of friction, near rest the impulse that at most stops it.
fn after(body: &Driven, before: &Vector2<f64>, force: &Vector2<f64>, h: f64) -> Vector2<f64> {
    let (gained, lost) = (h / body.mass, body.friction * h / body.mass);
    let pushed = before + force * gained;
    let stopped = pushed * (1.0 - lost / pushed.norm().max(1e-300)).max(0.0);
    let (fast, slow) = (before.norm(), stopped.norm());
    if fast.min(slow) <= 2.0 * lost {
        return stopped;
    }
    pushed - (before / fast + stopped / slow) * (0.5 * lost)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Driven = Driven {
        mass: 0.5,
        friction: 1.0,
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
