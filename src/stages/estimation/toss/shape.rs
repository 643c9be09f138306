//! Shapes of what is thrown: from its mesh, or carved from the planes that its links lay, rolled and fell on.

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector3};

use super::conditions::Solid;
use crate::geometry::{Mesh, convex_hull, slim_hull};
use crate::stages::estimation::solid::solid_of;

/// Most corners of a hull, and how far it may stay inside the full one, m.
const CORNERS: usize = 40;
const WITHIN: f64 = 3e-4;
/// A half space that leaves less than this about the origin is a mistake of the track, m.
const CORE: f64 = 5e-3;
/// A carved link reaches no farther than this, m.
const FAR: f64 = 0.3;

/// A mesh at uniform density about `origin` (mesh frame); axes of the mesh.
pub fn of_mesh(mesh: &Mesh, origin: &Point3<f64>) -> Option<Solid> {
    let solid = solid_of(mesh)?;
    let hull = slim_hull(&mesh.vertices, CORNERS, WITHIN)?;
    Some(Solid {
        centre: solid.centroid - origin,
        inertia: solid.inertia / solid.volume,
        corners: hull.vertices.iter().map(|v| v - origin).collect(),
        inward: inward(&hull),
    })
}

/// The way of each corner per metre by which all faces about it move in: least squares over their normals.
fn inward(hull: &Mesh) -> Vec<Vector3<f64>> {
    let mut normals: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); hull.vertices.len()];
    for (i, corners) in hull.triangles.iter().enumerate() {
        let Some(n) = hull.scaled_normal(i).try_normalize(1e-18) else {
            continue;
        };
        for c in corners {
            let own = &mut normals[*c as usize];
            if own.iter().all(|m| m.dot(&n) < 0.999) {
                own.push(n);
            }
        }
    }
    let one = |own: &Vec<Vector3<f64>>| {
        let a = DMatrix::from_fn(own.len(), 3, |i, k| own[i][k]);
        let b = DVector::from_element(own.len(), -1.0);
        let solved = a.svd(true, true).solve(&b, 1e-3).ok();
        // A needle would draw back without end.
        solved.map_or_else(Vector3::zeros, |d| Vector3::new(d[0], d[1], d[2]).cap_magnitude(2.5))
    };
    normals.iter().map(one).collect()
}

/// The largest convex body that no pose pushes through the support: the intersection of the half spaces above it in
/// the link's axes, by the hull of their duals about the link's origin. `poses` are world-from-link; `origin` is in the
/// link's frame. Nothing where the poses leave it open.
pub fn carved(
    poses: impl Iterator<Item = Isometry3<f64>>,
    normal: &Vector3<f64>,
    height: f64,
    origin: &Point3<f64>,
) -> Option<Solid> {
    let mut dual: Vec<Point3<f64>> = poses
        .filter_map(|pose| {
            let clearance = normal.dot(&pose.translation.vector) - height;
            (clearance > CORE).then(|| Point3::from(-(pose.rotation.inverse() * normal) / clearance))
        })
        .collect();
    for k in 0..3 {
        let axis = Vector3::ith(k, 1.0 / FAR);
        dual.extend([Point3::from(axis), Point3::from(-axis)]);
    }
    let faces = convex_hull(&dual)?;
    let corner = |i: usize| {
        let n = faces.scaled_normal(i).try_normalize(1e-18)?;
        let distance = n.dot(&faces.corners(i)[0].coords);
        (distance > 1e-9).then(|| Point3::from(n / distance))
    };
    let corners: Vec<Point3<f64>> = (0..faces.triangles.len()).filter_map(corner).collect();
    let hull = convex_hull(&corners)?;
    let (low, high) = hull.bounds()?;
    if (high - low).amax() > 1.5 * FAR {
        return None;
    }
    of_mesh(&hull, origin)
}
