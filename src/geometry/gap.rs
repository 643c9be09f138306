//! How near two surfaces come to each other.

use nalgebra::Point3;

use super::{Mesh, SurfaceDistance};

/// Points per edge on which the gap is probed.
const PER_EDGE: usize = 4;
/// Points of a surface that are probed at most.
const MOST: usize = 4000;

/// Smallest distance between two surfaces, m (0 where they meet), probed at the vertices, along the edges and
/// at the centres of the triangles of each against the surface of the other; nothing for an empty mesh.
pub fn gap(a: &Mesh, b: &Mesh) -> Option<f64> {
    let (on_a, on_b) = (SurfaceDistance::new(a)?, SurfaceDistance::new(b)?);
    let nearest = |points: Vec<Point3<f64>>, surface: &SurfaceDistance| {
        points.iter().map(|p| surface.distance(p)).fold(f64::INFINITY, f64::min)
    };
    Some(nearest(probes(a), &on_b).min(nearest(probes(b), &on_a)))
}

fn probes(mesh: &Mesh) -> Vec<Point3<f64>> {
    let mut points = mesh.vertices.clone();
    if mesh.triangles.len() * (3 * PER_EDGE + 1) < MOST {
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(i);
            points.push(Point3::from((a.coords + b.coords + c.coords) / 3.0));
            for (p, q) in [(a, b), (b, c), (c, a)] {
                points.extend((1..=PER_EDGE).map(|k| p + (q - p) * (k as f64 / (PER_EDGE + 1) as f64)));
            }
        }
    }
    let stride = points.len().div_ceil(MOST).max(1);
    points.into_iter().step_by(stride).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::cuboid;

    #[test]
    fn two_boxes_side_by_side_are_as_far_apart_as_their_faces() {
        let a = cuboid([0.1, 0.1, 0.1]);
        let b = a.transformed(&nalgebra::Isometry3::translation(0.107, 0.02, 0.01));
        assert!((gap(&a, &b).expect("not empty") - 0.007).abs() < 1e-9);
    }
}
