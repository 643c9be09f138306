//! The motions of a joint, read block by block.

use super::Curve;
use super::family::Scatter;
use super::fit::Fit;
use super::held_out::left;
use super::marginal::weights;
use super::motion_laws::Moved;
use super::motions::{EVEN, Motions};
use crate::capture::{Capture, Interaction, Segmented, position_noise};
use crate::math::{median, quantile};
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{Joint, JointKind, Model};

/// Seconds of one sample.
pub(super) const BIN: f64 = 0.04;
/// Half the span of the parabola from which velocities come: at first, at least, at most, s, and as a share of the
/// time that the motion takes from end to end.
const HALF: [f64; 3] = [0.08, 0.04, 0.4];
const SHARE: f64 = 0.1;
/// Where the speed changes by more than this share within its span a shorter one does: that whose speed is noisy by this share of
/// the usual one, if it is shorter by a factor. Of spans up to so many seconds, those of fast motions, starts are no longer.
const CHANGES: f64 = 0.25;
const NOISY: f64 = 0.04;
const BRIEF: f64 = 0.16;
const SHORTER: f64 = 0.6;
/// Share of the usual speed from which on a joint that set out goes.
const STEADY: f64 = 0.8;
/// How far above the usual force a range ends that cuts off the large ones.
pub(super) const CUTS: f64 = 1.1;
/// A parent that moves by more than this does not stand, m.
const STANDS: f64 = 3e-3;
/// Weight of a sample below which nothing is foretold.
const SURE: f64 = 0.1;
/// Seconds over which the pose is averaged that a joint's position is counted from.
const REST: f64 = 0.25;

/// Rows of the child's track that its pose at rest is the mean of.
fn rested(interaction: &Interaction, joint: &Joint) -> f64 {
    let track = interaction.tracks.get(&joint.child);
    let first = track.and_then(|t| t.time.first()).copied().unwrap_or(0.0);
    let rows = track.map_or(0, |t| t.time.partition_point(|x| *x <= first + REST));
    rows.max(1) as f64
}

/// One motion of a joint as it was read.
pub(super) struct Read {
    pub interaction: String,
    pub held_out: bool,
    pub loads: Vec<JointLoad>,
    /// Half the span from which each of its velocities comes, s.
    pub halves: Vec<f64>,
    pub noise: f64,
    /// Noise of the track along the freedom, rad or m.
    pub jitter: f64,
    /// How well it is known where the joint's position is 0, rad or m.
    pub zero: f64,
    /// Nothing but the path of what holds the child tells where it was.
    pub by_hand: bool,
}

impl Read {
    /// Samples to either side that the longest span of its velocities holds.
    pub(super) fn reach(&self) -> usize {
        let longest = self.halves.iter().copied().fold(0.0, f64::max);
        (longest / BIN).ceil() as usize
    }
}

/// Slow motions allow a long span, which calms their speed; fast ones need a short one.
fn span_of(loads: &[JointLoad]) -> Option<f64> {
    let speeds: Vec<f64> = loads.iter().map(|l| l.speed.abs()).collect();
    let places: Vec<f64> = loads.iter().map(|l| l.position).collect();
    let range = quantile(&places, 0.98)? - quantile(&places, 0.02)?;
    let lasts = range / quantile(&speeds, 0.8)?.max(1e-9);
    Some((SHARE * lasts).clamp(HALF[1], HALF[2]))
}

/// Half the shortest span whose speeds are noisy by no more than a share of the usual one: a slope over `±h` seconds of rows with a
/// noise `σ` at a rate `r` has a variance of `3 σ² / (2 r h³)`.
fn short_span(interaction: &Interaction, joint: &Joint, loads: &[JointLoad], jitter: f64) -> Option<f64> {
    let track = interaction.tracks.get(&joint.child)?;
    let rate = (track.time.len() as f64 - 1.0) / (track.time.last()? - track.time.first()?).max(1e-6);
    let speeds: Vec<f64> = loads.iter().map(|l| l.speed.abs()).collect();
    let usual = quantile(&speeds, 0.8)?.max(1e-9);
    Some((1.5 * (jitter / (NOISY * usual)).powi(2) / rate).cbrt().max(HALF[1]))
}

/// Loads whose speeds come from a short span where they change within a long one, as when the joint sets out: what is at one place
/// there is over before a long span is; with half the span of each.
fn brisk(calm: Vec<JointLoad>, half: f64, brief: &[JointLoad], short: f64) -> (Vec<JointLoad>, Vec<f64>) {
    let speeds: Vec<f64> = calm.iter().map(|l| l.speed.abs()).collect();
    let reach = (half / BIN).ceil() as usize;
    // Ends, turns and blows are no matter of where the joint sets out.
    let fast = quantile(&speeds, 0.8).unwrap_or(0.0);
    let sets_out = speeds.iter().position(|v| *v > STEADY * fast).map_or(0, |i| i + reach);
    let changes = |i: usize| {
        let near = &calm[i.saturating_sub(reach)..(i + reach + 1).min(calm.len())];
        let ends = near.iter().map(|l| l.speed);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        high - low > CHANGES * (calm[i].speed.abs() + 0.1 * fast)
    };
    let one = |i: usize| {
        let same = brief.iter().find(|b| (b.time - calm[i].time).abs() < 1e-6);
        match same.filter(|_| i < sets_out && changes(i)) {
            Some(b) => (b.clone(), short),
            None => (calm[i].clone(), half),
        }
    };
    (0..calm.len()).map(one).unzip()
}

