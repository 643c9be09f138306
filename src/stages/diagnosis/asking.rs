//! What to measure next: experiments that part causes which these data cannot tell apart, and such that would show
//! causes of which they say nothing.

use std::collections::BTreeSet;

use crate::twin::{Experiment, Finding};

/// Sets of causes and the experiment that parts them.
const PARTING: [(&[&str], &str); 14] = [
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
        &["static-ageing", "breakaway-bond"],
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
        &["force-crosstalk", "tool-friction"],
        "push a face squarely, then at 30 degrees from either side",
    ),
];

/// Experiments for the rivals of each finding, then for what could not be tested.
pub fn experiments(findings: &[Finding], untestable: &BTreeSet<&str>) -> Vec<Experiment> {
    let mut out: Vec<Experiment> = Vec::new();
    for finding in findings.iter().filter(|f| !f.alternatives.is_empty()) {
        let rivals = finding.alternatives.iter().map(|a| a.cause.clone());
        let parts: Vec<String> = std::iter::once(finding.cause.clone()).chain(rivals).collect();
        let share = |set: &&(&[&str], &str)| parts.iter().filter(|p| set.0.contains(&p.as_str())).count();
        let Some((_, words)) = PARTING.iter().max_by_key(share).filter(|s| share(s) > 1) else {
            continue;
        };
        // Information of a test that leaves one of them.
        let odds = std::iter::once(finding.probability).chain(finding.alternatives.iter().map(|a| a.probability));
        let bits = odds.filter(|p| *p > 0.0).map(|p| -p * p.log2()).sum::<f64>();
        out.push(Experiment {
            words: (*words).into(),
            parts,
            bits: Some(bits),
        });
    }
    for (set, words) in PARTING {
        let parts: Vec<String> = set
            .iter()
            .filter(|c| untestable.contains(*c))
            .map(|c| (*c).to_owned())
            .collect();
        let told = |e: &Experiment| e.words == words;
        if !parts.is_empty() && !out.iter().any(told) {
            out.push(Experiment {
                words: words.into(),
                parts,
                bits: None,
            });
        }
    }
    out
}
