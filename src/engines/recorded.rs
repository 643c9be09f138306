//! A capture's touches as trials for an engine, with what was measured of each.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};

use super::astray::set_right;
use super::table::Skipped;
use crate::base::{Pose, Result};
use crate::capture::{Capture, Interaction, Kind, PoseStream, Tool, ToolShape, first_rest};
use crate::export::{Hold, Trial, TrialShape};
use crate::geometry::parse_mesh;
use crate::twin::Model;

/// Rows over which a pose at rest is averaged, s.
const REST: f64 = 0.1;
/// Half the window over which a tool's way is averaged, s: what an encoder jitters is not a speed.
const JITTER: f64 = 0.004;
/// A thing that leans by more than this, rad, against the first view is placed as measured; one that does not stands as
/// the exports have it, for the noise of a track must not tip it.
const LEANS: f64 = 0.05;
/// The same for its height, m.
const RISES: f64 = 5e-3;
/// How well the place of a tool's tip is taken to be known, m.
pub(super) const TIP: f64 = 1e-3;
/// Noise of a motion, m and rad, where the capture states none; and the least that is believed.
const TRACKED: [f64; 2] = [3e-4, 5e-3];
const FINEST: [f64; 2] = [1e-4, 1e-3];
/// Friction between tool and thing where none was measured.
pub const ASSUMED_TOOL_FRICTION: f64 = 0.4;

/// A touch to be played, and what came of it.
pub struct Recorded {
    /// What is played.
    pub trial: Trial,
    /// Squeezed against the support: judged by its force, in engines whose contacts yield.
    pub press: bool,
    /// Never used to fit.
    pub held_out: bool,
    /// No friction against the tool is known; [`ASSUMED_TOOL_FRICTION`] stands for it.
    pub friction_assumed: bool,
    /// World-from-link of the target, at rest before and after; no orientation where none was tracked.
    pub before: Pose,
    /// The same after.
    pub after: Pose,
    /// By how much the tool's way was shifted, m, so that it touches when the force says.
    pub shifted: Option<f64>,
    /// Its orientation was tracked.
    pub oriented: bool,
    /// Away from the table.
    pub up: UnitVector3<f64>,
    /// How well its motion is known by the tracks: 1 sd of the place, m, and of the turn, rad.
    pub noise: [f64; 2],
    /// Seconds from the trial's start and force of the tool on the target, N, world.
    pub force: Vec<(f64, Vector3<f64>)>,
}

/// Every touch that engines can play, in the order of the capture, and why others cannot be.
///
/// # Errors
/// Where the mesh of a tool cannot be read.
pub fn recorded(capture: &Capture, model: &Model) -> Result<(Vec<Recorded>, Vec<Skipped>)> {
    let (mut touches, mut skipped) = (Vec::new(), Vec::new());
    let mut now: BTreeMap<String, Pose> = BTreeMap::new();
    for interaction in &capture.interactions {
        let mut start = now.clone();
        for (name, track) in &interaction.tracks {
            start.extend(first_rest(track, REST).map(|(pose, _)| (name.clone(), Pose(pose))));
        }
        match touch(capture, model, interaction, &start)? {
            Ok(touch) => touches.push(touch),
            Err(why) => skipped.push(Skipped {
                interaction: interaction.name.clone(),
                why: why.into(),
            }),
        }
        for (name, track) in &interaction.tracks {
            now.extend(last_rest(track).map(|pose| (name.clone(), pose)));
        }
    }
    set_right(model, &mut touches)?;
    Ok((touches, skipped))
}

type Touch = std::result::Result<Recorded, &'static str>;

