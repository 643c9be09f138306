//! The laws that pushes can show, with the priors of their parameters and where a fit of them may start.

use nalgebra::{Vector2, Vector3};

use super::family::{Law, Parameter};
use super::push_laws::form;
use super::pushes::Pushes;

/// Every law that pushes can show.
pub fn push_laws(pushes: &Pushes, scale: f64) -> Vec<Law> {
    let mut laws = friction_laws();
    laws.extend(history_laws());
    laws.extend(local_laws(pushes, scale));
    laws.extend(far_laws(pushes));
    laws.extend(sensor_laws(pushes, scale));
    laws.extend(bias_laws(pushes));
    laws
}

fn law(
    cause: &'static str,
    place: &str,
    form: usize,
    amplitudes: Vec<Parameter>,
    shapes: Vec<Parameter>,
    grid: Vec<Vec<f64>>,
    words: &'static str,
) -> Law {
    let count = amplitudes.len();
    let parameters = amplitudes.into_iter().chain(shapes).collect();
    Law {
        cause,
        place: place.into(),
        form,
        parameters,
        amplitudes: count,
        grid,
        words,
    }
}

fn logs(values: &[f64]) -> Vec<Vec<f64>> {
    values.iter().map(|v| vec![v.ln()]).collect()
}

/// Friction that depends on speed.
fn friction_laws() -> Vec<Law> {
    let none = || vec![Vec::new()];
    let a = Parameter::amplitude;
    let positive = Parameter::positive;
    let speeds = || vec![Parameter::scale("vs", "m/s", 0.02, 0.8)];
    vec![
        law(
            "velocity-weakening-friction",
            "support",
            form::WEAKENING,
            vec![positive("a", "1", 0.3)],
            speeds(),
            logs(&[0.005, 0.015, 0.04, 0.1]),
            "friction is stronger at low speed",
        ),
        law(
            "velocity-weakening-friction",
            "support",
            form::WEAKENING_SQUARE,
            vec![positive("a", "1", 0.3)],
            speeds(),
            logs(&[0.01, 0.03, 0.08]),
            "friction is stronger at low speed",
        ),
        law(
            "viscous-friction",
            "support",
            form::VISCOUS,
            vec![positive("b", "N*s/m", 4.0)],
            Vec::new(),
            none(),
            "friction grows with speed",
        ),
        law(
            "rate-state-friction",
            "support",
            form::RATE_STATE,
            vec![a("a_minus_b", "1", 0.02)],
            Vec::new(),
            none(),
            "friction follows the logarithm of speed",
        ),
    ]
}

/// Friction that depends on what happened before, or on the direction.
fn history_laws() -> Vec<Law> {
    let none = || vec![Vec::new()];
    let a = Parameter::amplitude;
    let positive = Parameter::positive;
    let pair = || vec![a("ac", "1", 0.15), a("as", "1", 0.15)];
    vec![
        law(
            "static-ageing",
            "support",
            form::AGEING,
            vec![positive("beta", "1", 0.15)],
            Vec::new(),
            none(),
            "the first millimetre is harder the longer the body had stood",
        ),
        law(
            "anisotropic-friction",
            "support",
            form::ANISOTROPY,
            pair(),
            Vec::new(),
            none(),
            "friction depends on the direction across the table",
        ),
        law(
            "anisotropic-friction",
            "body",
            form::ANISOTROPY_OF_BODY,
            pair(),
            Vec::new(),
            none(),
            "friction depends on the direction across the body",
        ),
        law(
            "wear-or-heating",
            "support",
            form::WEAR,
            vec![a("w", "1/m", 0.3)],
            Vec::new(),
            none(),
            "friction changes with the distance slid",
        ),
        law(
            "wear-or-heating",
            "support",
            form::HEATING,
            vec![a("kappa", "1/s", 5e-4)],
            Vec::new(),
            none(),
            "friction changes with time",
        ),
        law(
            "breakaway-bond",
            "support",
            form::BOND,
            vec![positive("Fg", "N", 2.0)],
            vec![Parameter::scale("d", "m", 1.5e-3, 0.6)],
            logs(&[5e-4, 1.5e-3, 4e-3]),
            "the very first displacement needs more force than any later one",
        ),
    ]
}

/// Where bodies were moved: the middle, the standard deviation of a place's prior, and every place.
fn workspace(pushes: &Pushes) -> (Vector2<f64>, f64, Vec<Vector2<f64>>) {
    let at: Vec<Vector2<f64>> = pushes.moving().map(|s| s.at).collect();
    let n = at.len().max(1) as f64;
    let middle = at.iter().sum::<Vector2<f64>>() / n;
    let square = at.iter().map(|p| (p - middle).norm_squared()).sum::<f64>() / n;
    (middle, (1.2 * square.sqrt().max(0.01)).max(0.025), at)
}

fn places(middle: Vector2<f64>, sd: f64) -> Vec<Parameter> {
    let (x, y) = (
        Parameter::place("px", middle.x, sd),
        Parameter::place("py", middle.y, sd),
    );
    vec![x, y]
}

