//! The motions of a joint, read block by block.

use super::Curve;
use super::family::Scatter;
use super::fit::Fit;
use super::held_out::left;
use super::marginal::weights;
use super::motion_laws::Moved;
use super::motion_led::led;
use super::motions::{EVEN, Motions};
use crate::capture::{Capture, Interaction, Segmented, position_noise};
use crate::math::{median, quantile};
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{Joint, JointKind, Model};

/// Seconds of one sample.
pub(super) const BIN: f64 = 0.04;
/// Half the span of the parabola from which velocities come: at first, at least, at most, s, and as a share of the
/// time that the motion takes from end to end.
pub(super) const HALF: [f64; 3] = [0.08, 0.04, 0.4];
const SHARE: f64 = 0.1;
/// Where the speed changes by more than this share within its span a shorter one does: that whose speed is noisy by this share of
/// the usual one, if it is shorter by a factor. Of spans up to so many seconds, those of fast motions, starts are no longer.
const CHANGES: f64 = 0.25;
const NOISY: f64 = 0.04;
const BRIEF: f64 = 0.16;
const SHORTER: f64 = 0.6;
/// Share of the usual speed from which on a joint that set out goes, and of the way up to which it is closed.
const STEADY: f64 = 0.8;
const CLOSED: f64 = 0.1;
/// How far above the usual force a range ends that cuts off the large ones.
pub(super) const CUTS: f64 = 1.1;
/// Share that ends of the range of each axis leave of how much the force varies, in squares, where they are what it varies by.
const AXES: f64 = 0.2;
/// Median of the square of a normal number.
const MIDDLE: f64 = 0.455;
/// Forces over the end of a range that are tried for what drives the joint.
const FORCES: [f64; 8] = [1.1, 1.3, 1.6, 2.0, 2.5, 3.2, 4.0, 6.0];
/// A parent that moves by more than this does not stand, m.
pub(super) const STANDS: f64 = 3e-3;
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

/// Force below which nothing is touched, standard deviations, and the share of a motion without a touch from which it is one by itself.
const FREE: f64 = 4.0;
const SWINGS_ON: f64 = 0.3;

