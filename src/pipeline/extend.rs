//! The extended model: what the diagnosis found of the world, written into the twin, which the exports are made from.

use std::collections::BTreeMap;

use super::doubt::{by_force, doubt, doubt_what_is_left};
use crate::base::{Estimate, Status};
use crate::stages::diagnosis::{Level, Number};
use crate::twin::{Coupling, Detent, Diagnosis, Effect, Finding, Joint, Link, Model, RelationKind, Twin};

/// Causes that lie in how something was measured and touched, not in what was.
const OF_THE_RIG: [&str; 15] = [
    "contact-law",
    "contact-point-offset",
    "length-scale",
    "lever-arm",
    "force-bias",
    "force-bias-world",
    "force-drift",
    "force-crosstalk",
    "force-saturation",
    "time-delay",
    "sensor-lag",
    "clock-drift",
    "tracking-error",
    "quantisation",
    "outliers",
];
/// The largest draw of a notch of amplitude 1, `exp(-1/2)`; it lies at the notch's width.
const DRAW: f64 = 0.606_530_66;

/// Share of what a law takes off a number that its form leaves in doubt: another of the same cause takes more or less.
const FORM: f64 = 0.25;
/// Causes that make a joint resist with its speed.
const BY_SPEED: [&str; 3] = ["joint-quadratic-damping", "soft-close", "velocity-weakening-friction"];

/// Writes every finding that is more likely than not into the twin, unless one of its numbers holds it already, and what its
/// numbers are beside the findings.
pub fn extend(model: &mut Model, diagnosis: &Diagnosis, levels: &[Level]) {
    if !diagnosis.findings.iter().any(|f| f.probability > 0.5) {
        doubt_what_is_left(model, diagnosis);
        return;
    }
    for level in levels {
        set(&mut model.twin, level);
    }
    for joint in model.twin.bodies.iter_mut().flat_map(|b| &mut b.joints) {
        relieve(joint, &diagnosis.findings);
    }
    doubt(model, diagnosis);
    doubt_what_is_left(model, diagnosis);
    let sure = diagnosis.findings.iter().filter(|f| f.probability > 0.5);
    for finding in sure.filter(|f| !OF_THE_RIG.contains(&f.cause.as_str())) {
        if !of_joint(&mut model.twin, finding) && !held(&model.twin, finding) {
            model.twin.effects.push(Effect {
                cause: finding.cause.clone(),
                place: finding.place.clone(),
                probability: finding.probability,
                parameters: finding.parameters.clone(),
            });
        }
    }
}

/// A number of a link or a joint as it is beside what was named.
fn set(twin: &mut Twin, level: &Level) {
    if level.number == Number::JointFriction {
        let joints = twin.bodies.iter_mut().flat_map(|b| &mut b.joints);
        let own = joints
            .filter(|j| j.name == level.of)
            .filter_map(|j| j.friction.as_mut());
        own.for_each(|number| correct(number, level));
        return;
    }
    let Some(link) = twin.link_mut(&level.of) else { return };
    let numbers = match level.number {
        // A tilt alone tells friction without any force that was read.
        Number::Friction => [
            link.friction_force.kinetic.as_mut(),
            link.friction.kinetic.as_mut().filter(|e| by_force(e)),
        ],
        _ => [link.stiffness.as_mut(), None],
    };
    numbers.into_iter().flatten().for_each(|number| correct(number, level));
}

/// Logarithmic doubt of a number beside what was named from which on it is no longer measured.
const UNSURE: f64 = 0.25;

fn correct(number: &mut Estimate, level: &Level) {
    let log = level.log.0;
    let doubt = level.log.1.hypot(FORM * log);
    let half = number.ci95.map_or(0.0, |c| 0.5 * (c[1] - c[0]));
    let value = number.value * log.exp();
    let wide = (half * log.exp()).hypot(1.96 * doubt * value);
    number.sd = number.sd.map(|sd| (sd * log.exp()).hypot(doubt * value));
    number.value = value;
    number.ci95 = Some([(value - wide).max(0.0), value + wide]);
    number.method = format!("{}, beside what the diagnosis named", number.method);
    if doubt > UNSURE && number.is_measured() {
        number.status = Status::Assumed;
    }
}

