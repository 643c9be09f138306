//! Which experiments are told for causes that were not told apart: those that were worked out, and those that are known to part such
//! causes.

use super::imagined::Asked;
use crate::twin::{AskedTouch, Experiment, Finding};

/// Sets of causes and the experiment that parts them.
const PARTING: [(&[&str], &str); 27] = [
    (
        &["bump", "friction-patch", "magnet"],
        "push across the same place in the opposite direction, then again with a known load on top: what resists both \
         ways is friction, what helps one way is a slope or a pull, and only a slope grows with the load",
    ),
    (
        &["length-scale", "gravity-error", "clock-drift"],
        "move the body by a length that a ruler gives, half a metre or more, and compare the track; film a second clock; then \
         gravity is what is left",
    ),
    (
        &["tracking-error", "gravity-error", "support-tilt"],
        "lay a level on the support, and let the body hang from a thread in the view of the track: the thread is vertical",
    ),
    (
        &["support-tilt", "gravity-error"],
        "push a second object over the same table, and lift and weigh one in two orientations",
    ),
    (
        &["support-tilt", "force-bias-world", "tether"],
        "repeat a push with a known load on top, and read the force without contact",
    ),
    (
        &["force-bias", "force-bias-world"],
        "repeat a push with the tool turned by 90 degrees about the vertical",
    ),
    (
        &["velocity-weakening-friction", "viscous-friction", "rate-state-friction"],
        "push along one line at four speeds or more, each twice as fast as the one before",
    ),
    (
        &["static-ageing", "breakaway-bond", "velocity-weakening-friction"],
        "repeat the first push at once and after a wait of a minute",
    ),
    (
        &["wear-or-heating", "force-drift", "stiffness-drift"],
        "wait a minute without sliding, read the force without contact, then repeat a push",
    ),
    (
        &["elastic-damping", "stress-relaxation", "time-delay", "sensor-lag"],
        "press at two rates that differ tenfold and hold each for three seconds",
    ),
    (
        &[
            "hardening-stiffness",
            "second-stage",
            "power-law-stiffness",
            "snap-through",
            "force-saturation",
        ],
        "press in fine steps of depth to the deepest that is safe",
    ),
    (
        &[
            "elastic-hysteresis",
            "guide-friction",
            "plastic-set",
            "softening-by-use",
        ],
        "press, turn back half way and press again, then repeat a shallow press",
    ),
    (
        &["anisotropic-friction", "friction-patch"],
        "push through the same place along four headings, then turn the object by 90 degrees and repeat",
    ),
    (
        &["loose-mass", "added-inertia"],
        "start and stop the body at two accelerations and let it coast; then tilt it and wait, and shake it at the rate at which it \
         seems to swing; or lift it and move it 4 cm to and fro within a third of a second each way",
    ),
    (
        &["contact-point-offset", "com-offset"],
        "push opposite faces, then turn the body by 90 degrees and push again: an offset of the tool stays in the room, a centre \
         of mass turns with the body",
    ),
    (&["com-offset", "nonuniform-density"], SPIN),
    (
        &["uneven-support-pressure", "com-offset", "tool-friction"],
        "push all four sides off the middle, to either side of it",
    ),
    (
        &["force-crosstalk", "tool-friction"],
        "push a face squarely, then at 30 degrees from either side",
    ),
    (
        &["force-crosstalk", "gravity-error"],
        "lift it with the tool turned by 90 degrees about the vertical, and push it to and fro along two lines: a sensor that leaks \
         turns with the tool, and gravity helps one way",
    ),
    (
        &["hidden-body", "friction-patch"],
        "stop, retreat and push on along the same way: a thing that was pushed along is met where it was left, a patch where it was",
    ),
    (
        &[
            "joint-damping",
            "joint-quadratic-damping",
            "soft-close",
            "velocity-weakening-friction",
        ],
        "move the joint through the same range at four speeds, each twice as fast as the one before",
    ),
    (
        &["joint-spring", "joint-gravity", "limit-compliance"],
        "move the joint slowly through all of its range, more than 60 degrees if it can, then tip what it is fixed to and repeat",
    ),
    (
        &["detent", "latch"],
        "pass the place slowly both ways, and move the joint past its closed end if it can",
    ),
    (
        &["backlash", "joint-stiction"],
        "reverse the joint in small steps, each a little larger than the one before, and hold the force before it moves",
    ),
    (
        &["joint-gravity", "lever-arm"],
        "move the joint by a handle at half the radius",
    ),
    (
        &[
            "force-gain",
            "load-dependent-friction",
            "added-inertia",
            "force-bias",
            "gravity-error",
        ],
        "hang a known weight on the tool, let the body coast, and read the force without contact",
    ),
    (
        &["support-compliance", "length-scale", "tracking-error"],
        "press something much stiffer at the same place of the support, in view of the track",
    ),
];

