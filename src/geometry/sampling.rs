//! Points spread evenly over a surface.

use nalgebra::{Point3, Vector3};
use rand::Rng;

use super::Mesh;

/// A point on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Where it lies, m.
    pub point: Point3<f64>,
    /// Outward unit normal of its triangle.
    pub normal: Vector3<f64>,
    /// Its triangle.
    pub triangle: usize,
}

/// `count` points, uniform by area: systematic draws along the summed area (so that no region is missed by
/// chance), uniform inside each triangle (Osada et al. 2002, eq. 1). Empty where the mesh has no area.
pub fn sample_surface(mesh: &Mesh, count: usize, rng: &mut impl Rng) -> Vec<SurfaceSample> {
    sample_triangles(mesh, count, rng, |_| true)
}

/// As `sample_surface`, on the triangles for which `keep` holds.
pub fn sample_triangles(
    mesh: &Mesh,
    count: usize,
    rng: &mut impl Rng,
    keep: impl Fn(usize) -> bool,
) -> Vec<SurfaceSample> {
    let mut total = 0.0;
    let mut sums = Vec::with_capacity(mesh.triangles.len());
    for i in 0..mesh.triangles.len() {
        total += if keep(i) { mesh.scaled_normal(i).norm() } else { 0.0 };
        sums.push(total);
    }
    if total <= 0.0 {
        return Vec::new();
    }
    (0..count)
        .map(|k| {
            let at = total * (k as f64 + rng.random::<f64>()) / count as f64;
            let triangle = sums.partition_point(|&s| s <= at).min(sums.len() - 1);
            sample_triangle(mesh, triangle, rng.random(), rng.random())
        })
        .collect()
}

fn sample_triangle(mesh: &Mesh, triangle: usize, u: f64, v: f64) -> SurfaceSample {
    let [a, b, c] = mesh.corners(triangle);
    let root = u.sqrt();
    SurfaceSample {
        point: a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v),
        normal: mesh.scaled_normal(triangle).normalize(),
        triangle,
    }
}