/// What resists more the faster a joint moves is what was named, and what pulls with its place is a weight, or
/// a stop that gives, where that was: a damping or a spring that was told without it would count twice.
fn relieve(joint: &mut Joint, findings: &[Finding]) {
    let named = |cause: &str| {
        let mut own = findings.iter().filter(|f| f.place == joint.name && f.probability > 0.5);
        own.find(|f| f.cause == cause)
    };
    let beside = |cause: &str, name: &str| named(cause).and_then(|f| f.parameters.get(name)).cloned();
    if BY_SPEED.iter().any(|cause| named(cause).is_some()) {
        joint.damping = beside("joint-damping", "b");
    }
    if named("joint-gravity").is_some() || named("limit-compliance").is_some() {
        joint.stiffness = beside("joint-spring", "k");
        joint.rest = beside("joint-spring", "q0");
    }
}

/// Whether a joint has a place for it, and was given it.
fn of_joint(twin: &mut Twin, finding: &Finding) -> bool {
    let mut joints = twin.bodies.iter_mut().flat_map(|b| &mut b.joints);
    let Some(joint) = joints.find(|j| j.name == finding.place) else {
        return false;
    };
    let turns = joint.axis_turns();
    let of = |name: &str| finding.parameters.get(name).cloned();
    match finding.cause.as_str() {
        "joint-stiction" => {
            let share = of("fs_over_fc").zip(joint.friction.as_ref());
            joint.effects.static_excess = share.map(|(share, friction)| product(&share, friction));
            joint.effects.static_excess.is_some()
        }
        "detent" | "latch" => {
            let detent = detent_of(&finding.parameters, finding.cause == "latch", turns);
            joint.effects.detents.extend(detent.clone());
            detent.is_some()
        }
        "joint-coupling" => {
            let leader = finding.leader.clone();
            joint.effects.coupling = of("rho").zip(leader).map(|(ratio, leader)| Coupling { leader, ratio });
            joint.effects.coupling.is_some()
        }
        "backlash" => {
            joint.effects.backlash = of("b");
            joint.effects.backlash.is_some()
        }
        _ => false,
    }
}

fn detent_of(parameters: &BTreeMap<String, Estimate>, latch: bool, turns: bool) -> Option<Detent> {
    let of = |name: &str| parameters.get(name).cloned();
    let mut load = scaled(&of("A")?, DRAW);
    load.unit = if turns { "N·m" } else { "N" }.into();
    Some(Detent {
        latch,
        position: of("qd")?,
        load,
        reach: of("w")?,
    })
}

fn scaled(e: &Estimate, factor: f64) -> Estimate {
    Estimate {
        value: e.value * factor,
        sd: e.sd.map(|s| s * factor),
        ci95: e.ci95.map(|c| c.map(|v| v * factor)),
        ..e.clone()
    }
}

/// A share of a quantity, with the doubts of both: ends of the interval by their relative distances, added in squares.
fn product(share: &Estimate, whole: &Estimate) -> Estimate {
    let value = share.value * whole.value;
    let relative = |e: &Estimate, off: f64| off.abs() / e.value.abs().max(1e-12);
    let end = |k: usize| {
        let off = |e: &Estimate| relative(e, e.ci95.map_or(0.0, |c| c[k] - e.value));
        off(share).hypot(off(whole)) * value.abs()
    };
    let sd = |e: &Estimate| relative(e, e.sd.unwrap_or(0.0));
    let doubt = sd(share).hypot(sd(whole)) * value.abs();
    let mut out = Estimate::measured(value, doubt, &whole.unit, share.from.clone(), &share.method);
    out = out.with_interval([(value - end(0)).max(0.0), value + end(1)]);
    if whole.status == Status::Assumed {
        out.status = Status::Assumed;
    }
    out
}

