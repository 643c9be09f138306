//! Readings that are none: such as lie far from their neighbours in time or at the end of the range, and a sensor that rounds.
//!
//! Strays are looked for where a stream is quiet, since a blow looks like one: a reading is compared with the median of
//! the five about it (Hampel's identifier). Only where the quiet stretches prove them are they taken out everywhere.

use nalgebra::{Point3, Vector3};

use super::ceiling::ceiling_of;
use super::clipped::clipped_of;
use super::frozen::{frozen_of, thaw};
use super::hum::hum_of;
use super::stairs::evened;
use crate::capture::{Capture, Interaction, Kind, SensorFaults, Strays};
use crate::math::{mad_sd, median, quantile};

/// Readings on either side of the one that is judged.
const BESIDE: usize = 2;
/// Readings of a block whose quiet is judged.
const BLOCK: usize = 25;
/// Readings on either side that are on one level where nothing touches or lets go.
const ABOUT: usize = 5;
/// Blocks up to this many times as noisy as the quietest tenth are quiet.
const QUIET: f64 = 1.5;
/// Standard deviations from which on a reading is a stray.
const FAR: f64 = 7.0;
/// Fewest strays, and the least share of the quiet readings, that prove them.
const PROOF: (usize, f64) = (8, 2.5e-3);
/// A larger share of the quiet readings is no stray but the noise itself: of a sensor that repeats its readings, say.
const MOST: f64 = 0.15;
/// Readings this many standard deviations from where their stream began are loaded. Strays are among the others too, in at
/// least this share of what they are on the whole; a tool that chatters on what it holds makes none there.
const LOADED: f64 = 10.0;
const ALIKE: f64 = 0.3;
/// Share of the streams that must have some: a knock is in one, a poor sensor in all.
const SPREAD: f64 = 0.4;
/// A step of rounding below this many standard deviations of the noise does not show in what is estimated.
const COARSE: f64 = 1.5;
/// A step of rounding below this share of the largest force is a way of writing numbers down.
const WRITTEN: f64 = 0.005;
/// Readings nearer than this share of the largest are one value: a file holds some digits.
const SAME: f64 = 1e-5;
/// Values that show a comb by themselves; and the fewest that do where readings hop between them, so often an interaction.
const COMB: (usize, usize) = (4, 3);
const HOPS: usize = 10;

/// A capture without its strays where it has such, its paths evened out where they go in steps, and what is wrong with its readings.
pub fn sift(capture: &Capture) -> (Option<Capture>, SensorFaults) {
    let evened = evened(capture);
    let capture = evened.as_ref().unwrap_or(capture);
    let forces: Vec<Judged> = capture.interactions.iter().map(|i| Judged::of(&forces_of(i))).collect();
    let level = level_of(&forces);
    let hum = hum_of(capture);
    // The tops of a hum are far from the readings about them.
    let strays = strays_of(capture, &forces, level).filter(|_| hum.is_none());
    let tracks = tracks_stray(capture);
    let faults = SensorFaults {
        rounding: rounding_of(capture, level.unwrap_or(0.0)),
        strays,
        stray_positions: tracks.map(|t| t.1),
        clipped: clipped_of(capture).or_else(|| ceiling_of(capture)),
        hum,
        frozen: frozen_of(capture),
    };
    if faults.sound() {
        return (evened, faults);
    }
    let mut clean = capture.clone();
    // What stands at the end of the range may have been anything above it.
    let mut cut = faults.clipped.iter().flat_map(|c| &c.rows);
    for (interaction, judged) in clean.interactions.iter_mut().zip(&forces) {
        if let (Some(stream), Some(level), true) = (&mut interaction.force, level, faults.strays.is_some()) {
            for i in judged.strays(level) {
                stream.force[i] = Vector3::repeat(f64::NAN);
            }
        }
        if let (Some(stream), Some(rows)) = (&mut interaction.force, cut.next()) {
            leave_out(&mut stream.force, rows);
            // What is left of a weight that is beyond the range is where it is not carried.
            if interaction.kind == Kind::Lift && !rows.is_empty() {
                interaction.force = None;
            }
        }
        let held = interaction.tracks.values_mut().filter(|_| faults.frozen.is_some());
        held.for_each(thaw);
        for track in interaction.tracks.values_mut().filter(|_| tracks.is_some()) {
            let positions: Vec<Vector3<f64>> = track.position.iter().map(|p| p.coords).collect();
            for i in Judged::of(&positions).strays(tracks.map_or(0.0, |t| t.0)) {
                track.position[i] = Point3::from(Vector3::repeat(f64::NAN));
                track.rotation[i] = None;
            }
        }
    }
    (Some(clean), faults)
}

