//! What the twin carries of a joint beyond an ideal axis with Coulomb friction: that a fitted value leaves its plain
//! one beyond doubt is the finding.

use std::collections::BTreeMap;

use crate::base::Estimate;
use crate::twin::{CauseOdds, Evidence, Finding, Gain, Joint, Model};

/// Standard deviations from the plain value from which on it counts: p below 6e-7.
const CLEAR: f64 = 5.0;

/// Damping and return springs that were measured beyond doubt, of joints of which nothing is `named` yet.
pub fn joint_findings(model: &Model, named: &[Finding]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let others = model.twin.joints().filter(|j| named.iter().all(|f| f.place != j.name));
    for joint in others {
        let spring = "the joint pulls back the farther it is moved";
        let damping = "the joint resists more the faster it moves";
        findings.extend(finding(joint, joint.damping.as_ref(), ("joint-damping", "b", damping)));
        findings.extend(finding(joint, joint.stiffness.as_ref(), ("joint-spring", "k", spring)));
    }
    findings
}

fn finding(joint: &Joint, value: Option<&Estimate>, (cause, name, words): (&str, &str, &str)) -> Option<Finding> {
    let value = value.filter(|v| v.is_measured())?;
    let statistic = value.value / value.sd?;
    if statistic < CLEAR {
        return None;
    }
    let evidence = Evidence {
        residual: format!("force over {}", value.from.join(", ")),
        test: "value over its standard deviation".into(),
        statistic,
        p_value: (-0.5 * statistic * statistic).exp(),
        words: words.into(),
    };
    Some(Finding {
        leader: None,
        cause: cause.into(),
        place: joint.name.clone(),
        probability: 0.95,
        alternatives: Vec::<CauseOdds>::new(),
        parameters: BTreeMap::from([(name.to_owned(), value.clone())]),
        evidence: vec![evidence],
        gain: Gain {
            quantity: "force".into(),
            rmse_before: 0.0,
            rmse_after: 0.0,
            unit: "N".into(),
            held_out: Vec::new(),
            reduction: 0.0,
        },
    })
}
