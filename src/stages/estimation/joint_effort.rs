//! What it takes to move a joint, by position, and the latch told apart from the way after it.
//!
//! The latch is a change of level: of all splits of the first half of the travel into a level and a line after it the one that
//! leaves the least squares, kept where the level stands above the line beyond doubt. Loads along the way hang together, so
//! that means are doubted by their effective number of samples; what the mass takes at a brisk start is taken off first.

use nalgebra::{DMatrix, DVector};

use super::joint_load::{JointLoad, joint_loads};
use crate::base::{Confounded, Estimate};
use crate::capture::{Capture, Interaction, Segmented};
use crate::math::{correlated_mean, effective_samples, median, quantile};
use crate::twin::{EffortAt, Joint, JointEffort, JointKind, Latch, Model};

/// Stretches into which the travel is cut at most and at least, loads that there are for each, and the least of one.
const STRETCHES: usize = 20;
const FEWEST_STRETCHES: usize = 6;
const EACH: usize = 4;
const FEWEST: usize = 3;
/// Shares of the usual speed and of the usual load below which nothing is being done to the joint.
const RESTS: f64 = 0.05;
const LEFT_ALONE: f64 = 0.3;
/// Places at which the level is read, and the loads that there are for each.
const PLACES: usize = 60;
const OF_A_PLACE: usize = 2;
/// Share of the travel in which a latch can lie, and that with which it is compared.
const LATCHED: f64 = 0.25;
const COMPARED: f64 = 0.5;
/// The two levels differ by at least so many standard deviations of their difference.
const CLEAR: f64 = 4.0;
/// The way after the latch rises or falls from so many standard deviations of its slope on.
const SLOPES: f64 = 3.0;
/// Share by which a force sensor's gain may be off, where nobody says.
const GAIN: f64 = 0.02;

/// Units of load, force and position.
struct Units<'a> {
    load: &'a str,
    position: &'a str,
}

/// Blocks that a pull is cut into, the longest of them and half the span of the parabola that gives velocities in blocks, how
/// far the parent may move, m, and the shortest block in rows of the coarser stream.
const BLOCKS: f64 = 200.0;
const LONGEST: f64 = 0.1;
const WIDE: f64 = 3.0;
const STANDS: f64 = 1e-3;
const ROWS: f64 = 1.5;

/// What it took to move a joint of which only the path of the hand is known, from the pull that went farthest.
pub(super) fn joint_effort(
    capture: &Capture,
    segmented: &[Segmented],
    joint: &Joint,
    model: &Model,
) -> Option<JointEffort> {
    let slides = joint.kind == JointKind::Prismatic;
    let units = Units {
        load: if slides { "N" } else { "N·m" },
        position: if slides { "m" } else { "rad" },
    };
    let by_hand = |i: &&Interaction| !i.tracks.contains_key(&joint.child);
    let pulls = capture.fitted().filter(by_hand).filter_map(|i| {
        let cut = segmented.iter().find(|s| s.interaction == i.name)?;
        let loads = joint_loads(i, cut, joint, model, blocks_of(i)?)?;
        let far = loads.iter().map(|l| l.position.abs()).fold(0.0, f64::max);
        Some((far, i, loads))
    });
    let (_, interaction, loads) = pulls.max_by(|a, b| a.0.total_cmp(&b.0))?;
    effort_of(&loads, &interaction.name, &units)
}

/// Block and half span of velocities, s, and how far the parent may move, m: a quick pull is cut more finely, no finer than
/// it was recorded.
fn blocks_of(interaction: &Interaction) -> Option<[f64; 3]> {
    let (force, path) = (&interaction.force.as_ref()?.time, &interaction.tool_path.as_ref()?.time);
    let lasts = force.last()? - force.first()?;
    let row = |time: &[f64]| median(&time.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>());
    let shortest = ROWS * row(force)?.max(row(path)?);
    let block = (lasts / BLOCKS).max(shortest).min(LONGEST.max(shortest));
    Some([block, WIDE * block, STANDS])
}

