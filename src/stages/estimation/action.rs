//! Turns a recorded interaction into the command that was given, without anything of its outcome.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};

use crate::base::Pose;
use crate::capture::{Capture, Interaction, PhaseKind, PoseStream, Segmented, ToolShape};
use crate::math::{freed, mean_rotation, median};
use crate::physics::{Action, Hold, ToolMotion};
use crate::twin::{Body, Model};

/// The support's normal, or straight up.
pub fn support_normal(capture: &Capture, model: &Model) -> UnitVector3<f64> {
    let given = model.twin.support.as_ref().map(|s| Vector3::from(s.normal));
    let up = given
        .or_else(|| (-capture.gravity).try_normalize(1e-9))
        .unwrap_or_else(Vector3::z);
    UnitVector3::new_normalize(up)
}

/// Seconds at the start in which nothing happens yet.
pub fn first_rest(interaction: &Interaction, segmented: Option<&Segmented>) -> (f64, f64) {
    let start = interaction
        .tracks
        .values()
        .filter_map(|t| t.time.first())
        .fold(f64::INFINITY, |a, b| a.min(*b));
    let rest = segmented
        .and_then(|s| s.phases.first())
        .filter(|p| p.kind == PhaseKind::Rest);
    rest.map_or((start, start + 0.1), |p| (p.start, p.end))
}

/// World-from-link before anything happened: the robust mean of the track's samples at rest.
pub fn rest_pose(track: &PoseStream, rest: (f64, f64)) -> Option<Pose> {
    let mut rows: Vec<usize> = (0..track.len()).filter(|i| track.time[*i] <= rest.1).collect();
    if rows.is_empty() || track.is_snapshot_pair() {
        rows = vec![0];
    }
    let axis = |k: usize| median(&rows.iter().map(|i| track.position[*i].coords[k]).collect::<Vec<_>>());
    let position = Vector3::new(axis(0)?, axis(1)?, axis(2)?);
    let turns: Vec<UnitQuaternion<f64>> = rows.iter().filter_map(|i| track.rotation[*i]).collect();
    let rotation = mean_rotation(&turns).unwrap_or_else(UnitQuaternion::identity);
    Some(Pose(Isometry3::from_parts(position.into(), rotation)))
}

/// World-from-link of every link at the start of the interaction: as tracked, else carried along with its
/// body, else as at the first view.
pub fn start_poses(
    capture: &Capture,
    interaction: &Interaction,
    rest: (f64, f64),
    model: &Model,
) -> BTreeMap<String, Pose> {
    let tracked: BTreeMap<&str, Pose> = interaction
        .tracks
        .iter()
        .filter_map(|(name, t)| Some((name.as_str(), rest_pose(t, rest)?)))
        .collect();
    let mut start = BTreeMap::new();
    let here = |body: &&Body| !taken_away(capture, interaction, body);
    for body in model.twin.bodies.iter().filter(here) {
        let moved = body
            .links
            .iter()
            .find_map(|l| Some(*tracked.get(l.name.as_str())? * l.pose.inverse()));
        for link in &body.links {
            let carried = moved.unwrap_or_else(Pose::identity) * link.pose;
            start.insert(
                link.name.clone(),
                tracked.get(link.name.as_str()).copied().unwrap_or(carried),
            );
        }
    }
    start
}

/// Whether something is seen where the same thing is handled at other times, and not now that that is seen: it was taken away, or not
/// put there yet.
fn taken_away(capture: &Capture, interaction: &Interaction, body: &Body) -> bool {
    let sees = |i: &Interaction| body.links.iter().any(|l| i.tracks.contains_key(&l.name));
    let Some(target) = interaction
        .target
        .as_ref()
        .filter(|t| interaction.tracks.contains_key(*t))
    else {
        return false;
    };
    let alike = |i: &&Interaction| i.target.as_ref() == Some(target) && i.tracks.contains_key(target);
    !sees(interaction) && capture.interactions.iter().filter(alike).any(sees)
}

