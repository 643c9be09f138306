//! What it takes to set a joint going over what keeps it going, read at every start.
//!
//! A hand that sets out overshoots by itself: a mass on the hand's spring swings. But all of that becomes momentum: of a joint
//! with nothing but dry friction, the impulse over what keeps it going is `J v`, `v` the speed that it then has, however soft the
//! hand. What a static excess holds back is felt and moves nothing: it is what is left of the impulse where `v` goes to 0.

use nalgebra::{DMatrix, DVector};

use super::joint_starts::{JointStart, joint_starts};
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::math::{mad_sd, median, weighted_linear};
use crate::twin::{Finding, Joint, JointKind, Model};

/// Fewest starts, standard deviations, and the least share of the friction that is an excess.
const FEWEST: usize = 5;
const CLEAR: f64 = 6.0;
const LEAST: f64 = 0.3;
/// Between which shares of the usual level that of a start has to be.
const SAME: [f64; 2] = [0.5, 2.0];
/// Scatter from start to start, as a share.
const SCATTER: f64 = 0.1;
/// Standard deviations from which on a start has less of a say.
const STRAYS: f64 = 2.0;
/// Share of the starts that have to show half of what all show.
const COMMON: f64 = 0.85;
/// Speed that a stiff hand gives a part for a moment, over the speed that smoothing leaves of it, and share of what all starts show that
/// the slowest third of them has to show beyond that: a clean door whose hand sets out at once swung to 1.45 times its speed.
const SWINGS: f64 = 1.5;
const BEYOND: f64 = 0.25;
/// Causes that make a joint jump at one place or after a way.
const OTHERS: [&str; 5] = ["joint-stiction", "latch", "detent", "backlash", "joint-loose-mass"];

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
            &joint_starts(capture, segmented, model, joint),
        )
    };
    model.twin.joints().filter(free).filter_map(of).collect()
}

/// Impulses of starts as `inertia v + held`.
#[derive(Clone, Copy, Debug)]
struct Impulses {
    /// kg·m² or kg.
    inertia: f64,
    /// What moves nothing, with its standard deviation, N·m·s or N·s.
    held: (f64, f64),
}

impl Impulses {
    /// Robust: a start that was none has little say. Without `held` where that is not asked for.
    fn of(starts: &[&JointStart], held: bool) -> Option<Self> {
        let n = starts.len();
        let speeds = DVector::from_iterator(n, starts.iter().map(|s| s.speed));
        let felt = DVector::from_iterator(n, starts.iter().map(|s| s.impulse.0));
        let mut foretold = felt.clone();
        let mut out = None;
        for _ in 0..10 {
            let weight = |i: usize| {
                let sd = starts[i].impulse.1.hypot(SCATTER * foretold[i]).max(1e-12);
                let strays = (felt[i] - foretold[i]).abs() / sd;
                (STRAYS / strays.max(STRAYS)) / (sd * sd)
            };
            let weights = DVector::from_fn(n, |i, _| weight(i));
            // What gives way to a push cannot run ahead of it: an inertia is not negative.
            let both = DMatrix::from_fn(n, 2, |i, k| if k == 0 { speeds[i] } else { 1.0 });
            let two = held.then(|| weighted_linear(&both, &felt, &weights)).flatten();
            let column = |values: &DVector<f64>| DMatrix::from_column_slice(n, 1, values.as_slice());
            let (x, fit, last) = if let Some(fit) = two.filter(|f| f.x[0] > 0.0) {
                ([fit.x[0], fit.x[1]], fit, 1)
            } else if held {
                let fit = weighted_linear(&column(&DVector::from_element(n, 1.0)), &felt, &weights)?;
                ([0.0, fit.x[0]], fit, 0)
            } else {
                let fit = weighted_linear(&column(&speeds), &felt, &weights)?;
                ([fit.x[0], 0.0], fit, 0)
            };
            foretold = speeds.map(|v| x[0] * v + x[1]);
            let squares: f64 = (0..n).map(|i| weights[i] * (felt[i] - foretold[i]).powi(2)).sum();
            let misfit = (squares / (n as f64 - 2.0).max(1.0)).sqrt().max(1.0);
            out = Some(Self {
                inertia: x[0],
                held: (x[1], fit.covariance[(last, last)].sqrt() * misfit),
            });
        }
        out
    }

