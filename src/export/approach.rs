//! When a tool meets what it means to touch, by the shapes of both.

use nalgebra::{Isometry3, Vector3};
use rapier3d_f64::parry::query::{contact, distance};
use rapier3d_f64::prelude::ColliderBuilder;

use super::colliders::hulls;
use super::layout::lay_out;
use super::play::collider;
use super::trial::{Trial, place};
use crate::base::Result;
use crate::twin::Model;

/// How far the tool is looked for on either side of where it was recorded, m.
const REACH: f64 = 0.03;
/// Step of that search, m, and how exactly the place is told, m.
const STEP: f64 = 5e-4;
const EXACT: f64 = 1e-5;
/// Time over which the tool's heading is taken, s.
const HEADING: f64 = 0.2;

/// A target's face that is no more than this off the way of what pushes it, as the cosine, is the one that is pushed.
const FACING: f64 = 0.1;

/// How far a tool is from a target, m (negative: inside), and the way out, unit, world.
#[derive(Clone, Copy, Debug)]
pub struct Gap {
    /// m.
    pub distance: f64,
    /// From the target to the tool.
    pub out: Vector3<f64>,
}

/// The gap between tool and target at `time`, seconds from the trial's start, were the target still where the trial has it;
/// nothing where they are far apart, or what is nearest is not in the tool's way.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn gap(model: &Model, trial: &Trial, time: f64) -> Result<Option<Gap>> {
    let scene = lay_out(model)?;
    let placed = place(&scene, &trial.start);
    let (Some(id), Some(tool)) = (scene.find(&trial.target), collider(&trial.shape)) else {
        return Ok(None);
    };
    let target = placed.parts[id.tree][id.part];
    let pose = trial.tool_at(time) * Isometry3::from(tool.position);
    let near = |s: ColliderBuilder| {
        let found = contact(&target.into(), &*s.shape, &pose.into(), &*tool.shape, REACH);
        let found = found.ok().flatten()?;
        Some(Gap {
            distance: found.dist,
            out: found.normal1.into(),
        })
    };
    let nearest = hulls(scene.part(id), model).filter_map(near);
    let nearest = nearest.min_by(|a, b| a.distance.total_cmp(&b.distance));
    let went = heading(trial, time).unwrap_or_default();
    Ok(nearest.filter(|g| -g.out.dot(&went) > FACING && g.distance.is_finite()))
}

/// Where the tool goes at a time, unit.
fn heading(trial: &Trial, time: f64) -> Option<Vector3<f64>> {
    let at = |t: f64| trial.tool_at(t).translation.vector;
    (at(time + HEADING) - at(time - HEADING)).try_normalize(1e-6)
}

/// A shift of the tool's way, m, world, along its heading, with which it touches the target first at `onset`, seconds from
/// the trial's start; nothing where its heading is not known or it would pass the target by.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn meeting(model: &Model, trial: &Trial, onset: f64) -> Result<Option<Vector3<f64>>> {
    let scene = lay_out(model)?;
    let placed = place(&scene, &trial.start);
    let (Some(id), Some(tool)) = (scene.find(&trial.target), collider(&trial.shape)) else {
        return Ok(None);
    };
    let part = scene.part(id);
    let shapes: Vec<ColliderBuilder> = hulls(part, model).collect();
    let target = placed.parts[id.tree][id.part];
    let at = trial.tool_at(onset);
    let Some(heading) = heading(trial, onset) else {
        return Ok(None);
    };
    let overlaps = |back: f64| {
        let pose = Isometry3::translation(-back * heading.x, -back * heading.y, -back * heading.z) * at;
        let pose = pose * Isometry3::from(tool.position);
        shapes.iter().any(|s| {
            let apart = distance(&pose.into(), &*tool.shape, &target.into(), &*s.shape);
            apart.is_ok_and(|d| d.distance <= 0.0)
        })
    };
    let steps = (2.0 * REACH / STEP) as usize;
    let Some(inside) = (0..=steps)
        .map(|k| REACH - k as f64 * STEP)
        .find(|back| overlaps(*back))
    else {
        return Ok(None);
    };
    if inside >= REACH {
        return Ok(None);
    }
    let (mut inside, mut outside) = (inside, inside + STEP);
    while outside - inside > EXACT {
        let middle = 0.5 * (inside + outside);
        if overlaps(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    Ok(Some(-heading * outside))
}
