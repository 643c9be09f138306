//! A body that is driven over a level support by known forces and does not turn: inertia against dry friction.
//!
//! `m v' = F(t) - f v/|v|`, at rest while `|F| <= f`. The force over the acceleration tells mass, what is left at any speed
//! tells friction: one fast push parts what slow pushes cannot.

use nalgebra::Vector2;

/// What is driven.
#[derive(Clone, Copy, Debug)]
pub struct Driven {
    /// kg.
    pub mass: f64,
    /// Kinetic friction force, N.
    pub friction: f64,
}

/// Step of the solver, s.
const STEP: f64 = 1e-3;

/// Positions (m) at each of `times` (s, not decreasing) under `force` (time in s, N; linear between rows, constant beyond),
/// from `position` and `velocity` at the first of them.
pub fn predict_driven(
    body: &Driven,
    (position, velocity): (Vector2<f64>, Vector2<f64>),
    force: &[(f64, Vector2<f64>)],
    times: &[f64],
) -> Vec<Vector2<f64>> {
    predict_driven_with_step(body, (position, velocity), force, times, STEP)
}

/// The same with the solver's step given: halving it shows the solver's error.
pub fn predict_driven_with_step(
    body: &Driven,
    (mut position, mut velocity): (Vector2<f64>, Vector2<f64>),
    force: &[(f64, Vector2<f64>)],
    times: &[f64],
    step: f64,
) -> Vec<Vector2<f64>> {
    let mut t = times.first().copied().unwrap_or(0.0);
    let mut row = 0;
    let mut out = Vec::with_capacity(times.len());
    for &goal in times {
        while goal - t > 1e-12 {
            let h = (goal - t).min(step);
            let middle = t + 0.5 * h;
            while row + 1 < force.len() && force[row + 1].0 < middle {
                row += 1;
            }
            let before = velocity;
            velocity = after(body, &before, &force_at(force, row, middle), h);
            position += 0.5 * h * (before + velocity);
            t += h;
        }
        out.push(position);
    }
    out
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

fn force_at(force: &[(f64, Vector2<f64>)], row: usize, t: f64) -> Vector2<f64> {
    match (force.get(row), force.get(row + 1)) {
        (Some((a, f)), Some((b, g))) if t > *a && b > a => f + (g - f) * ((t - a) / (b - a)).min(1.0),
        (Some((_, f)), _) => *f,
        _ => Vector2::zeros(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: Driven = Driven {
        mass: 0.5,
        friction: 1.0,
    };

    #[test]
    fn a_constant_force_speeds_up_and_friction_stops() {
        let x = Vector2::x();
        let force = [(0.0, 3.0 * x), (0.5, 3.0 * x), (0.5, 0.0 * x)];
        let path = predict_driven(&BODY, (Vector2::zeros(), Vector2::zeros()), &force, &[0.0, 0.5, 2.0]);
        // 4 m/s² for 0.5 s, then -2 m/s² until it stands.
        assert!((path[1].x - 0.5).abs() < 1e-3, "{}", path[1].x);
        assert!((path[2].x - 1.5).abs() < 3e-3, "{}", path[2].x);
    }

    #[test]
    fn less_than_friction_moves_nothing_and_half_the_step_changes_little() {
        let still = [(0.0, Vector2::new(0.9, 0.0))];
        let path = predict_driven(&BODY, (Vector2::zeros(), Vector2::zeros()), &still, &[0.0, 1.0]);
        assert_eq!(path[1], Vector2::zeros());
        let wave: Vec<(f64, Vector2<f64>)> = (0..1000)
            .map(|i| f64::from(i) * 2e-3)
            .map(|t| (t, Vector2::new(2.0 * (8.0 * t).sin(), 0.5)))
            .collect();
        let ends = [1e-3, 5e-4]
            .map(|h| predict_driven_with_step(&BODY, (Vector2::zeros(), Vector2::zeros()), &wave, &[0.0, 2.0], h)[1]);
        assert!((ends[0] - ends[1]).norm() < 1e-4, "{:?}", ends);
    }
}
