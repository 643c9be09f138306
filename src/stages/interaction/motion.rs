//! When a tracked body moved: its pose against its own noise at rest.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::Config;
use crate::capture::PoseStream;
use crate::math::{mad_sd, mean_rotation, median};

/// A track with its rest pose and the noise about it.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    /// Seconds.
    pub time: Vec<f64>,
    /// Smoothed displacement from the rest position, m; NaN where missing.
    pub shift: Vec<f64>,
    /// Smoothed rotation from the rest orientation, rad; NaN where missing.
    pub turn: Vec<f64>,
    /// Displacement that counts as motion, m.
    pub shift_threshold: f64,
    /// Rotation that counts as motion, rad.
    pub turn_threshold: f64,
    /// Noise of the position per axis, m.
    pub position_noise: Option<f64>,
    /// Noise of the rotation per axis, rad.
    pub rotation_noise: Option<f64>,
}

fn finite(p: &Point3<f64>) -> bool {
    p.coords.iter().all(|x| x.is_finite())
}

fn middle(points: &[Point3<f64>]) -> Option<Point3<f64>> {
    let axis = |k: usize| median(&points.iter().map(|p| p[k]).collect::<Vec<_>>());
    Some(Point3::new(axis(0)?, axis(1)?, axis(2)?))
}

/// White noise per axis from second differences, which steady motion does not enter.
fn second_difference_noise(vectors: &[Vector3<f64>]) -> Option<f64> {
    let bends: Vec<f64> = (0..3)
        .flat_map(|k| vectors.windows(3).map(move |w| w[0][k] - 2.0 * w[1][k] + w[2][k]))
        .filter(|d| d.is_finite())
        .collect();
    (bends.len() >= 12).then(|| mad_sd(&bends).map(|sd| sd / 6.0_f64.sqrt()))?
}

/// The rotation vectors of the rows that have an orientation, relative to `from`.
fn rotation_vectors(stream: &PoseStream, from: &UnitQuaternion<f64>) -> Vec<Option<Vector3<f64>>> {
    stream
        .rotation
        .iter()
        .map(|q| q.map(|q| (q * from.inverse()).scaled_axis()))
        .collect()
}

/// Share of the rows of a whole window below which its mean says nothing: beside a gap a few rows would stand for all.
const SPARSE: f64 = 0.4;

/// Moving mean over `half` s to both sides, in which `whole` rows are expected; NaN where too few are there.
fn smoothed(time: &[f64], values: &[Vector3<f64>], half: f64, whole: f64) -> Vec<Vector3<f64>> {
    let (mut from, mut to) = (0, 0);
    (0..time.len())
        .map(|i| {
            while time[from] < time[i] - half {
                from += 1;
            }
            while to < time.len() && time[to] <= time[i] + half {
                to += 1;
            }
            let rows: Vec<_> = values[from..to].iter().filter(|v| v.x.is_finite()).collect();
            let sum: Vector3<f64> = rows.iter().copied().sum();
            if (rows.len() as f64) < (SPARSE * whole).max(1.0) {
                Vector3::repeat(f64::NAN)
            } else {
                sum / rows.len() as f64
            }
        })
        .collect()
}