/// Whether a number of the twin holds it.
pub(super) fn held(twin: &Twin, finding: &Finding) -> bool {
    let joint = |of: fn(&Joint) -> bool| twin.joints().any(|j| j.name == finding.place && of(j));
    let link = |of: fn(&Link) -> bool| twin.link(&finding.place).is_some_and(of);
    match finding.cause.as_str() {
        "com-offset" => link(|l| l.com.is_some()),
        "yaw-inertia" => link(|l| l.inertia.is_some()),
        "nonuniform-density" => link(|l| l.com.is_some() && l.inertia.is_some()),
        "uneven-support-pressure" => link(|l| l.friction.torsional_radius.as_ref().is_some_and(Estimate::is_measured)),
        "rolling-resistance" => link(|l| l.friction.rolling.is_some()),
        "elastic-damping" => link(|l| l.damping.as_ref().is_some_and(Estimate::is_measured)),
        "joint-damping" => joint(|j| j.damping.is_some()),
        "joint-spring" => joint(|j| j.stiffness.is_some()),
        "support-tilt" | "gravity-error" => twin.support.as_ref().is_some_and(|s| s.gravity.is_some()),
        "breakaway-bond" => twin.relations.iter().any(|r| {
            let about = [&r.a, &r.b].into_iter().any(|n| *n == finding.place);
            r.kind == RelationKind::Fixed && r.breakaway.is_some() && about
        }),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, interval: [f64; 2], unit: &str) -> Estimate {
        let sd = (interval[1] - interval[0]) / 3.92;
        Estimate::measured(value, sd, unit, vec!["pull".into()], "test").with_interval(interval)
    }

    #[test]
    fn a_share_of_a_doubtful_quantity_has_the_doubts_of_both() {
        let excess = product(&estimate(0.5, [0.3, 0.8], "1"), &estimate(2.0, [1.8, 2.2], "N·m"));
        let [low, high] = excess.ci95.expect("an interval");
        assert!((excess.value - 1.0).abs() < 1e-12 && excess.unit == "N·m");
        assert!((low - (1.0 - 0.4f64.hypot(0.1))).abs() < 1e-9, "{low}");
        assert!((high - (1.0 + 0.6f64.hypot(0.1))).abs() < 1e-9, "{high}");
    }

    #[test]
    fn a_notch_is_told_by_its_largest_draw() {
        let parameters = [
            ("A", estimate(0.2, [0.18, 0.22], "N·m")),
            ("qd", estimate(0.3, [0.29, 0.31], "rad")),
            ("w", estimate(0.06, [0.05, 0.07], "rad")),
        ];
        let named = parameters.map(|(name, e)| (name.to_owned(), e));
        let detent = detent_of(&BTreeMap::from(named), false, true).expect("a detent");
        // A s exp(-s²/2) is largest at s = 1.
        let largest = (0..4000)
            .map(|i| 1e-3 * f64::from(i))
            .map(|s| 0.2 * s * (-0.5 * s * s).exp());
        assert!((detent.load.value - largest.fold(0.0, f64::max)).abs() < 1e-6);
        assert!((detent.reach.value - 0.06).abs() < 1e-12 && !detent.latch);
    }

    /// Of three doors on one post, the last of which follows the second.
    #[test]
    fn a_follower_follows_the_joint_that_its_finding_names() {
        let joint = |name: &str| {
            serde_json::json!({
                "name": name, "type": "revolute", "parent": "post", "child": format!("{name} leaf"), "probability": 1.0,
                "alternatives": [],
                "axis": Estimate::measured([0.0, 0.0, 1.0], [0.01; 3], "1", Vec::new(), "test"),
                "origin": Estimate::measured([0.0; 3], [0.001; 3], "m", Vec::new(), "test"),
            })
        };
        let joints = ["first", "second", "third"].map(joint);
        let body = serde_json::json!({ "name": "post", "links": [], "joints": joints });
        let twin = serde_json::json!({
            "format": "palpate-twin/1", "name": "doors", "gravity": [0.0, 0.0, -9.81], "bodies": [body], "relations": [],
            "provenance": crate::twin::Provenance::default(),
        });
        let mut twin: Twin = serde_json::from_value(twin).expect("a twin");
        let finding = Finding {
            leader: Some("second".into()),
            priors: BTreeMap::new(),
            cause: "joint-coupling".into(),
            place: "third".into(),
            probability: 0.95,
            alternatives: Vec::new(),
            parameters: BTreeMap::from([("rho".to_owned(), estimate(0.5, [0.49, 0.51], "1"))]),
            // Words may name any joint.
            evidence: Vec::new(),
            gain: crate::twin::Gain {
                quantity: "angle".into(),
                rmse_before: 0.1,
                rmse_after: 0.01,
                unit: "rad".into(),
                held_out: Vec::new(),
                reduction: 0.9,
                ..crate::twin::Gain::default()
            },
        };
        assert!(of_joint(&mut twin, &finding));
        let third = twin.joints().find(|j| j.name == "third").expect("the third");
        let coupling = third.effects.coupling.as_ref().expect("a coupling");
        assert_eq!(coupling.leader, "second");
        assert!(
            twin.joints()
                .filter(|j| j.name != "third")
                .all(|j| j.effects.is_empty())
        );
    }
}
