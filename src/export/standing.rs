//! What was seen to stand must stand: a bound on masses that nobody measured.
//!
//! A body of several parts rested at the first view, so that its weight acts within the outline of what stands on the table.
//! Where default densities put it outside, the default mass of what stands is raised until it does not.

use nalgebra::{Point3, Vector3};

use super::scene::{Floor, Scene, Tree};
use super::surface::surface_of;
use crate::twin::Model;

/// Points within this of the table stand on it, m.
const FACE: f64 = 2e-3;
/// The weight acts within this share of the way from the middle of what stands to its edge.
const WITHIN: f64 = 0.85;
/// Directions in which the outline is asked for.
const DIRECTIONS: usize = 72;
/// Step by which a mass is raised, and how far at most.
const STEP: f64 = 1.1;
const MOST: f64 = 30.0;
/// What is said of such a mass.
const SAID: &str = "mass (raised until it stands as it was seen to)";

/// Raises default masses in trees that would fall over.
pub(super) fn stand(scene: &mut Scene, model: &Model) {
    let Some(floor) = scene.floor.as_ref() else { return };
    let welded = |i: usize| scene.welds.iter().any(|w| w.ends.iter().any(|id| id.tree == i));
    let wanted: Vec<(usize, usize, f64)> = (0..scene.trees.len())
        .filter(|i| !welded(*i) && !scene.trees[*i].anchored && scene.trees[*i].parts.len() > 1)
        .filter_map(|i| raised(&scene.trees[i], floor, model).map(|(part, ratio)| (i, part, ratio)))
        .collect();
    let gravity = Vector3::from(model.twin.gravity).norm();
    for (tree, part, ratio) in wanted {
        let part = &mut scene.trees[tree].parts[part];
        part.mass *= ratio;
        part.inertia *= ratio;
        if let Some(link) = model.twin.link(&part.link) {
            part.surface = surface_of(link, part.mass, gravity);
        }
        part.assumed.retain(|said| *said != "mass");
        part.assumed.insert(0, SAID);
    }
}

/// The part whose default mass is to be raised, and by what ratio; nothing where the tree stands, or would not with any.
fn raised(tree: &Tree, floor: &Floor, model: &Model) -> Option<(usize, f64)> {
    let points: Vec<Vec<Vector3<f64>>> = (0..tree.parts.len()).map(|i| standing(tree, i, floor, model)).collect();
    let all: Vec<Vector3<f64>> = points.iter().flatten().copied().collect();
    let unweighed = |i: &usize| model.twin.link(&tree.parts[*i].link).is_some_and(|l| l.mass.is_none());
    let part = (0..tree.parts.len()).find(|i| points[*i].len() > 2 && unweighed(i))?;
    let stands = |ratio: f64| {
        let share = |i: usize| tree.parts[i].mass * if i == part { ratio } else { 1.0 };
        let total: f64 = (0..tree.parts.len()).map(share).sum();
        let centre = |i: usize| (tree.parts[i].world_from_part * Point3::from(tree.parts[i].com)).coords;
        let weight = (0..tree.parts.len())
            .map(|i| centre(i) * share(i))
            .sum::<Vector3<f64>>()
            / total;
        is_within(&weight, &all, floor)
    };
    if stands(1.0) {
        return None;
    }
    let ratios = (1..).map(|k| STEP.powi(k)).take_while(|r| *r <= MOST);
    ratios.into_iter().find(|r| stands(*r)).map(|r| (part, r))
}

/// Where a part stands on the table, world.
fn standing(tree: &Tree, part: usize, floor: &Floor, model: &Model) -> Vec<Vector3<f64>> {
    let part = &tree.parts[part];
    let meshes = part.hulls.iter().filter_map(|path| model.meshes.get(path));
    let world = |v: &Point3<f64>| (part.world_from_part * (v + part.link_origin)).coords;
    let near = |p: &Vector3<f64>| (p - floor.point).dot(&floor.normal).abs() < FACE;
    meshes.flat_map(|m| &m.vertices).map(world).filter(near).collect()
}

/// Whether a point lies well within the outline of others, seen along the table's normal.
fn is_within(point: &Vector3<f64>, others: &[Vector3<f64>], floor: &Floor) -> bool {
    let up = floor.normal.into_inner();
    let across = up
        .cross(&if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() })
        .normalize();
    let third = up.cross(&across);
    let heading = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
        across * angle.cos() + third * angle.sin()
    };
    let reach = |h: &Vector3<f64>| others.iter().map(|p| p.dot(h)).fold(f64::NEG_INFINITY, f64::max);
    (0..DIRECTIONS).map(heading).all(|h| {
        let (far, near) = (reach(&h), -reach(&-h));
        let middle = 0.5 * (far + near);
        point.dot(&h) - middle <= WITHIN * (far - middle)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Unit;

    #[test]
    fn a_weight_beyond_the_edge_of_what_stands_does_not_stand() {
        let floor = Floor {
            point: Vector3::zeros(),
            normal: Unit::new_normalize(Vector3::z()),
        };
        let square: Vec<_> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Vector3::new(0.03 * x, 0.03 * y, 0.0))
            .to_vec();
        assert!(is_within(&Vector3::new(0.02, 0.0, 0.1), &square, &floor));
        assert!(!is_within(&Vector3::new(0.031, 0.0, 0.1), &square, &floor));
        assert!(!is_within(&Vector3::new(0.0, -0.028, 0.0), &square, &floor));
    }
}
