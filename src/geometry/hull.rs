//! Convex hulls, and hulls with few vertices.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::try_convex_hull;

use super::Mesh;

/// The convex hull of `points` as a closed mesh, or nothing where they span no volume.
pub fn convex_hull(points: &[Point3<f64>]) -> Option<Mesh> {
    if points.len() < 4 {
        return None;
    }
    let cloud: Vec<Vector> = points.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    let (vertices, triangles) = try_convex_hull(&cloud).ok()?;
    let hull = Mesh {
        vertices: vertices.iter().map(|v| Point3::new(v.x, v.y, v.z)).collect(),
        triangles,
        ..Mesh::default()
    };
    let (lo, hi) = hull.bounds()?;
    (hull.volume() > 1e-9 * (hi - lo).norm().powi(3)).then_some(hull)
}

/// A hull of at most `max_vertices` of the points that stays within `tolerance` (m) inside the full hull
/// where that many vertices allow it: starts from the extremes along the axes and adds, one at a time, the
/// point that stands out farthest. It never stands out of the full hull, so a flat face stays flat.
pub fn slim_hull(points: &[Point3<f64>], max_vertices: usize, tolerance: f64) -> Option<Mesh> {
    let full = convex_hull(points)?;
    if full.vertices.len() <= 12.min(max_vertices) {
        return Some(full);
    }
    let mut chosen = extremes(&full.vertices);
    let mut best = convex_hull(&pick(&full.vertices, &chosen));
    while chosen.len() < max_vertices {
        let farthest = best.as_ref().map_or_else(
            || first_unchosen(full.vertices.len(), &chosen),
            |hull| farthest_outside(&full.vertices, hull, tolerance),
        );
        let Some(next) = farthest.filter(|i| !chosen.contains(i)) else {
            break;
        };
        chosen.push(next);
        best = convex_hull(&pick(&full.vertices, &chosen)).or(best);
    }
    best.or(Some(full))
}

fn pick(points: &[Point3<f64>], chosen: &[usize]) -> Vec<Point3<f64>> {
    chosen.iter().map(|&i| points[i]).collect()
}

fn first_unchosen(count: usize, chosen: &[usize]) -> Option<usize> {
    (0..count).find(|i| !chosen.contains(i))
}

fn extremes(points: &[Point3<f64>]) -> Vec<usize> {
    let mut chosen = Vec::new();
    for direction in [
        Vector3::x(),
        Vector3::y(),
        Vector3::z(),
        -Vector3::x(),
        -Vector3::y(),
        -Vector3::z(),
    ] {
        let reach = |i: usize| points[i].coords.dot(&direction);
        let best = (0..points.len()).max_by(|&a, &b| reach(a).total_cmp(&reach(b)).then(b.cmp(&a)));
        if let Some(i) = best.filter(|i| !chosen.contains(i)) {
            chosen.push(i);
        }
    }
    chosen
}

/// The point that stands out of `hull` farthest (over its planes), if by more than `tolerance`.
fn farthest_outside(points: &[Point3<f64>], hull: &Mesh, tolerance: f64) -> Option<usize> {
    let planes = face_planes(hull);
    let out = |p: &Point3<f64>| {
        planes
            .iter()
            .map(|(n, d)| n.dot(&p.coords) - d)
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let (best, i) = points
        .iter()
        .enumerate()
        .map(|(i, p)| (out(p), i))
        .max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
    (best > tolerance).then_some(i)
}

/// Unit outward normals and offsets of the faces of a convex mesh; faces without area are left out.
pub(super) fn face_planes(hull: &Mesh) -> Vec<(Vector3<f64>, f64)> {
    (0..hull.triangles.len())
        .filter_map(|i| {
            let normal = hull.scaled_normal(i).try_normalize(1e-15)?;
            Some((normal, normal.dot(&hull.corners(i)[0].coords)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::is_closed_manifold;
    use crate::geometry::solids::{cuboid, sphere};

    #[test]
    fn the_hull_of_a_box_with_points_inside_is_the_box() {
        let mut points = cuboid([0.1, 0.2, 0.3]).vertices;
        points.push(Point3::new(0.01, 0.02, 0.03));
        let hull = convex_hull(&points).unwrap();
        assert_eq!(hull.vertices.len(), 8);
        assert!((hull.volume() - 0.006).abs() < 1e-12);
        assert_eq!(is_closed_manifold(&hull), Ok(()));
    }

    #[test]
    fn flat_points_have_no_hull() {
        let points: Vec<_> = (0..10)
            .map(|i| Point3::new(f64::from(i), f64::from(i * i), 0.0))
            .collect();
        assert_eq!(convex_hull(&points), None);
    }

    #[test]
    fn a_slim_hull_stays_inside_and_near() {
        let ball = sphere(0.05, 4);
        let slim = slim_hull(&ball.vertices, 64, 1e-5).unwrap();
        assert!(slim.vertices.len() <= 64);
        assert!(slim.volume() < ball.volume() && slim.volume() > 0.85 * ball.volume());
    }
}