/// Readings on either side of one at the end of the range that go with it: of those that noise lifts over the end only the low ones
/// are left there.
const WITH: usize = 5;

fn leave_out(force: &mut [Vector3<f64>], rows: &[usize]) {
    for i in rows {
        let near = i.saturating_sub(WITH)..(i + WITH + 1).min(force.len());
        force[near].fill(Vector3::repeat(f64::NAN));
    }
}

fn forces_of(interaction: &Interaction) -> Vec<Vector3<f64>> {
    interaction.force.as_ref().map(|s| s.force.clone()).unwrap_or_default()
}

/// A stream beside its own neighbours.
struct Judged {
    /// Reading less the median about it.
    off: Vec<Vector3<f64>>,
    /// Median about it, less that where the stream begins.
    away: Vec<Vector3<f64>>,
    /// Scatter of the block that each reading is in, the noisiest axis.
    local: Vec<f64>,
}

impl Judged {
    fn of(values: &[Vector3<f64>]) -> Self {
        let near = |i: usize| i.saturating_sub(BESIDE)..(i + BESIDE + 1).min(values.len());
        let about = |i: usize, k: usize| {
            let own: Vec<f64> = values[near(i)].iter().map(|v| v[k]).collect();
            median(&own).unwrap_or(f64::NAN)
        };
        let off: Vec<Vector3<f64>> = (0..values.len())
            .map(|i| Vector3::from_fn(|k, _| values[i][k] - about(i, k)))
            .collect();
        let scatter = |block: &[Vector3<f64>]| {
            let axis = |k: usize| mad_sd(&block.iter().map(|v| v[k]).collect::<Vec<f64>>());
            (0..3).filter_map(axis).fold(0.0, f64::max)
        };
        let local = off.chunks(BLOCK).flat_map(|b| vec![scatter(b); b.len()]).collect();
        let about = |i: usize| values[i] - off[i];
        let start = Vector3::from_fn(|k, _| {
            let first: Vec<f64> = (0..values.len().min(BLOCK)).map(|i| about(i)[k]).collect();
            median(&first).unwrap_or(0.0)
        });
        let away = (0..values.len()).map(|i| about(i) - start).collect();
        Self { off, away, local }
    }

    /// How far the readings about this one are from where the stream began.
    fn away(&self, i: usize) -> f64 {
        self.away[i].amax()
    }

    fn size(&self, i: usize) -> f64 {
        self.off[i].amax()
    }

    /// Readings of quiet blocks between quiet blocks, on one level with those before and after them: what touches or lets go may
    /// knock.
    fn quiet(&self, level: f64) -> impl Iterator<Item = usize> {
        let calm = move |i: usize| self.local.get(i).is_none_or(|l| *l <= QUIET * level);
        let last = self.away.len().saturating_sub(1);
        let step = move |i: usize| self.away[(i + ABOUT).min(last)] - self.away[i.saturating_sub(ABOUT)];
        let even = move |i: usize| step(i).iter().all(|x| x.is_nan() || x.abs() <= FAR * level);
        let all = move |i: &usize| calm(*i) && calm(i + BLOCK) && calm(i.saturating_sub(BLOCK)) && even(*i);
        (0..self.off.len()).filter(move |i| all(i) && self.off[*i].iter().all(|x| x.is_finite()))
    }

    fn strays(&self, level: f64) -> Vec<usize> {
        let far = |i: &usize| self.size(*i) > FAR * level.max(self.local[*i]);
        (0..self.off.len()).filter(far).collect()
    }
}

/// Scatter of the quietest tenth of all blocks; nothing where it is none.
fn level_of(all: &[Judged]) -> Option<f64> {
    let each: Vec<f64> = all
        .iter()
        .flat_map(|j| j.local.iter().step_by(BLOCK).copied())
        .collect();
    quantile(&each, 0.1).filter(|l| *l > 0.0 && each.len() > 10)
}

/// Quiet readings and the strays among them, where these are proven.
fn proven(all: &[Judged], level: f64) -> Option<(usize, usize)> {
    let of = |j: &Judged| {
        let quiet: Vec<usize> = j.quiet(level).collect();
        let far = quiet.iter().filter(|i| j.size(**i) > FAR * level).count();
        (quiet.len(), far)
    };
    let each: Vec<(usize, usize)> = all.iter().map(of).filter(|(quiet, _)| *quiet > 0).collect();
    let (quiet, far) = each.iter().fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let with = each.iter().filter(|(_, far)| *far > 0).count();
    let spread = with as f64 >= SPREAD * each.len() as f64;
    let share = far as f64 / quiet.max(1) as f64;
    let proven = far >= PROOF.0 && share > PROOF.1 && share < MOST && spread;
    (proven && without_load(all, level, share)).then_some((quiet, far))
}