/// Measures a track against its rest before `rest_until`; `None` for a track without a single position.
pub(super) fn measure_motion(stream: &PoseStream, rest_until: f64, config: &Config) -> Option<Motion> {
    let n = stream.len();
    let rest_rows = stream.time.partition_point(|t| *t <= rest_until).clamp(1.min(n), n);
    let rest: Vec<_> = stream.position[..rest_rows]
        .iter()
        .filter(|p| finite(p))
        .copied()
        .collect();
    let first = stream.position.iter().find(|p| finite(p)).copied();
    let home = middle(&rest).or(first)?;
    let turned_home = mean_rotation(stream.rotation[..rest_rows].iter().flatten())
        .or_else(|| stream.rotation.iter().flatten().next().copied());
    let shifts: Vec<Vector3<f64>> = stream.position.iter().map(|p| p - home).collect();
    let missing = Vector3::repeat(f64::NAN);
    let turns: Vec<Vector3<f64>> = match &turned_home {
        Some(q) => rotation_vectors(stream, q)
            .into_iter()
            .map(|v| v.unwrap_or(missing))
            .collect(),
        None => vec![missing; n],
    };
    let position_noise = second_difference_noise(&shifts);
    let rotation_noise = second_difference_noise(&turns);
    // As often as it is seen where it is seen: a tracker may be written down more often than it reads.
    let seen: Vec<f64> = (0..n)
        .filter(|i| finite(&stream.position[*i]))
        .map(|i| stream.time[i])
        .collect();
    let apart = median(&seen.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
    let rate = 1.0 / apart.unwrap_or(f64::INFINITY).max(1e-9);
    let half = if stream.is_snapshot_pair() {
        0.0
    } else {
        0.5 * config.track_window
    };
    let whole = (2.0 * half * rate).max(1.0);
    let averaged = whole.sqrt();
    let smooth = |values: &[Vector3<f64>]| -> Vec<f64> {
        let means = smoothed(&stream.time, values, half, whole);
        means.iter().map(Vector3::norm).collect()
    };
    let threshold = |noise: Option<f64>, floor: f64| {
        (config.motion_sigmas * noise.unwrap_or(0.0) * (1.0 / averaged + 1.0 / (rest_rows as f64).sqrt())).max(floor)
    };
    Some(Motion {
        shift: smooth(&shifts),
        turn: smooth(&turns),
        time: stream.time.clone(),
        shift_threshold: threshold(position_noise, config.motion_floor),
        turn_threshold: threshold(rotation_noise, config.turn_floor),
        position_noise,
        rotation_noise,
    })
}

impl Motion {
    fn displaced(&self, i: usize) -> bool {
        self.shift[i] > self.shift_threshold || self.turn[i] > self.turn_threshold
    }

    /// When it left its rest pose for good, back-extrapolated to the last time that it was within noise.
    pub fn onset(&self, after: f64) -> Option<f64> {
        let from = self.time.partition_point(|t| *t < after);
        let run = 3.min(self.time.len().saturating_sub(from)).max(1);
        let over =
            (from..self.time.len()).find(|&i| i + run <= self.time.len() && (i..i + run).all(|k| self.displaced(k)))?;
        // A missing orientation is NaN and does not speak against rest.
        let turned = |i: usize| self.turn[i] > self.turn_threshold;
        let quiet = |i: usize| self.shift[i] < 0.4 * self.shift_threshold && !turned(i);
        let last_quiet = (from..over).rev().find(|&i| quiet(i));
        Some(
            last_quiet
                .map_or(self.time[over], |i| 0.5 * (self.time[i] + self.time[over]))
                .max(after),
        )
    }

    /// When it came to rest at the end: the last time that it was away from its final pose.
    pub fn stops(&self, after: f64) -> Option<f64> {
        let last = self.shift.iter().rev().find(|s| s.is_finite())?;
        let last_turn = self.turn.iter().rev().find(|s| s.is_finite()).copied().unwrap_or(0.0);
        (0..self.time.len())
            .rev()
            .find(|&i| {
                self.time[i] >= after
                    && ((self.shift[i] - last).abs() > self.shift_threshold
                        || (self.turn[i] - last_turn).abs() > self.turn_threshold)
            })
            .map(|i| self.time[i])
    }

    /// Whether it changed its pose between two times beyond its noise.
    pub fn moved_between(&self, start: f64, end: f64) -> bool {
        // Where rows are missing what was seen last stands for it, or next where nothing was before.
        let seen = |of: &[f64], i: usize| {
            let known = |x: &f64| x.is_finite();
            let last = || of[..i].iter().rev().copied().find(known);
            let next = || of[i..].iter().copied().find(known);
            Some(of[i])
                .filter(known)
                .or_else(last)
                .or_else(next)
                .unwrap_or(f64::NAN)
        };
        let at = |t: f64| {
            let i = self.time.partition_point(|x| *x < t).min(self.time.len() - 1);
            (seen(&self.shift, i), seen(&self.turn, i))
        };
        let span = (0..self.time.len()).filter(|&i| self.time[i] >= start && self.time[i] <= end);
        let (s0, r0) = at(start);
        let mut any = span.map(|i| (self.shift[i], self.turn[i])).chain([at(end)]);
        any.any(|(s, r)| (s - s0).abs() > self.shift_threshold || (r - r0).abs() > self.turn_threshold)
    }
}
