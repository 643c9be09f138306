//! A hand that holds the child of a joint, and the child itself, both followed along the freedom.

use nalgebra::Vector3;

use crate::capture::{Interaction, Kind, PoseStream, Segmented};
use crate::math::{median, quantile};
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{Joint, JointKind, Model};

/// Seconds of one reading; least rows of a track over which a speed is read; how far the parent may move, m.
const BLOCK: f64 = 0.04;
const ROWS: f64 = 2.5;
const STANDS: f64 = 3e-3;
/// Share of the usual speed from which on something moves.
const MOVES: f64 = 0.4;
/// Farther than this an angle is not told from one the other way about, rad.
const HALF_TURN: f64 = 2.8;

/// One reading: where hand and child are along the freedom, how fast they go, and what the hand feels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub hand: f64,
    pub child: f64,
    pub hand_speed: f64,
    pub child_speed: f64,
    pub load: f64,
}

/// What a joint's freedom is measured in.
pub(super) fn units(turns: bool) -> (&'static str, &'static str) {
    if turns { ("angle", "rad") } else { ("position", "m") }
}

/// Of the hand.
pub(super) fn usual_speed(readings: &[Reading]) -> f64 {
    let speeds: Vec<f64> = readings.iter().map(|r| r.hand_speed.abs()).collect();
    quantile(&speeds, 0.8).unwrap_or(0.0)
}

/// A motion of a joint whose child a hand holds, both followed.
pub(super) struct Followed {
    pub interaction: String,
    pub held_out: bool,
    /// The time of the first reading, s.
    pub began: f64,
    /// Metres at the hand for each unit of the joint.
    pub lever: f64,
    /// Load while it moves, N·m or N.
    pub load: f64,
    /// The hand's first place, from which its positions count.
    pub first: Vector3<f64>,
    pub readings: Vec<Reading>,
}

impl Followed {
    /// Nothing where no hand holds the child, or one of the two is not followed.
    pub fn of(interaction: &Interaction, segmented: &[Segmented], model: &Model, joint: &Joint) -> Option<Self> {
        interaction.tool.as_ref().filter(|t| t.pin || t.grip)?;
        let (path, track) = (interaction.tool_path.as_ref()?, interaction.tracks.get(&joint.child)?);
        if interaction.kind != Kind::Pull {
            return None;
        }
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let row = |s: &PoseStream| median(&s.time.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>());
        let rows = ROWS * row(path)?.max(row(track)?);
        let loads = joint_loads(
            interaction,
            cut,
            joint,
            model,
            [BLOCK.max(rows), BLOCK.max(rows), STANDS],
        )?;
        let lever = median(&loads.iter().map(|l| l.lever).collect::<Vec<f64>>())?;
        let (first, readings) = readings(path, &loads, joint, 0.5 * BLOCK.max(rows))?;
        let slides = joint.kind == JointKind::Prismatic;
        // Poses do not count whole turns.
        if !slides && readings.iter().any(|r| r.hand.abs() > HALF_TURN) {
            return None;
        }
        let out = Self {
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            began: track.time.first().copied()?,
            lever: if slides { 1.0 } else { lever },
            load: 0.0,
            first,
            readings,
        };
        let both = [1.0, -1.0].map(|sign| out.goes(sign));
        let felt: Vec<f64> = both.iter().flatten().map(|r| r.load.abs()).collect();
        let load = median(&felt).filter(|l| *l > 0.0)?;
        Some(Self { load, ..out })
    }

    /// Readings in which both go one way.
    pub fn goes(&self, sign: f64) -> Vec<&Reading> {
        let usual = usual_speed(&self.readings);
        let both = |r: &&Reading| sign * r.hand_speed > MOVES * usual && sign * r.child_speed > MOVES * usual;
        self.readings.iter().filter(both).collect()
    }
}

/// Way along the freedom between two places of the hand, rad or m.
pub(super) fn along(joint: &Joint, first: &Vector3<f64>, now: &Vector3<f64>) -> f64 {
    let (axis, origin) = (Vector3::from(joint.axis.value), Vector3::from(joint.origin.value));
    if joint.kind == JointKind::Prismatic {
        return axis.dot(&(now - first));
    }
    let level = |v: Vector3<f64>| v - axis * axis.dot(&v);
    let (home, out) = (level(first - origin), level(now - origin));
    axis.dot(&home.cross(&out)).atan2(home.dot(&out))
}

/// Where a path is at `t`, m, on the line through what was read within `reach`: few rows are not as many before as after it.
fn place_at(path: &PoseStream, t: f64, reach: f64) -> Option<Vector3<f64>> {
    let rows = path.time.partition_point(|x| *x < t - reach)..path.time.partition_point(|x| *x <= t + reach);
    let read: Vec<(f64, Vector3<f64>)> = rows
        .map(|i| (path.time[i] - t, path.position[i].coords))
        .filter(|r| r.1.x.is_finite())
        .collect();
    let n = read.len() as f64;
    let (when, mean) = read
        .iter()
        .fold((0.0, Vector3::zeros()), |(a, b), r| (a + r.0 / n, b + r.1 / n));
    let spread: f64 = read.iter().map(|r| (r.0 - when).powi(2)).sum();
    let goes = read.iter().map(|r| r.1 * (r.0 - when)).sum::<Vector3<f64>>() / spread.max(1e-12);
    (!read.is_empty()).then(|| mean - goes * when)
}

/// The hand's first place, and hand and child block by block; positions of the hand count from there.
fn readings(path: &PoseStream, loads: &[JointLoad], joint: &Joint, reach: f64) -> Option<(Vector3<f64>, Vec<Reading>)> {
    let at = |t: f64| place_at(path, t, reach);
    let first = loads.iter().find_map(|l| at(l.time))?;
    let hands: Vec<Option<f64>> = loads.iter().map(|l| Some(along(joint, &first, &at(l.time)?))).collect();
    let one = |i: usize| {
        let (before, after) = (hands[i - 1]?, hands[i + 1]?);
        Some(Reading {
            hand: hands[i]?,
            child: loads[i].position,
            hand_speed: (after - before) / (loads[i + 1].time - loads[i - 1].time),
            child_speed: loads[i].speed,
            load: loads[i].load,
        })
    };
    let all = (1..loads.len().saturating_sub(1)).filter_map(one).collect();
    Some((first, all))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;

    #[test]
    fn a_path_of_few_rows_is_not_read_early_or_late() {
        let mut path = PoseStream::default();
        for i in 0..40 {
            let time = f64::from(i) / 30.0;
            path.time.push(time);
            path.position.push(Point3::new(0.2 * time, 0.0, 0.0));
            path.rotation.push(None);
        }
        for k in 5..100 {
            let t = 0.0113 * f64::from(k);
            let place = place_at(&path, t, 0.042).expect("rows");
            assert!((place.x - 0.2 * t).abs() < 1e-9, "{t} {place}");
        }
    }
}
