//! A force sensor that lags, as motions of joints tell it: the joint goes already while what is read still rises.
//!
//! With dry friction alone the load of a moving joint is `f + J q''`. What a pole of `T` seconds reads of it falls short by the
//! impulse `∫ (f - L) dt = T ΔL - J Δq'` from any moment of the motion until it is steady: in every start, at every speed, by the
//! same `T`. Clocks that run apart, damping, a friction that comes up over a way and a spring fall short by other rules.

use nalgebra::{DMatrix, DVector};

use super::joint_starts::{Begins, LEVEL, Path, motions_of};
use super::sensor_lag::SensorLag;
use super::told::gain;
use crate::capture::{Capture, Segmented};
use crate::math::{mad_sd, median, weighted_linear};
use crate::stages::estimation::JointLoad;
use crate::twin::{Joint, JointKind, Model};

/// Seconds of one reading, half of the span of its place by a track, and how far a parent may move that stands, m; half of that
/// span by the path of a tool, s.
const READ: ([f64; 3], f64) = ([0.005, 0.08, 3e-3], 0.02);
/// When before the start its place at rest is read, s.
const RESTED: [f64; 2] = [0.25, 0.05];
/// How long a joint is sought that has set out, s, in standard deviations of its place at rest: to have gone, and to stay so.
const SOUGHT: [f64; 2] = [-0.2, 0.5];
const GONE: [f64; 2] = [5.0, 4.0];
const STAYS: usize = 6;
/// A start of which the moment is not known as well as that, s, tells nothing.
const SHARP: f64 = 0.05;
/// When after it the load may be steady, s, and poles that it takes to come up.
const STEADY: [f64; 2] = [0.15, 0.9];
const COMES_UP: f64 = 4.0;
const PASSES: usize = 3;
/// How long what is read is followed, s, and what share of the level is still missing at its end.
const FOLLOWED: f64 = 0.2;
const MISSING: f64 = 0.1;
/// Share of the level that is missing when it goes already, or it does not lag; fewest readings that it takes.
const LAGS: f64 = 0.15;
const READINGS: usize = 3;
/// Fewest starts, and the share of all that have to lag.
const FEWEST: usize = 4;
const COMMON: f64 = 0.7;
/// The least and the longest lag, s: no true one that was found was below 40 ms, hinges without came to 15, 17 and 19 ms.
const RANGE: [f64; 2] = [20e-3, 0.2];
/// Share of the squares that it may leave, and by how many times another rule has to leave more.
const LEAVES: f64 = 0.12;
const BETTER: f64 = 3.0;
/// Powers of the speed with which a damping may go: its form is not known.
const DAMPED: [f64; 2] = [1.0, 0.6];
/// Readings of one start that are as good as independent.
const FREE: f64 = 3.0;
/// Standard deviations.
const CLEAR: f64 = 8.0;

/// One start that lags, from when it goes until it is steady.
struct Rise {
    interaction: String,
    held_out: bool,
    level: f64,
    /// Speed when it is steady, rad/s or m/s.
    steady: f64,
    /// Seconds since the first reading; rad or m since it rested; rad/s or m/s; N·m or N that are missing; the rate of that, 1/s.
    rows: Vec<Row>,
    /// How many of them are beginnings of a stretch.
    from: usize,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    time: f64,
    way: f64,
    speed: f64,
    missing: f64,
    rate: f64,
}

/// Why the load of a moving joint is less than later.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    /// Read through so many equal poles.
    Lagging(u8),
    Late,
    /// In proportion to this power of the speed.
    Damped(f64),
    Presliding,
    Sprung,
}