fn touch(capture: &Capture, model: &Model, interaction: &Interaction, start: &BTreeMap<String, Pose>) -> Result<Touch> {
    let Some(tool) = interaction.tool.as_ref() else {
        return Ok(Err("no tool touched anything"));
    };
    let hold = match (interaction.kind, tool) {
        (Kind::Push | Kind::Pull, Tool { grip: true, .. }) => Hold::Grip,
        (Kind::Push | Kind::Pull, Tool { pin: true, .. }) => Hold::Pin,
        (Kind::Push | Kind::Pull, _) => Hold::Touch,
        (
            Kind::Press,
            Tool {
                grip: false,
                pin: false,
                ..
            },
        ) => Hold::Touch,
        (Kind::Lift, _) => return Ok(Err("a lift: what is held goes where the hand goes in every engine")),
        _ => return Ok(Err("no tool pushed or pulled")),
    };
    let Some(path) = &interaction.tool_path else {
        return Ok(Err("the tool's way was not recorded"));
    };
    let Some((target, track)) = target(model, interaction) else {
        return Ok(Err("no link of the twin was tracked"));
    };
    let (Some((before, _)), Some(after)) = (first_rest(track, REST), last_rest(track)) else {
        return Ok(Err("the track has no pose"));
    };
    let Some((zero, time, path)) = way(path, track) else {
        return Ok(Err("the tool's way has no whole row while the thing was tracked"));
    };
    let Some(link) = model.twin.link(&target) else {
        return Ok(Err("no such link in the twin"));
    };
    let up = capture.support.as_ref().map_or(Vector3::z_axis(), |s| s.normal);
    let placed = start.iter().filter_map(|(name, pose)| {
        let first = model.twin.link(name)?.pose;
        Some((name.clone(), standing(&first, pose, &up)))
    });
    let friction = link.friction.tool.as_ref().map(|e| e.value);
    let press = interaction.kind == Kind::Press;
    if press && link.stiffness.is_none() {
        return Ok(Err("a press: how stiff it is was not measured"));
    }
    let force = force(interaction, zero);
    let trial = Trial {
        name: interaction.name.clone(),
        target,
        shape: shape(tool)?,
        hold,
        friction: friction.unwrap_or(ASSUMED_TOOL_FRICTION),
        time,
        path,
        start: placed.collect(),
        present: interaction.tracks.keys().cloned().collect(),
    };
    Ok(Ok(Recorded {
        shifted: None,
        press,
        held_out: interaction.held_out,
        friction_assumed: friction.is_none() && hold == Hold::Touch,
        before: Pose(before),
        after,
        oriented: track.rotation.iter().any(Option::is_some),
        up,
        noise: noise(capture, track),
        force,
        trial,
    }))
}

/// The link that the tool meant, or the tracked one that moved furthest.
fn target<'a>(model: &Model, interaction: &'a Interaction) -> Option<(String, &'a PoseStream)> {
    let known = |name: &&String| model.twin.link(name).is_some_and(|l| l.mesh.is_some());
    let named = interaction.target.as_ref().filter(known);
    if let Some((name, track)) = named.and_then(|n| interaction.tracks.get_key_value(n)) {
        return Some((name.clone(), track));
    }
    let way = |track: &PoseStream| {
        let ends = first_rest(track, REST).zip(last_rest(track));
        ends.map_or(0.0, |((a, _), b)| (a.translation.vector - b.translation.vector).norm())
    };
    let tracked = interaction.tracks.iter().filter(|(n, _)| known(n));
    let furthest = tracked.max_by(|a, b| way(a.1).total_cmp(&way(b.1)));
    furthest.map(|(name, track)| (name.clone(), track))
}

/// The mean pose of the last tenth of a second of a track.
fn last_rest(track: &PoseStream) -> Option<Pose> {
    let end = *track.time.last()?;
    let from = track.time.partition_point(|t| *t < end - REST);
    let tail = PoseStream {
        time: track.time[from..].to_vec(),
        position: track.position[from..].to_vec(),
        rotation: track.rotation[from..].to_vec(),
    };
    first_rest(&tail, f64::INFINITY).map(|(pose, _)| Pose(pose))
}

/// How well means over both ends of a track tell the motion between them: by the stated noise, or where none is by what
/// a tracker is good for.
fn noise(capture: &Capture, track: &PoseStream) -> [f64; 2] {
    let (Some(first), Some(last)) = (track.time.first(), track.time.last()) else {
        return TRACKED;
    };
    let near = |t: &f64, end: &f64| (t - end).abs() < REST;
    let rows = |end: &f64| track.time.iter().filter(|t| near(t, end)).count().max(1) as f64;
    let over = (1.0 / rows(first) + 1.0 / rows(last)).sqrt();
    let stated = [capture.noise.position, capture.noise.rotation];
    std::array::from_fn(|k| stated[k].map_or(TRACKED[k], |sd| (sd * over).max(FINEST[k])))
}

