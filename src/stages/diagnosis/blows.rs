//! How far the force overshoots where a push sets a body going, against how fast the tool came.
//!
//! A tool that gives overshoots by itself: `c v` against dry friction, and `√(Δ² + c² v²)` from a static excess `Δ`. Pushes of like
//! speed whose overshoot is another tell the excess, where the swings that follow hide it in what comes after.

use super::push_ringing::Ringing;
use super::pushes::Pushes;
use super::rested::aged;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::math::{mad_sd, median};
use crate::twin::{Finding, Profile};

/// Fewest pushes, standard deviations, and the least excess as a share of the friction.
const FEWEST: usize = 6;
const CLEAR: f64 = 7.0;
const LEAST: f64 = 0.15;
/// Least scatter of an overshoot, as a share of the friction.
const SCATTER: f64 = 0.03;
/// Share of the usual friction that a push comes to that is one.
const WHOLE: f64 = 0.6;
/// Wait before the first push over all others' from which on it may be ageing.
const LONGER: f64 = 1.5;
/// Share of the speed of the first push that another one has to come to.
const AS_FAST: f64 = 0.9;
/// Share of the speed of the first push from which on others tell how far a blow of it strays, and the part of the farthest of them
/// that counts as a standard deviation.
const NEAR: f64 = 0.5;
const STRAYS: f64 = 0.5;
/// Part of the swing that a bond has to come to beyond it: a blow that is over within a reading or two shows more or less of its peak.
const BRIEF: f64 = 1.5;
/// Other causes of a force that comes up late or falls while it slides.
const OTHERS: [&str; 6] = [
    "static-ageing",
    "breakaway-bond",
    "velocity-weakening-friction",
    "rate-state-friction",
    "loose-mass",
    "force-saturation",
];

/// How the tool met a body.
#[derive(Clone, Debug, Default)]
pub struct Blow {
    pub interaction: String,
    pub held_out: bool,
    /// What may ring after it, N.
    pub size: f64,
    /// By how much the force was highest over what comes after, N.
    pub over: f64,
    /// Speed of the body once it goes, and with which the tool came, m/s.
    pub speed: f64,
    pub came: f64,
    /// What comes after, N.
    pub level: f64,
    /// Rate at which the body swings on the tool, as the force rose, rad/s.
    pub swings: f64,
    /// How it rang, where it did.
    pub rings: Option<Ringing>,
    /// How long it had rested, s.
    pub wait: f64,
    /// Nothing had moved it before.
    pub first: bool,
}

impl Blow {
    /// Speed with which it was met, m/s: a tool that goes on slower than it came tells it by the body.
    pub(super) fn pace(&self) -> f64 {
        self.came.max(self.speed)
    }
}

/// Speed from which on a push tells how a body swings on the tool, m/s.
const TELLS: f64 = 0.025;
/// A part that swings as the whole does on the tool, within this of its logarithm, and is this share of it at least, is the whole.
const AS_THE_WHOLE: f64 = 0.5;
const NEARLY_ALL: f64 = 0.6;

/// Whether what swings at this `rate` (rad/s) goes as the body does on a tool that gives.
pub fn swings_as_the_whole<'a>(blows: impl Iterator<Item = &'a Blow>, rate: f64) -> bool {
    let fast = blows.filter(|b| b.pace() > TELLS && b.swings > 0.0);
    let whole = median(&fast.map(|b| b.swings).collect::<Vec<f64>>());
    whole.is_some_and(|w| (rate / w).ln().abs() < AS_THE_WHOLE)
}

/// Whether a loose mass of this `share` and `rate` (rad/s) is but the body on a tool that gives.
pub fn swings_on_the_tool<'a>(blows: impl Iterator<Item = &'a Blow>, share: f64, rate: f64) -> bool {
    share > NEARLY_ALL && swings_as_the_whole(blows, rate)
}

/// What sets the overshoot of a body's pushes apart, where nothing is `named` that would, and how it shows where that is a dependence.
pub fn blow_findings(pushes: &Pushes, named: &[Finding]) -> Vec<(Finding, Option<Profile>)> {
    if named.iter().any(|f| OTHERS.contains(&f.cause.as_str())) {
        return Vec::new();
    }
    let one = |body: usize| {
        let own = || pushes.blows.iter().filter(|b| b.0 == body).map(|b| &b.1);
        let usual = median(&own().map(|b| b.level).collect::<Vec<f64>>())?;
        // What is let go while it is still sped up has nothing after it.
        let whole = |b: &&Blow| b.came > 0.0 && b.level > WHOLE * usual;
        let own: Vec<&Blow> = own().filter(whole).collect();
        // By whichever speed it was met with.
        let bond = bond(&own, &|b| b.came).and_then(|_| bond(&own, &Blow::pace));
        let bond = bond.map(|b| (b, None));
        bond.or_else(|| aged(&own).map(|(found, profile)| (found, Some(profile))))
    };
    (0..pushes.names.len()).filter_map(one).collect()
}