/// Whether the quiet readings without a load have their part of the strays.
fn without_load(all: &[Judged], level: f64, share: f64) -> bool {
    let idle = |j: &Judged| {
        let quiet: Vec<usize> = j.quiet(level).filter(|i| j.away(*i) < LOADED * level).collect();
        let far = quiet.iter().filter(|i| j.size(**i) > FAR * level).count();
        (quiet.len(), far)
    };
    let (quiet, far) = all.iter().map(idle).fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    far > 0 && far as f64 >= ALIKE * share * quiet as f64
}

fn strays_of(capture: &Capture, forces: &[Judged], level: Option<f64>) -> Option<Strays> {
    let level = level?;
    let (quiet, far) = proven(forces, level)?;
    let named = || capture.interactions.iter().zip(forces);
    let held: Vec<(&Interaction, &Judged)> = named().filter(|(i, _)| i.held_out).collect();
    let judged = if held.is_empty() {
        named().collect()
    } else {
        held.clone()
    };
    let rms = |with: bool| {
        let readings = judged.iter().flat_map(|(_, j)| j.quiet(level).map(|i| j.size(i)));
        let counted: Vec<f64> = readings.filter(|s| with || *s <= FAR * level).collect();
        (counted.iter().map(|s| s * s).sum::<f64>() / counted.len().max(1) as f64).sqrt()
    };
    Some(Strays {
        count: far,
        of: quiet,
        scatter: (rms(true), rms(false)),
        held_out: held.iter().map(|(i, _)| i.name.clone()).collect(),
        from: named()
            .filter(|(_, j)| !j.strays(level).is_empty())
            .map(|(i, _)| i.name.clone())
            .collect(),
    })
}

/// The quiet scatter of the tracks, where they have strays, with how many of how many positions are.
fn tracks_stray(capture: &Capture) -> Option<(f64, (usize, usize))> {
    let tracks = capture.interactions.iter().flat_map(|i| i.tracks.values());
    let judged: Vec<Judged> = tracks
        .filter(|t| t.len() > BLOCK)
        .map(|t| Judged::of(&t.position.iter().map(|p| p.coords).collect::<Vec<_>>()))
        .collect();
    let level = level_of(&judged)?;
    proven(&judged, level).map(|(quiet, far)| (level, (far, quiet)))
}

/// The step of which all readings of force are multiples, where it is coarser than their noise: along the axes of the room, or
/// along those of the tool where its sensor turns with it.
fn rounding_of(capture: &Capture, scatter: f64) -> Option<(f64, usize)> {
    let noise = capture.noise.force.unwrap_or(scatter);
    let comb = |streams: Vec<Vec<Vector3<f64>>>| comb_of(&streams, noise);
    comb(capture.interactions.iter().map(forces_of).collect())
        .or_else(|| comb(capture.interactions.iter().map(forces_of_tool).collect()))
}

/// The forces along the axes of the tool; none where it has no path with a heading.
fn forces_of_tool(interaction: &Interaction) -> Vec<Vector3<f64>> {
    let (Some(stream), Some(path)) = (&interaction.force, &interaction.tool_path) else {
        return Vec::new();
    };
    let row = |t: f64| path.time.partition_point(|x| *x < t).min(path.len().saturating_sub(1));
    let turn = |t: f64| path.rotation.get(row(t)).copied().flatten();
    let rows = stream.time.iter().zip(&stream.force);
    rows.filter_map(|(t, f)| turn(*t).map(|q| q.inverse() * f)).collect()
}