/// Way, in units of the noise of one reading of the track, within which a joint that is at rest seems to go.
const NOWHERE: f64 = 4.0;

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

    /// Whether what was struck moved on faster than `slow` (rad/s or m/s) with nothing touching it.
    pub(super) fn swings_on(&self, slow: f64) -> bool {
        let moving = || (0..self.loads.len()).filter(|i| self.loads[*i].speed.abs() > slow);
        let free = moving().filter(|i| self.is_free(*i)).count();
        free as f64 > SWINGS_ON * moving().count() as f64
    }

    /// A joint that goes nowhere stands: what its track seems to do is noise.
    fn rest(&mut self) {
        let places: Vec<f64> = self.loads.iter().map(|l| l.position).collect();
        let way = quantile(&places, 0.98)
            .zip(quantile(&places, 0.02))
            .map_or(0.0, |(high, low)| high - low);
        if way < NOWHERE * self.jitter {
            self.loads
                .iter_mut()
                .for_each(|l| (l.speed, l.acceleration) = (0.0, 0.0));
        }
    }

    /// Whether nothing touches it at the moment `i`.
    pub(super) fn is_free(&self, i: usize) -> bool {
        let l = &self.loads[i];
        l.load.abs() < FREE * self.noise * l.lever
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

/// Half the shortest span over which rows at such times, of a noise `jitter` each, tell speeds with a noise of no more than a share of
/// the usual one: a slope over `±h` seconds of rows with a noise `σ` at a rate `r` has a variance of `3 σ² / (2 r h³)`.
pub(super) fn short_span(times: &[f64], loads: &[JointLoad], jitter: f64) -> Option<f64> {
    let rate = (times.len() as f64 - 1.0) / (times.last()? - times.first()?).max(1e-6);
    let usual = usual_speed(loads)?;
    Some((1.5 * (jitter / (NOISY * usual)).powi(2) / rate).cbrt().max(HALF[1]))
}

/// Of four fifths of what is read none is faster, rad/s or m/s.
pub(super) fn usual_speed(loads: &[JointLoad]) -> Option<f64> {
    let speeds: Vec<f64> = loads.iter().map(|l| l.speed.abs()).collect();
    Some(quantile(&speeds, 0.8)?.max(1e-9))
}

/// Half a short span, and the loads whose speeds come from it.
type Brief = (f64, Vec<JointLoad>);

/// Speeds from a short span where they change within a long one as the joint sets out: what is at one place there is over before a
/// long span is. Ends, turns and blows stay as they are.
fn brisk(read: &mut Read, brief: &[JointLoad], short: f64) {
    let speeds: Vec<f64> = read.loads.iter().map(|l| l.speed.abs()).collect();
    let fast = quantile(&speeds, 0.8).unwrap_or(0.0);
    let reach = read.reach();
    let sets_out = speeds.iter().position(|v| *v > STEADY * fast).map_or(0, |i| i + reach);
    let changes = |i: usize| {
        let near = &read.loads[i.saturating_sub(reach)..(i + reach + 1).min(read.loads.len())];
        let ends = near.iter().map(|l| l.speed);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        high - low > CHANGES * (speeds[i] + 0.1 * fast)
    };
    let changing: Vec<usize> = (0..sets_out.min(speeds.len())).filter(|i| changes(*i)).collect();
    for i in changing {
        let same = brief.iter().find(|b| (b.time - read.loads[i].time).abs() < 1e-6);
        if let Some(load) = same {
            (read.loads[i], read.halves[i]) = (*load, short);
        }
    }
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
        let track = interaction.tracks.get(&joint.child);
        let short = track.and_then(|track| short_span(&track.time, &loads, own.unwrap_or(0.0)));
        let short = short.filter(|s| half > BRIEF && *s < SHORTER * half);
        let brief = short.and_then(|s| Some((s, read(s)?)));
        let stream = interaction.force.as_ref()?;
        let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?).max(1e-6);
        let read = Read {
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            halves: vec![half; loads.len()],
            loads,
            noise: noise / (rate * BIN).max(1.0).sqrt(),
            jitter: own.unwrap_or(0.0),
            zero: own.unwrap_or(0.0) * (2.0 / rested(interaction, joint)).sqrt(),
            by_hand,
        };
        let led = led(&read, (interaction, cut), joint, model);
        let held = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
        Some((read, led, brief, held))
    };
    let each: Vec<(Read, Option<Read>, Option<Brief>, bool)> = capture.interactions.iter().filter_map(one).collect();
    // By the path of the tool all that it holds, or none: their speeds are to be of one kind.
    let all_led = each.iter().all(|(_, led, _, held)| led.is_some() || !held);
    let taken = |(read, led, brief, _): (Read, Option<Read>, Option<Brief>, bool)| match led.filter(|_| all_led) {
        Some(led) => (led, None),
        None => (read, brief),
    };
    let mut reads: Vec<(Read, Option<Brief>)> = each.into_iter().map(taken).collect();
    reads.iter_mut().for_each(|r| r.0.rest());
    let start = |r: &Read| r.loads.first().map_or(f64::INFINITY, |l| l.time);
    reads.sort_by(|a, b| start(&a.0).total_cmp(&start(&b.0)));
    let places = reads.iter().flat_map(|r| r.0.loads.iter().map(|l| l.position));
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
    let mut first = true;
    for (read, brief) in &mut reads {
        // What holds a joint before it goes is at its closed end, or broke as it was moved first.
        let closed = read
            .loads
            .first()
            .is_some_and(|l| l.position < low + CLOSED * (high - low));
        if let Some((short, brief)) = brief.as_ref().filter(|_| first || closed) {
            brisk(read, brief, *short);
        }
        first = false;
    }
    reads.into_iter().map(|r| r.0).collect()
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
                // The force of a blow is that of what gives at the finger.
                if w * fine(m) < SURE || m.still || m.unsure || self.struck[g] {
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

    /// Whether the force that is read while it moves goes with its direction as that of a sensor whose axes each end at `limit`, N: along the
    /// diagonals more is read than along an axis. Friction is the same all round.
    pub(super) fn goes_by_axes(&self, limit: f64) -> bool {
        let moving = || self.moments.iter().flatten().filter(|m| !m.still);
        let read = |m: &Moved| m.load.abs() / m.lever.max(1e-9);
        // Medians, for motions start and turn about with forces of their own; less what the noise makes of them.
        let noise = |m: &Moved| (self.sheet.kinds[0].sigma / m.lever.max(1e-9)).powi(2);
        let middle = |of: &dyn Fn(&Moved) -> f64| median(&moving().map(of).collect::<Vec<f64>>()).unwrap_or(0.0);
        let off = |of: &dyn Fn(&Moved) -> f64| middle(&|m| (read(m) - of(m)).powi(2) - MIDDLE * noise(m));
        let cut = |m: &Moved, force: f64| m.way.dot(&(m.way * force).map(|f| f.clamp(-limit, limit)));
        let ended = FORCES.map(|times| off(&|m| cut(m, times * limit)));
        let (usual, least) = (middle(&read), ended.into_iter().fold(f64::INFINITY, f64::min));
        let varies = off(&|_| usual);
        varies > middle(&noise) && least < AXES * varies
    }

    /// Values of a group's samples while it moves.
    pub(super) fn told(&self, group: usize, value: &dyn Fn(&Moved) -> f64) -> Vec<f64> {
        let each = self.moments[group].iter();
        each.map(|m| if m.still { f64::NAN } else { value(m) }).collect()
    }
}