/// Share of what is open that touches have to be expected to tell for nothing else to be asked for.
const ENOUGH: f64 = 0.6;

/// How to tell a yaw inertia.
const SPIN: &str = "push the body fast and off its middle, three times on either side, and let it spin until it rests: how soon it \
                    stops spinning tells its yaw inertia";

/// How to tell it with a hand that lifts and feels torques.
const TWIST: &str = "lift the body and twist it to and fro about the vertical: how hard it resists tells its yaw inertia, without \
                     friction";

/// What to do where fast pushes have told it as well as they can.
const HANG: &str = "hang the body from three threads of one length and time how it twists to and fro: its yaw inertia goes with the \
                    square of that time, and fast pushes have told it as well as they can";

/// What is known of a body whose centre is not where its shape has it.
#[derive(Clone, Debug, Default)]
pub struct Done {
    /// Fast pushes off the middle that could be made next, and whether such pushes have told a yaw inertia well.
    pub spins: Vec<AskedTouch>,
    pub spun: bool,
    /// A lift with a twist that could be made next.
    pub twist: Option<AskedTouch>,
}

/// Experiments for the rivals of each finding, those that were worked out (`asked`) before those that are known to part
/// such causes.
pub fn experiments(findings: &[Finding], asked: &[Asked], done: &Done) -> Vec<Experiment> {
    let mut out: Vec<Experiment> = Vec::new();
    for finding in findings.iter().filter(|f| !f.alternatives.is_empty()) {
        let of_it = |(place, e): &&Asked| *place == finding.place && e.parts.first() == Some(&finding.cause);
        let odds = std::iter::once(finding.probability).chain(finding.alternatives.iter().map(|a| a.probability));
        let bits = odds.filter(|p| *p > 0.0).map(|p| -p * p.log2()).sum::<f64>();
        if let Some((_, worked_out)) = asked.iter().find(of_it) {
            out.push(worked_out.clone());
            if worked_out.bits.is_some_and(|b| b > ENOUGH * bits) {
                continue;
            }
        }
        let rivals = finding.alternatives.iter().map(|a| a.cause.clone());
        let parts: Vec<String> = std::iter::once(finding.cause.clone()).chain(rivals).collect();
        let share = |set: &&(&[&str], &str)| parts.iter().filter(|p| set.0.contains(&p.as_str())).count();
        let Some((_, words)) = PARTING.iter().max_by_key(share).filter(|s| share(s) > 1) else {
            continue;
        };
        let (words, touches) = match (*words == SPIN, &done.twist, done.spun) {
            (true, Some(twist), _) => (TWIST, vec![twist.clone()]),
            (true, None, true) => (HANG, Vec::new()),
            (true, None, false) => (SPIN, done.spins.clone()),
            (false, ..) => (*words, Vec::new()),
        };
        // A test that leaves one of them tells all of it.
        out.push(Experiment {
            words: words.into(),
            touches,
            parts,
            bits: Some(bits),
        });
    }
    out
}
