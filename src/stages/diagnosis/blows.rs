//! How far the force overshoots where a push sets a body going, against how the tool came and how long the body had rested.
//!
//! A tool that gives overshoots by itself: `c v` against dry friction, and `√(Δ² + c² v²)` from a static excess `Δ`. Pushes of like
//! speed whose overshoot is another tell the excess, where the swings that follow hide it in what comes after.

use nalgebra::DVector;

use super::pushes::Pushes;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::math::{Settings, levenberg_marquardt, mad_sd, median};
use crate::twin::Finding;

/// Fewest pushes, standard deviations, and the least excess as a share of the friction.
const FEWEST: usize = 6;
const CLEAR: f64 = 7.0;
const LEAST: f64 = 0.15;
/// Least scatter of an overshoot, as a share of the friction.
const SCATTER: f64 = 0.03;
/// Share of the squares that the excess has to take away.
const TAKEN: f64 = 0.6;
/// Share of the usual friction that a push comes to that is one.
const WHOLE: f64 = 0.6;
/// Longest wait over the shortest from which on ageing shows; the first push may not have come after a much longer one.
const WAITS: f64 = 3.0;
const LONGER: f64 = 1.5;
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
    /// How long it had rested, s.
    pub wait: f64,
    /// Nothing had moved it before.
    pub first: bool,
}

/// What sets the overshoot of a body's pushes apart, where nothing is `named` that would.
pub fn blow_findings(pushes: &Pushes, named: &[Finding]) -> Vec<Finding> {
    if named.iter().any(|f| OTHERS.contains(&f.cause.as_str())) {
        return Vec::new();
    }
    let one = |body: usize| {
        let own = || pushes.blows.iter().filter(|b| b.0 == body).map(|b| &b.1);
        let usual = median(&own().map(|b| b.level).collect::<Vec<f64>>())?;
        // What is let go while it is still sped up has nothing after it.
        let whole = |b: &&Blow| b.came > 0.0 && b.level > WHOLE * usual;
        let own: Vec<&Blow> = own().filter(whole).collect();
        bond(&own).or_else(|| ageing(&own))
    };
    (0..pushes.names.len()).filter_map(one).collect()
}

