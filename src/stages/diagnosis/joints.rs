//! What the twin carries of a joint beyond an ideal axis with Coulomb friction: that a fitted value leaves its plain
//! one beyond doubt is the finding.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::Quantity;
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{CauseOdds, Evidence, Finding, Gain, Joint, JointKind, Model};

/// Standard deviations from the plain value from which on it counts: p below 6e-7.
const CLEAR: f64 = 5.0;
/// How a slide's numbers are told where its inertia shows.
const DRIVEN: &str = "joint-drive";
/// Share of the error that it takes away below which it stands for something else.
const LITTLE: f64 = 0.03;

/// Damping and return springs that were measured beyond doubt, of joints of which nothing is `named` yet.
pub fn joint_findings(capture: &Capture, segmented: &[Segmented], model: &Model, named: &[Finding]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let others = model.twin.joints().filter(|j| named.iter().all(|f| f.place != j.name));
    for joint in others {
        let spring = "the joint pulls back the farther it is moved";
        let damping = "the joint resists more the faster it moves";
        let found = [
            (joint.damping.as_ref(), ("joint-damping", "b", damping)),
            (joint.stiffness.as_ref(), ("joint-spring", "k", spring)),
        ];
        for (k, (value, words)) in found.into_iter().enumerate() {
            let gain = || gain(&motions(capture, segmented, model, joint), joint, k);
            findings.extend(finding(joint, value, words, &gain));
        }
    }
    findings
}

fn finding(
    joint: &Joint,
    value: Option<&Estimate>,
    (cause, name, words): (&str, &str, &str),
    gain: &dyn Fn() -> Gain,
) -> Option<Finding> {
    let value = value.filter(|v| v.is_measured())?;
    let statistic = value.value / value.sd?;
    if statistic < CLEAR {
        return None;
    }
    let gain = gain();
    // Beside the inertia of a drive the loads are other than those of the law that the gain is told by.
    if gain.reduction < LITTLE && value.method != DRIVEN {
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
        priors: BTreeMap::new(),
        cause: cause.into(),
        place: joint.name.clone(),
        probability: 0.95,
        alternatives: Vec::<CauseOdds>::new(),
        parameters: BTreeMap::from([(name.to_owned(), value.clone())]),
        evidence: vec![evidence],
        gain,
    })
}

/// Block and half span of velocities, s, and how far the parent may move, m.
const BLOCKS: [f64; 3] = [0.05, 0.1, 3e-3];
/// Share of the largest speed below which the direction of friction is not sure.
const SLOW: f64 = 0.15;

struct Motion<'a> {
    name: &'a str,
    held_out: bool,
    loads: Vec<JointLoad>,
}

/// What was felt of a joint while it moved.
fn motions<'a>(capture: &'a Capture, segmented: &[Segmented], model: &Model, joint: &Joint) -> Vec<Motion<'a>> {
    let each = capture.interactions.iter().filter_map(|i| {
        let cut = segmented.iter().find(|s| s.interaction == i.name)?;
        let mut loads = joint_loads(i, cut, joint, model, BLOCKS)?;
        let fastest = loads.iter().map(|l| l.speed.abs()).fold(0.0, f64::max);
        loads.retain(|l| l.speed.abs() > SLOW * fastest && l.load.is_finite());
        let (name, held_out) = (i.name.as_str(), i.held_out);
        Some(Motion { name, held_out, loads })
    });
    each.collect()
}

/// Error of dry friction and a constant load on what was not fitted, without and with the `term` beside (0: damping, 1: a
/// spring); on what was fitted where nothing was held out. Another term that the twin carries is in both.
fn gain(motions: &[Motion], joint: &Joint, term: usize) -> Gain {
    let carried = [joint.damping.is_some(), joint.stiffness.is_some()];
    let error = |with: bool| {
        let terms = [0, 1].map(|k| carried[k] && (k != term || with));
        law_error(motions, terms).unwrap_or(0.0)
    };
    let (rmse_before, rmse_after) = (error(false), error(true));
    let slides = joint.kind == JointKind::Prismatic;
    let quantity = if slides { Quantity::Force } else { Quantity::Torque };
    let held = motions.iter().filter(|m| m.held_out && !m.loads.is_empty());
    Gain {
        quantity: quantity.name().into(),
        rmse_before,
        rmse_after,
        unit: quantity.unit().into(),
        held_out: held.map(|m| m.name.to_owned()).collect(),
        reduction: if rmse_before > 0.0 {
            1.0 - rmse_after / rmse_before
        } else {
            0.0
        },
        ..Gain::default()
    }
}

/// Root mean square of what a linear law of the loads leaves.
fn law_error(motions: &[Motion], [damping, spring]: [bool; 2]) -> Option<f64> {
    let row = |l: &JointLoad| {
        let terms = [
            (true, l.speed.signum()),
            (true, 1.0),
            (damping, l.speed),
            (spring, l.position),
        ];
        terms.into_iter().filter(|t| t.0).map(|t| t.1).collect::<Vec<f64>>()
    };
    let of = |held_out: bool| {
        motions
            .iter()
            .filter(move |m| m.held_out == held_out)
            .flat_map(|m| &m.loads)
    };
    let fitted: Vec<&JointLoad> = of(false).collect();
    let columns = 2 + usize::from(damping) + usize::from(spring);
    if fitted.len() < 2 * columns {
        return None;
    }
    let rows: Vec<f64> = fitted.iter().flat_map(|l| row(l)).collect();
    let a = DMatrix::from_row_slice(fitted.len(), columns, &rows);
    let b = DVector::from_iterator(fitted.len(), fitted.iter().map(|l| l.load));
    let law = a.svd(true, true).solve(&b, 1e-9).ok()?;
    let judged: Vec<&JointLoad> = if of(true).next().is_some() {
        of(true).collect()
    } else {
        fitted
    };
    let left = |l: &&JointLoad| l.load - row(l).iter().zip(law.iter()).map(|(x, y)| x * y).sum::<f64>();
    Some((judged.iter().map(|l| left(l).powi(2)).sum::<f64>() / judged.len() as f64).sqrt())
}