/// Laws of a place on the table start from a grid over where the body was moved.
fn local_laws(pushes: &Pushes, scale: f64) -> Vec<Law> {
    let a = Parameter::amplitude;
    let (middle, sd, at) = workspace(pushes);
    let round = || {
        let mut p = places(middle, sd);
        p.push(Parameter::scale("R", "m", 0.016, 0.4));
        p
    };
    // Every place is one where the body was: farther away nothing is felt.
    let step = (at.len() / 24).max(1);
    let visited = at.iter().step_by(step);
    let grid: Vec<Vec<f64>> = visited
        .flat_map(|p| [0.010_f64, 0.022].map(|r| vec![p.x, p.y, r.ln()]))
        .collect();
    vec![
        law(
            "friction-patch",
            "support",
            form::PATCH,
            vec![a("a", "1", 0.3)],
            round(),
            grid.clone(),
            "friction differs at one place of the table",
        ),
        law(
            "friction-patch",
            "support",
            form::PATCH_SHARP,
            vec![a("a", "1", 0.3)],
            round(),
            grid.clone(),
            "friction differs at one place of the table",
        ),
        law(
            "bump",
            "support",
            form::BUMP,
            vec![a("slope", "1", 0.15)],
            round(),
            grid.clone(),
            "the table rises at one place: up costs what down gives back",
        ),
        law(
            "magnet",
            "support",
            form::MAGNET,
            vec![Parameter::positive("A", "N", 0.8f64.max(0.3 * scale))],
            round(),
            grid,
            "something pulls the body towards one place",
        ),
    ]
}

/// Forces that act everywhere on the table.
fn far_laws(pushes: &Pushes) -> Vec<Law> {
    let a = Parameter::amplitude;
    let (middle, sd, _) = workspace(pushes);
    vec![
        law(
            "tether",
            "support",
            form::TETHER,
            vec![Parameter::positive("k", "N/m", 20.0)],
            places(middle, sd),
            vec![vec![middle.x, middle.y]],
            "something pulls the body back the farther it goes",
        ),
        law(
            "support-tilt",
            "support",
            form::TILT,
            vec![a("tx", "rad", 0.05), a("ty", "rad", 0.05)],
            Vec::new(),
            vec![Vec::new()],
            "pushing one way needs more force than pushing the other",
        ),
        // With one object that lies on one table the two are the same data.
        law(
            "gravity-error",
            "support",
            form::TILT,
            vec![a("tx", "rad", 0.05), a("ty", "rad", 0.05)],
            Vec::new(),
            vec![Vec::new()],
            "gravity does not point where the capture says",
        ),
    ]
}

fn sensor_laws(pushes: &Pushes, scale: f64) -> Vec<Law> {
    let none = || vec![Vec::new()];
    let a = Parameter::amplitude;
    let largest = pushes.largest();
    vec![
        law(
            "force-bias",
            "sensor",
            form::BIAS_ALONG,
            vec![a("b", "N", 0.3)],
            Vec::new(),
            none(),
            "the sensor reads a force along the push without touching",
        ),
        law(
            "force-drift",
            "sensor",
            form::DRIFT_ALONG,
            vec![a("d", "N/s", 0.1 / 60.0)],
            Vec::new(),
            none(),
            "the reading without touching creeps with time",
        ),
        law(
            "force-drift",
            "sensor",
            form::DRIFT_WORLD,
            vec![a("dx", "N/s", 0.1 / 60.0), a("dy", "N/s", 0.1 / 60.0)],
            Vec::new(),
            none(),
            "the reading without touching creeps with time",
        ),
        law(
            "force-crosstalk",
            "sensor",
            form::CROSSTALK,
            vec![a("C", "1", 0.05)],
            Vec::new(),
            none(),
            "a force along one axis is read on another too",
        ),
        law(
            "force-saturation",
            "sensor",
            form::SATURATION,
            Vec::new(),
            // Nothing larger than the limit can have been read.
            vec![Parameter {
                low: (0.97 * largest).max(0.1 * scale).ln(),
                ..Parameter::scale("Fs", "N", largest.max(0.1 * scale), 0.3)
            }],
            vec![vec![(0.98 * largest).max(0.1 * scale).ln()]],
            "the sensor cuts off large forces",
        ),
    ]
}

/// A constant reading, in the frame of the tool or in that of the room.
fn bias_laws(pushes: &Pushes) -> Vec<Law> {
    let none = || vec![Vec::new()];
    let a = Parameter::amplitude;
    let turned: Vec<Vector3<f64>> = pushes.moving().map(|s| s.tool.scaled_axis()).collect();
    let turns = turned.iter().any(|t| (t - turned[0]).norm() > 0.3);
    let mut laws = Vec::new();
    let world = || vec![a("bx", "N", 0.25), a("by", "N", 0.25)];
    let tool = vec![a("bx", "N", 0.25), a("by", "N", 0.25), a("bz", "N", 0.25)];
    if turns {
        laws.push(law(
            "force-bias",
            "sensor",
            form::BIAS_TOOL,
            tool,
            Vec::new(),
            none(),
            "the sensor reads a force in its own frame without touching",
        ));
        laws.push(law(
            "force-bias-world",
            "sensor",
            form::BIAS_WORLD,
            world(),
            Vec::new(),
            none(),
            "the sensor reads a force of fixed direction in the room without touching",
        ));
    } else {
        // The tool kept its orientation: the frames of tool and room are one, and the tool's is the likelier.
        laws.push(law(
            "force-bias",
            "sensor",
            form::BIAS_WORLD,
            world(),
            Vec::new(),
            none(),
            "the sensor reads a constant force without touching",
        ));
        laws.push(law(
            "force-bias-world",
            "sensor",
            form::BIAS_WORLD,
            world(),
            Vec::new(),
            none(),
            "the sensor reads a constant force without touching",
        ));
    }
    laws
}