/// The motions of a joint in the order of time.
pub(super) fn read_all(capture: &Capture, segmented: &[Segmented], model: &Model, joint: &Joint) -> Vec<Read> {
    let one = |interaction: &Interaction| {
        let cut = segmented.iter().find(|s| s.interaction == interaction.name)?;
        let first = joint_loads(interaction, cut, joint, model, [BIN, HALF[0], STANDS])?;
        let half = span_of(&first)?;
        let read = |half: f64| joint_loads(interaction, cut, joint, model, [BIN, half, STANDS]);
        let loads = read(half)?;
        let noise = capture.noise.force.or(cut.force_noise)?;
        let by_hand = !interaction.tracks.contains_key(&joint.child);
        let own = if by_hand {
            // The path of what holds it tells an angle by its arm.
            let of_path = interaction.tool_path.as_ref().map(|p| position_noise(&[p]));
            let lever = median(&loads.iter().map(|l| l.lever).collect::<Vec<f64>>())?;
            let noise = capture.noise.position.or(of_path.filter(|n| n.is_finite()));
            noise.map(|n| n / lever.max(1e-6))
        } else if joint.kind == JointKind::Revolute {
            capture.noise.rotation.or(cut.rotation_noise)
        } else {
            capture.noise.position.or(cut.position_noise)
        };
        let short = short_span(interaction, joint, &loads, own.unwrap_or(0.0)).filter(|s| half > BRIEF && *s < SHORTER * half);
        let (loads, halves) = match short.and_then(|s| Some((s, read(s)?))) {
            Some((short, brief)) => brisk(loads, half, &brief, short),
            None => {
                let halves = vec![half; loads.len()];
                (loads, halves)
            }
        };
        let stream = interaction.force.as_ref()?;
        let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?).max(1e-6);
        Some(Read {
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            loads,
            halves,
            noise: noise / (rate * BIN).max(1.0).sqrt(),
            jitter: own.unwrap_or(0.0),
            zero: own.unwrap_or(0.0) * (2.0 / rested(interaction, joint)).sqrt(),
            by_hand,
        })
    };
    let mut reads: Vec<Read> = capture.interactions.iter().filter_map(one).collect();
    let start = |r: &Read| r.loads.first().map_or(f64::INFINITY, |l| l.time);
    reads.sort_by(|a, b| start(a).total_cmp(&start(b)));
    reads
}

/// What is new in every motion: the level of friction, and a tare.
pub(super) fn scatter_of(lever: f64) -> Vec<Scatter> {
    let of = |tau: f64, counts: f64, floor: f64, nuisance: bool, step: f64| Scatter {
        tau,
        counts,
        floor,
        nuisance,
        step,
    };
    vec![
        of(0.015, 10.0, 0.004, false, 1e-4),
        of(0.003 * lever, 10.0, 0.003 * lever, true, 1e-4 * lever),
    ]
}

impl Motions {
    /// The load that `fit` foretells beside the measured one, by interaction; where the joint stands or sets out it
    /// foretells nothing.
    pub fn curves(&self, fit: &Fit) -> Vec<(&str, Curve)> {
        let one = |g: usize| {
            let group = &self.sheet.groups[g];
            let channel = &group.channels[0];
            // What is left open of all loads alike is no reason to foretell none.
            let fine = |m: &Moved| (EVEN * m.load / self.sheet.kinds[0].sigma).hypot(1.0);
            let sure = weights(self, g).into_iter().zip(&self.moments[g]);
            let rows = sure.zip(left(self, fit, g, true)).zip(&channel.measured);
            let foretold = rows.map(|(((w, m), e), x)| {
                if w * fine(m) < SURE || m.still || m.unsure {
                    f64::NAN
                } else {
                    x - e
                }
            });
            let curve = Curve {
                label: format!("{}: load of the tool along it", self.joint),
                quantity: self.sheet.kinds[0].quantity,
                time: self.moments[g].iter().map(|m| m.time + self.zero).collect(),
                measured: channel.measured.clone(),
                predicted: foretold.collect(),
                noise: Some(self.sheet.kinds[0].sigma),
            };
            (group.name.as_str(), curve)
        };
        (0..self.sheet.groups.len()).map(one).collect()
    }

    /// The largest component of the force, N, as it usually is while it moves.
    pub(super) fn usual(&self) -> f64 {
        let moving = self.moments.iter().flatten().filter(|m| !m.still);
        let each: Vec<f64> = moving.map(|m| (m.way * (m.load / m.lever.max(1e-9))).amax()).collect();
        median(&each).unwrap_or(0.0)
    }

    /// Values of a group's samples while it moves.
    pub(super) fn told(&self, group: usize, value: &dyn Fn(&Moved) -> f64) -> Vec<f64> {
        let each = self.moments[group].iter();
        each.map(|m| if m.still { f64::NAN } else { value(m) }).collect()
    }
}
