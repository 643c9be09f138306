//! One push or pull of a jointed body, as it is compared with its replay.

use nalgebra::{UnitQuaternion, Vector3};

use super::action::{action_of, first_rest, rest_pose};
use super::evidence::{mean_wrench, tare_of};
use super::replay::{gap_at_touch, travel_direction};
use crate::base::Pose;
use crate::capture::{Capture, Interaction, Kind, PhaseKind, PoseStream, Segmented};
use crate::math::interpolate;
use crate::physics::{Action, Play};
use crate::twin::{Body, Model};

/// What the model may miss: of a force, as a share and N; of a path, m and rad.
const MISS_FORCE: (f64, f64) = (0.04, 0.03);
const MISS_PATH: (f64, f64) = (0.001, 0.015);
/// Seconds of one mean of the force, and how long after the first touch it is left out.
const BLOCK: f64 = 0.2;
const SETTLE: f64 = 0.25;
/// Samples of a path.
const SAMPLES: usize = 8;

/// How many steps of a replay one coarse step is.
const COARSE: usize = 3;

/// A recorded push or pull of a jointed body.
pub(super) struct Trial<'a> {
    pub interaction: &'a Interaction,
    action: Action,
    /// Played in full, and in coarse steps.
    plays: [Play; 2],
    gap: f64,
    direction: Vector3<f64>,
    /// Time, force along and across the way, N.
    force: Vec<(f64, f64, f64)>,
    /// Link, and its samples: time, along, across (m), heading (rad).
    paths: Vec<(String, Vec<[f64; 4]>)>,
}

/// Everything that was done to this body along the support and may be used to fit.
pub(super) fn trials_of<'a>(
    capture: &'a Capture,
    segmented: &[Segmented],
    model: &Model,
    body: &Body,
) -> Vec<Trial<'a>> {
    let of_body = |i: &&Interaction| {
        let about = i
            .target
            .as_deref()
            .or_else(|| i.tracks.keys().next().map(String::as_str));
        matches!(i.kind, Kind::Push | Kind::Pull) && about.is_some_and(|t| body.links.iter().any(|l| l.name == t))
    };
    capture
        .fitted()
        .filter(of_body)
        .filter_map(|i| {
            let cut = segmented.iter().find(|s| s.interaction == i.name)?;
            trial(capture, i, cut, model, body)
        })
        .collect()
}

fn trial<'a>(
    capture: &Capture,
    interaction: &'a Interaction,
    cut: &Segmented,
    model: &Model,
    body: &Body,
) -> Option<Trial<'a>> {
    let action = action_of(capture, interaction, Some(cut), model)?;
    let direction = travel_direction(&action)?;
    let gap = gap_at_touch(model, cut, &action).unwrap_or(0.0);
    let slide = cut.of(PhaseKind::Slide).next()?;
    let (first, last) = (slide.start, slide.end);
    let across = action.normal.cross(&direction);
    let force = blocks(interaction, cut, &action, (first, last), &direction);
    let rest = first_rest(interaction, Some(cut));
    let paths = interaction
        .tracks
        .iter()
        .filter(|(name, _)| body.links.iter().any(|l| l.name == **name))
        .filter_map(|(name, track)| {
            let start = rest_pose(track, rest)?;
            let samples = samples(track, &start, (first, last), &direction, &across, &action.normal);
            Some((name.clone(), samples))
        })
        .collect();
    let plays = [Play::new(model, &action, 1)?, Play::new(model, &action, COARSE)?];
    Some(Trial {
        interaction,
        action,
        plays,
        gap,
        direction,
        force,
        paths,
    })
}

/// Means of the force while the tool moves steadily.
fn blocks(
    interaction: &Interaction,
    cut: &Segmented,
    action: &Action,
    (first, last): (f64, f64),
    direction: &Vector3<f64>,
) -> Vec<(f64, f64, f64)> {
    let Some(stream) = interaction.force.as_ref() else {
        return Vec::new();
    };
    let tare = tare_of(interaction, cut);
    let across = action.normal.cross(direction);
    let speed = |t: f64| {
        let at = |t: f64| {
            let axis = |k: usize| {
                let values: Vec<f64> = action.tool.position.iter().map(|p| p[k]).collect();
                interpolate(&action.tool.time, &values, t)
            };
            Some(Vector3::new(axis(0)?, axis(1)?, axis(2)?))
        };
        at(t + 0.5 * BLOCK)
            .zip(at(t - 0.5 * BLOCK))
            .map_or(0.0, |(b, a)| (b - a).norm() / BLOCK)
    };
    let times: Vec<f64> = (0..)
        .map(|k| first + SETTLE + (f64::from(k) + 0.5) * BLOCK)
        .take_while(|t| t + 0.5 * BLOCK < last)
        .collect();
    let fastest = times.iter().map(|t| speed(*t)).fold(0.0, f64::max);
    times
        .into_iter()
        .filter(|t| speed(*t) > 0.8 * fastest)
        .filter_map(|t| {
            let f = mean_wrench(stream, t - 0.5 * BLOCK, t + 0.5 * BLOCK, &tare)?.force;
            Some((t, f.dot(direction), f.dot(&across)))
        })
        .collect()
}

