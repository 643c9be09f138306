//! The mean distance between two surfaces.

use nalgebra::Point3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;

use crate::base::{Error, Result};
use crate::geometry::Mesh;

/// Points on each surface.
const SAMPLES: usize = 4000;

/// Mean of the distance from `a` to `b` and of that from `b` to `a`, m, each over points spread evenly over
/// the area.
///
/// # Errors
/// Where a mesh has no area.
pub(super) fn mean_distance(a: &Mesh, b: &Mesh) -> Result<f64> {
    Ok(0.5 * (one_way(a, b)? + one_way(b, a)?))
}

/// Mean distance, m, from the part of `mesh` that was seen (all of it where nothing is known of that) to `right`.
///
/// # Errors
/// Where a mesh has no area.
pub(super) fn seen_distance(mesh: &Mesh, right: &Mesh) -> Result<f64> {
    let flagged = mesh.seen.len() == mesh.vertices.len();
    let seen = mesh.subset(|t| !flagged || mesh.triangles[t].iter().all(|v| mesh.seen[*v as usize]));
    one_way(if seen.triangles.is_empty() { mesh } else { &seen }, right)
}

fn one_way(from: &Mesh, to: &Mesh) -> Result<f64> {
    let vertices = to.vertices.iter().map(|v| v.coords.into()).collect();
    let surface = TriMesh::new(vertices, to.triangles.clone()).map_err(|e| Error::Failed(format!("mesh: {e}")))?;
    let points = spread(from);
    if points.is_empty() {
        return Err(Error::Failed("a mesh without area cannot be scored".into()));
    }
    let distance = |p: &Point3<f64>| {
        let p = p.coords.into();
        (surface.project_local_point(p, false).point - p).length()
    };
    Ok(points.iter().map(distance).sum::<f64>() / points.len() as f64)
}

/// Points at even steps of area, placed inside their triangles by a low-discrepancy sequence (Roberts' R2).
fn spread(mesh: &Mesh) -> Vec<Point3<f64>> {
    let step = mesh.area() / SAMPLES as f64;
    if step <= 0.0 || !step.is_finite() {
        return Vec::new();
    }
    let (mut points, mut swept) = (Vec::with_capacity(SAMPLES), 0.0);
    for i in 0..mesh.triangles.len() {
        swept += 0.5 * mesh.scaled_normal(i).norm();
        let [a, b, c] = mesh.corners(i);
        while (points.len() as f64 + 0.5) * step < swept {
            let n = points.len() as f64;
            let (u, v) = (
                (n * 0.754_877_666_246_692_7).fract(),
                (n * 0.569_840_290_998_053_2).fract(),
            );
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}
