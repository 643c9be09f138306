//! The relative motion of two tracked things over all interactions, thinned by averaging.

use nalgebra::{UnitQuaternion, Vector3};

use super::manifold::Sample;
use crate::capture::{Capture, Interaction, PoseStream, RelativePose, TrackNoise, relative_motion, track_noise};

/// Samples that a fit gets at most; rows are averaged to stay below.
const MOST: usize = 360;

/// Two tracked things, and how one moved in the frame of the other.
pub struct Pair<'a> {
    /// Name of the parent's track.
    pub parent: String,
    /// Name of the child's track.
    pub child: String,
    /// The interactions in which both were tracked.
    pub runs: Vec<&'a Interaction>,
    /// Child in parent.
    pub samples: Vec<Sample>,
    /// One of each run that did not move the two against each other, where others did.
    pub still: Vec<Sample>,
}

impl<'a> Pair<'a> {
    /// Gathers the pair; the one that moved less in the world is the parent. Nothing where the two were never
    /// tracked together.
    pub fn gather(capture: &'a Capture, a: &str, b: &str) -> Option<Self> {
        let runs: Vec<&Interaction> = capture
            .fitted()
            .filter(|i| i.tracks.contains_key(a) && i.tracks.contains_key(b))
            .collect();
        let travelled = |name: &str| runs.iter().map(|i| travel(&i.tracks[name])).sum::<f64>();
        if travelled(b) < 0.95 * travelled(a) {
            Self::between(capture, b, a)
        } else {
            Self::between(capture, a, b)
        }
    }

    /// The pair with its parent chosen.
    pub fn between(capture: &'a Capture, parent: &str, child: &str) -> Option<Self> {
        let runs: Vec<&Interaction> = capture
            .fitted()
            .filter(|i| i.tracks.contains_key(parent) && i.tracks.contains_key(child))
            .collect();
        let mut motions: Vec<Vec<RelativePose>> = runs
            .iter()
            .map(|i| relative_motion(&i.tracks[parent], &i.tracks[child]))
            .collect();
        let noise = (track_noise(capture, parent), track_noise(capture, child));
        let mut pair = Self {
            parent: parent.into(),
            child: child.into(),
            samples: thinned(&motions, noise),
            still: Vec::new(),
            runs,
        };
        // Where it moved in a few touches only, those that left it alone would make its motion look like outliers.
        let moved: Vec<bool> = (0..motions.len())
            .map(|run| pair.of_run(run).next().is_some() && pair.moved(run))
            .collect();
        if moved.contains(&true) && moved.contains(&false) {
            let still = (0..moved.len()).filter(|run| !moved[*run]);
            pair.still = still.filter_map(|run| pair.of_run(run).next().cloned()).collect();
            for (motion, moved) in motions.iter_mut().zip(&moved) {
                if !moved {
                    motion.clear();
                }
            }
            pair.samples = thinned(&motions, noise);
        }
        (pair.samples.len() >= 2).then_some(pair)
    }

    /// The samples of one run.
    pub fn of_run(&self, run: usize) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(move |s| s.run == run)
    }

    /// The largest relative shift (m) and turn (rad) within one run.
    pub fn excursion(&self, run: usize) -> (f64, f64) {
        let Some(first) = self.of_run(run).next() else {
            return (0.0, 0.0);
        };
        self.of_run(run).fold((0.0f64, 0.0f64), |(shift, turn), s| {
            let angle = match (s.rotation, first.rotation) {
                (Some(q), Some(p)) => (q * p.inverse()).angle(),
                _ => 0.0,
            };
            (shift.max((s.position - first.position).norm()), turn.max(angle))
        })
    }

    /// The largest relative shift within one run, from where it began, m.
    pub fn farthest(&self, run: usize) -> Option<Vector3<f64>> {
        let first = self.of_run(run).next()?.position;
        let ways = self.of_run(run).map(|s| s.position - first);
        ways.max_by(|a, b| a.norm().total_cmp(&b.norm()))
    }

    /// Share of the runs in which the two moved against each other.
    pub fn share_moved(&self) -> f64 {
        let moved = (0..self.runs.len()).filter(|&run| self.moved(run)).count();
        moved as f64 / self.runs.len().max(1) as f64
    }

    /// True where the relative pose changed beyond noise in the run.
    pub fn moved(&self, run: usize) -> bool {
        let (shift, turn) = self.excursion(run);
        let noise = self.samples[0].noise;
        shift > (6.0 * noise.position).max(1e-3) || turn > (6.0 * noise.rotation).max(0.01)
    }
}

