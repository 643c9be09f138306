//! The same capture as it would have been recorded elsewhere: another place and turn of the table in the room, another
//! zero of the clock. What is found in it must not change.

use nalgebra::Isometry3;
use palpate::base::Pose;
use palpate::capture::{Capture, PoseStream};

/// The capture with all that it holds carried along by `by`.
pub fn moved(capture: &Capture, by: &Isometry3<f64>) -> Capture {
    let mut other = capture.clone();
    other.gravity = by.rotation * other.gravity;
    if let Some(support) = &mut other.support {
        support.point = by * support.point;
        support.normal = by.rotation * support.normal;
    }
    for view in &mut other.views {
        carry(&mut view.world_from_camera, by);
    }
    for pose in other.bodies.iter_mut().filter_map(|b| b.world_from_body.as_mut()) {
        carry(pose, by);
    }
    for touch in &mut other.interactions {
        if let Some(force) = &mut touch.force {
            let torque = force.torque.iter_mut().flatten();
            for vector in force.force.iter_mut().chain(torque) {
                *vector = by.rotation * *vector;
            }
        }
        if let Some(normals) = &mut touch.support_path {
            for normal in &mut normals.vector {
                *normal = by.rotation * *normal;
            }
        }
        for path in touch.tool_path.iter_mut().chain(touch.tracks.values_mut()) {
            carry_path(path, by);
        }
        if let Some(frames) = &mut touch.frames {
            if let Some(pose) = &mut frames.world_from_camera {
                carry(pose, by);
            }
            if let Some(path) = &mut frames.poses {
                carry_path(path, by);
            }
        }
    }
    other
}

fn carry(pose: &mut Pose, by: &Isometry3<f64>) {
    pose.0 = by * pose.0;
}

fn carry_path(path: &mut PoseStream, by: &Isometry3<f64>) {
    for position in &mut path.position {
        *position = by * *position;
    }
    for rotation in path.rotation.iter_mut().flatten() {
        *rotation = by.rotation * *rotation;
    }
}

/// The capture as a clock that is `seconds` ahead would have timed it.
pub fn later(capture: &Capture, seconds: f64) -> Capture {
    let mut other = capture.clone();
    for view in &mut other.views {
        view.time += seconds;
    }
    for touch in &mut other.interactions {
        let mut times: Vec<&mut Vec<f64>> = Vec::new();
        times.extend(touch.force.as_mut().map(|s| &mut s.time));
        times.extend(touch.support_path.as_mut().map(|s| &mut s.time));
        times.extend(touch.tool_path.as_mut().map(|s| &mut s.time));
        times.extend(touch.tracks.values_mut().map(|s| &mut s.time));
        if let Some(frames) = &mut touch.frames {
            times.push(&mut frames.time);
            times.extend(frames.poses.as_mut().map(|s| &mut s.time));
        }
        for time in times.into_iter().flatten() {
            *time += seconds;
        }
    }
    other
}
