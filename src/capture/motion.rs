//! What two tracks say about each other: the motion of one thing in the frame of another, and its noise.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{Capture, Interaction, PoseStream, WrenchStream};

/// The pose of one thing in the frame of another at one instant; noise from both tracks.
#[derive(Clone, Debug)]
pub struct RelativePose {
    /// Seconds on the capture's clock.
    pub time: f64,
    /// Origin of the second thing in the frame of the first, m.
    pub position: Vector3<f64>,
    /// `first_from_second`, where both orientations were tracked.
    pub rotation: Option<UnitQuaternion<f64>>,
}

/// Noise of a track, one standard deviation per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackNoise {
    /// m.
    pub position: f64,
    /// rad.
    pub rotation: f64,
}

/// So many missing readings in a row are no dropouts.
const IN_A_ROW: usize = 4;

/// Noise below which no track is believed (resolution of file and mount), m and rad.
const FLOOR: TrackNoise = TrackNoise {
    position: 2e-5,
    rotation: 2e-4,
};

impl WrenchStream {
    /// Whether some readings in a row are missing between two times: what was exerted meanwhile is not known.
    pub fn misses(&self, from: f64, until: f64) -> bool {
        let lost = |i: &usize| self.time[*i] >= from && self.time[*i] <= until && !self.force[*i].x.is_finite();
        let rows: Vec<usize> = (0..self.time.len()).filter(lost).collect();
        rows.windows(IN_A_ROW).any(|w| w[IN_A_ROW - 1] - w[0] == IN_A_ROW - 1)
    }
}

impl PoseStream {
    /// Position and rotation at a time, linear (slerp) between rows; nothing outside or in a gap.
    pub fn sample(&self, time: f64) -> Option<(Vector3<f64>, Option<UnitQuaternion<f64>>)> {
        let after = self.time.partition_point(|t| *t < time);
        let row = |i: usize| {
            let p = self.position[i].coords;
            p.iter().all(|x| x.is_finite()).then_some((p, self.rotation[i]))
        };
        if after < self.len() && (self.time[after] - time).abs() < 1e-9 {
            return row(after);
        }
        if after == 0 || after >= self.len() {
            return None;
        }
        let (a, b) = (row(after - 1)?, row(after)?);
        let share = (time - self.time[after - 1]) / (self.time[after] - self.time[after - 1]);
        let rotation = match (a.1, b.1) {
            (Some(p), Some(q)) => p.try_slerp(&q, share, 1e-9).or(Some(p)),
            _ => None,
        };
        Some((a.0.lerp(&b.0, share), rotation))
    }
}

/// The motion of `second` in the frame of `first`, at the times of the track with more rows. Where `first` has
/// no orientation its axes are taken as the world's.
pub fn relative_motion(first: &PoseStream, second: &PoseStream) -> Vec<RelativePose> {
    let times = if first.len() > second.len() {
        &first.time
    } else {
        &second.time
    };
    times
        .iter()
        .filter_map(|&time| {
            let (p, q) = first.sample(time)?;
            let (x, r) = second.sample(time)?;
            let turn = q.unwrap_or_else(UnitQuaternion::identity);
            Some(RelativePose {
                time,
                position: turn.inverse() * (x - p),
                rotation: q.and(r).map(|r| turn.inverse() * r),
            })
        })
        .collect()
}

/// Noise of the track of `name`: what the capture states, else 1.4826 times the median absolute second
/// difference over the square root of 6 (a smooth motion leaves second differences alone).
pub fn track_noise(capture: &Capture, name: &str) -> TrackNoise {
    let streams: Vec<&PoseStream> = capture.interactions.iter().filter_map(|i| i.tracks.get(name)).collect();
    let stated = capture.noise;
    TrackNoise {
        position: stated
            .position
            .unwrap_or_else(|| position_noise(&streams))
            .max(FLOOR.position),
        rotation: stated
            .rotation
            .unwrap_or_else(|| rotation_noise(&streams))
            .max(FLOOR.rotation),
    }
}

/// The track of `name`, or, for a thing that the tool holds and nobody tracks, the path of the tool's origin.
pub fn path_of<'a>(interaction: &'a Interaction, name: &str) -> Option<&'a PoseStream> {
    let held = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin);
    interaction.tracks.get(name).or_else(|| {
        (held && interaction.target.as_deref() == Some(name))
            .then_some(interaction.tool_path.as_ref())
            .flatten()
    })
}

/// White noise of positions from second differences, m per axis.
pub fn position_noise(streams: &[&PoseStream]) -> f64 {
    let mut sizes = Vec::new();
    for stream in streams {
        for rows in stream.position.windows(3) {
            let second = rows[2].coords - 2.0 * rows[1].coords + rows[0].coords;
            sizes.extend(second.iter().filter(|x| x.is_finite()).map(|x| x.abs()));
        }
    }
    1.4826 * median(&mut sizes) / 6f64.sqrt()
}

fn rotation_noise(streams: &[&PoseStream]) -> f64 {
    let mut sizes = Vec::new();
    for stream in streams {
        for rows in stream.rotation.windows(3) {
            if let [Some(a), Some(b), Some(c)] = rows {
                let second = (c * b.inverse()).scaled_axis() - (b * a.inverse()).scaled_axis();
                sizes.extend(second.iter().map(|x| x.abs()));
            }
        }
    }
    1.4826 * median(&mut sizes) / 6f64.sqrt()
}

/// The middle value, 0 for an empty list; sorts its input.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The mean pose of a track over its first `seconds`, and how many rows it rests on; orientation only where
/// every row has one.
pub fn first_rest(stream: &PoseStream, seconds: f64) -> Option<(Isometry3<f64>, usize)> {
    let start = *stream.time.first()?;
    let rows: Vec<usize> = (0..stream.len())
        .take_while(|&i| stream.time[i] <= start + seconds)
        .filter(|&i| stream.position[i].x.is_finite())
        .collect();
    let first = stream.rotation[*rows.first()?].unwrap_or_else(UnitQuaternion::identity);
    let count = rows.len() as f64;
    let position = rows.iter().map(|&i| stream.position[i].coords).sum::<Vector3<f64>>() / count;
    let turn = rows
        .iter()
        .filter_map(|&i| stream.rotation[i])
        .map(|q| (q * first.inverse()).scaled_axis())
        .sum::<Vector3<f64>>()
        / count;
    let rotation = UnitQuaternion::from_scaled_axis(turn) * first;
    Some((Isometry3::from_parts(position.into(), rotation), rows.len()))
}
