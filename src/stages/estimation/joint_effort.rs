//! What it takes to move a joint, by position, and the latch told apart from the way after it.
//!
//! The latch is a change of level: of all splits of the first half of the travel into two levels the one that leaves the
//! least squares, kept where the first level is higher beyond doubt. Loads along the way hang together, so that means
//! are doubted by their effective number of samples.

use super::joint_load::JointLoad;
use crate::base::{Confounded, Estimate};
use crate::math::{correlated_mean, effective_samples, median, quantile};
use crate::twin::{EffortAt, JointEffort, Latch};

/// Stretches into which the travel is cut at most, and the least loads of one.
const STRETCHES: usize = 20;
const FEWEST: usize = 3;
/// Share of the travel in which a latch can lie, and that with which it is compared.
const LATCHED: f64 = 0.25;
const COMPARED: f64 = 0.5;
/// The two levels differ by at least so many standard deviations of their difference.
const CLEAR: f64 = 4.0;
/// Share by which a force sensor's gain may be off, where nobody says.
const GAIN: f64 = 0.02;

/// Units of load, force and position.
pub(super) struct Units<'a> {
    pub load: &'a str,
    pub position: &'a str,
}

/// The loads of one interaction that carried the joint along one way; `None` where the travel is too short to be cut up.
pub(super) fn effort_of(loads: &[JointLoad], from: &str, units: &Units) -> Option<JointEffort> {
    let loads = ahead(loads)?;
    let (first, last) = (loads.first()?.position, loads.last()?.position);
    let width = (last - first) / STRETCHES as f64;
    if width <= 0.0 || loads.len() < 4 * STRETCHES {
        return None;
    }
    let stretch = |k: usize| {
        let (a, b) = (first + width * k as f64, first + width * (k + 1) as f64);
        let inside: Vec<&JointLoad> = loads.iter().filter(|l| l.position >= a && l.position <= b).collect();
        let mean = |of: &dyn Fn(&JointLoad) -> f64, unit: &str| {
            let values: Vec<f64> = inside.iter().map(|l| of(l)).collect();
            let mean = correlated_mean(&values)?;
            // A stretch in which the load hardly changes is no more certain than the sensor's gain.
            let sd = mean.sd.hypot(GAIN * mean.mean);
            Some(Estimate::measured(
                mean.mean,
                sd,
                unit,
                vec![from.into()],
                "mean load by position",
            ))
        };
        (inside.len() >= FEWEST).then(|| {
            Some(EffortAt {
                position: [a, b],
                load: mean(&|l| l.load, units.load)?,
                force: mean(&|l| l.load / l.lever, "N")?,
            })
        })?
    };
    Some(JointEffort {
        by_position: (0..STRETCHES).filter_map(stretch).collect(),
        latch: latch_of(&loads, from, units),
    })
}

/// The friction of a joint of which nothing but one way of a hand is known: the mean load after the latch, in doubt by
/// all that it changes on the way, for springs, weight and damping are in it.
pub(super) fn friction_of(effort: &JointEffort, unit: &str) -> Option<Estimate> {
    let until = effort.latch.as_ref().map_or(f64::NEG_INFINITY, |l| l.until.value);
    let after: Vec<&Estimate> = effort
        .by_position
        .iter()
        .filter(|e| e.position[0] >= until)
        .map(|e| &e.load)
        .collect();
    let n = after.len() as f64;
    if n < 3.0 {
        return None;
    }
    let mean = after.iter().map(|l| l.value).sum::<f64>() / n;
    let square = |l: &&&Estimate| (l.value - mean).powi(2) + l.sd.unwrap_or(0.0).powi(2);
    let sd = (after.iter().map(|l| square(&l)).sum::<f64>() / n).sqrt();
    let known = format!("mean load along one opening = {mean:.3} {unit}");
    let mut friction = Estimate::assumed(mean, sd, unit, "mean load by position");
    friction = friction.with_interval([(mean - 1.96 * sd).max(0.0), mean + 1.96 * sd]);
    friction.from = after.first()?.from.clone();
    friction.confounded = Some(Confounded {
        with: vec!["stiffness".into(), "damping".into()],
        known,
        experiment: "open it at half and at twice the speed, and close it again".into(),
    });
    (mean > 0.0).then_some(friction)
}

/// The loads up to the farthest position, positions counted in the direction of travel.
fn ahead(loads: &[JointLoad]) -> Option<Vec<JointLoad>> {
    let far = (0..loads.len()).max_by(|a, b| loads[*a].position.abs().total_cmp(&loads[*b].position.abs()))?;
    let sign = loads[far].position.signum();
    let turned = |l: &JointLoad| JointLoad {
        position: sign * l.position,
        load: sign * l.load,
        speed: sign * l.speed,
        ..*l
    };
    let mut out: Vec<JointLoad> = loads[..=far].iter().map(turned).collect();
    out.sort_by(|a, b| a.position.total_cmp(&b.position));
    Some(out)
}