/// Of these streams the step of their largest axis, and in how many values that comes.
fn comb_of(streams: &[Vec<Vector3<f64>>], noise: f64) -> Option<(f64, usize)> {
    let axis = |k: usize| {
        let each = streams.iter().flatten().map(|f| f[k]);
        let mut values: Vec<f64> = each.filter(|x| x.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let largest = values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        values.dedup_by(|a, b| (*a - *b).abs() < (SAME * largest).max(1e-9));
        (k, largest, values)
    };
    let (widest, largest, values) = (0..3).map(axis).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let step = values.windows(2).map(|w| w[1] - w[0]).reduce(f64::min)?;
    let even = |x: &f64| {
        let steps = (x - values[0]) / step;
        (steps - steps.round()).abs() < 0.02
    };
    let coarse = step > COARSE * noise && step > WRITTEN * largest;
    let comb = values.len() >= COMB.0 || values.len() >= COMB.1 && hops(streams, widest);
    (comb && coarse && values.iter().all(even)).then_some((step, values.len()))
}

/// Whether readings change between few values again and again, as noise beside a rounding edge makes them: what has no noise
/// takes few values without.
fn hops(streams: &[Vec<Vector3<f64>>], axis: usize) -> bool {
    let changes = |stream: &Vec<Vector3<f64>>| {
        let pairs = stream.windows(2);
        pairs.filter(|w| (w[0][axis] - w[1][axis]).abs() > 0.0).count()
    };
    let read = streams.iter().filter(|s| !s.is_empty()).count();
    streams.iter().map(changes).sum::<usize>() >= HOPS * read
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::{Noise, PoseStream, WrenchStream};

    /// A force of so many newtons, now one way, now the other, read with noise or without and rounded to `step`.
    fn read(size: f64, noise: f64, step: f64) -> Capture {
        let dice = |i: i32| (f64::from(i) * 12.9898).sin() * 43758.5453;
        let one = |i: i32| {
            let way = [0.0, 1.0, -1.0][(i / 100 % 3) as usize];
            let force = size * way + noise * (dice(i) - dice(i).floor() - 0.5);
            Vector3::new(0.0, (force / step).round() * step, 0.0)
        };
        let stream = WrenchStream {
            time: (0..900).map(|i| 0.002 * f64::from(i)).collect(),
            force: (0..900).map(one).collect(),
            ..WrenchStream::default()
        };
        Capture {
            root: Default::default(),
            name: "made-up".into(),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            support: None,
            cameras: Vec::new(),
            views: Vec::new(),
            bodies: Vec::new(),
            noise: Noise::default(),
            interactions: vec![Interaction {
                name: "pull".into(),
                kind: Kind::Pull,
                action: None,
                tool_name: None,
                tool: None,
                target: None,
                force: Some(stream),
                tool_path: None,
                support_path: None,
                tracks: Default::default(),
                frames: None,
                held_out: false,
            }],
            truth: None,
            digest: String::new(),
        }
    }

    #[test]
    fn three_values_are_a_comb_where_noise_hops_between_them() {
        let (step, values) = rounding_of(&read(0.26, 0.1, 0.53), 0.0).expect("a step");
        assert!((step - 0.53).abs() < 1e-9 && values == 3, "{step} {values}");
        assert!(rounding_of(&read(0.3, 0.0, 0.3), 0.0).is_none());
    }

    #[test]
    fn a_sensor_that_turns_with_its_tool_shows_its_comb_there() {
        let mut capture = read(2.0, 0.3, 0.2);
        let one = capture.interactions[0].clone();
        capture.interactions = vec![one; 3];
        // As a file of seven digits holds them.
        let digits = |x: f64| (x * 1e6).round() / 1e6;
        for (interaction, angle) in capture.interactions.iter_mut().zip([0.7, -0.3, 1.9]) {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            let stream = interaction.force.as_mut().expect("a force");
            stream.force.iter_mut().for_each(|f| *f = (turn * *f).map(digits));
            interaction.tool_path = Some(PoseStream {
                time: vec![0.0, 2.0],
                position: vec![nalgebra::Point3::origin(); 2],
                rotation: vec![Some(turn); 2],
            });
        }
        let (step, _) = rounding_of(&capture, 0.0).expect("a step");
        assert!((step - 0.2).abs() < 1e-4, "{step}");
    }

    /// A finger that meets something stiff bounces once before the force steps up; the readings about it are quiet.
    #[test]
    fn a_knock_where_something_is_touched_is_no_stray() {
        let touched = |stray: bool| {
            let mut capture = read(0.0, 0.02, 1e-9);
            capture.interactions = vec![capture.interactions[0].clone(); 16];
            for (k, interaction) in capture.interactions.iter_mut().enumerate() {
                let stream = interaction.force.as_mut().expect("a force");
                stream.time.truncate(150);
                // As noisy in every block, the same seven values in ever another order: of no one frequency.
                let order = |i: usize| (i % 7) * (1 + (3 * (i / 7) + k) % 6) + 5 * (i / 7) + 2 * k;
                let noise = |i: usize| 3e-3 * (order(i) % 7) as f64;
                stream.force = (0..150).map(|i| Vector3::new(0.0, noise(i), 0.0)).collect();
                stream.force[if stray { 20 } else { 73 }].y += 2.0;
                stream.force[75..].iter_mut().for_each(|f| f.y += 3.0);
            }
            sift(&capture).1.strays.map(|s| s.count)
        };
        assert_eq!(touched(false), None);
        assert!(touched(true).is_some_and(|n| n >= 8), "{:?}", touched(true));
    }

    #[test]
    fn what_is_beside_the_end_of_the_range_goes_with_it() {
        let mut force = vec![Vector3::new(1.0, 0.0, 0.0); 40];
        leave_out(&mut force, &[2, 20]);
        let left: Vec<usize> = (0..40).filter(|i| force[*i].x.is_finite()).collect();
        assert_eq!(left, (8..15).chain(26..40).collect::<Vec<usize>>());
    }
}