/// A first push that overshoots as none of its speed does after it.
fn bond(all: &[&Blow]) -> Option<Finding> {
    let first = all.iter().find(|b| b.first && !b.held_out)?;
    let others: Vec<&&Blow> = all.iter().filter(|b| !b.first).collect();
    if others.len() + 1 < FEWEST || others.iter().all(|b| LONGER * b.wait < first.wait) {
        return None;
    }
    let per_speed = median(&others.iter().map(|b| b.over / b.came).collect::<Vec<_>>())?;
    let left: Vec<f64> = others.iter().map(|b| b.over - per_speed * b.came).collect();
    let scatter = mad_sd(&left)?.hypot(SCATTER * first.level);
    let swing = per_speed * first.came;
    let beyond = first.over - swing;
    let excess = (first.over.powi(2) - swing.powi(2)).max(0.0).sqrt();
    // None of the others comes near.
    let next = left.iter().copied().fold(0.0, f64::max);
    if beyond < CLEAR * scatter || beyond < 2.0 * next || excess < LEAST * first.level {
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

/// Overshoots that grow with the logarithm of the time at rest.
fn ageing(all: &[&Blow]) -> Option<Finding> {
    let (held, fitted): (Vec<&Blow>, Vec<&Blow>) = all.iter().partition(|b| b.held_out);
    let waits = || fitted.iter().map(|b| b.wait);
    let spread = waits().fold(0.0, f64::max) / waits().fold(f64::INFINITY, f64::min).max(1e-3);
    if fitted.len() < FEWEST || spread < WAITS {
        return None;
    }
    let level = median(&fitted.iter().map(|b| b.level).collect::<Vec<_>>())?;
    let per_speed = median(&fitted.iter().map(|b| b.over / b.came).collect::<Vec<_>>())?.max(0.0);
    let foretold = |x: &DVector<f64>, b: &Blow| {
        let excess = b.level * (x[0] + x[1] * (1.0 + b.wait).log10()).max(0.0);
        excess.hypot(x[2] * b.came)
    };
    let missed = |x: &DVector<f64>, of: &[&Blow]| of.iter().map(|b| (b.over - foretold(x, b)).powi(2)).sum::<f64>();
    let fit = |free: bool| {
        let residuals = |x: &DVector<f64>| {
            let x = DVector::from_vec(vec![x[0].abs(), if free { x[1] } else { 0.0 }, x[2]]);
            let mut out: Vec<f64> = fitted
                .iter()
                .map(|b| (b.over - foretold(&x, b)) / (SCATTER * level))
                .collect();
            // A wide prior keeps what the data do not tell in bounds.
            out.extend([x[0], x[1], (x[2] / per_speed.max(1e-6)).ln() / 2.0]);
            DVector::from_vec(out)
        };
        let start = DVector::from_vec(vec![0.1, if free { 0.1 } else { 0.0 }, 0.8 * per_speed.max(1e-6)]);
        let steps = DVector::from_vec(vec![1e-4, 1e-4, 1e-4 * per_speed.max(1e-6)]);
        levenberg_marquardt(&start, &steps, Settings::default(), residuals)
    };
    let (with, without) = (fit(true)?, fit(false)?);
    let judged = if held.is_empty() { &fitted } else { &held };
    let [before, after] = [&without.x, &with.x].map(|x| (missed(x, judged) / judged.len() as f64).sqrt());
    let taken = 1.0 - missed(&with.x, &fitted) / missed(&without.x, &fitted).max(1e-30);
    let misfit = (missed(&with.x, &fitted) / (fitted.len() as f64 - 3.0).max(1.0)).sqrt() / (SCATTER * level);
    let (beta, sd) = (with.x[1], with.sd(1) * misfit.max(1.0));
    if beta < CLEAR * sd || beta < 0.5 * LEAST || taken < TAKEN || after > 0.8 * before {
        return None;
    }
    let names = |of: &[&Blow]| of.iter().map(|b| b.interaction.clone()).collect::<Vec<String>>();
    let told = Told {
        cause: "static-ageing",
        place: "support",
        probability: 0.95,
        rivals: &[],
        parameter: (
            "beta",
            Estimate::measured(
                beta,
                sd.hypot(0.15 * beta),
                "1",
                names(&fitted),
                "overshoots over times at rest",
            ),
        ),
        residual: "overshoot",
        statistic: beta / sd,
        words: "the longer it rested the more force sets it going".into(),
        gain: gain("force", "N", [before, after], names(&held)),
    };
    Some(told.finding())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn blows(bond: f64, beta: f64) -> Vec<Blow> {
        let one = |k: usize| {
            let (speed, wait) = ([0.01, 0.03, 0.08][k % 3], [1.0, 3.0, 10.0, 30.0][k % 4]);
            let excess = if k == 0 { bond } else { 0.0 } + 3.0 * (0.05 + beta * (1.0_f64 + wait).log10());
            Blow {
                interaction: format!("push-{k:02}"),
                held_out: k > 9,
                over: excess.hypot(30.0 * speed) + 0.04 * ((k * 7 % 5) as f64 - 2.0),
                speed,
                came: speed,
                level: 3.0,
                wait,
                first: k == 0,
                size: 0.0,
            }
        };
        (0..12).map(one).collect()
    }

    #[test]
    fn a_bond_and_an_ageing_are_told_from_the_swing_of_a_tool() {
        let told = |bond_: f64, beta: f64| {
            let all = blows(bond_, beta);
            let own: Vec<&Blow> = all.iter().collect();
            bond(&own).or_else(|| ageing(&own)).map(|f| f.cause)
        };
        assert_eq!(told(0.0, 0.0), None);
        assert_eq!(told(2.0, 0.0).as_deref(), Some("breakaway-bond"));
        assert_eq!(told(0.0, 0.2).as_deref(), Some("static-ageing"));
    }
}