    /// By how much the load of a start goes over its level without an excess, N·m or N: `√(J v k r)`, `k r` the rate at which the
    /// hand loads it.
    fn swing(&self, start: &JointStart) -> f64 {
        (self.inertia * start.speed * start.rises).sqrt()
    }

    /// Root mean square of what is left of the impulses, N·m·s or N·s.
    fn error(&self, starts: &[&JointStart]) -> f64 {
        let left = |s: &JointStart| s.impulse.0 - self.inertia * s.speed - self.held.0;
        let squares: f64 = starts.iter().map(|s| left(s).powi(2)).sum();
        (squares / starts.len().max(1) as f64).sqrt()
    }
}

/// Of a joint with this name, which turns or slides, with this friction, N·m or N.
fn finding((name, turns, friction): (&str, bool, f64), all: &[JointStart]) -> Option<Finding> {
    let usual = median(&all.iter().map(|s| s.level).collect::<Vec<_>>())?;
    // Where the load never came down to what keeps it going it was stopped before, and its impulse is not that of a start.
    let whole = all
        .iter()
        .filter(|s| (SAME[0] * usual..SAME[1] * usual).contains(&s.level));
    let (held, fitted): (Vec<&JointStart>, Vec<&JointStart>) = whole.partition(|s| s.held_out);
    if fitted.len() < FEWEST {
        return None;
    }
    let friction = friction.max(median(&fitted.iter().map(|s| s.level).collect::<Vec<_>>())?);
    let (impulses, plain) = (Impulses::of(&fitted, true)?, Impulses::of(&fitted, false)?);
    let (left, sd_left) = impulses.held;
    // Slow starts swing least.
    let usual = median(&fitted.iter().map(|s| impulses.swing(s)).collect::<Vec<_>>())?;
    let slow = || fitted.iter().filter(|s| impulses.swing(s) <= usual);
    // If it is gone before the swing begins the peak is all its own; if it lasts as long the swing comes on top.
    let peaks: Vec<f64> = slow().map(|s| s.excess).collect();
    let on_top: Vec<f64> = slow().map(|s| (s.excess - impulses.swing(s)).max(0.0)).collect();
    let scatter = mad_sd(&peaks)? / (peaks.len() as f64).sqrt();
    let [gone, lasts] = [median(&peaks)?, median(&on_top)?];
    let excess = 0.5 * (gone + lasts);
    let sd = scatter.hypot(0.1 * excess).hypot((gone - lasts) / 12.0_f64.sqrt());
    let shows = |s: &&&JointStart| s.impulse.0 - impulses.inertia * s.speed > 0.5 * left;
    let common = fitted.iter().filter(shows).count() as f64 > COMMON * fitted.len() as f64;
    let judged = if held.is_empty() { &fitted } else { &held };
    let [before, after] = [plain.error(judged), impulses.error(judged)];
    // A swing that is over sooner than a speed is told takes more momentum than is read of it.
    let beyond = median(&slowest(&fitted, |s| s.impulse.0 - SWINGS * impulses.inertia * s.speed))?;
    let common = common && beyond > BEYOND * left;
    // Impulses that do not grow with speed tell nothing of what would be left of them without any.
    if impulses.inertia <= 0.0 || left < CLEAR * sd_left || excess < LEAST * friction || !common || after > before {
        return None;
    }
    let names = |of: &[&JointStart]| {
        let mut names: Vec<String> = of.iter().map(|s| s.interaction.clone()).collect();
        names.dedup();
        names
    };
    let unit = if turns { "N·m·s" } else { "N·s" };
    let share = Estimate::measured(
        excess / friction,
        sd / friction,
        "1",
        names(&fitted),
        "impulses and peaks of starts over their speeds",
    );
    let told = Told {
        cause: "joint-stiction",
        place: name,
        probability: 0.95,
        rivals: &[],
        parameter: ("fs_over_fc", share),
        residual: "load at the start",
        statistic: left / sd_left,
        words: "more force is needed to set the joint going than to keep it going".into(),
        gain: gain("impulse", unit, [before, after], names(&held)),
    };
    Some(told.finding())
}

