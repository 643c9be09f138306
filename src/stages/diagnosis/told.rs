//! A finding that rests on one number, which leaves its plain value beyond doubt.

use std::collections::BTreeMap;

use super::breakaway::breakaway_findings;
use super::coupling::coupling_findings;
use super::given::{finger_findings, scale_finding};
use super::joints::joint_findings;
use super::sinking::sinking_findings;
use super::tilts::tilt_findings;
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::twin::{CauseOdds, Evidence, Finding, Gain, Model};

/// What is told.
pub struct Told<'a> {
    pub cause: &'a str,
    pub place: &'a str,
    pub probability: f64,
    /// Other causes that would do, with their odds.
    pub rivals: &'a [(&'a str, f64)],
    /// As the catalogue calls it, and how far from the plain value it is.
    pub parameter: (&'a str, Estimate),
    /// Where it shows: `way`, `force`, ….
    pub residual: &'a str,
    /// Standard deviations from the plain value.
    pub statistic: f64,
    pub words: String,
    pub gain: Gain,
}

impl Told<'_> {
    /// As `diagnosis.json` says it.
    pub fn finding(self) -> Finding {
        let (name, value) = self.parameter;
        let rivals = self.rivals.iter().filter(|r| r.1 > 0.0);
        Finding {
            leader: None,
            priors: BTreeMap::new(),
            cause: self.cause.into(),
            place: self.place.into(),
            probability: self.probability,
            alternatives: rivals
                .map(|(cause, probability)| CauseOdds {
                    cause: (*cause).into(),
                    probability: *probability,
                })
                .collect(),
            evidence: vec![Evidence {
                residual: format!("{} of {}", self.residual, value.from.join(", ")),
                test: "value over its standard deviation".into(),
                statistic: self.statistic,
                p_value: (-0.5 * self.statistic * self.statistic).exp(),
                words: self.words,
            }],
            parameters: BTreeMap::from([(name.to_owned(), value)]),
            gain: self.gain,
        }
    }
}

/// A gain on interactions that were not fitted; the reduction follows from the errors.
pub fn gain(quantity: &str, unit: &str, [before, after]: [f64; 2], held_out: Vec<String>) -> Gain {
    Gain {
        quantity: quantity.into(),
        rmse_before: before,
        rmse_after: after,
        unit: unit.into(),
        held_out,
        reduction: if before > 0.0 { 1.0 - after / before } else { 0.0 },
        ..Gain::default()
    }
}

/// A sure finding on the support, for tests.
#[cfg(test)]
pub fn one_named(cause: &str, gain: Gain) -> Finding {
    Told {
        cause,
        place: "support",
        probability: 1.0,
        rivals: &[],
        parameter: ("a", Estimate::measured(1.0, 0.1, "1", Vec::new(), "pushes")),
        residual: "force",
        statistic: 9.0,
        words: String::new(),
        gain,
    }
    .finding()
}

/// Findings beside those that were named, which need no ladder of laws.
pub fn told_by_one_number(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    named: &[Finding],
) -> Vec<Finding> {
    let mut findings = joint_findings(capture, segmented, model, named);
    findings.extend(breakaway_findings(capture, segmented, model, named));
    findings.extend(coupling_findings(capture, segmented, model));
    findings.extend(sinking_findings(capture, segmented, model));
    findings.extend(scale_finding(capture, segmented));
    findings.extend(finger_findings(capture, segmented, model));
    findings.extend(tilt_findings(capture, segmented, model, named));
    findings
}