/// The latch of loads in the order of their positions.
fn latch_of(loads: &[JointLoad], from: &str, units: &Units) -> Option<Latch> {
    let (first, last) = (loads.first()?.position, loads.last()?.position);
    let end = loads.partition_point(|l| l.position <= first + COMPARED * (last - first));
    let values: Vec<f64> = even(&loads[..end]);
    let places = values.len();
    // Splits are weighed by position, so that a hand that dwells at one place does not count there for more.
    let at = |k: usize| first + (COMPARED * (last - first)) * k as f64 / places as f64;
    let most = (LATCHED / COMPARED * places as f64) as usize;
    let split = (2..most).min_by(|a, b| squares(&values, *a).total_cmp(&squares(&values, *b)))?;
    let (held, free) = values.split_at(split);
    let (high, low) = (correlated_mean(held)?, correlated_mean(free)?);
    let doubt = high.sd.hypot(low.sd);
    if high.mean <= 0.0 || high.mean - low.mean < CLEAR * doubt {
        return None;
    }
    let before: Vec<&JointLoad> = loads.iter().filter(|l| l.position <= at(split)).collect();
    let peak = quantile(&before.iter().map(|l| l.load).collect::<Vec<f64>>(), 0.97)?;
    let lever = median(&before.iter().map(|l| l.lever).collect::<Vec<f64>>())?;
    // The level wanders along the way: its scatter, not that of its mean, is what the peak stands out of.
    let scatter = low.sd * effective_samples(free).sqrt();
    let excess = peak - low.mean;
    let sd = scatter.hypot(GAIN * peak);
    let measured =
        |value: f64, sd: f64, unit: &str| Estimate::measured(value, sd, unit, vec![from.into()], "two levels of load");
    Some(Latch {
        excess: measured(excess, sd, units.load),
        force: measured(excess / lever, sd / lever, "N"),
        level: measured(low.mean, scatter, units.load),
        until: measured(at(split), width_of(&values, split) * (at(1) - at(0)), units.position),
    })
}

/// The loads at even steps of position, each the mean of what lies nearest.
fn even(loads: &[JointLoad]) -> Vec<f64> {
    let (Some(first), Some(last)) = (loads.first(), loads.last()) else {
        return Vec::new();
    };
    let count = 60;
    let step = (last.position - first.position) / f64::from(count);
    let mut previous = first.load;
    (0..count)
        .map(|k| {
            let (a, b) = (
                first.position + step * f64::from(k),
                first.position + step * f64::from(k + 1),
            );
            let inside: Vec<f64> = loads
                .iter()
                .filter(|l| l.position >= a && l.position < b)
                .map(|l| l.load)
                .collect();
            if !inside.is_empty() {
                previous = inside.iter().sum::<f64>() / inside.len() as f64;
            }
            previous
        })
        .collect()
}

fn squares(values: &[f64], split: usize) -> f64 {
    let about = |part: &[f64]| {
        let mean = part.iter().sum::<f64>() / part.len().max(1) as f64;
        part.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
    };
    about(&values[..split]) + about(&values[split..])
}

/// Half the number of splits that are nearly as good as the best: how sharply the latch gives way, in steps.
fn width_of(values: &[f64], best: usize) -> f64 {
    let least = squares(values, best);
    let near = (2..values.len() - 1)
        .filter(|k| squares(values, *k) < 1.15 * least)
        .count();
    (0.5 * near as f64).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn door(load: impl Fn(f64) -> f64) -> Vec<JointLoad> {
        let wobble = |i: usize| 0.05 * ((i * 37 % 11) as f64 - 5.0);
        (0..900)
            .map(|i| JointLoad {
                time: 0.1 * i as f64,
                load: load(1.6 * i as f64 / 900.0) + wobble(i),
                lever: 0.35,
                aside: [0.0; 2],
                position: 1.6 * i as f64 / 900.0,
                speed: 0.018,
                speed_gain: 1.0,
                acceleration: 0.0,
            })
            .collect()
    }

    const UNITS: Units = Units {
        load: "N·m",
        position: "rad",
    };

    #[test]
    fn a_latch_is_told_apart_from_what_comes_after_it() {
        let latched = |q: f64| if q < 0.12 { 5.0 } else { 2.0 };
        let effort = effort_of(&door(latched), "pull", &UNITS).expect("an effort");
        assert_eq!(effort.by_position.len(), STRETCHES);
        let latch = effort.latch.expect("a latch");
        assert!((latch.excess.value - 3.0).abs() < 0.4, "{:?}", latch.excess);
        assert!((latch.force.value - 3.0 / 0.35).abs() < 1.2);
        assert!((latch.level.value - 2.0).abs() < 0.1);
        assert!((latch.until.value - 0.12).abs() < 0.03, "{:?}", latch.until);
    }

    #[test]
    fn a_door_without_a_latch_has_none() {
        let effort = effort_of(&door(|_| 2.0), "pull", &UNITS).expect("an effort");
        assert!(effort.latch.is_none());
        assert!(effort.by_position.iter().all(|e| (e.load.value - 2.0).abs() < 0.1));
    }
}