/// What the slowest third of starts shows.
fn slowest(starts: &[&JointStart], of: impl Fn(&JointStart) -> f64) -> Vec<f64> {
    let mut by_speed = starts.to_vec();
    by_speed.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    by_speed.truncate(starts.len().div_ceil(3));
    by_speed.into_iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::diagnosis::joint_starts::Path;
    use crate::stages::estimation::JointLoad;

    /// A slide of 1 kg that takes 2 N to be kept going, and `excess` more to be set going, which fades over half a millimetre; a hand
    /// that comes up to `speed` in 0.1 s draws it by a spring of this stiffness, N/m, and a damper, a share of the critical one. Stepped
    /// through, 20 microseconds each.
    fn motion(excess: f64, (stiffness, damped): (f64, f64), speed: f64) -> Vec<JointLoad> {
        let (mut hand, mut place, mut goes, mut slid) = (0.0, 0.0, 0.0_f64, 0.0_f64);
        let mut out = Vec::new();
        for i in 0..125_000_u32 {
            let t = 2e-5 * f64::from(i);
            let drawn = speed * ((t - 1.0) / 0.1).clamp(0.0, 1.0);
            hand += 2e-5 * drawn;
            let load: f64 = stiffness * (hand - place) + 2.0 * damped * stiffness.sqrt() * (drawn - goes);
            let rubs = 2.0 + excess * (-slid / 5e-4).exp();
            if goes > 0.0 || load > rubs {
                goes = (goes + 2e-5 * (load - rubs)).max(0.0);
            }
            place += 2e-5 * goes;
            slid += 2e-5 * goes;
            if i % 500 == 250 {
                let wobble = f64::from((i / 500) * 7 % 5) - 2.0;
                out.push(JointLoad {
                    time: t,
                    load: load + 0.01 * wobble,
                    lever: 1.0,
                    aside: [0.0; 2],
                    way: nalgebra::Vector3::x(),
                    position: place + 1e-6 * wobble,
                    speed: goes,
                    speed_gain: 1.0,
                    acceleration: 0.0,
                });
            }
        }
        out
    }

    fn found(excess: f64, hand: (f64, f64)) -> Option<Finding> {
        let each = [0.02, 0.04, 0.08, 0.15, 0.03, 0.06, 0.1].into_iter().enumerate();
        let starts = each.flat_map(|(k, speed)| {
            let loads = motion(excess, hand, speed);
            let path = Path(&loads);
            let read: Vec<JointStart> = path.starts().into_iter().filter_map(|b| path.read(b)).collect();
            assert_eq!(read.len(), 1, "{speed}");
            read.into_iter().map(move |s| JointStart {
                interaction: format!("pull-{k}"),
                held_out: k == 4,
                ..s
            })
        });
        finding(("slide", false, 2.0), &starts.collect::<Vec<_>>())
    }

    #[test]
    fn an_excess_is_told_from_the_swing_of_a_hand() {
        // One that hardly damps rings on; that feigns nothing.
        for hand in [(2e3, 0.2), (8e3, 0.2), (2e3, 0.04), (8e3, 0.04)] {
            assert!(found(0.0, hand).is_none(), "{hand:?}");
        }
        for hand in [(2e3, 0.2), (8e3, 0.2)] {
            let told = found(2.4, hand).expect("an excess");
            let share = &told.parameters["fs_over_fc"];
            let holds = share.ci95.is_some_and(|[low, high]| low < 1.2 && 1.2 < high);
            assert!(holds && (share.value - 1.2).abs() < 0.35, "{hand:?}: {share:?}");
            assert!(told.gain.reduction > 0.5, "{:?}", told.gain);
        }
    }
}