/// Fewest readings of a motion that tell its largest.
const TELLS: usize = 10;

/// The largest component of the force along the freedom of any motion that is faster than `slow`, but for its noise, N: slow motions have
/// most of the readings, fast ones the largest.
pub(super) fn largest_component<'a>(all: impl Iterator<Item = &'a [JointLoad]>, slow: f64) -> f64 {
    let of = |loads: &[JointLoad]| {
        let moving = loads.iter().filter(|l| l.speed.abs() > slow);
        let each: Vec<f64> = moving.map(|l| (l.way * (l.load / l.lever)).amax()).collect();
        quantile(&each, 0.95).filter(|_| each.len() >= TELLS)
    };
    all.filter_map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_force_is_that_of_the_fastest_motion_however_long_the_slow_ones_last() {
        let read = |force: f64, speed: f64, count: usize| {
            let load = JointLoad {
                load: force,
                lever: 1.0,
                speed,
                way: nalgebra::Vector3::x(),
                ..smoothed(0.0)[0]
            };
            vec![load; count]
        };
        let all = [read(1.0, 0.02, 900), read(5.0, 0.3, 40), read(9.0, 0.0, 40)];
        let all = all.iter().map(Vec::as_slice);
        assert!((largest_component(all, 0.01) - 5.0).abs() < 1e-12);
    }

    /// A joint that goes at once from rest to 30 mm/s at 0.4 s and stops as suddenly at 3.6 s, its speeds smoothed over so many
    /// seconds to either side.
    fn smoothed(half: f64) -> Vec<JointLoad> {
        let edge = |t: f64| ((t + half) / (2.0 * half)).clamp(0.0, 1.0);
        let load = |i: i32| {
            let time = BIN * (f64::from(i) + 0.5);
            JointLoad {
                time,
                load: 1.0,
                lever: 1.0,
                aside: [0.0; 2],
                way: nalgebra::Vector3::x(),
                position: 0.03 * (time - 0.4).clamp(0.0, 3.2),
                speed: 0.03 * edge(time - 0.4) * edge(3.6 - time),
                speed_gain: half.powf(-1.5),
                acceleration: 0.0,
            }
        };
        (0..100).map(load).collect()
    }

    fn read_of(loads: Vec<JointLoad>, half: f64) -> Read {
        Read {
            interaction: "pull-00".into(),
            held_out: false,
            halves: vec![half; loads.len()],
            loads,
            noise: 0.01,
            jitter: 1e-4,
            zero: 0.0,
            by_hand: false,
        }
    }

    #[test]
    fn what_was_struck_swings_on_and_what_is_led_does_not() {
        let mut read = read_of(smoothed(0.08), 0.08);
        assert!(!read.swings_on(1e-3));
        for load in read.loads.iter_mut().filter(|l| l.time > 0.6) {
            load.load = 0.0;
        }
        assert!(read.swings_on(1e-3));
    }

    #[test]
    fn a_slow_start_is_read_by_a_short_span_and_its_end_as_before() {
        let calm = smoothed(0.36);
        let mut read = read_of(calm.clone(), 0.36);
        brisk(&mut read, &smoothed(0.08), 0.08);
        // A tenth of a second after it set out it goes as fast as it will.
        let at = |t: f64| (t / BIN) as usize;
        let [before, now] = [&calm, &read.loads].map(|l| l[at(0.52)].speed / 0.03);
        assert!(before < 0.7 && now > 0.99, "{before} {now}");
        assert!((read.halves[at(0.52)] - 0.08).abs() < 1e-9);
        for t in [2.0, 3.5, 3.7] {
            let (a, b) = (calm[at(t)].speed, read.loads[at(t)].speed);
            assert!((a - b).abs() < 1e-12 && read.halves[at(t)] > 0.3, "{t}: {a} {b}");
        }
    }
}
