//! Closer forms of what was found in presses.

use super::family::{Law, Parameter};
use super::press_catalogue::{at, law};
use super::press_laws::form;
use crate::twin::Finding;

/// Forms with more numbers, which are tried where the one that they extend was taken up.
pub fn closer_laws(deepest: f64) -> Vec<Law> {
    let mut laws = of_history();
    laws.extend(of_curves(deepest));
    laws
}

/// A second spring that bears from where the pad is met on is none: it is the bond that draws with another stiffness than the pad presses.
pub fn stiffer_than_its_bond(findings: &mut Vec<Finding>) {
    let clings = findings.iter().find(|f| f.cause == "adhesion").map(|f| f.place.clone());
    let at_the_surface = |f: &Finding| {
        let from = f.parameters.get("d");
        from.is_some_and(|d| d.value < 2.0 * d.sd.unwrap_or(0.0))
    };
    findings.retain(|f| f.cause != "second-stage" || clings.as_ref() != Some(&f.place) || !at_the_surface(f));
}

/// (exp(x) − 1)/x − 1: what an exponential spring (Fung 1967) of stiffness 1 at first has more than a straight one, at a depth of `x` of
/// its scales.
pub(super) fn grown(x: f64) -> f64 {
    if x.abs() < 1e-6 { 0.5 * x } else { x.exp_m1() / x - 1.0 }
}

/// Of what remembers how it was pressed.
fn of_history() -> Vec<Law> {
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

/// Of the force over the depth.
fn of_curves(deepest: f64) -> Vec<Law> {
    vec![
        Law {
            extends: &[form::STAGE],
            ..law(
                "second-stage",
                form::STAGE_ROUND,
                vec![Parameter::positive("k2_over_k", "1", 0.4)],
                vec![at("d", deepest), Parameter::scale("over", "m", 0.08 * deepest, 0.7)],
                [0.04, 0.12].map(|over: f64| vec![(over * deepest).ln()]).to_vec(),
                "from some depth on a second spring bears",
            )
        },
        Law {
            extends: &[form::SNAP],
            ..law(
                "snap-through",
                form::SNAP_SHAPED,
                vec![Parameter::positive("A", "N", 1.0)],
                vec![
                    Parameter {
                        high: 1.3 * deepest,
                        ..at("us", deepest)
                    },
                    Parameter::scale("w", "m", 3e-4, 0.6),
                    Parameter::scale("edge", "1", 2.0, 0.4),
                    Parameter::scale("tail", "1", 3.0, 0.8),
                ],
                [[3.5f64, 1.0], [3.0, 6.0], [1.5, 2.0]]
                    .map(|x| x.map(f64::ln).to_vec())
                    .to_vec(),
                "the force drops at one depth",
            )
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Estimate;
    use crate::stages::diagnosis::told::{gain, one_named};

    #[test]
    fn a_stage_that_begins_where_the_pad_is_met_is_its_bond() {
        let named = |cause: &str, from: f64| {
            let mut finding = one_named(cause, gain("force", "N", [1.0, 0.1], Vec::new()));
            let from = Estimate::measured(from, 8e-5, "m", Vec::new(), "presses");
            finding.parameters.insert("d".into(), from);
            finding
        };
        let left = |first: &str, from: f64| {
            let mut findings = vec![named(first, 0.0), named("second-stage", from)];
            stiffer_than_its_bond(&mut findings);
            findings.len()
        };
        assert_eq!((left("adhesion", 3e-5), left("adhesion", 1e-3)), (1, 2));
        assert_eq!(left("stress-relaxation", 3e-5), 2);
    }
}