/// The loads of one interaction that carried the joint along one way; `None` where the travel is too short to be cut up.
fn effort_of(loads: &[JointLoad], from: &str, units: &Units) -> Option<JointEffort> {
    let loads = ahead(loads)?;
    let (first, last) = (loads.first()?.position, loads.last()?.position);
    let stretches = STRETCHES.min(loads.len() / EACH);
    let width = (last - first) / stretches.max(1) as f64;
    if width <= 0.0 || stretches < FEWEST_STRETCHES {
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
        by_position: (0..stretches).filter_map(stretch).collect(),
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
    let usual = |of: &dyn Fn(&JointLoad) -> f64| median(&out.iter().map(of).collect::<Vec<f64>>());
    let speed = RESTS * usual(&|l| l.speed.abs())?;
    let load = LEFT_ALONE * usual(&|l| l.load.abs())?;
    // Before it is pulled and after it was let go a hand only stands beside it.
    while out.pop_if(|l| l.speed.abs() <= speed).is_some() {}
    out.retain(|l| l.speed.abs() > speed || l.load.abs() > load);
    out.sort_by(|a, b| a.position.total_cmp(&b.position));
    Some(out)
}

/// The latch of loads in the order of their positions.
fn latch_of(loads: &[JointLoad], from: &str, units: &Units) -> Option<Latch> {
    let loads = &without_inertia(loads)?;
    let (first, last) = (loads.first()?.position, loads.last()?.position);
    let end = loads.partition_point(|l| l.position <= first + COMPARED * (last - first));
    let values: Vec<f64> = even(&loads[..end]);
    let places = values.len();
    // Splits are weighed by position, so that a hand that dwells at one place does not count there for more.
    let at = |k: usize| first + (COMPARED * (last - first)) * k as f64 / places as f64;
    let most = (LATCHED / COMPARED * places as f64) as usize;
    let split = (2..most).min_by(|a, b| squares(&values, *a).total_cmp(&squares(&values, *b)))?;
    let (held, free) = values.split_at(split);
    // The way after it may rise or fall: what stands out is what stands above its line.
    let line = Line::of(free)?;
    let back = -0.5 * held.len() as f64;
    let (level, high) = (line.at(back), correlated_mean(held)?);
    let alone = (held.len() as f64 * line.effective / free.len() as f64).max(1.0);
    // A latch that gives way by and by scatters by its own fall, which is no doubt.
    let doubt = line.sd(back).hypot(high.sd.min(line.scatter / alone.sqrt()));
    if high.mean <= 0.0 || high.mean - level < CLEAR * doubt {
        return None;
    }
    let before: Vec<&JointLoad> = loads.iter().filter(|l| l.position <= at(split)).collect();
    let peak = quantile(&before.iter().map(|l| l.load).collect::<Vec<f64>>(), 0.97)?;
    let lever = median(&before.iter().map(|l| l.lever).collect::<Vec<f64>>())?;
    // The level wanders along the way: its scatter, not that of its mean, is what the peak stands out of.
    let scatter = line.scatter.hypot(line.sd(back));
    let excess = peak - level;
    // Between two readings the load falls by so much: the peak may lie between them.
    let lowest = before.iter().map(|l| l.load).fold(peak, f64::min);
    let coarse = 0.5 * (peak - lowest) / (before.len() as f64 - 1.0).max(1.0);
    let sd = scatter.hypot(GAIN * peak).hypot(coarse);
    let measured =
        |value: f64, sd: f64, unit: &str| Estimate::measured(value, sd, unit, vec![from.into()], "two levels of load");
    Some(Latch {
        excess: measured(excess, sd, units.load),
        force: measured(excess / lever, sd / lever, "N"),
        level: measured(level, scatter, units.load),
        until: measured(at(split), width_of(&values, split) * (at(1) - at(0)), units.position),
    })
}

/// A straight line through values at even steps.
struct Line {
    mean: f64,
    slope: f64,
    count: f64,
    /// Standard deviation of what it leaves, and how many values of that are free of each other.
    scatter: f64,
    effective: f64,
}

impl Line {
    /// The line that the values have beyond doubt, or the level that they keep.
    fn of(values: &[f64]) -> Option<Self> {
        let count = values.len() as f64;
        let middle = 0.5 * (count - 1.0);
        let mean = values.iter().sum::<f64>() / count;
        let (mut over, mut under) = (0.0, 0.0);
        for (k, v) in values.iter().enumerate() {
            over += (k as f64 - middle) * (v - mean);
            under += (k as f64 - middle).powi(2);
        }
        let with = |slope: f64| {
            let at = |k: usize| mean + slope * (k as f64 - middle);
            let left: Vec<f64> = values.iter().enumerate().map(|(k, v)| v - at(k)).collect();
            Self {
                mean,
                slope,
                count,
                scatter: (left.iter().map(|r| r * r).sum::<f64>() / (count - 2.0)).sqrt(),
                effective: effective_samples(&left),
            }
        };
        let sloped = with(over / under.max(1e-12));
        let doubt = sloped.scatter * (12.0 / sloped.effective).sqrt() / count;
        let rises = sloped.slope.abs() > SLOPES * doubt;
        (count > 3.0).then(|| if rises { sloped } else { with(0.0) })
    }

    /// The value at a step counted from the first one.
    fn at(&self, step: f64) -> f64 {
        self.mean + self.slope * (step - 0.5 * (self.count - 1.0))
    }

    /// Standard deviation of [`Line::at`].
    fn sd(&self, step: f64) -> f64 {
        let away = (step - 0.5 * (self.count - 1.0)) / self.count;
        let turned = if self.slope == 0.0 { 0.0 } else { 12.0 * away * away };
        self.scatter * ((1.0 + turned) / self.effective).sqrt()
    }

    /// Sum of squares that it leaves.
    fn left(&self) -> f64 {
        self.scatter.powi(2) * (self.count - 2.0)
    }
}

/// The loads less what the mass takes that is sped up, where the way after the first part of it tells that clearly: a
/// brisk start is no latch.
fn without_inertia(loads: &[JointLoad]) -> Option<Vec<JointLoad>> {
    let (first, last) = (loads.first()?.position, loads.last()?.position);
    let after: Vec<&JointLoad> = loads
        .iter()
        .filter(|l| l.position > first + LATCHED * (last - first))
        .collect();
    let place = |l: &JointLoad| (l.position - first) / (last - first);
    let rows: Vec<f64> = after
        .iter()
        .flat_map(|l| [l.acceleration, 1.0, place(l), place(l).powi(2)])
        .collect();
    let a = DMatrix::from_row_slice(after.len(), 4, &rows);
    let b = DVector::from_iterator(after.len(), after.iter().map(|l| l.load));
    let normal = a.transpose() * &a;
    let inverse = normal.try_inverse();
    let told = inverse.and_then(|inverse| {
        let law = &inverse * a.transpose() * &b;
        let left: Vec<f64> = (&b - &a * &law).iter().copied().collect();
        let variance = left.iter().map(|r| r * r).sum::<f64>() / (left.len() as f64 - 4.0).max(1.0);
        let alike = left.len() as f64 / effective_samples(&left);
        let sd = (variance * alike * inverse[(0, 0)]).sqrt();
        (law[0] > CLEAR * sd).then_some(law[0])
    });
    let inertia = told.unwrap_or(0.0);
    let less = |l: &JointLoad| JointLoad {
        load: l.load - inertia * l.acceleration,
        ..*l
    };
    Some(loads.iter().map(less).collect())
}

/// The loads at even steps of position, each the mean of what lies nearest.
fn even(loads: &[JointLoad]) -> Vec<f64> {
    let (Some(first), Some(last)) = (loads.first(), loads.last()) else {
        return Vec::new();
    };
    let count = PLACES.min(loads.len() / OF_A_PLACE).max(1);
    let step = (last.position - first.position) / count as f64;
    let mut previous = first.load;
    (0..count)
        .map(|k| {
            let (a, b) = (first.position + step * k as f64, first.position + step * (k + 1) as f64);
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

/// What a level and, after it, a line leave.
fn squares(values: &[f64], split: usize) -> f64 {
    let (held, free) = values.split_at(split);
    let mean = held.iter().sum::<f64>() / held.len().max(1) as f64;
    let left = Line::of(free).map_or(f64::INFINITY, |line| line.left());
    held.iter().map(|v| (v - mean).powi(2)).sum::<f64>() + left
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
                way: nalgebra::Vector3::y(),
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
