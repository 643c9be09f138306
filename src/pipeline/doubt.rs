//! What else a finding leaves in doubt: numbers of the twin that were told as if nothing of the kind were there.

use crate::base::{Estimate, Status};
use crate::twin::{Diagnosis, Finding, Model};

/// What a body feels, or its sensor makes of it, while it speeds up or slides on as well, so that a mass that comes from that alone, by
/// plain friction, is off.
const FELT_AT_SPEED: [&str; 7] = [
    "loose-mass",
    "viscous-friction",
    "velocity-weakening-friction",
    "rate-state-friction",
    "sensor-lag",
    "time-delay",
    "force-saturation",
];
/// What holds a thing back, or moves it on, when it starts to slide: the static friction of a tilt or of a peak has it in it.
const HOLDS_BACK: [&str; 13] = [
    "viscous-friction",
    "velocity-weakening-friction",
    "rate-state-friction",
    "static-ageing",
    "anisotropic-friction",
    "friction-patch",
    "bump",
    "magnet",
    "tether",
    "breakaway-bond",
    "hidden-body",
    "support-tilt",
    "gravity-error",
];
/// Share of the sensor's range from which on a force may be one that was cut off.
const NEAR_LIMIT: f64 = 0.8;
/// By how much such a mass may be off, as a share.
const OFF: f64 = 0.5;

/// What takes work from a press whatever its speed, or by a memory of its own, so that a loop is no proof of damping.
const WITHOUT_DAMPING: [&str; 6] = [
    "guide-friction",
    "elastic-hysteresis",
    "softening-by-use",
    "plastic-set",
    "stress-relaxation",
    "adhesion",
];

/// Doubts the numbers of the twin that findings which are more likely than not bear on.
pub(super) fn doubt(model: &mut Model, diagnosis: &Diagnosis) {
    let likely = |causes: &'static [&str]| {
        let named = move |f: &&Finding| f.probability > 0.5 && causes.contains(&f.cause.as_str());
        diagnosis.findings.iter().filter(named)
    };
    if let Some(finding) = likely(&FELT_AT_SPEED).next() {
        doubt_masses(model, &finding.cause);
    }
    if let Some(finding) = likely(&HOLDS_BACK).next() {
        doubt_static(model, &finding.cause);
    }
    if let Some(limit) = likely(&["force-saturation"])
        .next()
        .and_then(|f| f.parameters.get("Fs"))
    {
        doubt_forces(model, limit.value);
    }
    likely(&WITHOUT_DAMPING).for_each(|f| doubt_damping(model, f));
}

/// Whether the force of a push is in it.
pub(super) fn by_force(friction: &Estimate) -> bool {
    friction.method.contains("push") || !friction.method.starts_with("tilt")
}

/// The damping of what was pressed, where something else was found to take work from it.
fn doubt_damping(model: &mut Model, finding: &Finding) {
    let links = model.twin.bodies.iter_mut().flat_map(|b| &mut b.links);
    // Of one body that was pressed the finding says `body`.
    let own = links.filter(|l| l.name == finding.place || finding.place == "body");
    for damping in own.filter_map(|l| l.damping.as_mut()) {
        let most = damping.ci95.map_or(damping.value, |c| c[1]);
        damping.status = Status::Assumed;
        damping.ci95 = Some([0.0, most]);
        damping.sd = damping.sd.map(|sd| sd.hypot(0.5 * most));
        damping.method = format!("{}, which may be {}", damping.method, finding.cause);
    }
}

/// Masses that come from how pushed bodies speed up and slide on: the law of friction that was taken for it was not the one.
fn doubt_masses(model: &mut Model, cause: &str) {
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let moved = |m: &Estimate| m.method.starts_with("accelerated-push");
        let Some(mass) = link.mass.as_mut().filter(|m| moved(m)) else {
            continue;
        };
        // Its friction is the force over its weight.
        let friction = [link.friction.kinetic.as_mut(), link.friction.static_.as_mut()];
        let friction = friction.into_iter().flatten().filter(|e| by_force(e));
        for number in [mass].into_iter().chain(friction) {
            let doubt = number.sd.unwrap_or(0.0).hypot(OFF * number.value);
            number.status = Status::Assumed;
            number.sd = Some(doubt);
            let least = (number.value - 1.96 * doubt).max(0.05 * number.value);
            number.ci95 = Some([least, number.value + 1.96 * doubt]);
            number.method = format!("{}, by a friction without {cause}", number.method);
        }
    }
}

/// Static friction, where what was named may have held the thing or moved it on: it is not less than the kinetic one.
fn doubt_static(model: &mut Model, cause: &str) {
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let least = link.friction.kinetic.as_ref().and_then(|k| k.ci95).map(|c| c[0]);
        let held = link.friction.static_.as_mut().filter(|e| e.is_measured());
        let (Some(number), Some(least)) = (held, least) else {
            continue;
        };
        let [low, high] = number.ci95.unwrap_or([number.value; 2]);
        number.status = Status::Assumed;
        number.ci95 = Some([low.min(least), high]);
        number.sd = Some(number.sd.unwrap_or(0.0).max((high - low.min(least)) / 3.92));
        number.method = format!("{}, which may be {cause}", number.method);
    }
}

/// Friction forces that reach to where the sensor ends: what is left of their readings is the lower part of them.
fn doubt_forces(model: &mut Model, limit: f64) {
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let near = |e: &Estimate| e.is_measured() && e.ci95.is_some_and(|c| c[1] > NEAR_LIMIT * limit);
        let Some(force) = link.friction_force.kinetic.as_mut().filter(|e| near(e)) else {
            continue;
        };
        let most = 2.0 * limit.max(force.value) / force.value;
        let friction = link
            .friction
            .kinetic
            .as_mut()
            .filter(|e| e.is_measured() && by_force(e));
        for number in [force].into_iter().chain(friction) {
            number.status = Status::Assumed;
            number.ci95 = number.ci95.map(|[low, high]| [low, high.max(most * number.value)]);
            number.sd = number.sd.map(|sd| sd.hypot(0.25 * most * number.value));
            number.method = format!("{}, cut off where the sensor ends", number.method);
        }
    }
}
