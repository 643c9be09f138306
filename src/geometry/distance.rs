//! How far points, and whole meshes, are from a surface.

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::{PointQuery, PointQueryWithLocation, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

use super::{Mesh, is_closed_manifold, sample_surface};
use crate::base::{Seed, rng_for};

/// Answers nearest-point queries on a mesh through a tree of boxes.
pub struct SurfaceDistance {
    tree: TriMesh,
    closed: bool,
}

/// The point of a surface nearest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// On the surface, m.
    pub point: Point3<f64>,
    /// The triangle that holds it.
    pub triangle: usize,
    /// From the query to it, m.
    pub distance: f64,
}

impl SurfaceDistance {
    /// Builds the tree; nothing for a mesh without triangles.
    pub fn new(mesh: &Mesh) -> Option<Self> {
        let vertices = mesh.vertices.iter().map(to_parry).collect();
        let mut tree = TriMesh::new(vertices, mesh.triangles.clone()).ok()?;
        let closed = is_closed_manifold(mesh).is_ok() && tree.set_flags(TriMeshFlags::ORIENTED).is_ok();
        Some(Self { tree, closed })
    }

    /// The nearest point of the surface; nothing for a query that is not finite.
    pub fn nearest(&self, p: &Point3<f64>) -> Option<Nearest> {
        self.nearest_within(p, f64::MAX)
    }

    /// The nearest point of the surface if it is nearer than `limit`, m: the tighter, the faster.
    pub fn nearest_within(&self, p: &Point3<f64>, limit: f64) -> Option<Nearest> {
        let query = to_parry(p);
        let (projection, (triangle, _)) = self
            .tree
            .project_local_point_and_get_location_with_max_dist(query, false, limit)?;
        let point = from_parry(projection.point);
        Some(Nearest {
            point,
            triangle: triangle as usize,
            distance: (point - p).norm(),
        })
    }

    /// Distance to the surface, m; infinite for a query that is not finite.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        self.nearest(p).map_or(f64::INFINITY, |n| n.distance)
    }

    /// Distance, negative inside (Bærentzen & Aanæs 2005, angle-weighted pseudonormals); nothing where the mesh
    /// bounds no solid.
    pub fn signed(&self, p: &Point3<f64>) -> Option<f64> {
        self.closed.then(|| {
            let projection = self.tree.project_local_point(to_parry(p), false);
            let distance = (from_parry(projection.point) - p).norm();
            if projection.is_inside { -distance } else { distance }
        })
    }

    /// As `signed`; where the mesh bounds no solid the sign is that of the side of the nearest triangle, a guess
    /// that serves for meshes with small faults. Infinite for a query that is not finite.
    pub fn signed_or_guessed(&self, p: &Point3<f64>) -> f64 {
        self.signed(p).unwrap_or_else(|| {
            self.nearest(p).map_or(f64::INFINITY, |n| {
                let side = self.normal(n.triangle).dot(&(p - n.point));
                if side < 0.0 { -n.distance } else { n.distance }
            })
        })
    }

    /// Whether a ray meets the surface within a number of lengths of its direction.
    pub fn is_hit(&self, from: &Point3<f64>, direction: &Vector3<f64>, most: f64) -> bool {
        let ray = Ray::new(to_parry(from), Vector::new(direction.x, direction.y, direction.z));
        self.tree.intersects_local_ray(&ray, most)
    }

    /// Where a ray meets the surface first, in lengths of its direction; nothing beyond `most` of them.
    pub fn first_hit(&self, from: &Point3<f64>, direction: &Vector3<f64>, most: f64) -> Option<f64> {
        let ray = Ray::new(to_parry(from), Vector::new(direction.x, direction.y, direction.z));
        self.tree.cast_local_ray(&ray, most, false)
    }

    /// Outward unit normal of a triangle; zero where it has no area.
    pub fn normal(&self, triangle: usize) -> Vector3<f64> {
        let t = self.tree.triangle(triangle as u32);
        let (a, b, c) = (from_parry(t.a), from_parry(t.b), from_parry(t.c));
        (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
    }
}

fn to_parry(p: &Point3<f64>) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

fn from_parry(v: Vector) -> Point3<f64> {
    Point3::new(v.x, v.y, v.z)
}

/// How far one surface lies from another, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceError {
    /// Mean distance.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// 95 of 100 points are nearer than this.
    pub p95: f64,
    /// Farthest of the sampled points.
    pub max: f64,
}

/// Distances of points spread evenly over `a` from the surface of `b` (one way: take both ways for a symmetric
/// figure). Nothing where either has no area.
pub fn mean_surface_error(a: &Mesh, b: &Mesh, samples: usize, seed: Seed) -> Option<SurfaceError> {
    let surface = SurfaceDistance::new(b)?;
    let mut distances: Vec<f64> = sample_surface(a, samples, &mut rng_for(seed, "mean-surface-error"))
        .iter()
        .map(|s| surface.distance(&s.point))
        .collect();
    distances.sort_by(f64::total_cmp);
    let count = distances.len() as f64;
    let max = *distances.last()?;
    Some(SurfaceError {
        mean: distances.iter().sum::<f64>() / count,
        rms: (distances.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
        p95: distances[((0.95 * count) as usize).min(distances.len() - 1)],
        max,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::{cuboid, sphere};

    #[test]
    fn distances_to_a_box_are_the_ones_by_hand() {
        let surface = SurfaceDistance::new(&cuboid([0.2, 0.2, 0.2])).unwrap();
        for (p, expected) in [
            ([0.0, 0.0, 0.0], -0.1),
            ([0.05, 0.0, 0.09], -0.01),
            ([0.3, 0.0, 0.0], 0.2),
            ([0.13, 0.14, 0.0], 0.05),
            ([0.12, 0.12, 0.11], 0.03),
        ] {
            let p = Point3::from(p);
            assert!((surface.distance(&p) - f64::abs(expected)).abs() < 1e-12, "{p}");
            assert!((surface.signed(&p).unwrap() - expected).abs() < 1e-12, "{p}");
        }
    }

    #[test]
    fn an_open_mesh_has_no_sign() {
        let mut open = cuboid([0.2; 3]);
        open.triangles.pop();
        assert_eq!(SurfaceDistance::new(&open).unwrap().signed(&Point3::origin()), None);
    }

    #[test]
    fn two_spheres_are_apart_by_the_difference_of_their_radii() {
        let e = mean_surface_error(&sphere(0.051, 4), &sphere(0.05, 4), 2000, Seed(1)).unwrap();
        assert!(
            (e.mean - 0.001).abs() < 5e-5 && e.max < 0.0011 && e.rms >= e.mean && e.p95 <= e.max,
            "{e:?}"
        );
    }
}