fn heading(q: &UnitQuaternion<f64>, start: &UnitQuaternion<f64>, normal: &Vector3<f64>) -> f64 {
    (q * start.inverse()).scaled_axis().dot(normal)
}

fn samples(
    track: &PoseStream,
    start: &Pose,
    (first, last): (f64, f64),
    direction: &Vector3<f64>,
    across: &Vector3<f64>,
    normal: &Vector3<f64>,
) -> Vec<[f64; 4]> {
    let at = |k: usize| {
        let t = first + (last - first) * (k + 1) as f64 / SAMPLES as f64;
        let rows: Vec<usize> = (0..track.len())
            .filter(|i| (track.time[*i] - t).abs() < 0.05)
            .filter(|i| track.position[*i].x.is_finite() && track.rotation[*i].is_some())
            .collect();
        let mean = |value: &dyn Fn(usize) -> f64| rows.iter().map(|i| value(*i)).sum::<f64>() / rows.len() as f64;
        let moved = |i: usize| track.position[i].coords - start.translation.vector;
        let turned = |i: usize| track.rotation[i].map_or(0.0, |q| heading(&q, &start.rotation, normal));
        (!rows.is_empty()).then(|| {
            [
                t,
                mean(&|i| moved(i).dot(direction)),
                mean(&|i| moved(i).dot(across)),
                mean(&turned),
            ]
        })
    };
    (0..SAMPLES).filter_map(at).collect()
}

/// Replayed less measured, in units of what the model may miss; samples of one curve go wrong together and count
/// as a few. `coarse`: in coarse steps.
pub(super) fn misfit(model: &Model, trial: &Trial, coarse: bool) -> Vec<f64> {
    let rows = 2 * trial.force.len() + 3 * trial.paths.iter().map(|p| p.1.len()).sum::<usize>();
    let Some(replay) = trial.plays[usize::from(coarse)].with(model, trial.gap) else {
        return vec![3.0; rows];
    };
    let time = &replay.prediction.time;
    let across = trial.action.normal.cross(&trial.direction);
    let mut out = Vec::with_capacity(rows);
    let component = |axis: &Vector3<f64>| {
        replay
            .prediction
            .force
            .iter()
            .map(|f| f.dot(axis))
            .collect::<Vec<f64>>()
    };
    let (along, aside) = (component(&trial.direction), component(&across));
    let shared = (trial.force.len() as f64 / 3.0).max(1.0).sqrt();
    for (t, f, g) in &trial.force {
        let sd = (MISS_FORCE.0 * f.hypot(*g)).hypot(MISS_FORCE.1) * shared;
        out.push((interpolate(time, &along, *t).unwrap_or(0.0) - f) / sd);
        out.push((interpolate(time, &aside, *t).unwrap_or(0.0) - g) / (2.0 * sd));
    }
    for (name, samples) in &trial.paths {
        out.extend(path_misfit(&replay.prediction.poses, time, name, samples, trial));
    }
    out
}

fn path_misfit(
    poses: &std::collections::BTreeMap<String, Vec<Pose>>,
    time: &[f64],
    name: &str,
    samples: &[[f64; 4]],
    trial: &Trial,
) -> Vec<f64> {
    let Some(poses) = poses.get(name) else {
        return vec![0.0; 3 * samples.len()];
    };
    let across = trial.action.normal.cross(&trial.direction);
    let start = poses[0];
    let moved = |axis: &Vector3<f64>| -> Vec<f64> {
        let shift = |p: &Pose| (p.translation.vector - start.translation.vector).dot(axis);
        poses.iter().map(shift).collect()
    };
    let turned: Vec<f64> = poses
        .iter()
        .map(|p| heading(&p.rotation, &start.rotation, &trial.action.normal))
        .collect();
    let curves = [moved(&trial.direction), moved(&across), turned];
    let shared = (samples.len() as f64 / 3.0).max(1.0).sqrt();
    let mut out = Vec::with_capacity(3 * samples.len());
    for sample in samples {
        for k in 0..3 {
            let sd = if k == 2 { MISS_PATH.1 } else { MISS_PATH.0 } * shared;
            // A tenth of the motion itself may be missed.
            let sd = sd.hypot(0.05 * sample[k + 1].abs() * shared);
            let predicted = interpolate(time, &curves[k], sample[0]).unwrap_or(sample[k + 1]);
            out.push((predicted - sample[k + 1]) / sd);
        }
    }
    out
}
