//! What it takes to set a joint going over what keeps it going, read at every start.
//!
//! A hand that sets out at once overshoots by itself: against dry friction a mass on the hand's spring swings by `v √(k m)`, and
//! from a static excess `Δ` by the two together, `√(Δ² + c² v²)`. What is left at slow starts is the excess.

use nalgebra::DVector;

use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::math::{Settings, levenberg_marquardt, median};
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{Finding, Joint, JointKind, Model};

/// Seconds of one reading, half of the span of its speeds, and how far a parent may move that stands, m.
const READ: [f64; 3] = [0.01, 0.08, 3e-3];
/// Share of a leg's own speed from which on it has set out, and how long it stood before, s.
const SETS_OUT: f64 = 0.2;
const STOOD: f64 = 0.15;
/// Around the setting out the peak lies, and after the peak what keeps it going and how fast it goes are read, s.
const PEAK: [f64; 2] = [0.15, 0.15];
const AFTER: [f64; 2] = [0.04, 0.14];
const GOES: [f64; 2] = [0.1, 0.3];
/// Fewest starts, standard deviations, and the least share of the friction that is an excess.
const FEWEST: usize = 5;
const CLEAR: f64 = 6.0;
const LEAST: f64 = 0.4;
/// Share of the squares that it has to take away, and of the starts that have to show half of it.
const TAKEN: f64 = 0.7;
const COMMON: f64 = 0.85;
/// Causes that make a joint jump at one place or after a way.
const OTHERS: [&str; 5] = ["joint-stiction", "latch", "detent", "backlash", "joint-loose-mass"];

/// One start.
struct Start {
    interaction: String,
    held_out: bool,
    /// rad/s or m/s.
    speed: f64,
    /// Peak over what keeps it going, N·m or N, and that.
    excess: f64,
    level: f64,
}

/// Joints that need more to be set going than to be kept going, of which nothing is `named` that would make it so.
pub fn breakaway_findings(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    named: &[Finding],
) -> Vec<Finding> {
    let free = |j: &&Joint| {
        let one = matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
        one && named
            .iter()
            .all(|f| f.place != j.name || !OTHERS.contains(&f.cause.as_str()))
    };
    let of = |joint: &Joint| {
        let friction = joint.friction.as_ref().map_or(0.0, |f| f.value);
        let turns = joint.kind == JointKind::Revolute;
        finding(
            (&joint.name, turns, friction),
            &starts(capture, segmented, model, joint),
        )
    };
    model.twin.joints().filter(free).filter_map(of).collect()
}

fn starts(capture: &Capture, segmented: &[Segmented], model: &Model, joint: &Joint) -> Vec<Start> {
    let mut out = Vec::new();
    for interaction in &capture.interactions {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name);
        let Some(loads) = cut.and_then(|cut| joint_loads(interaction, cut, joint, model, READ)) else {
            continue;
        };
        out.extend(starts_of(&loads).into_iter().map(|(speed, excess, level)| Start {
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            speed,
            excess,
            level,
        }));
    }
    out
}

/// Speed, excess and level of each start of one motion.
fn starts_of(loads: &[JointLoad]) -> Vec<(f64, f64, f64)> {
    let fast = loads.iter().map(|l| l.speed.abs()).fold(0.0, f64::max);
    let mut out = Vec::new();
    let mut stood = 0.0;
    for i in 1..loads.len() {
        if loads[i].speed.abs() < SETS_OUT * fast {
            stood += loads[i].time - loads[i - 1].time;
            continue;
        }
        if stood > STOOD {
            out.extend(start(loads, i));
        }
        stood = 0.0;
    }
    out
}

fn start(loads: &[JointLoad], i: usize) -> Option<(f64, f64, f64)> {
    let (at, way) = (loads[i].time, loads[i].speed.signum());
    let within = |from: f64, to: f64| loads.iter().filter(move |l| (from..to).contains(&l.time));
    let peak = within(at - PEAK[0], at + PEAK[1]).max_by(|a, b| (way * a.load).total_cmp(&(way * b.load)))?;
    let of = |span: [f64; 2], value: &dyn Fn(&JointLoad) -> f64| {
        let values: Vec<f64> = within(peak.time + span[0], peak.time + span[1]).map(value).collect();
        (values.len() > 5).then(|| median(&values)).flatten()
    };
    let level = of(AFTER, &|l| way * l.load)?;
    let speed = of(GOES, &|l| way * l.speed).filter(|v| *v > 0.0)?;
    Some((speed, way * peak.load - level, level))
}

