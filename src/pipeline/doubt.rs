//! What else a finding leaves in doubt: numbers of the twin that were told as if nothing of the kind were there.

use crate::base::{Estimate, Status};
use crate::twin::{Diagnosis, Finding, Link, Model, Verdict};

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

/// By how much numbers may be off, as a share, where what acted beside what was named has no name.
const UNNAMED: f64 = 0.2;
/// Error of the plain model's ways, m, from which on what they told is in doubt.
const ASTRAY: f64 = 5e-3;

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
    likely(&["contact-point-offset"]).for_each(|f| doubt_centre(model, f));
}

/// Doubts what pushes told of a body where what acted on it besides is not all named, or led it far from where it was thought to go.
pub(super) fn doubt_what_is_left(model: &mut Model, diagnosis: &Diagnosis) {
    let unnamed = diagnosis.verdict == Verdict::Unknown;
    let way = diagnosis.base.rmse.get("position").copied().unwrap_or(0.0);
    let acts =
        |f: &&Finding| HOLDS_BACK.contains(&f.cause.as_str()) && (unnamed || f.probability > 0.5 && way > ASTRAY);
    let Some(finding) = diagnosis.findings.iter().find(acts) else {
        return;
    };
    let why = match unnamed {
        true => format!("beside more than {}, which has no name", finding.cause),
        false => format!("by ways from which {} led far off", finding.cause),
    };
    doubt_rubbing(model, &why);
}

/// Whether the force of a push is in it.
pub(super) fn by_force(friction: &Estimate) -> bool {
    friction.method.contains("push") || !friction.method.starts_with("tilt")
}

/// The damping of what was pressed, where something else was found to take work from it.
fn doubt_damping(model: &mut Model, finding: &Finding) {
    let links = model.twin.bodies.iter_mut().flat_map(|b| &mut b.links);
    // Where several were pressed the finding says `body`.
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

/// Makes a number one that is told with `doubt` (standard deviation) more.
fn loosen(number: &mut Estimate, doubt: f64, why: &str) {
    let sd = number.sd.unwrap_or(0.0).hypot(doubt);
    let [low, high] = number.ci95.unwrap_or([number.value; 2]);
    let least = (number.value - 1.96 * sd).max(0.05 * number.value);
    number.status = Status::Assumed;
    number.sd = Some(sd);
    number.ci95 = Some([low.min(least), high.max(number.value + 1.96 * sd)]);
    number.method = format!("{}, {why}", number.method);
}

/// What pushes told by force of how a link rubs.
fn rubbing(link: &mut Link) -> impl Iterator<Item = &mut Estimate> {
    let friction = [link.friction.kinetic.as_mut(), link.friction.static_.as_mut()];
    let own = friction.into_iter().flatten().filter(|e| by_force(e));
    own.filter(|e| e.status != Status::Known)
}

/// A centre of mass whose lever is measured from where the tool was thought to be.
fn doubt_centre(model: &mut Model, finding: &Finding) {
    let size = |name: &str| finding.parameters.get(name).map_or(0.0, |e| e.value);
    let off = size("dx").hypot(size("dy"));
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let Some(com) = link.com.as_mut().filter(|c| c.is_measured()) else {
            continue;
        };
        let sd = com.sd.unwrap_or([0.0; 3]).map(|s| s.hypot(off));
        com.status = Status::Assumed;
        com.ci95 = Some(std::array::from_fn(|k| {
            [com.value[k] - 1.96 * sd[k], com.value[k] + 1.96 * sd[k]]
        }));
        com.sd = Some(sd);
        com.method = format!("{}, by a tool that is beside its path", com.method);
    }
}

/// Friction and inertia of what was pushed, where more than what was named acted on it.
fn doubt_rubbing(model: &mut Model, why: &str) {
    for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
        let force = link.friction_force.kinetic.as_mut().filter(|e| e.is_measured());
        if let Some(number) = force {
            loosen(number, UNNAMED * number.value, why);
        }
        for number in rubbing(link).filter(|e| e.is_measured()) {
            loosen(number, UNNAMED * number.value, why);
        }
        let Some(inertia) = link
            .inertia
            .as_mut()
            .filter(|i| i.is_measured() && i.method.contains("push"))
        else {
            continue;
        };
        let scale = inertia.value[0].max(inertia.value[1]).max(inertia.value[2]);
        let sd = inertia.sd.unwrap_or([0.0; 6]).map(|s| s.hypot(UNNAMED * scale));
        inertia.status = Status::Assumed;
        inertia.ci95 = Some(std::array::from_fn(|k| {
            [inertia.value[k] - 1.96 * sd[k], inertia.value[k] + 1.96 * sd[k]]
        }));
        inertia.sd = Some(sd);
        inertia.method = format!("{}, {why}", inertia.method);
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
