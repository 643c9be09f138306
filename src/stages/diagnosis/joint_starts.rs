//! The starts of a joint from rest: how high the load goes, and how much of it becomes momentum.

use crate::capture::{Capture, Interaction, Segmented};
use crate::math::{median, noise_of, quantile};
use crate::stages::estimation::{JointLoad, joint_loads_by_tool};
use crate::twin::{Joint, Model};

/// Seconds of one reading, half of the span of its place by a track, and how far a parent may move that stands, m; half of that
/// span by the path of a tool, s.
const READ: ([f64; 3], f64) = ([0.01, 0.08, 3e-3], 0.04);
/// Least span of a speed that tells rest from motion, s; the same in standard deviations of the place over the speed.
const SPAN: (f64, f64) = (0.15, 6.0);
/// Share of a motion's own speed below which it rests, and above which it goes.
const RESTS: f64 = 0.125;
const GOES: f64 = 0.35;
/// Around the start within which its peak lies, s: before, and after its span.
const PEAK: [f64; 2] = [0.1, 0.2];
/// How long before the peak the load is still low, s, and what share of its level is low.
const BEFORE: f64 = 0.6;
const LOW: f64 = 0.5;
/// When after its peak the load may be steady, and how long its level is read, s.
const STEADY: [f64; 2] = [0.06, 0.5];
pub(super) const LEVEL: f64 = 0.2;
/// Change of the speed over half of that which is steady, as a share.
const EVEN: f64 = 0.25;
/// Longest that the load stays above its level on either side of the peak, s.
const ABOVE: f64 = 0.4;
/// Share of the later speed that it has when the load comes down to its level, or what is read is no start.
const UNDER_WAY: f64 = 0.3;
/// Readings that share the noise of an impulse.
const SHARED: f64 = 6.0;

/// One start.
#[derive(Clone, Debug)]
pub(super) struct JointStart {
    pub(super) interaction: String,
    pub(super) held_out: bool,
    /// What keeps it going, N·m or N.
    pub(super) level: f64,
    /// The most over that, N·m or N, and the greatest rate at which it rises, 1/s of that.
    pub(super) excess: f64,
    pub(super) rises: f64,
    /// All that is over it, with its standard deviation, N·m·s or N·s.
    pub(super) impulse: (f64, f64),
    /// Speed when the load has come down to its level, rad/s or m/s.
    pub(super) speed: f64,
}

/// Loads of each motion of a joint, by their interactions.
pub(super) fn motions_of(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    joint: &Joint,
    read: ([f64; 3], f64),
) -> Vec<(String, bool, Vec<JointLoad>)> {
    let one = |i: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == i.name)?;
        let loads = joint_loads_by_tool(i, cut, joint, model, read)?;
        Some((i.name.clone(), i.held_out, loads))
    };
    capture.interactions.iter().filter_map(one).collect()
}

/// All starts of a joint from rest.
pub(super) fn joint_starts(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    joint: &Joint,
) -> Vec<JointStart> {
    let mut out = Vec::new();
    for (interaction, held_out, loads) in motions_of(capture, segmented, model, joint, READ) {
        let path = Path(&loads);
        out.extend(
            path.starts()
                .into_iter()
                .filter_map(|s| path.read(s))
                .map(|s| JointStart {
                    interaction: interaction.clone(),
                    held_out,
                    ..s
                }),
        );
    }
    out
}

/// One motion, reading by reading.
pub(super) struct Path<'a>(pub(super) &'a [JointLoad]);

/// Where one begins: its first reading, its direction, and the span over which that was told, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Begins {
    pub(super) at: usize,
    pub(super) way: f64,
    span: f64,
}

