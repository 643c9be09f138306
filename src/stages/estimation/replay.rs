//! A push replayed by the forward model, with the offset between mesh and touched surface fitted anew.

use nalgebra::Vector3;

use super::action::{first_rest, rest_pose};
use crate::capture::{Interaction, Segmented};
use crate::math::median;
use crate::physics::{Action, Hold, PushPrediction, predict_push};
use crate::twin::Model;

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
    let Some(measured) = travel_of_track(interaction, segmented, action, &direction) else {
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

fn travel_of_track(
    interaction: &Interaction,
    segmented: Option<&Segmented>,
    action: &Action,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let track = interaction.tracks.get(&action.target)?;
    let start = rest_pose(track, first_rest(interaction, segmented))?;
    let tail = track.len().saturating_sub(10).max(track.len() / 2)..track.len();
    let ends: Vec<f64> = tail
        .map(|i| (track.position[i].coords - start.translation.vector).dot(direction))
        .collect();
    median(&ends)
}
