//! The ends of a joint's travel: found only where the tool went on, or its force rose, while the joint stopped.

use super::pair::Pair;
use crate::base::Estimate;
use crate::capture::Interaction;
use crate::math::median;

/// Joint position over time in one interaction.
pub struct Travel {
    /// Index into the runs of the pair.
    pub run: usize,
    /// Seconds.
    pub time: Vec<f64>,
    /// rad or m, 0 at the first view.
    pub position: Vec<f64>,
}

/// Lowest and highest position seen.
pub fn travelled(travels: &[Travel]) -> [f64; 2] {
    travels
        .iter()
        .flat_map(|t| &t.position)
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], q| [l.min(*q), h.max(*q)])
}

/// The limits, where at least one end was run into. `sd` is the noise of one position; an end that was not
/// reached is given as far as the joint travelled, with an interval that is open by the whole range outwards and
/// by the noise of an extreme inwards.
pub fn limits(pair: &Pair, travels: &[Travel], sd: f64, unit: &str) -> Option<Estimate<[f64; 2]>> {
    let [low, high] = travelled(travels);
    let (at_low, at_high) = (reached(pair, travels, sd, -1.0), reached(pair, travels, sd, 1.0));
    if at_low.is_none() && at_high.is_none() {
        return None;
    }
    let from: Vec<String> = [&at_low, &at_high]
        .into_iter()
        .flatten()
        .map(|(_, run)| pair.runs[*run].name.clone())
        .collect();
    let range = high - low;
    // An end that gives begins before the farthest place that it was pressed to.
    let begins = |found: &Option<(f64, usize)>, sign: f64| {
        let (farthest, run) = (*found)?;
        let travel = travels.iter().find(|t| t.run == run)?;
        yields_from(pair, travel, sign, farthest).filter(|q| (farthest - q).abs() > (10.0 * sd).max(GIVES * range))
    };
    let end = |found: &Option<(f64, usize)>, seen: f64, sign: f64| match (found, begins(found, sign)) {
        (None, _) => (seen, range),
        (Some((farthest, _)), Some(q)) => (q, 0.25 * (farthest - q).abs()),
        (Some((farthest, _)), None) => (*farthest, 0.6 * sd),
    };
    let (lower, upper) = (end(&at_low, low, -1.0), end(&at_high, high, 1.0));
    let mut estimate = Estimate::measured([lower.0, upper.0], [lower.1, upper.1], unit, from, "end-stop");
    if let Some(interval) = estimate.ci95.as_mut() {
        if at_low.is_none() {
            interval[0] = [low - range, low + 4.0 * sd];
        }
        if at_high.is_none() {
            interval[1] = [high - 4.0 * sd, high + range];
        }
    }
    Some(estimate)
}

/// Share of the range over which an end that gives is told from one that stands.
const GIVES: f64 = 0.02;
/// Times the force of the way there from which on an end is felt.
const FELT: f64 = 1.5;

/// Where the force at an end rose, on the way to `farthest`; nothing where it is not known.
fn yields_from(pair: &Pair, t: &Travel, sign: f64, farthest: f64) -> Option<f64> {
    let force = pair.runs[t.run].force.as_ref()?;
    let reached = (0..t.time.len()).find(|i| sign * (farthest - t.position[*i]) <= 0.0)?;
    let (first, last) = (t.time[0], t.time[reached]);
    let on_the_way = |i: &usize| force.time[*i] >= first && force.time[*i] <= last;
    let sizes: Vec<f64> = (0..force.time.len())
        .filter(on_the_way)
        .map(|i| force.force[i].norm())
        .filter(|f| f.is_finite())
        .collect();
    let usual = median(&sizes)?;
    let size = |time: f64| {
        let i = force.time.partition_point(|x| *x < time).min(force.time.len() - 1);
        force.force[i].norm()
    };
    // Back from the end to where it was last as large as on the way.
    let risen = (0..reached)
        .rev()
        .take_while(|i| size(t.time[*i]) > FELT * usual)
        .last()?;
    Some(t.position[risen])
}

/// Whether the lower and the upper end were run into.
pub fn ends(pair: &Pair, travels: &[Travel], sd: f64) -> [bool; 2] {
    [-1.0, 1.0].map(|sign| reached(pair, travels, sd, sign).is_some())
}

/// The end in one direction (`sign`), and the run that ran into it.
fn reached(pair: &Pair, travels: &[Travel], sd: f64, sign: f64) -> Option<(f64, usize)> {
    let extreme = travels
        .iter()
        .flat_map(|t| t.position.iter().map(|q| sign * q))
        .fold(f64::NEG_INFINITY, f64::max);
    let set_out_for = travels.iter().find_map(|t| {
        let at_end: Vec<usize> = (0..t.time.len())
            .filter(|&i| sign * t.position[i] > extreme - 5.0 * sd)
            .collect();
        let (first, last) = (*at_end.first()?, *at_end.last()?);
        let moved = (sign * t.position[0] - extreme).abs() > 20.0 * sd;
        let long = t.time[last] - t.time[first] > 0.1;
        (moved && long && pressed(pair.runs[t.run], t.time[0], t.time[first], t.time[last])).then(|| {
            let mean = at_end.iter().map(|&i| t.position[i]).sum::<f64>() / at_end.len() as f64;
            (mean, t.run)
        })
    });
    set_out_for.or_else(|| travels.iter().find_map(|t| came_back_to(pair, t, sd, sign, extreme)))
}

/// Share of the way to an end from which on the force is that of the way there.
const LAST_PART: f64 = 0.7;

/// The end in one direction where a motion came back to it: where it set out from it, or had run into the other one.
fn came_back_to(pair: &Pair, t: &Travel, sd: f64, sign: f64, extreme: f64) -> Option<(f64, usize)> {
    let apart = |i: &usize| extreme - sign * t.position[*i];
    let all = || 0..t.time.len();
    let farthest = all().map(|i| apart(&i)).fold(0.0, f64::max);
    let away = all().rev().find(|i| apart(i) > LAST_PART * farthest)?;
    let at_end: Vec<usize> = (away..t.time.len()).filter(|i| apart(i) < 5.0 * sd).collect();
    let (first, last) = (*at_end.first()?, *at_end.last()?);
    let came = farthest > 20.0 * sd && t.time[last] - t.time[first] > 0.1;
    (came && pressed(pair.runs[t.run], t.time[away], t.time[first], t.time[last])).then(|| {
        let mean = at_end.iter().map(|i| t.position[*i]).sum::<f64>() / at_end.len() as f64;
        (mean, t.run)
    })
}

/// True where the force at the stop is far above the one on the way there.
fn pressed(run: &Interaction, start: f64, stop: f64, end: f64) -> bool {
    let Some(force) = &run.force else { return false };
    let sizes = |from: f64, to: f64| {
        let mut sizes: Vec<f64> = (0..force.time.len())
            .filter(|&i| force.time[i] >= from && force.time[i] <= to)
            .map(|i| force.force[i].norm())
            .filter(|f| f.is_finite())
            .collect();
        sizes.sort_by(f64::total_cmp);
        sizes
    };
    let (before, after) = (sizes(start, stop), sizes(stop, end));
    let quantile = |v: &[f64], p: f64| v.get((p * v.len() as f64) as usize).copied();
    match (quantile(&before, 0.9), quantile(&after, 0.8)) {
        (Some(way), Some(stop)) => stop > 2.5 * way && stop > way + 0.5,
        _ => false,
    }
}