/// When the trial begins on the capture's clock, its times from there, and the tool's poses, each the mean over a short
/// window; from the beginning of the way to its end or that of the track, whichever is first.
fn way(path: &PoseStream, track: &PoseStream) -> Option<(f64, Vec<f64>, Vec<Pose>)> {
    let end = track.time.last()?.min(*path.time.last()?);
    let whole = |i: &usize| path.position[*i].coords.iter().all(|x| x.is_finite()) && path.time[*i] <= end;
    let rows: Vec<usize> = (0..path.len()).filter(whole).collect();
    let zero = path.time[*rows.first()?];
    let mut poses = Vec::new();
    for &i in &rows {
        let near = rows.iter().filter(|j| (path.time[**j] - path.time[i]).abs() <= JITTER);
        let (sum, count) = near.fold((Vector3::zeros(), 0.0), |(s, n), j| {
            (s + path.position[*j].coords, n + 1.0)
        });
        let turn = path.rotation[i].unwrap_or_else(UnitQuaternion::identity);
        poses.push(Pose(Isometry3::from_parts((sum / count).into(), turn)));
    }
    Some((zero, rows.iter().map(|i| path.time[*i] - zero).collect(), poses))
}

/// Where a thing starts: shifted over the table and turned about its normal as measured, upright as at the first view
/// unless it was measured to lean or to stand higher.
fn standing(first: &Pose, measured: &Pose, up: &UnitVector3<f64>) -> Pose {
    let turn = measured.rotation * first.rotation.inverse();
    let (_, twist) = swing_twist(&turn, up);
    let leans = (turn * twist.inverse()).angle();
    let shift = measured.translation.vector - first.translation.vector;
    let rise = shift.dot(up);
    if leans > LEANS || rise.abs() > RISES {
        return *measured;
    }
    let place = first.translation.vector + shift - up.into_inner() * rise;
    Pose(Isometry3::from_parts(place.into(), twist * first.rotation))
}

/// A rotation as a turn about `axis` followed by one about an axis across it.
pub fn swing_twist(turn: &UnitQuaternion<f64>, axis: &UnitVector3<f64>) -> (UnitQuaternion<f64>, UnitQuaternion<f64>) {
    let along = turn.imag().dot(axis);
    let twist = UnitQuaternion::from_axis_angle(axis, 2.0 * along.atan2(turn.w));
    (turn * twist.inverse(), twist)
}

fn shape(tool: &Tool) -> Result<TrialShape> {
    Ok(match &tool.shape {
        ToolShape::Sphere { radius } => TrialShape::Sphere { radius: *radius },
        ToolShape::Box { half } => TrialShape::Box { half: (*half).into() },
        ToolShape::Cylinder { radius, half_height } => TrialShape::Cylinder {
            radius: *radius,
            half_height: *half_height,
        },
        ToolShape::Mesh(file) => TrialShape::Hull {
            points: hull(&parse_mesh(&file.path, &file.bytes)?.vertices),
        },
    })
}

fn hull(points: &[Point3<f64>]) -> Vec<[f64; 3]> {
    points.iter().map(|p| p.coords.into()).collect()
}

fn force(interaction: &Interaction, zero: f64) -> Vec<(f64, Vector3<f64>)> {
    let Some(stream) = &interaction.force else {
        return Vec::new();
    };
    let rows = stream.time.iter().map(|t| t - zero).zip(stream.force.iter().copied());
    rows.filter(|(_, f)| f.iter().all(|x| x.is_finite())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_does_not_tip_what_stands() {
        let first = Pose::from_seven([0.1, 0.0, 0.03, 0.0, 0.0, 0.0, 1.0]);
        let turned = UnitQuaternion::from_scaled_axis(Vector3::new(0.01, -0.01, 0.8));
        let measured = Pose(Isometry3::from_parts(Vector3::new(0.2, 0.1, 0.031).into(), turned));
        let placed = standing(&first, &measured, &Vector3::z_axis());
        let up = placed.rotation * Vector3::z();
        assert!((up - Vector3::z()).norm() < 1e-12);
        assert!((placed.translation.vector - Vector3::new(0.2, 0.1, 0.03)).norm() < 1e-12);
        assert!((placed.rotation.angle() - 0.8).abs() < 1e-3);
    }
}