impl Rule {
    /// The impulse that is missing from this reading on, of a size of 1 s or so.
    fn impulse(self, rise: &Rise, from: usize, size: f64) -> f64 {
        let (rows, first) = (&rise.rows[from..], &rise.rows[from]);
        match self {
            Self::Lagging(1) => size * first.missing,
            Self::Lagging(_) => size * first.missing + 0.25 * size * size * first.rate,
            // What rose evenly while it stood goes on rising until it has been told of all.
            Self::Late => 0.5 * first.missing * (size - first.time).max(0.0),
            Self::Damped(power) => {
                let of = |speed: f64| speed.max(0.0).powf(power);
                size * integral(rows, |r| of(rise.steady) - of(r.speed))
            }
            Self::Presliding => integral(rows, |r| rise.level * (1.0 - r.way / size.max(1e-9)).max(0.0)),
            Self::Sprung => {
                let last = rows.last().map_or(0.0, |r| r.way);
                size * integral(rows, |r| last - r.way)
            }
        }
    }

    /// Speed that is yet to be gained in what is read from this reading on, rad/s or m/s: of a late one also what came before it.
    fn gained(self, rise: &Rise, from: usize, size: f64) -> f64 {
        let since = rise.rows[from].time - if self == Self::Late { size } else { 0.0 };
        let then = rise.rows.iter().take_while(|r| r.time <= since + 1e-9).last();
        rise.steady - then.map_or(0.0, |r| r.speed)
    }

    /// Sizes that are tried.
    fn sizes(self, rises: &[&Rise]) -> Vec<f64> {
        let scale =
            |of: &dyn Fn(&Rise) -> f64| median(&rises.iter().map(|r| of(r)).collect::<Vec<f64>>()).unwrap_or(1.0);
        let way = scale(&|r| r.rows.last().map_or(0.0, |l| l.way)).max(1e-9);
        let unit = match self {
            Self::Lagging(_) | Self::Late => 1.0,
            Self::Damped(power) => scale(&|r| r.level / r.steady.max(1e-9).powf(power)),
            Self::Presliding => 3.0 * way,
            Self::Sprung => scale(&|r| r.level) / way,
        };
        // From 3 ms, or as small a part of the scale, on.
        (0..60).map(|k| unit * 3e-3 * 1.1_f64.powi(k)).collect()
    }
}

/// Of a stretch of readings.
fn integral(rows: &[Row], of: impl Fn(&Row) -> f64) -> f64 {
    let pairs = rows
        .windows(2)
        .map(|w| 0.5 * (of(&w[0]) + of(&w[1])) * (w[1].time - w[0].time));
    pairs.sum()
}

/// A rule with its size and the inertia beside it, and what it leaves of the squares of all.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    size: f64,
    inertia: f64,
    leaves: f64,
}

/// Missing impulses as `rule - inertia Δq'`.
fn fit(rule: Rule, rises: &[&Rise]) -> Option<Fitted> {
    let rows: Vec<(&Rise, usize)> = rises.iter().flat_map(|r| (0..r.from).map(move |k| (*r, k))).collect();
    let n = rows.len();
    let weights = DVector::from_iterator(n, rows.iter().map(|(r, _)| 1.0 / (r.level * r.level * r.from as f64)));
    let missing = DVector::from_iterator(n, rows.iter().map(|(r, k)| integral(&r.rows[*k..], |r| r.missing)));
    let squares = |x: &DVector<f64>| x.iter().zip(weights.iter()).map(|(x, w)| w * x * x).sum::<f64>();
    let all = squares(&missing).max(1e-300);
    let with = |size: f64| {
        let told = DVector::from_iterator(n, rows.iter().map(|(r, k)| rule.impulse(r, *k, size)));
        let gained = DMatrix::from_fn(n, 1, |i, _| rule.gained(rows[i].0, rows[i].1, size));
        let left = &told - &missing;
        let inertia = weighted_linear(&gained, &left, &weights).map_or(0.0, |f| f.x[0].max(0.0));
        let leaves = squares(&(left - gained.column(0) * inertia)) / all;
        Fitted { size, inertia, leaves }
    };
    let sizes = rule.sizes(rises);
    let best = sizes
        .into_iter()
        .map(with)
        .min_by(|a, b| a.leaves.total_cmp(&b.leaves))?;
    let fine = (-20..=20).map(|k| with(best.size * 1.1_f64.powf(f64::from(k) / 20.0)));
    fine.min_by(|a, b| a.leaves.total_cmp(&b.leaves))
}

