//! Paths that were written down with few digits, or read by an encoder of few lines: where a coordinate goes in steps that its noise
//! does not fill, each step stands for all that rounds to it, and what is told exactly is when it goes over from one to the next.

use crate::capture::{Capture, PoseStream};
use crate::math::median;

/// Least step that is evened out, m: what is finer is below the noise of what tells positions.
const COARSE: f64 = 1e-5;
/// How near differences have to be to whole steps, as a share of one; and the share of the differences that are.
const WHOLE: f64 = 0.02;
const MOST: f64 = 0.99;
/// Rows on one step from which on it is a stair, and the share of the rows on such ones from which on noise does not fill the steps.
const ROWS: usize = 3;
const STAIRS: f64 = 0.5;
/// Share of the steps that take back the one before, from which on noise makes them: their mean tells more than when they are taken.
const HOPS: f64 = 0.1;
/// Fewest steps of a path that tell it.
const FEWEST: usize = 8;
/// Stays on a step this much longer than its neighbours let it cross it are rests.
const LINGERS: f64 = 1.5;

/// The capture with the paths of its tools evened out, where they go in steps: each axis of the room by itself.
pub(super) fn evened(capture: &Capture) -> Option<Capture> {
    let paths = || capture.interactions.iter().filter_map(|i| i.tool_path.as_ref());
    let steps = [0, 1, 2].map(|k| {
        let own: Vec<f64> = paths().filter_map(|p| step_of(&seen(p, k))).collect();
        median(&own).filter(|_| 2 * own.len() > paths().filter(|p| moves(&seen(p, k))).count())
    });
    if steps.iter().all(Option::is_none) {
        return None;
    }
    let mut out = capture.clone();
    for path in out.interactions.iter_mut().filter_map(|i| i.tool_path.as_mut()) {
        for (k, step) in steps.iter().enumerate() {
            step.iter().for_each(|step| even(path, k, *step));
        }
    }
    Some(out)
}

/// One coordinate of a path where it is known, m.
fn seen(path: &PoseStream, k: usize) -> Vec<f64> {
    let known = path.position.iter().filter(|p| p[k].is_finite());
    known.map(|p| p[k]).collect()
}

/// Differences from row to row; what is left of a subtraction is none.
fn taken(values: &[f64]) -> Vec<f64> {
    let pairs = values.windows(2).map(|w| w[1] - w[0]);
    pairs.filter(|d| d.abs() > 1e-9).collect()
}

fn moves(values: &[f64]) -> bool {
    taken(values).len() >= FEWEST
}

/// The step in which a coordinate goes, m; nothing where it goes in none that noise leaves to be seen.
fn step_of(values: &[f64]) -> Option<f64> {
    let taken = taken(values);
    let step = taken.iter().map(|d| d.abs()).fold(f64::INFINITY, f64::min);
    let whole = |d: &&f64| (d.abs() / step - (d.abs() / step).round()).abs() < WHOLE;
    let comb = taken.len() >= FEWEST && taken.iter().filter(whole).count() as f64 >= MOST * taken.len() as f64;
    let on_stairs: usize = runs(values).iter().map(|run| run.len()).filter(|n| *n >= ROWS).sum();
    let stairs = on_stairs as f64 > STAIRS * values.len() as f64;
    let back = taken.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
    let quiet = (back as f64) < HOPS * taken.len() as f64;
    (step > COARSE && comb && stairs && quiet).then_some(step)
}

/// Rows on one value.
fn runs(values: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut out: Vec<std::ops::Range<usize>> = Vec::new();
    for (i, value) in values.iter().enumerate() {
        match out.last_mut() {
            Some(run) if (values[run.start] - value).abs() < 1e-9 => run.end = i + 1,
            _ => out.push(i..i + 1),
        }
    }
    out
}

fn even(path: &mut PoseStream, k: usize, step: f64) {
    let rows: Vec<usize> = (0..path.len()).filter(|i| path.position[*i][k].is_finite()).collect();
    let times: Vec<f64> = rows.iter().map(|i| path.time[*i]).collect();
    for (row, value) in rows.iter().zip(between_steps(&times, &seen(path, k), step)) {
        path.position[*row][k] = value;
    }
}

