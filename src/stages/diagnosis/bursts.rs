//! Forces that jump off what is foretold now and then, and come back: of a cable that snags, of grit, of a finger that slips.
//!
//! They are over before a touch is: means over stretches of it, which tell laws apart, hardly feel them, and nothing of the catalogue
//! comes and goes at no place, speed or time of its own.

use super::sensor::taken_out;
use super::tares::before_the_touch;
use super::{Curve, Quantity, Trace};
use crate::math::{median, quantile};
use crate::twin::{Evidence, Finding};

/// Seconds over which readings are averaged, and those to either side whose middle one is how far the whole is off there.
const SMOOTH: f64 = 0.03;
const AROUND: f64 = 0.4;
/// Standard deviations of such a mean, and share of the usual force, by which it is off in a burst; its least and longest time, s.
const OFF: (f64, f64) = (6.0, 0.08);
const LASTS: [f64; 2] = [0.025, 0.35];
/// Where the foretold force changes by more than this share of the usual one within `NEAR` s nothing is judged, nor at the ends.
const CHANGES: f64 = 0.15;
const NEAR: f64 = 0.1;
const ENDS: f64 = 0.15;
/// Fewest readings of a touch, touches, touches with several bursts, as a share, and bursts in all: of 120 captures of
/// MuJoCo and of another engine none in which nothing was named, and in which nothing of the kind was hidden, came to half of that.
const READINGS: usize = 60;
const TOUCHES: usize = 4;
const SHARE: f64 = 0.5;
const SEVERAL: usize = 2;
const ALL: usize = 10;

/// How many bursts one touch has.
fn bursts_of(curve: &Curve) -> Option<usize> {
    let rows = curve.time.iter().zip(&curve.measured).zip(&curve.predicted);
    let rows: Vec<(f64, f64, f64)> = rows
        .map(|((t, m), p)| (*t, m - p, *p))
        .filter(|r| r.1.is_finite())
        .collect();
    let (first, last) = (rows.first()?.0, rows.last()?.0);
    if rows.len() < READINGS || last <= first {
        return None;
    }
    let rate = (rows.len() as f64 - 1.0) / (last - first);
    let near = |i: usize, seconds: f64| {
        let reach = (seconds * rate).round().max(0.0) as usize;
        &rows[i.saturating_sub(reach)..(i + reach + 1).min(rows.len())]
    };
    let usual = median(&rows.iter().map(|r| r.2.abs()).collect::<Vec<f64>>())?;
    let means: Vec<f64> = (0..rows.len())
        .map(|i| {
            let own = near(i, 0.5 * SMOOTH);
            own.iter().map(|r| r.1).sum::<f64>() / own.len() as f64
        })
        .collect();
    let averaged = (SMOOTH * rate).max(1.0).sqrt();
    let least = (OFF.0 * curve.noise? / averaged).max(OFF.1 * usual);
    let off = |i: usize| {
        let (t, _, _) = rows[i];
        let inside = t > first + ENDS && t < last - ENDS;
        let foretold: Vec<f64> = near(i, NEAR).iter().map(|r| r.2).collect();
        let (low, high) = foretold
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let around: Vec<f64> = near(i, AROUND).iter().map(|r| r.1).collect();
        let calm = inside && high - low < CHANGES * usual;
        calm && median(&around).is_some_and(|middle| (means[i] - middle).abs() > least)
    };
    let mut begun: Option<f64> = None;
    let mut count = 0;
    for i in 0..=rows.len() {
        match (i < rows.len() && off(i), begun) {
            (true, None) => begun = Some(rows[i].0),
            (false, Some(from)) => {
                let lasted = rows[i - 1].0 - from;
                count += usize::from((LASTS[0]..LASTS[1]).contains(&lasted));
                begun = None;
            }
            _ => {}
        }
    }
    Some(count)
}

/// That the force of many touches comes in bursts, where nothing that acts on what is touched was named.
pub(super) fn bursts(traces: &[Trace], findings: &[Finding]) -> Option<Evidence> {
    if !findings.iter().all(|f| taken_out(f) || before_the_touch(f)) {
        return None;
    }
    let along = |t: &Trace| {
        t.curves
            .iter()
            .find(|c| c.quantity == Quantity::Force)
            .and_then(bursts_of)
    };
    told(&traces.iter().filter_map(along).collect::<Vec<_>>())
}

fn told(counts: &[usize]) -> Option<Evidence> {
    let several = counts.iter().filter(|n| **n >= SEVERAL).count();
    let all: usize = counts.iter().sum();
    let clear = counts.len() >= TOUCHES && several as f64 >= SHARE * counts.len() as f64 && all >= ALL;
    let usual = quantile(&counts.iter().map(|n| *n as f64).collect::<Vec<f64>>(), 0.5)?;
    clear.then(|| Evidence {
        residual: "force over time".into(),
        test: "bursts of the force off what is foretold".into(),
        statistic: all as f64,
        p_value: 0.0,
        words: format!(
            "the force jumps off what is foretold for a moment, and back, {all} times in {} touches ({usual:.0} in the middle one): \
             something tugs or slips now and then, of which the catalogue knows nothing",
            counts.len()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A push of three seconds at 100 Hz of 1.5 N, which is 0.6 N more for 0.1 s at these times, s.
    fn push(bursts: &[f64], level: f64) -> Curve {
        let time: Vec<f64> = (0..300).map(|i| 0.01 * f64::from(i)).collect();
        let wobble = |i: usize| 0.04 * (((i * 37) % 13) as f64 / 6.0 - 1.0);
        let tug = |t: f64| {
            if bursts.iter().any(|b| (*b..b + 0.1).contains(&t)) {
                0.6
            } else {
                0.0
            }
        };
        Curve {
            label: "force along the motion".into(),
            quantity: Quantity::Force,
            measured: time
                .iter()
                .enumerate()
                .map(|(i, t)| 1.5 + level + tug(*t) + wobble(i))
                .collect(),
            predicted: vec![1.5; time.len()],
            time,
            noise: Some(0.03),
        }
    }

    #[test]
    fn tugs_are_counted_and_a_level_that_is_off_is_none() {
        assert_eq!(bursts_of(&push(&[0.6, 1.3, 2.2], 0.0)), Some(3));
        assert_eq!(bursts_of(&push(&[], 0.4)), Some(0));
    }

    #[test]
    fn many_touches_have_to_show_them() {
        assert!(told(&[3, 2, 4, 2, 0, 1]).is_some());
        assert!(told(&[12, 0, 0, 0, 0, 1]).is_none());
        assert!(told(&[2, 2]).is_none());
    }
}