/// A path of the tool freed of its noise: played back, a finger that trembles would let go of what it pushes.
fn steady(time: &[f64], path: &[Point3<f64>]) -> Vec<Point3<f64>> {
    let mut out = path.to_vec();
    for k in 0..3 {
        let seen: Vec<f64> = path.iter().map(|p| p[k]).collect();
        for (p, value) in out.iter_mut().zip(freed(time, &seen).map_or(seen, |f| f.values)) {
            p[k] = value;
        }
    }
    out
}

/// By how much a tool has turned about `axis` since the first row of its path, rad, freed of its noise; empty where a row does not
/// tell.
fn turned_about(path: &PoseStream, axis: &UnitVector3<f64>) -> Vec<f64> {
    let mut sum = 0.0;
    let step = |pair: &[Option<UnitQuaternion<f64>>]| {
        let (from, to) = (pair[0]?, pair[1]?);
        sum += (to * from.inverse()).scaled_axis().dot(axis);
        Some(sum)
    };
    let Some(rest) = path.rotation.windows(2).map(step).collect::<Option<Vec<f64>>>() else {
        return Vec::new();
    };
    let seen: Vec<f64> = std::iter::once(0.0).chain(rest).collect();
    freed(&path.time, &seen).map_or(seen, |f| f.values)
}

/// How far the face of a box that goes ahead is from its middle, m; nothing where its orientation is not known.
fn ahead(half: &Vector3<f64>, path: &PoseStream) -> Option<f64> {
    let from = path.position.iter().find(|p| p.iter().all(|x| x.is_finite()))?;
    let gone = |i: &usize| (path.position[*i] - from).norm();
    let known = (0..path.len()).filter(|i| gone(i).is_finite());
    let farthest = known.max_by(|a, b| gone(a).total_cmp(&gone(b)))?;
    let way = path.rotation[farthest]?.inverse() * (path.position[farthest] - from).try_normalize(1e-6)?;
    let leaves = |k: &usize| half[*k] / way[*k].abs().max(1e-9);
    (0..3).min_by(|a, b| leaves(a).total_cmp(&leaves(b))).map(|k| half[k])
}

/// The command of a push, pull, press or lift; nothing where tool or path are missing.
pub fn action_of(
    capture: &Capture,
    interaction: &Interaction,
    segmented: Option<&Segmented>,
    model: &Model,
) -> Option<Action> {
    let tool = interaction.tool.as_ref()?;
    let path = interaction.tool_path.as_ref()?;
    let target = interaction
        .target
        .clone()
        .or_else(|| interaction.tracks.keys().next().cloned())?;
    let radius = match &tool.shape {
        ToolShape::Sphere { radius } | ToolShape::Cylinder { radius, .. } => *radius,
        ToolShape::Box { half } => ahead(half, path).unwrap_or(half.x.min(half.y)),
        ToolShape::Mesh(_) => 0.0,
    };
    let hold = match (tool.grip, tool.pin) {
        (true, _) => Hold::Grip,
        (_, true) => Hold::Pin,
        _ => Hold::Push,
    };
    let normal = support_normal(capture, model);
    Some(Action {
        target,
        tool: ToolMotion {
            radius,
            hold,
            time: path.time.clone(),
            position: steady(&path.time, &path.position),
            turned: if hold == Hold::Grip {
                turned_about(path, &normal)
            } else {
                Vec::new()
            },
        },
        start: start_poses(capture, interaction, first_rest(interaction, segmented), model),
        gravity: -capture.gravity.dot(&normal),
        normal,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_goes_ahead_with_the_face_that_its_path_leaves_it_through() {
        let path = |turn: f64| PoseStream {
            time: vec![0.0, 1.0],
            position: vec![Point3::origin(), Point3::new(0.05, 0.0, 0.0)],
            rotation: vec![Some(UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn)); 2],
        };
        let half = Vector3::new(0.012, 0.004, 0.01);
        let reach = |turn: f64| ahead(&half, &path(turn)).expect("a face");
        assert!((reach(0.0) - 0.012).abs() < 1e-12 && (reach(0.2) - 0.012).abs() < 1e-12);
        assert!((reach(1.5) - 0.004).abs() < 1e-12);
        let mut unknown = path(0.0);
        unknown.rotation = vec![None; 2];
        assert!(ahead(&half, &unknown).is_none());
    }
}
