//! What the streams say at one time: smoothed poses with derivatives, wrenches averaged over a block.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::capture::{Interaction, PoseStream, Segmented, WrenchStream};
use crate::math::{LocalFit, interpolate, local_quadratic};

/// Pose and motion of a tracked frame at one time, world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionState {
    /// World-from-link.
    pub pose: Isometry3<f64>,
    /// Of the link's origin, m/s.
    pub velocity: Vector3<f64>,
    /// rad/s.
    pub spin: Vector3<f64>,
    /// rad/s².
    pub spin_rate: Vector3<f64>,
    /// Of the link's origin, m/s².
    pub acceleration: Vector3<f64>,
    /// Standard deviation of the velocity per axis for unit position noise, 1/s.
    pub velocity_gain: f64,
}

/// A local parabola through one component of a stream.
fn component(stream: &PoseStream, values: impl Fn(usize) -> f64, t: f64, half: f64) -> Option<LocalFit> {
    let from = stream.time.partition_point(|x| *x < t - half);
    let to = stream.time.partition_point(|x| *x <= t + half);
    let values: Vec<f64> = (from..to).map(values).collect();
    local_quadratic(&stream.time[from..to], &values, t, half)
}

/// Smoothed pose and derivatives of a track at `t` from the rows within `half` seconds.
pub(super) fn motion_at(stream: &PoseStream, t: f64, half: f64) -> Option<MotionState> {
    let position = |k: usize| component(stream, |i| stream.position[i][k], t, half);
    let p = [position(0)?, position(1)?, position(2)?];
    let near = stream.time.partition_point(|x| *x < t).min(stream.len() - 1);
    // Rows of which the orientation was not told tell nothing of it.
    let told = |i: &usize| stream.rotation[*i].is_some() && (stream.time[*i] - t).abs() <= half;
    let reference = (0..stream.len())
        .filter(told)
        .min_by_key(|i| i.abs_diff(near))
        .and_then(|i| stream.rotation[i]);
    // Of what is told elsewhere nothing is known here.
    if reference.is_none() && stream.rotation.iter().any(Option::is_some) {
        return None;
    }
    let still = Vector3::zeros();
    let (rotation, spin, spin_rate) = match reference {
        Some(q0) => {
            let vector =
                |i: usize, k: usize| stream.rotation[i].map_or(f64::NAN, |q| (q * q0.inverse()).scaled_axis()[k]);
            let r = [0, 1, 2].map(|k| component(stream, |i| vector(i, k), t, half));
            match r {
                [Some(x), Some(y), Some(z)] => (
                    UnitQuaternion::from_scaled_axis(Vector3::new(x.value, y.value, z.value)) * q0,
                    Vector3::new(x.velocity, y.velocity, z.velocity),
                    Vector3::new(x.acceleration, y.acceleration, z.acceleration),
                ),
                _ => (q0, still, still),
            }
        }
        None => (UnitQuaternion::identity(), still, still),
    };
    Some(MotionState {
        pose: Isometry3::from_parts(Point3::new(p[0].value, p[1].value, p[2].value).coords.into(), rotation),
        velocity: Vector3::new(p[0].velocity, p[1].velocity, p[2].velocity),
        spin,
        spin_rate,
        acceleration: Vector3::new(p[0].acceleration, p[1].acceleration, p[2].acceleration),
        velocity_gain: p[0].gain[1],
    })
}

/// Mean wrench over a stretch of time, tare taken off.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeanWrench {
    /// N, on the body, world axes.
    pub force: Vector3<f64>,
    /// N·m about the tool's origin, where the sensor has torque.
    pub torque: Option<Vector3<f64>>,
    /// Rows that it is the mean of.
    pub rows: usize,
}

/// What the sensor reads without contact: force, and torque where it has torque.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tare {
    pub force: Vector3<f64>,
    pub torque: Vector3<f64>,
}

/// The tare of an interaction from the rows before its first contact.
pub(super) fn tare_of(interaction: &Interaction, segmented: &Segmented) -> Tare {
    let force = segmented.force_tare.unwrap_or_default();
    let before = segmented
        .phases
        .iter()
        .find(|p| {
            !matches!(
                p.kind,
                crate::capture::PhaseKind::Rest | crate::capture::PhaseKind::Approach
            )
        })
        .map_or(0.0, |p| p.start);
    let quiet = interaction
        .force
        .as_ref()
        .and_then(|s| mean_wrench(s, s.time.first().copied()?, before, &Tare::default()));
    let torque = quiet
        .filter(|q| q.rows >= 20 && segmented.preload.is_none())
        .and_then(|q| q.torque)
        .unwrap_or_default();
    Tare { force, torque }
}

