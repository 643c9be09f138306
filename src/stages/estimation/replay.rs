//! A push replayed by the forward model, with the offset between mesh and touched surface fitted anew.

use std::ops::Range;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::action::{first_rest, rest_pose};
use crate::capture::{Interaction, PhaseKind, PoseStream, Segmented};
use crate::math::{interpolate, mean_rotation, median};
use crate::physics::{Action, Hold, Linkage, PushPrediction, Stance, predict_push};
use crate::twin::{JointKind, Model};

/// The reconstructed surface may be off by this much, m.
const LARGEST_GAP: f64 = 0.008;

/// Share of the farthest way from which on the way out is taken for a push, and of itself below which the tool is back from it.
const OUT: f64 = 0.5;
const BACK: f64 = 0.5;

/// Unit direction from the first to the farthest point of the tool's way, along the support: of its way out, where it comes back
/// beyond where it began.
pub fn travel_direction(action: &Action) -> Option<Vector3<f64>> {
    let first = action.tool.position.first()?;
    let normal = action.normal.into_inner();
    let flat = |p: &Point3<f64>| (p - first) - normal * (p - first).dot(&normal);
    let ways = action.tool.position.iter().map(flat);
    let finite: Vec<Vector3<f64>> = ways.filter(|w| w.iter().all(|x| x.is_finite())).collect();
    let far = finite.iter().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let mut out = Vector3::zeros();
    for way in &finite {
        if way.norm() > out.norm() {
            out = *way;
        } else if out.norm() > OUT * far.norm() && way.norm() < BACK * out.norm() {
            break;
        }
    }
    out.try_normalize(2e-3)
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
    let Some((point, measured)) = touched(interaction, segmented, action, &direction) else {
        return Some((gap, found));
    };
    for _ in 0..rounds {
        let poses = found.prediction.poses.get(&action.target)?;
        let predicted = (poses.last()?.0 * point - poses.first()?.0 * point).dot(&direction);
        gap = (gap + predicted - measured).clamp(-LARGEST_GAP, LARGEST_GAP);
        found = predict_push(model, action, gap)?;
    }
    Some((gap, found))
}

/// Rows of a track at its end, where all has come to rest.
fn tail(track: &PoseStream) -> Range<usize> {
    track.len().saturating_sub(10).max(track.len() / 2)..track.len()
}

/// The point of the target, in its own frame, that is where the tool went farthest, and how far it was moved along `direction`, m:
/// where a body turns about itself its origin may go the other way. The origin where rotations were not tracked.
fn touched(
    interaction: &Interaction,
    segmented: Option<&Segmented>,
    action: &Action,
    direction: &Vector3<f64>,
) -> Option<(Point3<f64>, f64)> {
    let track = interaction.tracks.get(&action.target)?;
    let start = rest_pose(track, first_rest(interaction, segmented))?;
    let last = tail(track);
    let axis = |k: usize| median(&track.position[last.clone()].iter().map(|p| p[k]).collect::<Vec<_>>());
    let end = Vector3::new(axis(0)?, axis(1)?, axis(2)?);
    let turns: Option<Vec<UnitQuaternion<f64>>> = track.rotation[last.clone()].iter().copied().collect();
    let point = turns.and_then(|t| mean_rotation(&t)).map(|turned| {
        let end = Isometry3::from_parts(end.into(), turned);
        let all = action
            .tool
            .position
            .iter()
            .filter(|p| p.coords.iter().all(|x| x.is_finite()));
        let far = all.max_by(|a, b| a.coords.dot(direction).total_cmp(&b.coords.dot(direction)));
        let point = far.map_or_else(Point3::origin, |far| end.inverse_transform_point(far));
        (point, (end * point - start.0 * point).dot(direction))
    });
    Some(point.unwrap_or_else(|| (Point3::origin(), (end - start.translation.vector).dot(direction))))
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
    let ends: Vec<f64> = tail(track)
        .map(|i| (track.position[i].coords - start.translation.vector).dot(direction))
        .collect();
    median(&ends)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::base::Pose;
    use crate::capture::Kind;
    use crate::physics::ToolMotion;

    fn action(ways: &[f64]) -> Action {
        Action {
            target: "box".into(),
            tool: ToolMotion {
                radius: 0.008,
                hold: Hold::Push,
                turned: Vec::new(),
                position: ways.iter().map(|x| Point3::new(*x, 0.05, 0.03)).collect(),
                time: (0..ways.len()).map(|k| 0.1 * k as f64).collect(),
            },
            start: BTreeMap::new(),
            normal: Vector3::z_axis(),
            gravity: 9.81,
        }
    }

    #[test]
    fn a_tool_that_is_drawn_back_beyond_where_it_began_pushed_on_its_way_out() {
        let out: Vec<f64> = (0..30).map(|k| 0.001 * f64::from(k)).collect();
        let back = (0..70).map(|k| 0.029 - 0.001 * f64::from(k));
        let ways: Vec<f64> = out.iter().copied().chain(back).collect();
        let along = |ways: &[f64]| travel_direction(&action(ways)).map(|d| d.x);
        assert_eq!(along(&ways), Some(1.0));
        // A little way out before a long one back is none.
        let back: Vec<f64> = (0..100).map(|k| 0.004 - 0.001 * f64::from(k)).collect();
        assert_eq!(along(&[&[0.0, 0.002][..], &back].concat()), Some(-1.0));
        assert_eq!(along(&[0.0, 0.001]), None);
    }

    #[test]
    fn what_turns_about_itself_was_moved_where_it_was_touched() {
        let mut track = PoseStream::default();
        for k in 0..60 {
            // About a point 0.02 m beside its middle, away from the finger: the middle goes back.
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.004 * f64::from((k - 20).clamp(0, 20)));
            let about = Vector3::new(0.0, 0.02, 0.0);
            track.time.push(0.1 * f64::from(k));
            track.position.push(Point3::from(about - turn * about));
            track.rotation.push(Some(turn));
        }
        let interaction = Interaction {
            name: "push".into(),
            kind: Kind::Push,
            action: None,
            tool_name: None,
            tool: None,
            target: Some("box".into()),
            force: None,
            tool_path: None,
            support_path: None,
            tracks: BTreeMap::from([("box".to_owned(), track.clone())]),
            frames: None,
            held_out: false,
        };
        let action = action(&[-0.04, -0.03, -0.035, -0.05]);
        let (point, moved) = touched(&interaction, None, &action, &Vector3::x()).expect("a track with rotations");
        let (start, end) = (track.position[0], track.position[59]);
        assert!((end - start).x < -1e-3 && moved > 2e-3, "{:?} {moved}", end - start);
        let pose = Pose(Isometry3::from_parts(
            end.coords.into(),
            track.rotation[59].expect("a rotation"),
        ));
        assert!((pose.0 * point - Point3::new(-0.03, 0.05, 0.03)).norm() < 1e-9);
    }
}
