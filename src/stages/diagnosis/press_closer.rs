//! Closer forms of what was found in presses.

use super::family::{Law, Parameter};
use super::press_catalogue::law;
use super::press_laws::form;

/// Forms with more numbers, which are tried where the one that they extend was taken up.
pub fn closer_laws() -> Vec<Law> {
    vec![
        Law {
            extends: &[form::ADHESION, form::BOND],
            ..law(
                "adhesion",
                form::ADHESION_STRUNG,
                vec![Parameter::positive("Fa", "N", 0.5)],
                vec![Parameter::scale("reach", "m", 3e-4, 0.8)],
                [1e-4f64, 3e-4, 1e-3].map(|r| vec![r.ln()]).to_vec(),
                "it clings to the tool on the way out",
            )
        },
        Law {
            extends: &[form::RELAXATION],
            ..law(
                "stress-relaxation",
                form::RELAXATION_OF_TWO,
                vec![Parameter::positive("s", "1", 0.2)],
                vec![
                    Parameter::scale("tau", "s", 0.5, 0.8),
                    Parameter::scale("s_ratio", "1", 1.0, 0.8),
                    Parameter::scale("tau_ratio", "1", 8.0, 0.5),
                ],
                [[0.5f64, 6.0], [1.0, 12.0]].map(|r| r.map(f64::ln).to_vec()).to_vec(),
                "the force sinks while the tool stands still",
            )
        },
        Law {
            extends: &[form::HYSTERESIS, form::STOPS],
            ..law(
                "elastic-hysteresis",
                form::STOPS_UNLIKE,
                vec![Parameter::positive("A", "N", 0.5)],
                vec![
                    Parameter::scale("d", "m", 1e-3, 0.6),
                    Parameter::scale("apart", "1", 1.0, 0.5),
                    Parameter {
                        unit: "1",
                        ..Parameter::place("shares", 0.0, 0.5)
                    },
                ],
                [[1.0f64.ln(), 0.5], [0.6f64.ln(), 0.5], [1.5f64.ln(), 0.0]]
                    .map(Vec::from)
                    .to_vec(),
                "going in costs more than coming out gives back, at any speed",
            )
        },
    ]
}
