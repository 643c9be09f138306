//! Pushes and pulls along the table, predicted and laid beside what was measured.

use nalgebra::Vector3;

use super::action::{first_rest, rest_pose};
use super::predict::{Outcome, Scene};
use super::{Curve, Quantity};
use crate::base::Pose;
use crate::capture::PoseStream;
use crate::math::interpolate;
use crate::physics::{Action, Hold, Prediction, PushPrediction, predict_push};

/// The reconstructed surface may be off by this much, m.
const LARGEST_GAP: f64 = 0.008;
/// Seconds after first contact in which static friction and presliding rule: the model does not say.
const SETTLE: f64 = 0.25;
/// Below this speed the tool stands, and the force of a standing tool is not determined, m/s.
const STANDING: f64 = 2e-3;

/// Force along the motion and the motion of every tracked link.
pub fn slide_curves(scene: &Scene, action: &Action) -> Outcome {
    let direction = travel_direction(action).ok_or("the tool does not move along the support")?;
    let (gap, found) = fit_gap(scene, action, &direction)
        .ok_or("friction or shape of what is moved is not known, or its joint is out of the plane")?;
    let mut curves = Vec::new();
    curves.extend(force_curve(scene, action, &found, &direction));
    for (name, track) in &scene.interaction.tracks {
        curves.extend(motion_curves(scene, name, track, &found.prediction, &direction));
    }
    let remark = (action.tool.hold == Hold::Push).then(|| {
        format!(
            "the tool met the surface {:.1} mm from where the mesh has it (fitted anew)",
            gap * 1e3
        )
    });
    Ok((curves, remark))
}

/// Unit direction from the first to the farthest point of the tool's way, along the support.
fn travel_direction(action: &Action) -> Option<Vector3<f64>> {
    let first = action.tool.position.first()?;
    let finite = action
        .tool
        .position
        .iter()
        .filter(|p| p.coords.iter().all(|x| x.is_finite()));
    let far = finite.max_by(|a, b| (*a - first).norm().total_cmp(&(*b - first).norm()))?;
    let along = far - first;
    (along - action.normal.into_inner() * along.dot(&action.normal)).try_normalize(2e-3)
}

/// The offset between mesh and touched surface that makes the target travel as far as it did.
fn fit_gap(scene: &Scene, action: &Action, direction: &Vector3<f64>) -> Option<(f64, PushPrediction)> {
    let mut gap = 0.0;
    let mut found = predict_push(scene.model, action, gap)?;
    if action.tool.hold != Hold::Push {
        return Some((gap, found));
    }
    let Some(measured) = travel_of_track(scene, action, direction) else {
        return Some((gap, found));
    };
    for _ in 0..3 {
        let poses = found.prediction.poses.get(&action.target)?;
        let predicted = (poses.last()?.translation.vector - poses.first()?.translation.vector).dot(direction);
        gap = (gap + predicted - measured).clamp(-LARGEST_GAP, LARGEST_GAP);
        found = predict_push(scene.model, action, gap)?;
    }
    Some((gap, found))
}

fn travel_of_track(scene: &Scene, action: &Action, direction: &Vector3<f64>) -> Option<f64> {
    let track = scene.interaction.tracks.get(&action.target)?;
    let start = rest_pose(track, first_rest(scene.interaction, scene.segmented))?;
    let tail = track.len().saturating_sub(10).max(track.len() / 2)..track.len();
    let ends: Vec<f64> = tail
        .map(|i| (track.position[i].coords - start.translation.vector).dot(direction))
        .collect();
    crate::math::median(&ends)
}

fn force_curve(scene: &Scene, action: &Action, found: &PushPrediction, direction: &Vector3<f64>) -> Option<Curve> {
    let (time, force, noise) = scene.binned_force(0.01)?;
    let predicted_along: Vec<f64> = found.prediction.force.iter().map(|f| f.dot(direction)).collect();
    let first_touch = found.contact.first().map_or(f64::INFINITY, |c| c.0);
    let speed = tool_speed(action, &found.prediction.time);
    let at = |t: &f64| {
        let value = interpolate(&found.prediction.time, &predicted_along, *t)?;
        let steady = *t > first_touch + SETTLE && interpolate(&found.prediction.time, &speed, *t)? > STANDING;
        if *t < first_touch - 0.5 * SETTLE {
            Some(0.0)
        } else {
            steady.then_some(value)
        }
    };
    Some(Curve {
        label: "force along the motion".into(),
        quantity: Quantity::Force,
        measured: force.iter().map(|f| f.dot(direction)).collect(),
        predicted: time.iter().map(|t| at(t).unwrap_or(f64::NAN)).collect(),
        time,
        noise,
    })
}

fn tool_speed(action: &Action, times: &[f64]) -> Vec<f64> {
    let axis = |k: usize| action.tool.position.iter().map(|p| p[k]).collect::<Vec<f64>>();
    let (axes, h) = ([axis(0), axis(1), axis(2)], 0.04);
    let speed = |t: &f64| {
        let at = |k: usize, t: f64| interpolate(&action.tool.time, &axes[k], t);
        let squared: Option<f64> = (0..3).map(|k| Some((at(k, t + h)? - at(k, t - h)?).powi(2))).sum();
        squared.map_or(0.0, |s| s.sqrt() / (2.0 * h))
    };
    times.iter().map(speed).collect()
}

/// Position along and across the motion, and heading, of one tracked link.
fn motion_curves(
    scene: &Scene,
    name: &str,
    track: &PoseStream,
    prediction: &Prediction,
    direction: &Vector3<f64>,
) -> Vec<Curve> {
    let Some(start) = rest_pose(track, first_rest(scene.interaction, scene.segmented)) else {
        return Vec::new();
    };
    let Some(poses) = prediction.poses.get(name) else {
        return Vec::new();
    };
    let up = super::action::support_normal(scene.capture, scene.model);
    let across = up.cross(direction);
    let curve = |label: String, quantity, noise, measured: Vec<f64>, predicted: Vec<f64>| {
        let at = |t: &f64| interpolate(&prediction.time, &predicted, *t).unwrap_or(f64::NAN);
        let predicted = track.time.iter().map(at).collect();
        Curve {
            label,
            quantity,
            time: track.time.clone(),
            measured,
            predicted,
            noise,
        }
    };
    let mut curves = Vec::new();
    for (word, axis) in [("along", direction), ("across", &across)] {
        let moved = |p: &Pose| (p.translation.vector - start.translation.vector).dot(axis);
        let measured = track
            .position
            .iter()
            .map(|p| (p.coords - start.translation.vector).dot(axis))
            .collect();
        let predicted = poses.iter().map(moved).collect();
        curves.push(curve(
            format!("{name}: {word} the motion"),
            Quantity::Position,
            scene.position_noise(),
            measured,
            predicted,
        ));
    }
    let heading = |q: &nalgebra::UnitQuaternion<f64>| (q * start.rotation.inverse()).scaled_axis().dot(&up);
    let measured = track
        .rotation
        .iter()
        .map(|q| q.as_ref().map_or(f64::NAN, heading))
        .collect();
    let predicted = poses.iter().map(|p| heading(&p.rotation)).collect();
    curves.push(curve(
        format!("{name}: heading"),
        Quantity::Rotation,
        scene.rotation_noise(),
        measured,
        predicted,
    ));
    curves
}
