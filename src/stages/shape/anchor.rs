//! Where the bodies that have a name are at the first view: the frames of tracks and of what is known beforehand.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};

use crate::base::Pose;
use crate::capture::{Capture, PoseStream};

/// Longest stretch at the beginning of a track that is averaged, s.
const REST: f64 = 0.5;

/// The frame of each named body, or `body/link`, before anything was done.
pub fn anchors(capture: &Capture) -> BTreeMap<String, Pose> {
    let mut first: BTreeMap<&str, (f64, Pose)> = BTreeMap::new();
    for (name, track) in capture.interactions.iter().flat_map(|i| &i.tracks) {
        let Some((time, pose)) = rest_pose(track) else { continue };
        if first.get(name.as_str()).is_none_or(|(known, _)| time < *known) {
            first.insert(name, (time, pose));
        }
    }
    let mut out: BTreeMap<String, Pose> = first.into_iter().map(|(n, (_, pose))| (n.to_string(), pose)).collect();
    for body in &capture.bodies {
        if let Some(pose) = body.world_from_body {
            out.insert(body.name.clone(), pose);
        }
    }
    out
}

/// The mean pose before the body first moves, and the time of its first row. A track without orientation gets
/// the axes of the world.
fn rest_pose(track: &PoseStream) -> Option<(f64, Pose)> {
    let rows: Vec<usize> = (0..track.time.len())
        .filter(|i| track.position[*i].coords.iter().all(|x| x.is_finite()))
        .collect();
    let begin = track.time[*rows.first()?];
    let resting = still_rows(track, &rows);
    let mean = resting.iter().map(|i| track.position[*i].coords).sum::<Vector3<f64>>() / resting.len() as f64;
    let turns: Vec<UnitQuaternion<f64>> = resting.iter().filter_map(|i| track.rotation[*i]).collect();
    let rotation = mean_rotation(&turns);
    Some((begin, Pose(Isometry3::from_parts(mean.into(), rotation))))
}

/// The rows from the first on that stay within 4 sd of the running mean, the sd from the differences of
/// neighbouring rows.
fn still_rows(track: &PoseStream, rows: &[usize]) -> Vec<usize> {
    let soon: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|i| track.time[*i] <= track.time[rows[0]] + REST)
        .collect();
    let mut steps: Vec<f64> = soon
        .windows(2)
        .map(|w| (track.position[w[1]] - track.position[w[0]]).norm())
        .collect();
    if soon.len() < 5 {
        return vec![rows[0]];
    }
    steps.sort_by(f64::total_cmp);
    // The median length of a difference of two readings is 1.54 * sqrt(2) sd per axis.
    let sd = (steps[steps.len() / 2] / 2.18).max(2e-5);
    let mut still = vec![soon[0]];
    let mut sum = track.position[soon[0]].coords;
    for window in soon.windows(3).map(|w| [w[0], w[1], w[2]]) {
        let mean = sum / still.len() as f64;
        let spread = sd * (4.0 + 4.0 / (still.len() as f64).sqrt());
        let moved = window[1..]
            .iter()
            .all(|i| (track.position[*i].coords - mean).norm() > spread);
        if moved {
            break;
        }
        still.push(window[1]);
        sum += track.position[window[1]].coords;
    }
    still
}

/// The mean of nearby rotations, by their quaternions with signs aligned (Markley et al. 2007, small spread).
fn mean_rotation(turns: &[UnitQuaternion<f64>]) -> UnitQuaternion<f64> {
    let Some(first) = turns.first() else {
        return UnitQuaternion::identity();
    };
    let sum = turns.iter().fold(Quaternion::new(0.0, 0.0, 0.0, 0.0), |sum, q| {
        let sign = if q.coords.dot(&first.coords) < 0.0 { -1.0 } else { 1.0 };
        sum + q.into_inner() * sign
    });
    UnitQuaternion::try_new(sum, 1e-9).unwrap_or(*first)
}

/// Origins of frames as points of another frame.
pub fn origins(anchors: &BTreeMap<String, Pose>, field_from_world: &Isometry3<f64>) -> Vec<(String, Point3<f64>)> {
    anchors
        .iter()
        .map(|(name, pose)| (name.clone(), field_from_world * Point3::from(pose.translation.vector)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rest_before_a_shove_is_averaged_and_the_shove_is_not() {
        let noise = |i: usize| 4e-4 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
        let mut track = PoseStream::default();
        for i in 0..120 {
            let time = i as f64 / 120.0;
            let moved = (time - 0.3_f64).max(0.0) * 0.2;
            track.time.push(time);
            track
                .position
                .push(Point3::new(noise(i) + moved, noise(i + 31), noise(i + 57)));
            track.rotation.push(None);
        }
        let (_, pose) = rest_pose(&track).expect("a pose");
        assert!(pose.translation.vector.norm() < 4e-4, "{:?}", pose.translation.vector);
    }

    #[test]
    fn a_snapshot_pair_gives_its_first_row() {
        let track = PoseStream {
            time: vec![0.0, 1.0],
            position: vec![Point3::new(1.0, 2.0, 3.0), Point3::new(4.0, 5.0, 6.0)],
            rotation: vec![None, None],
        };
        let (_, pose) = rest_pose(&track).expect("a pose");
        assert_eq!(pose.translation.vector, Vector3::new(1.0, 2.0, 3.0));
    }
}
