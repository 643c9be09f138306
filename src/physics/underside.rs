//! What of a mesh faces the support.

use nalgebra::{Isometry3, Point2, Point3};

use super::Footprint;
use super::foot::Under;
use crate::geometry::Mesh;

/// Height above the lowest point up to which a mesh may stand on it, and that of the cut that tells where it does not, m.
const NEAR: f64 = 3e-3;
const CUT: f64 = 1.5e-3;
/// Share of its hull that a cut leaves out at least, and at most, to be the footprint of something with a notch.
const NOTCHED: [f64; 2] = [0.07, 0.7];

/// The torsional radius of uniform pressure over the underside of a mesh at `pose` (z up), m.
pub fn uniform_torsional_radius(mesh: &Mesh, pose: &Isometry3<f64>) -> Option<f64> {
    let under = underside(mesh, pose)?;
    Some(under.mean_distance(&under.area_centroid().1))
}

/// The torsional radius of a mesh at `pose` (z up) that stands on the corners of its underside alone, m: none is larger.
pub fn outermost_torsional_radius(mesh: &Mesh, pose: &Isometry3<f64>) -> Option<f64> {
    let under = underside(mesh, pose)?;
    Some(Under::of(&under, &under.area_centroid().1).outermost)
}

/// The hull of what is within 3 mm of the lowest point; of an L or a U the outline just above it.
pub(super) fn underside(mesh: &Mesh, pose: &Isometry3<f64>) -> Option<Footprint> {
    let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|v| pose * v).collect();
    let lowest = lowest(mesh, pose);
    let near: Vec<Point2<f64>> = points.iter().filter(|p| p.z < lowest + NEAR).map(|p| p.xy()).collect();
    let hull = Footprint::hull(near)?;
    let notched = |cut: &Footprint| {
        let left_out = 1.0 - cut.area_centroid().0 / hull.area_centroid().0.max(1e-12);
        let own = 1.0 - cut.area_centroid().0 / cut.rim().area_centroid().0.max(1e-12);
        own > NOTCHED[0] && left_out < NOTCHED[1]
    };
    let cut = Footprint::section(&points, &mesh.triangles, lowest + CUT).filter(notched);
    Some(cut.unwrap_or(hull))
}

/// Height of the lowest point of a mesh at `pose`, m.
pub(super) fn lowest(mesh: &Mesh, pose: &Isometry3<f64>) -> f64 {
    mesh.vertices.iter().map(|v| (pose * v).z).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism over a polygon, 0.06 m high, whose triangles fan out from its first corner.
    fn prism(outline: &[[f64; 2]]) -> Mesh {
        let n = outline.len() as u32;
        let at = |z: f64| outline.iter().map(move |p| Point3::new(p[0], p[1], z));
        let walls = (0..n).flat_map(|i| {
            let j = (i + 1) % n;
            [[i, j, n + j], [i, n + j, n + i]]
        });
        let caps = (1..n - 1).flat_map(|i| [[0, i + 1, i], [n, n + i, n + i + 1]]);
        Mesh {
            vertices: at(0.0).chain(at(0.06)).collect(),
            triangles: walls.chain(caps).collect(),
            ..Mesh::default()
        }
    }

    #[test]
    fn an_l_stands_on_its_two_arms_alone() {
        let l = [
            [0.0, 0.0],
            [0.12, 0.0],
            [0.12, 0.04],
            [0.04, 0.04],
            [0.04, 0.12],
            [0.0, 0.12],
        ];
        let under = underside(&prism(&l), &Isometry3::identity()).expect("an underside");
        let (area, middle) = under.area_centroid();
        // Two rectangles: 0.12 by 0.04 about (0.06, 0.02) and 0.04 by 0.08 about (0.02, 0.08).
        assert!((area - 0.008).abs() < 1e-6, "{area}");
        assert!((middle - Point2::new(0.044, 0.044)).norm() < 1e-6, "{middle}");
        let points = under.quadrature();
        let sum: f64 = points.iter().map(|p| p.1).sum();
        let mean = points
            .iter()
            .map(|(p, w)| p.coords * *w)
            .sum::<nalgebra::Vector2<f64>>()
            / sum;
        assert!(points.iter().all(|(p, _)| p.x < 0.04 || p.y < 0.04));
        assert!(
            (sum / area - 1.0).abs() < 0.05 && (mean - middle.coords).norm() < 2e-3,
            "{sum} {mean}"
        );
        let square = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]];
        let under = underside(&prism(&square), &Isometry3::identity()).expect("an underside");
        assert_eq!(under.corners().len(), 4);
    }
}