/// Mean of the rows between two times; `None` where there is none.
pub(super) fn mean_wrench(stream: &WrenchStream, start: f64, end: f64, tare: &Tare) -> Option<MeanWrench> {
    let from = stream.time.partition_point(|x| *x < start);
    let to = stream.time.partition_point(|x| *x <= end);
    let mean = |values: &[Vector3<f64>]| {
        let rows: Vec<_> = values[from..to]
            .iter()
            .filter(|v| v.iter().all(|x| x.is_finite()))
            .collect();
        let sum: Vector3<f64> = rows.iter().copied().sum();
        (!rows.is_empty()).then(|| (sum / rows.len() as f64, rows.len()))
    };
    let (force, rows) = mean(&stream.force)?;
    let torque = stream
        .torque
        .as_ref()
        .and_then(|t| mean(t))
        .map(|(t, _)| t - tare.torque);
    Some(MeanWrench {
        force: force - tare.force,
        torque,
        rows,
    })
}

/// Position of the tool at `t`, m, world.
pub(super) fn tool_at(path: &PoseStream, t: f64) -> Option<Point3<f64>> {
    let axis = |k: usize| {
        let values: Vec<f64> = path.position.iter().map(|p| p[k]).collect();
        interpolate(&path.time, &values, t)
    };
    // Averages out the encoder noise where samples are dense; falls back to interpolation.
    let smooth = |k: usize| component(path, |i| path.position[i][k], t, 0.01).map(|f| f.value);
    let value = |k: usize| smooth(k).or_else(|| axis(k));
    Some(Point3::new(value(0)?, value(1)?, value(2)?))
}

/// A dense track from a snapshot pair: the pose moves from the first to the second in step with the distance
/// that the tool travels in contact. Only so far as the motion was straight in that measure is it right.
pub(super) fn bridge_snapshots(track: &PoseStream, tool: &PoseStream, start: f64, end: f64) -> Option<PoseStream> {
    let (first, last) = (track.pose(0)?, track.pose(track.len() - 1)?);
    let rows: Vec<usize> = (0..tool.len())
        .filter(|&i| tool.time[i] >= start && tool.time[i] <= end)
        .collect();
    let mut travelled = vec![0.0];
    for pair in rows.windows(2) {
        let step = (tool.position[pair[1]] - tool.position[pair[0]]).norm();
        travelled.push(travelled.last()? + if step.is_finite() { step } else { 0.0 });
    }
    let total = *travelled.last()?;
    if total <= 0.0 {
        return None;
    }
    let poses = travelled.iter().map(|s| {
        let share = s / total;
        let p = first.translation.vector.lerp(&last.translation.vector, share);
        (Point3::from(p), first.rotation.slerp(&last.rotation, share))
    });
    let (position, rotation): (Vec<_>, Vec<_>) = poses.map(|(p, q)| (p, Some(q))).unzip();
    Some(PoseStream {
        time: rows.iter().map(|&i| tool.time[i]).collect(),
        position,
        rotation,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body that turns by 0.5 rad/s; of some of its rows no orientation is known.
    fn turning(lost: impl Fn(usize) -> bool) -> PoseStream {
        let time: Vec<f64> = (0..50).map(|i| 0.01 * f64::from(i)).collect();
        let turned = |i: usize| UnitQuaternion::from_scaled_axis(Vector3::z() * (0.3 + 0.5 * time[i]));
        PoseStream {
            position: vec![Point3::new(0.1, 0.0, 0.0); time.len()],
            rotation: (0..time.len()).map(|i| (!lost(i)).then(|| turned(i))).collect(),
            time,
        }
    }

    #[test]
    fn where_one_row_is_lost_its_neighbours_tell_how_it_turns() {
        let motion = motion_at(&turning(|i| i == 20), 0.2, 0.05).expect("rows beside it");
        assert!((motion.pose.rotation.angle() - 0.4).abs() < 1e-6 && (motion.spin.z - 0.5).abs() < 1e-6);
    }

    #[test]
    fn where_all_near_rows_are_lost_nothing_is_known() {
        assert!(motion_at(&turning(|i| (10..30).contains(&i)), 0.2, 0.05).is_none());
        // What is tracked as a point has no orientation anywhere.
        assert!(motion_at(&turning(|_| true), 0.2, 0.05).is_some());
    }
}
