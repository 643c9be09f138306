//! What the twin measured beside what is given or usual: weights that were stated, fingers as they are sold.

use super::offset;
use super::told::{Told, gain};
use crate::base::{Estimate, Notices};
use crate::capture::{Capture, Segmented};
use crate::stages::estimation::{Config, calibrate_force};
use crate::twin::{Finding, Link, Model};

/// Standard deviations from the plain value from which on it counts, p below 6e-7, and the least share of it.
const CLEAR: f64 = 5.0;
const LEAST: f64 = 0.02;
/// A wrong gravity is no farther off than this share.
const GRAVITY: f64 = 0.05;
/// One push in which the finger seems to slide is none.
const FEWEST: usize = 2;
/// Friction of fingers that is usual: PTFE, a wet or a greased ball to soft rubber, and what is taken where nothing is known.
const FINGERS: [f64; 2] = [0.04, 1.2];
const FINGER: f64 = 0.4;

/// That the sensor reads stated weights too large or too small.
pub fn scale_finding(capture: &Capture, segmented: &[Segmented]) -> Option<Finding> {
    let scale = calibrate_force(capture, segmented, &Config::default(), &mut Notices::default()).ok()?;
    let (off, sd) = (scale.gain - 1.0, scale.gain_sd.max(1e-4));
    if off.abs() < (CLEAR * sd).max(LEAST) {
        return None;
    }
    let lifted = |held: bool| {
        let lifts = capture
            .interactions
            .iter()
            .filter(|i| i.kind == crate::capture::Kind::Lift);
        lifts
            .filter(|i| i.held_out == held)
            .map(|i| i.name.clone())
            .collect::<Vec<String>>()
    };
    let weight = 0.5 * (scale.range[0] + scale.range[1]);
    let rival = if off.abs() < GRAVITY { 0.3 } else { 0.0 };
    let told = Told {
        cause: "force-gain",
        place: "sensor",
        probability: 0.97 - rival,
        rivals: &[("gravity-error", rival)],
        parameter: (
            "g",
            Estimate::measured(off, sd, "1", lifted(false), "lifts of stated weights"),
        ),
        residual: "force",
        statistic: off.abs() / sd,
        words: format!("stated weights are read as {:.3} times what they weigh", scale.gain),
        gain: gain("force", "N", [off.abs() * weight, sd * weight], lifted(true)),
    };
    Some(told.finding())
}

/// Whether weights were stated and lifted.
pub fn tells_gain(capture: &Capture, segmented: &[Segmented]) -> bool {
    calibrate_force(capture, segmented, &Config::default(), &mut Notices::default()).is_ok()
}

/// Whether more than one push tells how a finger slides on what it pushes.
pub fn tells_finger(model: &Model) -> bool {
    let mut fingers = model.twin.links().filter_map(|(_, l)| l.friction.tool.as_ref());
    fingers.any(|f| f.from.len() >= FEWEST)
}

/// Fingers that slide much more, or much less, easily than fingers do.
pub fn finger_findings(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Finding> {
    let one = |link: &Link| {
        let own = link.friction.tool.as_ref()?;
        let [low, high] = own.ci95.unwrap_or([own.value, own.value]);
        // One that never slid is bounded from below.
        if own.from.len() < FEWEST || !(low > FINGERS[1] || own.is_measured() && high < FINGERS[0]) {
            return None;
        }
        let mut without = model.clone();
        if let Some(link) = without.twin.link_mut(&link.name) {
            link.friction.tool = Some(Estimate::assumed(FINGER, FINGER, "1", "usual"));
        }
        let gain = offset::gain(capture, segmented, (&without, model), &own.from, &link.name)?;
        let sd = own.sd.unwrap_or(0.1 * own.value) / FINGER;
        let share = own.value / FINGER - 1.0;
        let told = Told {
            cause: "tool-friction",
            place: &link.name,
            probability: 0.9,
            rivals: &[],
            parameter: ("e", Estimate::measured(share, sd, "1", own.from.clone(), &own.method)),
            residual: "direction of the force",
            statistic: (share / sd).abs(),
            words: format!(
                "the finger on {} has a friction of {:.2}, far from the {FINGER} of most",
                link.name, own.value
            ),
            gain,
        };
        Some(told.finding())
    };
    model.twin.links().filter_map(|(_, link)| one(link)).collect()
}