/// What was rounded, as the times at which it goes over from step to step tell it: between two such straight on, at rest in the middle.
/// What goes faster than rows follow each other stays as it was read.
fn between_steps(times: &[f64], values: &[f64], step: f64) -> Vec<f64> {
    let runs = runs(values);
    // Where a step is left for the next: when, s, and what it was then, m.
    let over = |from: usize| -> Option<(f64, f64)> {
        let (a, b) = (runs.get(from)?.end - 1, runs.get(from + 1)?.start);
        let next = (values[b] - values[a]).abs() < 1.5 * step;
        next.then(|| (0.5 * (times[a] + times[b]), 0.5 * (values[a] + values[b])))
    };
    let lasts = |run: usize| times[runs[run].end - 1] - times[runs[run].start];
    let mut out = values.to_vec();
    for (j, run) in runs.iter().enumerate() {
        let (came, left) = (j.checked_sub(1).and_then(over), over(j));
        let middle = values[run.start];
        // As fast as through its neighbours it is half way across it after that.
        let half = |neighbour: usize| 0.5 * lasts(neighbour).min(lasts(j));
        let (into, out_of) = (
            came.map(|c| (c.0 + half(j - 1), c)),
            left.map(|l| (l.0 - half(j + 1), l)),
        );
        let crosses = match (into, out_of) {
            (Some((_, a)), Some((_, b))) => {
                let own = half(j - 1) + half(j + 1);
                (a.1 - b.1).abs() > 0.5 * step && b.0 - a.0 < LINGERS * own.max(1e-9)
            }
            _ => false,
        };
        for i in run.clone() {
            let t = times[i];
            out[i] = match (into, out_of) {
                (Some((_, a)), Some((_, b))) if crosses => a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0),
                (Some((until, a)), _) if t < until => a.1 + (middle - a.1) * (t - a.0) / (until - a.0),
                (_, Some((from, b))) if t > from => b.1 + (middle - b.1) * (b.0 - t) / (b.0 - from),
                _ => middle,
            };
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rest, 4 mm/s for a second, rest, and back at 1 mm/s; read 500 times a second.
    fn way(t: f64) -> f64 {
        0.1234 + 4e-3 * (t - 0.5).clamp(0.0, 1.0) - 1e-3 * (t - 2.2).clamp(0.0, 1.0)
    }

    #[test]
    fn what_goes_in_steps_is_evened_to_a_fraction_of_one() {
        let times: Vec<f64> = (0..2000).map(|i| 0.002 * f64::from(i)).collect();
        let truth: Vec<f64> = times.iter().map(|t| way(*t)).collect();
        let rounded: Vec<f64> = truth.iter().map(|x| (x * 1e4).round() * 1e-4).collect();
        let rms = |of: &[f64]| (of.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / 2000.0).sqrt();
        let even = between_steps(&times, &rounded, 1e-4);
        let moving = |of: &[f64]| {
            let own = |i: &usize| (times[*i] > 0.55 && times[*i] < 1.45) || (times[*i] > 2.3 && times[*i] < 3.1);
            let off: Vec<f64> = (0..2000).filter(own).map(|i| (of[i] - truth[i]).powi(2)).collect();
            (off.iter().sum::<f64>() / off.len() as f64).sqrt()
        };
        assert!(moving(&rounded) > 2.5e-5, "{}", moving(&rounded));
        assert!(moving(&even) < 5e-6, "{}", moving(&even));
        assert!(rms(&even) < rms(&rounded), "{} {}", rms(&even), rms(&rounded));
        assert!(even.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 6e-5));
    }

    #[test]
    fn a_path_of_many_digits_and_one_whose_noise_fills_its_steps_have_none() {
        let path = |digits: f64, noise: f64| -> Vec<f64> {
            let stray = |i: u32| noise * (f64::from(i) * 12.9898).sin();
            let one = |i: u32| ((way(0.002 * f64::from(i)) + stray(i)) * digits).round() / digits;
            (0..1000).map(one).collect()
        };
        assert!(step_of(&path(1e4, 0.0)).is_some_and(|s| (s - 1e-4).abs() < 1e-9));
        assert!(step_of(&path(1e8, 0.0)).is_none());
        assert!(step_of(&path(1e4, 3e-4)).is_none());
        assert!(step_of(&[0.1; 400]).is_none());
    }
}