/// A first push that overshoots as none of its speed does after it.
fn bond(all: &[&Blow], pace: &dyn Fn(&Blow) -> f64) -> Option<Finding> {
    let first = all.iter().find(|b| b.first && !b.held_out)?;
    let others: Vec<&&Blow> = all.iter().filter(|b| !b.first).collect();
    if others.len() + 1 < FEWEST || others.iter().all(|b| LONGER * b.wait < first.wait) {
        return None;
    }
    // Overshoots grow faster than speed where what comes after is short: nothing is told beyond what was seen.
    if others.iter().all(|b| pace(b) < AS_FAST * pace(first)) {
        return None;
    }
    let per_speed = median(&others.iter().map(|b| b.over / pace(b)).collect::<Vec<_>>())?;
    let left: Vec<f64> = others.iter().map(|b| b.over - per_speed * pace(b)).collect();
    // What is read of a blow strays the more the faster it is.
    let near = |b: &&&&Blow| pace(b) > NEAR * pace(first) && AS_FAST * pace(b) < pace(first);
    let strays = others
        .iter()
        .filter(near)
        .map(|b| (b.over / pace(b) - per_speed) * pace(first));
    let strays = strays.fold(0.0, |m: f64, s| m.max(s.abs()));
    let scatter = mad_sd(&left)?.hypot(SCATTER * first.level).max(STRAYS * strays);
    let swing = per_speed * pace(first);
    let beyond = first.over - swing;
    let excess = (first.over.powi(2) - swing.powi(2)).max(0.0).sqrt();
    // None of the others comes near.
    let next = left.iter().copied().fold(0.0, f64::max);
    if beyond < (CLEAR * scatter).max(BRIEF * swing) || beyond < 2.0 * next || excess < LEAST * first.level {
        return None;
    }
    let told = Told {
        cause: "breakaway-bond",
        place: "support",
        probability: 0.95,
        rivals: &[],
        parameter: (
            "Fg",
            Estimate::measured(
                excess,
                (scatter * first.over / excess).hypot(0.15 * excess),
                "N",
                vec![first.interaction.clone()],
                "overshoot of the first push over that of its speed",
            ),
        ),
        residual: "overshoot",
        statistic: beyond / scatter,
        words: format!("the first push overshoots by {beyond:.2} N more than pushes of its speed do after it"),
        gain: gain("force", "N", [beyond, scatter], Vec::new()),
    };
    Some(told.finding())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blows(bond: f64) -> Vec<Blow> {
        let one = |k: usize| {
            let speed = [0.01, 0.03, 0.08][k % 3];
            let excess = if k == 0 { bond } else { 0.2 };
            Blow {
                interaction: format!("push-{k:02}"),
                held_out: k > 9,
                over: excess.hypot(30.0 * speed) + 0.04 * ((k * 7 % 5) as f64 - 2.0),
                speed,
                came: speed,
                level: 3.0,
                swings: 0.0,
                rings: None,
                wait: [10.0, 3.0, 30.0][k % 3],
                first: k == 0,
                size: 0.0,
            }
        };
        (0..12).map(one).collect()
    }

    #[test]
    fn a_bond_is_told_from_the_swing_of_a_tool() {
        let told = |excess: f64| {
            let all = blows(excess);
            bond(&all.iter().collect::<Vec<&Blow>>(), &Blow::pace)
        };
        assert!(told(0.2).is_none());
        let found = told(2.0).expect("a bond");
        let force = &found.parameters["Fg"];
        let [low, high] = force.ci95.expect("an interval");
        assert!(low < 2.0 && 2.0 < high, "{low} to {high}");
        // Nothing after it was as fast.
        let mut fast = blows(2.0);
        fast[0].speed = 0.12;
        assert!(bond(&fast.iter().collect::<Vec<&Blow>>(), &Blow::pace).is_none());
        // A much longer wait than any other's may have aged it.
        let mut rested = blows(2.0);
        rested[0].wait = 100.0;
        assert!(bond(&rested.iter().collect::<Vec<&Blow>>(), &Blow::pace).is_none());
    }

    #[test]
    fn a_body_that_swings_on_a_soft_tool_is_no_loose_mass() {
        let mut all = blows(0.2);
        all.iter_mut().for_each(|b| b.swings = 40.0);
        let whole = |share, rate| swings_on_the_tool(all.iter(), share, rate);
        assert!(whole(0.9, 36.0));
        // A small part, one that swings at another rate, or a tool of which nothing is known.
        assert!(!whole(0.25, 36.0) && !whole(0.9, 12.0));
        assert!(!swings_on_the_tool(blows(0.2).iter(), 0.9, 36.0));
        // However small, it goes as the whole does.
        assert!(swings_as_the_whole(all.iter(), 50.0) && !swings_as_the_whole(all.iter(), 22.0));
    }
}
