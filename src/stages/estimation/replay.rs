//! A push replayed by the forward model, with the offset between mesh and touched surface fitted anew.

use nalgebra::{Point3, Vector3};

use super::action::{first_rest, rest_pose};
use crate::capture::{Interaction, PhaseKind, Segmented};
use crate::math::{interpolate, median};
use crate::physics::{Action, Hold, Linkage, PushPrediction, Stance, predict_push};
use crate::twin::{JointKind, Model};

/// The reconstructed surface may be off by this much, m.
const LARGEST_GAP: f64 = 0.008;

/// Unit direction from the first to the farthest point of the tool's way, along the support.
pub fn travel_direction(action: &Action) -> Option<Vector3<f64>> {
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

/// The offset (m) that makes the target travel as far as it did, and the prediction with it; nothing where
/// the twin does not know enough to predict.
pub fn replay_push(
    model: &Model,
    interaction: &Interaction,
    segmented: Option<&Segmented>,
    action: &Action,
    start: f64,
    rounds: usize,
) -> Option<(f64, PushPrediction)> {
    let direction = travel_direction(action)?;
    let mut gap = start;
    let mut found = predict_push(model, action, gap)?;
    if action.tool.hold != Hold::Push {
        return Some((gap, found));
    }
    let body = model.twin.body_of(&action.target);
    let jointed = body.is_some_and(|b| b.joints.iter().any(|j| j.kind != JointKind::Fixed));
    if let Some(touched) = segmented
        .filter(|_| jointed)
        .and_then(|cut| gap_at_touch(model, cut, action))
    {
        return Some((touched, predict_push(model, action, touched)?));
    }
    let Some(measured) = travel_of_track(interaction, segmented, &action.target, &direction) else {
        return Some((gap, found));
    };
    for _ in 0..rounds {
        let poses = found.prediction.poses.get(&action.target)?;
        let predicted = (poses.last()?.translation.vector - poses.first()?.translation.vector).dot(&direction);
        gap = (gap + predicted - measured).clamp(-LARGEST_GAP, LARGEST_GAP);
        found = predict_push(model, action, gap)?;
    }
    Some((gap, found))
}

/// How far behind the mesh the tool was when its force began to rise, m; how far a link of several travels
/// depends on too much else.
pub(super) fn gap_at_touch(model: &Model, cut: &Segmented, action: &Action) -> Option<f64> {
    let touch = cut
        .phases
        .iter()
        .find(|p| matches!(p.kind, PhaseKind::Stick | PhaseKind::Slide))?;
    let axis = |k: usize| {
        let values: Vec<f64> = action.tool.position.iter().map(|p| p[k]).collect();
        interpolate(&action.tool.time, &values, touch.start)
    };
    let tool = Point3::new(axis(0)?, axis(1)?, axis(2)?);
    let normal = action.normal.into_inner();
    let height = action.tool.position.first()?.coords.dot(&normal);
    let body = model.twin.body_of(&action.target)?;
    let stance = Stance::of(model, body, &action.start, &normal, height)?;
    let linkage = Linkage::on(&stance, model, body, &action.start)?;
    let (outline, moved) = linkage.outline(linkage.index(&action.target)?)?;
    let gap = action.tool.radius - outline.nearest(moved, &stance.flatten(&tool)).distance;
    (gap.abs() < LARGEST_GAP).then_some(gap)
}

/// How far the tracked link `name` is from where it rested at the end of the interaction, along `direction`, m.
pub fn travel_of_track(
    interaction: &Interaction,
    segmented: Option<&Segmented>,
    name: &str,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let track = interaction.tracks.get(name)?;
    let start = rest_pose(track, first_rest(interaction, segmented))?;
    let tail = track.len().saturating_sub(10).max(track.len() / 2)..track.len();
    let ends: Vec<f64> = tail
        .map(|i| (track.position[i].coords - start.translation.vector).dot(direction))
        .collect();
    median(&ends)
}