/// How far a track strays from its first row, a turn counted at 50 mm, m.
pub fn travel(stream: &PoseStream) -> f64 {
    let first = (0..stream.len()).find(|&i| stream.position[i].x.is_finite());
    let Some(first) = first else { return 0.0 };
    (0..stream.len())
        .filter(|&i| stream.position[i].x.is_finite())
        .map(|i| {
            let turn = match (stream.rotation[i], stream.rotation[first]) {
                (Some(q), Some(p)) => (q * p.inverse()).angle(),
                _ => 0.0,
            };
            (stream.position[i] - stream.position[first]).norm() + 0.05 * turn
        })
        .fold(0.0, f64::max)
}

/// Averages up to 8 neighbouring rows, as many as the motion allows, and leaves out groups evenly until at most
/// [`MOST`] samples are left. The noise of a relative position holds the parent's orientation noise at the
/// child's distance.
pub fn thinned(motions: &[Vec<RelativePose>], noise: (TrackNoise, TrackNoise)) -> Vec<Sample> {
    let rows: usize = motions.iter().map(Vec::len).sum();
    let wanted = rows.div_ceil(MOST).clamp(1, 8);
    let group = (1..=wanted)
        .rev()
        .find(|&g| slow_enough(motions, g, noise))
        .unwrap_or(1);
    let stride = rows.div_ceil(group * MOST).max(1);
    let mut samples = Vec::new();
    for (run, motion) in motions.iter().enumerate() {
        for rows in motion.chunks(group).step_by(stride) {
            samples.push(mean_of(rows, run, noise));
        }
    }
    samples
}

/// True where nine in ten groups of so many rows move by no more than a few times the noise.
fn slow_enough(motions: &[Vec<RelativePose>], group: usize, noise: (TrackNoise, TrackNoise)) -> bool {
    let shift = 6.0 * noise.0.position.hypot(noise.1.position);
    let turn = 6.0 * noise.0.rotation.hypot(noise.1.rotation);
    let (mut slow, mut all) = (0usize, 0usize);
    for rows in motions.iter().flat_map(|m| m.chunks(group)) {
        let (first, last) = (&rows[0], &rows[rows.len() - 1]);
        let angle = match (first.rotation, last.rotation) {
            (Some(p), Some(q)) => p.angle_to(&q),
            _ => 0.0,
        };
        all += 1;
        slow += usize::from((last.position - first.position).norm() < shift && angle < turn);
    }
    10 * slow >= 9 * all
}

fn mean_of(rows: &[RelativePose], run: usize, noise: (TrackNoise, TrackNoise)) -> Sample {
    let count = rows.len() as f64;
    let middle = &rows[rows.len() / 2];
    let position = rows.iter().map(|r| r.position).sum::<Vector3<f64>>() / count;
    let rotation = middle.rotation.map(|m| {
        let turn = rows
            .iter()
            .filter_map(|r| r.rotation)
            .map(|q| (q * m.inverse()).scaled_axis())
            .sum::<Vector3<f64>>()
            / count;
        UnitQuaternion::from_scaled_axis(turn) * m
    });
    let lever = if rotation.is_some() {
        noise.0.rotation * position.norm()
    } else {
        0.0
    };
    let variance = noise.0.position.powi(2) + noise.1.position.powi(2) + 2.0 / 3.0 * lever.powi(2);
    Sample {
        run,
        time: middle.time,
        position,
        rotation,
        noise: TrackNoise {
            position: (variance / count).sqrt(),
            rotation: noise.0.rotation.hypot(noise.1.rotation) / count.sqrt(),
        },
    }
}