/// `√(Δ² + c² v²)`.
fn overshoot(x: &DVector<f64>, speed: f64) -> f64 {
    x[0].hypot(x[1] * speed)
}

fn squares(starts: &[&Start], x: &DVector<f64>) -> f64 {
    starts.iter().map(|s| (s.excess - overshoot(x, s.speed)).powi(2)).sum()
}

/// Of a joint with this name, which turns or slides, with this friction, N·m or N.
fn finding((name, turns, friction): (&str, bool, f64), all: &[Start]) -> Option<Finding> {
    let (held, fitted): (Vec<&Start>, Vec<&Start>) = all.iter().partition(|s| s.held_out);
    if fitted.len() < FEWEST {
        return None;
    }
    let friction = friction.max(median(&fitted.iter().map(|s| s.level).collect::<Vec<_>>())?);
    let usual = median(&fitted.iter().map(|s| s.excess).collect::<Vec<_>>())?.max(0.0);
    let per_speed = median(&fitted.iter().map(|s| s.excess / s.speed).collect::<Vec<_>>())?.max(0.0);
    // Robust: a start that was no start has no say.
    let scale = 0.2 * usual.max(1e-6);
    let residuals = |x: &DVector<f64>| {
        let each = fitted.iter().map(|s| (s.excess - overshoot(x, s.speed)) / scale);
        DVector::from_iterator(fitted.len(), each)
    };
    let steps = DVector::from_vec(vec![1e-3 * usual.max(1e-6), 1e-3 * per_speed.max(1e-6)]);
    let fit = levenberg_marquardt(
        &DVector::from_vec(vec![usual, 0.3 * per_speed]),
        &steps,
        Settings::default(),
        residuals,
    )?;
    let excess = fit.x[0].abs();
    let misfit = (2.0 * fit.cost / (fitted.len() as f64 - 2.0).max(1.0)).sqrt();
    let sd = (fit.sd(0) * misfit).hypot(0.05 * excess);
    let (top, base) = fitted
        .iter()
        .fold((0.0, 0.0), |(t, b), s| (t + s.excess * s.speed, b + s.speed * s.speed));
    let plain = DVector::from_vec(vec![0.0, (top / base.max(1e-30)).max(0.0)]);
    let judged = if held.is_empty() { &fitted } else { &held };
    let [before, after] = [&plain, &fit.x].map(|x| (squares(judged, x) / judged.len() as f64).sqrt());
    let taken = 1.0 - squares(&fitted, &fit.x) / squares(&fitted, &plain).max(1e-30);
    let shown = fitted.iter().filter(|s| s.excess > 0.5 * excess).count();
    let common = shown as f64 > COMMON * fitted.len() as f64;
    let clear = excess > CLEAR * sd && excess > LEAST * friction && taken > TAKEN && common && after < before;
    if !clear {
        return None;
    }
    let names = |of: &[&Start]| {
        let mut names: Vec<String> = of.iter().map(|s| s.interaction.clone()).collect();
        names.dedup();
        names
    };
    let (quantity, unit) = if turns { ("torque", "N·m") } else { ("force", "N") };
    let share = Estimate::measured(
        excess / friction,
        sd / friction,
        "1",
        names(&fitted),
        "peaks of starts over their speeds",
    );
    let told = Told {
        cause: "joint-stiction",
        place: name,
        probability: 0.95,
        rivals: &[],
        parameter: ("fs_over_fc", share),
        residual: "load at the start",
        statistic: excess / sd,
        words: "more force is needed to set the joint going than to keep it going".into(),
        gain: gain(quantity, unit, [before, after], names(&held)),
    };
    Some(told.finding())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn starts(excess: f64, per_speed: f64) -> Vec<Start> {
        let one = |k: usize| {
            let speed = [0.1, 0.3, 0.8, 1.5][k % 4];
            Start {
                interaction: format!("pull-{k:02}"),
                held_out: k % 5 == 4,
                speed,
                excess: excess.hypot(per_speed * speed) * (1.0 + 0.05 * ((k * 7 % 5) as f64 - 2.0)),
                level: 0.06,
            }
        };
        (0..15).map(one).collect()
    }

    #[test]
    fn an_excess_is_told_from_the_swing_of_a_hand() {
        let joint = ("hinge", true, 0.06);
        assert!(finding(joint, &starts(0.0, 0.2)).is_none());
        let found = finding(joint, &starts(0.15, 0.05)).expect("an excess");
        let share = &found.parameters["fs_over_fc"];
        assert!(
            found.cause == "joint-stiction" && (share.value - 2.5).abs() < 0.25,
            "{found:?}"
        );
    }
}