/// The lag of the force sensor that all starts of all joints share; nothing where it is not clear.
pub(super) fn lag_of_joints(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<SensorLag> {
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let of = |joint: &Joint| of_joint(&motions_of(capture, segmented, model, joint, READ), joint);
    model.twin.joints().filter(kinds).find_map(of)
}

/// Whether a joint set out so often that a lag of the force would show.
pub(super) fn joints_tell_lag(capture: &Capture, segmented: &[Segmented], model: &Model) -> bool {
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let told = |joint: &Joint| {
        let motions = motions_of(capture, segmented, model, joint, READ);
        lagging(&rises(&motions, STEADY[0])).is_some_and(|told| best(&told).is_some())
    };
    model.twin.joints().filter(kinds).any(told)
}

/// How the load came up at each start, where it is told.
fn rises(motions: &[(String, bool, Vec<JointLoad>)], up: f64) -> Vec<Option<Rise>> {
    let one = |(name, held_out, loads): &(String, bool, Vec<JointLoad>)| {
        let path = Path(loads);
        let told = |b: Begins| rise((name, *held_out), &path, b, up);
        path.starts().into_iter().filter_map(told).collect::<Vec<_>>()
    };
    motions.iter().flat_map(one).collect()
}

fn of_joint(motions: &[(String, bool, Vec<JointLoad>)], joint: &Joint) -> Option<SensorLag> {
    let mut starts = rises(motions, STEADY[0]);
    // A level is one of what has come up: as long as that is later than it was read, it is read again.
    for _ in 0..PASSES {
        let up = COMES_UP * best(&lagging(&starts)?)?.1.size.min(RANGE[1]);
        starts = rises(motions, STEADY[0].max(up));
    }
    let (poles, fitted, sd, late) = lag(&lagging(&starts)?)?;
    let rises: Vec<&Rise> = starts.iter().flatten().collect();
    let (held, own): (Vec<&Rise>, Vec<&Rise>) = rises.into_iter().partition(|r| r.held_out);
    let names = |of: &[&Rise]| {
        let mut names: Vec<String> = of.iter().map(|r| r.interaction.clone()).collect();
        names.dedup();
        names
    };
    let judged = if held.is_empty() { &own } else { &held };
    let error = |size: f64| {
        let left = |r: &&Rise| {
            let lasts = r.rows.last().map_or(1.0, |l| l.time).max(1e-3);
            let rule = Rule::Lagging(poles);
            let told = rule.impulse(r, 0, size) - fitted.inertia * rule.gained(r, 0, size);
            (integral(&r.rows, |row| row.missing) - told) / lasts
        };
        let squares: f64 = judged.iter().map(|r| left(r).powi(2)).sum();
        (squares / judged.len().max(1) as f64).sqrt()
    };
    let (quantity, unit) = match joint.kind {
        JointKind::Revolute => ("torque", "N·m"),
        _ => ("force", "N"),
    };
    let errors = [error(0.0), error(fitted.size)];
    (errors[1] < errors[0]).then(|| SensorLag {
        seconds: (fitted.size, sd),
        poles,
        late,
        from: names(&own),
        gain: gain(quantity, unit, errors, names(&held)),
    })
}

/// Starts that were not held out, if most lag.
fn lagging(starts: &[Option<Rise>]) -> Option<Vec<&Rise>> {
    let fitted: Vec<&Rise> = starts.iter().flatten().filter(|r| !r.held_out).collect();
    let common = starts.iter().flatten().count() as f64 >= COMMON * starts.len() as f64;
    (common && fitted.len() >= FEWEST).then_some(fitted)
}

/// One pole or two, with the lag.
fn best(rises: &[&Rise]) -> Option<(u8, Fitted)> {
    let poles = [1, 2].map(|poles| Some((poles, fit(Rule::Lagging(poles), rises)?)));
    poles
        .into_iter()
        .flatten()
        .min_by(|a, b| a.1.leaves.total_cmp(&b.1.leaves))
}

/// Poles, size and inertia, the standard deviation of the size, s, and how probable it is that clocks run apart instead.
fn lag(rises: &[&Rise]) -> Option<(u8, Fitted, f64, f64)> {
    let n = rises.len() as f64;
    let (poles, best) = best(rises)?;
    let leaves = |rule: Rule| fit(rule, rises).map_or(f64::INFINITY, |f| f.leaves);
    let mut others = DAMPED
        .map(Rule::Damped)
        .into_iter()
        .chain([Rule::Presliding, Rule::Sprung]);
    let better = others.all(|rule| leaves(rule) > BETTER * best.leaves);
    let nats = 0.5 * FREE * n * (leaves(Rule::Late) / best.leaves.max(1e-12)).ln();
    // Without each in turn.
    let without = |k: usize| {
        let rest: Vec<&Rise> = (0..rises.len()).filter(|i| *i != k).map(|i| rises[i]).collect();
        fit(Rule::Lagging(poles), &rest).map(|f| f.size - best.size)
    };
    let squares: f64 = (0..rises.len()).filter_map(without).map(|d| d * d).sum();
    let sd = (squares * (n - 1.0) / n).sqrt();
    let told = (RANGE[0]..RANGE[1]).contains(&best.size) && best.leaves < LEAVES && best.size > CLEAR * sd;
    (told && better && nats > 0.0).then(|| (poles, best, sd, 1.0 / (1.0 + nats.exp())))
}

/// `None` where it cannot be told when it goes, or whether it lags; `Some(None)` of one that does not lag. Its level is read `up` s later or more.
fn rise(of: (&str, bool), path: &Path, begins: Begins, up: f64) -> Option<Option<Rise>> {
    let (loads, way) = (path.0, begins.way);
    let began = loads[begins.at].time;
    let rested = loads
        .iter()
        .filter(|l| (began - RESTED[0]..began - RESTED[1]).contains(&l.time));
    let places: Vec<f64> = rested.map(|l| way * l.position).collect();
    let (home, sd) = (median(&places)?, mad_sd(&places)?.max(1e-7));
    let gone = |i: usize| way * loads[i].position - home;
    let sought = (0..loads.len()).filter(|i| (began + SOUGHT[0]..began + SOUGHT[1]).contains(&loads[*i].time));
    let stays =
        |i: &usize| gone(*i) > GONE[0] * sd && (*i..(*i + STAYS).min(loads.len())).all(|k| gone(k) > GONE[1] * sd);
    let goes = sought.clone().find(stays)?;
    let start = loads[goes].time;
    if GONE[0] * sd > SHARP * way * path.speed(start, 0.03) {
        return None;
    }
    let steady = path.steady(start, [up, up - STEADY[0] + STEADY[1]])?;
    let end = steady + 0.5 * LEVEL;
    let level = path.level(steady, way).filter(|l| *l > 0.0)?;
    let near = |t: f64| {
        let near: Vec<f64> = loads[path.within(t - 0.012, t + 0.012)]
            .iter()
            .map(|l| way * l.load)
            .collect();
        near.iter().sum::<f64>() / near.len().max(1) as f64
    };
    let last = path.within(start, end).end;
    let row = |i: usize| Row {
        time: loads[i].time - start,
        way: gone(i),
        speed: way * path.speed(loads[i].time, 0.02),
        missing: level - near(loads[i].time),
        rate: (near(loads[i].time - 0.01) - near(loads[i].time + 0.01)) / 0.02,
    };
    let rows: Vec<Row> = (goes..last).map(row).collect();
    let from = rows
        .iter()
        .take_while(|r| r.time < FOLLOWED && r.missing > MISSING * level)
        .count();
    let lags = rows.first()?.missing > LAGS * level && from >= READINGS;
    // What is thrown ahead of its level by what it weighs hides a lag.
    let thrown = |r: &Row| r.missing < -LAGS * level;
    if !lags && rows.iter().take_while(|r| r.time < FOLLOWED).any(thrown) {
        return None;
    }
    let (interaction, held_out) = (of.0.to_owned(), of.1);
    Some(lags.then(|| Rise {
        interaction,
        held_out,
        level,
        steady: way * path.speed(end, 0.5 * LEVEL),
        rows,
        from,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slide of 2 N of dry friction and 200 g that a hand sets going within 0.1 s, read by `sensor` of time.
    fn motion(speed: f64, sensor: impl Fn(&dyn Fn(f64) -> f64, f64) -> f64) -> Vec<JointLoad> {
        let exerted = |t: f64| {
            let speeds_up = if (1.0..1.05).contains(&t) {
                0.2 * speed / 0.05
            } else {
                0.0
            };
            2.0 * ((t - 0.9) / 0.1).clamp(0.0, 1.0) + speeds_up
        };
        let one = |k: usize| {
            let t = 0.005 * k as f64;
            let (ramp, since) = (((t - 1.0) / 0.05).clamp(0.0, 1.0), (t - 1.05).max(0.0));
            let wobble = 1e-6 * f64::from((k * 7 % 5) as u8);
            JointLoad {
                time: t,
                load: sensor(&exerted, t),
                lever: 1.0,
                aside: [0.0; 2],
                way: nalgebra::Vector3::x(),
                position: speed * (0.025 * ramp * ramp + since) + wobble,
                speed: speed * ramp,
                speed_gain: 1.0,
                acceleration: 0.0,
            }
        };
        (0..500).map(one).collect()
    }

    /// Through one pole of 50 ms.
    fn lags(exerted: &dyn Fn(f64) -> f64, t: f64) -> f64 {
        let each = (0..400).map(|k| f64::from(k) * 1e-3);
        each.map(|s| exerted(t - s) * (-s / 0.05).exp() * 1e-3 / 0.05).sum()
    }

    fn found(sensor: impl Fn(&dyn Fn(f64) -> f64, f64) -> f64 + Copy) -> Option<(u8, Fitted, f64, f64)> {
        let motions: Vec<Vec<JointLoad>> = [0.03, 0.06, 0.1, 0.15, 0.2].map(|v| motion(v, sensor)).into();
        let told = |loads: &Vec<JointLoad>| {
            let path = Path(loads);
            let one = |b| rise(("pull", false), &path, b, 0.25);
            path.starts().into_iter().filter_map(one).collect::<Vec<_>>()
        };
        let rises: Vec<Option<Rise>> = motions.iter().flat_map(told).collect();
        // Those that are thrown ahead of their level do not tell whether they lag; all others do.
        let all = rises.len() == 5 && rises.iter().all(Option::is_some);
        assert!(all || rises.len() >= 2 && rises.iter().any(Option::is_none));
        lag(&lagging(&rises)?)
    }

    #[test]
    fn a_lag_is_what_is_missing_while_the_joint_goes() {
        let (_, fitted, _, late) = found(lags).expect("a lag");
        assert!((fitted.size - 0.05).abs() < 0.005, "{fitted:?}");
        assert!(late < 0.05, "{late}");
    }

    #[test]
    fn what_is_read_at_once_or_late_is_no_lag() {
        assert!(found(|exerted, t| exerted(t)).is_none());
        assert!(found(|exerted, t| exerted(t - 0.05)).is_none());
    }
}
