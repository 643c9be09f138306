//! Colliders of the embedded engine for the convex parts of a twin.
//!
//! The engine knows a face by four of its corners at most, so that a thing on a face of many corners would stand
//! on a sliver of it. Level faces are therefore also given as tetrahedra, whose faces have three.

use nalgebra::{Point3, Vector3};
use rapier3d_f64::prelude::{CoefficientCombineRule, ColliderBuilder};

use super::feet::{Corners, RADIUS, feet};
use super::scene::{Floor, Part};
use crate::geometry::Mesh;
use crate::twin::Model;

/// Faces within this cosine of level count as feet and seats.
const LEVEL: f64 = 0.9;
/// Tetrahedra smaller than this are slivers, m³.
const SLIVER: f64 = 1e-12;

/// All colliders of a part in its frame, its feet among them.
pub(super) fn colliders(part: &Part, model: &Model, floor: &Floor) -> Vec<ColliderBuilder> {
    let up = part.world_from_part.rotation.inverse() * floor.normal.into_inner();
    let ring = feet(part, model, Some(floor), Corners::Few);
    let mut all: Vec<ColliderBuilder> = ring
        .iter()
        .map(|at| ColliderBuilder::ball(RADIUS).translation(at.coords.into()))
        .collect();
    for mesh in part.hulls.iter().filter_map(|path| model.meshes.get(path)) {
        let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|v| v + part.link_origin).collect();
        all.extend(hull(&points));
        all.extend(
            level_faces(mesh, &points, &up, ring.is_empty())
                .iter()
                .filter_map(|corners| hull(corners)),
        );
    }
    all.into_iter()
        .map(|c| c.density(0.0).friction(part.surface.kinetic_friction))
        .map(|c| c.friction_combine_rule(CoefficientCombineRule::Max).restitution(0.0))
        .collect()
}

/// The convex parts alone, in the part's frame.
pub(super) fn hulls<'a>(part: &'a Part, model: &'a Model) -> impl Iterator<Item = ColliderBuilder> + 'a {
    let meshes = part.hulls.iter().filter_map(|path| model.meshes.get(path));
    meshes.filter_map(|mesh| {
        let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|v| v + part.link_origin).collect();
        hull(&points)
    })
}

fn hull(points: &[Point3<f64>]) -> Option<ColliderBuilder> {
    let points: Vec<_> = points.iter().map(|p| p.coords.into()).collect();
    ColliderBuilder::convex_hull(&points)
}

/// A tetrahedron from every level face to the middle of the part; of those that look down only where it stands on its `faces`.
fn level_faces(mesh: &Mesh, points: &[Point3<f64>], up: &Vector3<f64>, faces: bool) -> Vec<[Point3<f64>; 4]> {
    let middle = Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64);
    let of = |i: usize| {
        let normal = mesh.scaled_normal(i).try_normalize(0.0)?;
        let [a, b, c] = mesh.triangles[i].map(|v| points[v as usize]);
        let volume = (b - a).cross(&(c - a)).dot(&(middle - a)).abs() / 6.0;
        let level = normal.dot(up) > LEVEL || faces && normal.dot(up) < -LEVEL;
        (level && volume > SLIVER).then_some([a, b, c, middle])
    };
    (0..mesh.triangles.len()).filter_map(of).collect()
}
