//! How far a prediction may be off for what is not known of the numbers that it rests on.

use super::Curve;
use crate::base::Estimate;
use crate::twin::{Body, Model};

/// One number of a body of links, or one that its links share.
#[derive(Clone, Copy)]
enum Known {
    /// Friction force of a link.
    Force(usize),
    Radius,
    Creep,
    Tool,
    /// Friction and damping of a joint.
    Friction(usize),
    Damping(usize),
}

/// The model with each number of a body of links that is in doubt a standard deviation more, one after the other. What is known
/// in a sum with another only is not moved alone: the sum is what foretells.
pub(super) fn in_doubt(model: &Model, target: &str) -> Vec<Model> {
    let Some(body) = model.twin.body_of(target).filter(|b| !b.joints.is_empty()) else {
        return Vec::new();
    };
    let shared = [Known::Radius, Known::Creep, Known::Tool];
    let forces = (0..body.links.len()).map(Known::Force);
    let joints = (0..body.joints.len()).flat_map(|k| [Known::Friction(k), Known::Damping(k)]);
    let all = forces.chain(shared).chain(joints);
    let meshes = body.links.iter().filter_map(|l| l.mesh.clone());
    let own = meshes.filter_map(|m| Some((m.clone(), model.meshes.get(&m)?.clone())));
    let bare = Model {
        twin: model.twin.clone(),
        meshes: own.collect(),
        textures: Default::default(),
    };
    all.filter_map(|which| moved(&bare, &body.name, which)).collect()
}

fn moved(model: &Model, name: &str, which: Known) -> Option<Model> {
    let mut out = model.clone();
    let body = out.twin.bodies.iter_mut().find(|b| b.name == name)?;
    let mut any = false;
    for estimate in numbers(body, which) {
        let sum = estimate.confounded.is_some();
        if let Some(relative) = estimate
            .sd
            .map(|sd| sd / estimate.value)
            .filter(|r| r.is_finite() && *r > 0.0 && !sum)
        {
            estimate.value *= relative.exp();
            any = true;
        }
    }
    any.then_some(out)
}

fn numbers(body: &mut Body, which: Known) -> Vec<&mut Estimate> {
    let links = &mut body.links;
    match which {
        Known::Force(k) => links
            .get_mut(k)
            .and_then(|l| l.friction_force.kinetic.as_mut())
            .into_iter()
            .collect(),
        Known::Radius => links
            .iter_mut()
            .filter_map(|l| l.friction.torsional_radius.as_mut())
            .collect(),
        Known::Creep => links
            .iter_mut()
            .filter_map(|l| l.friction.creep_speed.as_mut())
            .collect(),
        Known::Tool => links.iter_mut().filter_map(|l| l.friction.tool.as_mut()).collect(),
        Known::Friction(k) => body
            .joints
            .get_mut(k)
            .and_then(|j| j.friction.as_mut())
            .into_iter()
            .collect(),
        Known::Damping(k) => body
            .joints
            .get_mut(k)
            .and_then(|j| j.damping.as_mut())
            .into_iter()
            .collect(),
    }
}

/// Adds to the squares of the doubts of `curves` what the same curves `with` another number differ by.
pub(super) fn add_squares(squares: &mut Vec<Vec<f64>>, curves: &[Curve], with: &[Curve]) {
    squares.resize(curves.len(), Vec::new());
    for (curve, square) in curves.iter().zip(squares) {
        square.resize(curve.predicted.len(), 0.0);
        let same = with.iter().find(|c| c.label == curve.label);
        let pairs = same.map(|c| c.predicted.iter().zip(&curve.predicted));
        for (sum, (a, b)) in square.iter_mut().zip(pairs.into_iter().flatten()) {
            let by = a - b;
            *sum += if by.is_finite() { by * by } else { 0.0 };
        }
    }
}