impl Path<'_> {
    /// Place at a time, rad or m; the first or last beyond the ends.
    fn place(&self, t: f64) -> f64 {
        let next = self.0.partition_point(|l| l.time <= t);
        let Some(after) = self.0.get(next) else {
            return self.0.last().map_or(0.0, |l| l.position);
        };
        let Some(before) = next.checked_sub(1).map(|i| &self.0[i]) else {
            return after.position;
        };
        let share = (t - before.time) / (after.time - before.time).max(1e-9);
        before.position + share * (after.position - before.position)
    }

    /// Mean speed over ±`half`, rad/s or m/s.
    pub(super) fn speed(&self, t: f64, half: f64) -> f64 {
        (self.place(t + half) - self.place(t - half)) / (2.0 * half)
    }

    pub(super) fn within(&self, from: f64, to: f64) -> std::ops::Range<usize> {
        self.0.partition_point(|l| l.time < from)..self.0.partition_point(|l| l.time < to)
    }

    /// Where it sets out after a rest.
    pub(super) fn starts(&self) -> Vec<Begins> {
        let loads = self.0;
        let speeds: Vec<f64> = loads.iter().map(|l| l.speed.abs()).collect();
        let Some(fast) = quantile(&speeds, 0.9).filter(|f| *f > 0.0) else {
            return Vec::new();
        };
        let places: Vec<f64> = loads.iter().map(|l| l.position).collect();
        let noise = noise_of(&places).unwrap_or(0.0);
        let span = SPAN.0.max(SPAN.1 * noise / fast);
        let ahead = |t: f64| (self.place(t + span) - self.place(t)) / span;
        let behind = |t: f64| (self.place(t) - self.place(t - span)) / span;
        let ends = [loads[0].time + span, loads[loads.len() - 1].time - 2.0 * span];
        let (mut out, mut since) = (Vec::new(), f64::NEG_INFINITY);
        let mut goes = false;
        for (at, t) in loads.iter().map(|l| l.time).enumerate() {
            let rested = behind(t).abs() < RESTS * fast;
            goes &= !(rested && t > since + 2.0 * span);
            if !goes && rested && t > ends[0] && t < ends[1] && ahead(t).abs() > GOES * fast {
                let way = ahead(t).signum();
                out.push(Begins { at, way, span });
                (goes, since) = (true, t);
            }
        }
        out
    }

    /// When after `t` the speed changes little, or least, s, within what comes so much later.
    pub(super) fn steady(&self, t: f64, [from, to]: [f64; 2]) -> Option<f64> {
        let last = self.0.last()?.time;
        let count = ((to - from) / 0.02) as usize;
        let times = (0..count).map(|k| t + from + 0.02 * k as f64);
        let changes = times.filter(|t| t + LEVEL < last).map(|t| {
            let [early, late] = [0.25, 0.75].map(|share| self.speed(t + share * LEVEL, 0.3 * LEVEL));
            (
                t,
                (late - early).abs() / self.speed(t + 0.5 * LEVEL, 0.5 * LEVEL).abs().max(1e-9),
            )
        });
        let changes: Vec<(f64, f64)> = changes.collect();
        let first = changes.iter().find(|c| c.1 < EVEN);
        first.or(changes.iter().min_by(|a, b| a.1.total_cmp(&b.1))).map(|c| c.0)
    }

    /// The load from then on, N·m or N.
    pub(super) fn level(&self, from: f64, way: f64) -> Option<f64> {
        let steady: Vec<f64> = self.0[self.within(from, from + LEVEL)]
            .iter()
            .map(|l| way * l.load)
            .collect();
        median(&steady)
    }

    /// One that had rested without load, or under less.
    pub(super) fn read(&self, begins: Begins) -> Option<JointStart> {
        let (loads, way) = (self.0, begins.way);
        let began = loads[begins.at].time;
        let near = self.within(began - PEAK[0], began + begins.span + PEAK[1]);
        let peak = near.max_by(|a, b| (way * loads[*a].load).total_cmp(&(way * loads[*b].load)))?;
        let from = self.steady(loads[peak].time, STEADY)?;
        let level = self.level(from, way).filter(|l| *l > 0.0)?;
        let over = |i: usize| way * loads[i].load - level;
        let close = |i: &usize| (loads[*i].time - loads[peak].time).abs() < ABOVE;
        let first = (0..peak)
            .rev()
            .take_while(|i| over(*i) > 0.0 && close(i))
            .last()
            .unwrap_or(peak);
        let last = (peak..loads.len())
            .take_while(|i| over(*i) > 0.0 && close(i))
            .last()
            .unwrap_or(peak);
        let rested = self.within(loads[peak].time - BEFORE, loads[peak].time);
        let low = rested
            .clone()
            .map(|i| way * loads[i].load)
            .fold(f64::INFINITY, f64::min);
        let step = |i: usize| loads[i + 1].time - loads[i].time;
        let impulse: f64 = (first..=last.min(loads.len() - 2)).map(|i| over(i) * step(i)).sum();
        let speed = way * self.speed(loads[(last + 1).min(loads.len() - 1)].time, 0.04);
        let later = way * self.speed(from + 0.5 * LEVEL, 0.5 * LEVEL);
        let rise = first.saturating_sub(8)..peak.max(1);
        let rises = rise.map(|i| (loads[i + 1].load - loads[i].load) * way / step(i).max(1e-6));
        let noise = noise_of(&loads.iter().map(|l| l.load).collect::<Vec<f64>>())?;
        let starts = low < LOW * level && speed > UNDER_WAY * later && speed > 0.0;
        starts.then(|| JointStart {
            interaction: String::new(),
            held_out: false,
            level,
            excess: over(peak),
            rises: rises.fold(0.0, f64::max),
            impulse: (impulse, SHARED * noise * step(peak.min(loads.len() - 2))),
            speed,
        })
    }
}
