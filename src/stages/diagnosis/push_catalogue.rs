//! The laws that pushes can show, with the priors of their parameters and where a fit of them may start, and what is new in every one.

use nalgebra::Vector3;

use super::family::{Law, Parameter, Scatter};
use super::push_closer::closer_laws;
use super::push_laws::form;
use super::push_places::{far_laws, local_laws};
use super::pushes::Pushes;

/// Every law that pushes can show.
pub fn push_laws(pushes: &Pushes, scale: f64) -> Vec<Law> {
    let mut laws = friction_laws();
    laws.extend(history_laws());
    laws.push(loose_mass());
    if pushes.loads_vary() {
        laws.extend(load_laws());
    }
    laws.extend(local_laws(pushes, scale));
    laws.extend(closer_laws(pushes));
    laws.extend(far_laws(pushes, scale));
    laws.extend(sensor_laws(pushes, scale));
    laws.extend(bias_laws(pushes));
    laws
}

pub(super) fn law(
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
        extends: &[],
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
            "viscous-friction",
            "support",
            form::VISCOUS_POWER,
            vec![positive("b", "N*s/m", 4.0)],
            vec![Parameter::about_linear()],
            vec![vec![0.7], vec![1.4]],
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

/// By how much friction goes with the heading, twice a turn, as a share of it; no surface has more of it than the bound.
pub(super) fn share_by_heading(name: &'static str) -> Parameter {
    Parameter {
        low: -0.6,
        high: 0.6,
        ..Parameter::amplitude(name, "1", 0.15)
    }
}

/// Friction that depends on what happened before, or on the direction.
fn history_laws() -> Vec<Law> {
    let none = || vec![Vec::new()];
    let a = Parameter::amplitude;
    let positive = Parameter::positive;
    let pair = || ["ac", "as"].map(share_by_heading).to_vec();
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
            "static-ageing",
            "support",
            form::AGEING_RENEWED,
            vec![positive("beta", "1", 0.15)],
            vec![Parameter::scale("Dc", "m", 5e-4, 0.7)],
            logs(&[3e-4, 1e-3]),
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

/// Friction that is not in proportion to the load.
fn load_laws() -> Vec<Law> {
    let none = || vec![Vec::new()];
    let words = "friction does not grow as the load does";
    let one = |form, parameter| {
        law(
            "load-dependent-friction",
            "support",
            form,
            vec![parameter],
            Vec::new(),
            none(),
            words,
        )
    };
    vec![
        one(form::LOAD_POWER, Parameter::amplitude("p", "1", 0.25)),
        one(form::LOAD_ADHESION, Parameter::amplitude("A", "N", 1.0)),
    ]
}

/// A part of the mass on a spring and a damper.
fn loose_mass() -> Law {
    law(
        "loose-mass",
        "body",
        form::LOOSE_MASS,
        vec![Parameter {
            high: 0.9,
            ..Parameter::positive("share", "1", 0.3)
        }],
        vec![
            Parameter::scale("rate", "rad/s", 25.0, 0.5),
            Parameter {
                high: 0.7f64.ln(),
                ..Parameter::scale("damping_ratio", "1", 0.1, 0.8)
            },
        ],
        [12.0f64, 18.0, 25.0, 35.0, 50.0]
            .iter()
            .map(|w| vec![w.ln(), 0.1f64.ln()])
            .collect(),
        "something inside follows late and swings",
    )
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
            vec![Parameter::nought_before()],
            vec![vec![0.0]],
            "the reading without touching creeps with time",
        ),
        law(
            "force-drift",
            "sensor",
            form::DRIFT_WORLD,
            vec![a("dx", "N/s", 0.1 / 60.0), a("dy", "N/s", 0.1 / 60.0)],
            vec![Parameter::nought_before()],
            vec![vec![0.0]],
            "the reading without touching creeps with time",
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

/// What the sensor makes of a force along another axis: as if it were turned, or of one axis onto the other alone, where the
/// axes are those of the room.
fn crosstalk_laws(turns: bool) -> Vec<Law> {
    let forms = [form::CROSSTALK, form::CROSSTALK_ONTO_X, form::CROSSTALK_ONTO_Y];
    let kept = if turns { &forms[..1] } else { &forms[..] };
    let make = |form: &usize| {
        law(
            "force-crosstalk",
            "sensor",
            *form,
            vec![Parameter::amplitude("C", "1", 0.05)],
            Vec::new(),
            vec![Vec::new()],
            "a force along one axis is read on another too",
        )
    };
    kept.iter().map(make).collect()
}

/// Whether the tool was turned from push to push.
fn tool_turns(pushes: &Pushes) -> bool {
    let turned: Vec<Vector3<f64>> = pushes.moving().map(|s| s.tool.scaled_axis()).collect();
    turned.iter().any(|t| (t - turned[0]).norm() > 0.3)
}

/// A constant reading, in the frame of the tool or in that of the room.
fn bias_laws(pushes: &Pushes) -> Vec<Law> {
    let none = || vec![Vec::new()];
    let a = Parameter::amplitude;
    let turns = tool_turns(pushes);
    let mut laws = crosstalk_laws(turns);
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
        // The tool kept its orientation: the frames of tool and room are one.
        laws.push(law(
            "force-bias",
            "sensor",
            form::BIAS_HELD,
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

/// Which of the scatter is of tares.
pub const TARES: [usize; 2] = [1, 2];

/// What is new in every push: the level of friction, the tare along and across, the direction of the contact, the
/// change of friction with the way and with the turning, and the ringing of the blow: its size and its two phases.
pub fn scatter() -> Vec<Scatter> {
    let rows = [
        (0.012, 10.0, 0.002, false),
        (0.003, 10.0, 0.003, true),
        (0.003, 10.0, 0.003, true),
        (0.04, 4.0, 0.01, true),
        (0.015, 10.0, 0.005, false),
        (0.12, 10.0, 0.02, false),
        (0.3, 10.0, 0.1, true),
        (1.0, 10.0, 0.3, true),
        (1.0, 10.0, 0.3, true),
    ];
    let one = |(tau, counts, floor, nuisance)| Scatter {
        tau,
        counts,
        floor,
        nuisance,
        step: 1e-4,
    };
    rows.into_iter().map(one).collect()
}
