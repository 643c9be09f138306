//! The inertial of a link: as measured, or the documented default where it was not.

use nalgebra::{Matrix3, Point3, Vector3};
use parry3d_f64::transformation::try_convex_hull;

use crate::base::Status;
use crate::geometry::Mesh;
use crate::twin::Link;

/// Density of a link whose mass was never measured, kg/m³: a filled household object.
pub(super) const DEFAULT_DENSITY: f64 = 700.0;
/// Mass of a link that has neither a mass nor a mesh, kg.
pub(super) const DEFAULT_MASS: f64 = 0.1;
/// Radius of the ball that stands for a link without a mesh, m.
pub(super) const DEFAULT_RADIUS: f64 = 0.05;

/// Mass, centre of mass and inertia about it, link frame; with the names of what was assumed.
#[derive(Clone, Debug)]
pub(super) struct Inertial {
    pub(super) mass: f64,
    pub(super) com: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
    pub(super) assumed: Vec<&'static str>,
}

/// A solid of uniform density 1.
struct Solid {
    volume: f64,
    centre: Vector3<f64>,
    inertia: Matrix3<f64>,
}

/// What the exports carry as the inertial of `link`.
pub(super) fn inertial_of(link: &Link, mesh: Option<&Mesh>) -> Inertial {
    let solid = mesh.and_then(solid_of).unwrap_or_else(ball);
    let mut assumed = Vec::new();
    let default_mass = if mesh.is_some() {
        DEFAULT_DENSITY * solid.volume
    } else {
        DEFAULT_MASS
    };
    let mass = link.mass.as_ref().map_or(default_mass, |e| e.value);
    if link.mass.as_ref().is_none_or(|e| e.status == Status::Assumed) {
        assumed.push("mass");
    }
    let com = link.com.as_ref().map_or(solid.centre, |e| Vector3::from(e.value));
    if link.com.as_ref().is_none_or(|e| e.status == Status::Assumed) {
        assumed.push("centre of mass");
    }
    let uniform = solid.inertia * (mass / solid.volume);
    let inertia = link.inertia.as_ref().map_or(uniform, |e| tensor(&e.value));
    if link.inertia.as_ref().is_none_or(|e| e.status == Status::Assumed) {
        assumed.push("inertia");
    }
    Inertial {
        mass,
        com,
        inertia,
        assumed,
    }
}

/// ixx, iyy, izz, ixy, ixz, iyz as a matrix.
pub(super) fn tensor(six: &[f64; 6]) -> Matrix3<f64> {
    let [xx, yy, zz, xy, xz, yz] = *six;
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// A matrix as ixx, iyy, izz, ixy, ixz, iyz.
pub(super) fn six(m: &Matrix3<f64>) -> [f64; 6] {
    [m[(0, 0)], m[(1, 1)], m[(2, 2)], m[(0, 1)], m[(0, 2)], m[(1, 2)]]
}

fn ball() -> Solid {
    let volume = 4.0 / 3.0 * std::f64::consts::PI * DEFAULT_RADIUS.powi(3);
    Solid {
        volume,
        centre: Vector3::zeros(),
        inertia: Matrix3::identity() * (0.4 * volume * DEFAULT_RADIUS * DEFAULT_RADIUS),
    }
}

/// The mesh filled; where it does not close, its hull; where that is flat, its box.
fn solid_of(mesh: &Mesh) -> Option<Solid> {
    let (low, high) = mesh.bounds()?;
    let extent = (high - low).map(|d| d.max(1e-3));
    let least = 1e-3 * extent.product();
    let filled = integrate(mesh).filter(|s| s.volume > least && is_physical(&s.inertia));
    filled
        .or_else(|| {
            hull(mesh)
                .and_then(|h| integrate(&h))
                .filter(|s| s.volume > least && is_physical(&s.inertia))
        })
        .or_else(|| Some(cuboid(nalgebra::center(&low, &high), extent)))
}

fn cuboid(centre: Point3<f64>, extent: Vector3<f64>) -> Solid {
    let volume = extent.product();
    let square = extent.component_mul(&extent);
    let moment = Vector3::new(square.y + square.z, square.x + square.z, square.x + square.y);
    Solid {
        volume,
        centre: centre.coords,
        inertia: Matrix3::from_diagonal(&(moment * (volume / 12.0))),
    }
}

/// The convex hull of a mesh's vertices, or nothing where they lie in a plane.
fn hull(mesh: &Mesh) -> Option<Mesh> {
    let points: Vec<_> = mesh.vertices.iter().map(|p| p.coords.into()).collect();
    let (vertices, triangles) = try_convex_hull(&points).ok()?;
    Some(Mesh {
        vertices: vertices.into_iter().map(|v| Point3::new(v.x, v.y, v.z)).collect(),
        triangles,
        ..Mesh::default()
    })
}

/// Whether the hull of a mesh holds more than a hundredth of a cubic millimetre.
pub(super) fn has_volume(mesh: &Mesh) -> bool {
    hull(mesh).and_then(|h| integrate(&h)).is_some_and(|s| s.volume > 1e-11)
}

/// A box of these full edges about the origin.
pub(super) fn cuboid_mesh(edges: Vector3<f64>) -> Mesh {
    let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
    let vertices = (0..8)
        .map(|i| Point3::new(side(0, i) * edges.x, side(1, i) * edges.y, side(2, i) * edges.z))
        .collect();
    let quads: [[u32; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]])
        .collect();
    Mesh {
        vertices,
        triangles,
        ..Mesh::default()
    }
}

/// Volume, first and second moments by the divergence theorem over the tetrahedra that the triangles
/// make with the origin; nothing where the volume is not positive.
fn integrate(mesh: &Mesh) -> Option<Solid> {
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i).map(|p| p.coords);
        let det = a.dot(&b.cross(&c));
        let sum = a + b + c;
        volume += det / 6.0;
        first += sum * (det / 24.0);
        second += (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * (det / 120.0);
    }
    if volume <= 0.0 || !volume.is_finite() {
        return None;
    }
    let centre = first / volume;
    let covariance = second - centre * centre.transpose() * volume;
    let inertia = Matrix3::identity() * covariance.trace() - covariance;
    let rounding = 1e-12 * inertia.norm();
    Some(Solid {
        volume,
        centre,
        inertia: inertia.map(|v| if v.abs() < rounding { 0.0 } else { v }),
    })
}

/// Positive definite, and no principal moment greater than the other two together.
fn is_physical(inertia: &Matrix3<f64>) -> bool {
    let e = inertia.symmetric_eigenvalues();
    e.min() > 0.0 && 2.0 * e.max() <= e.sum() * (1.0 + 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Pose;

    fn corner_box(d: [f64; 3]) -> Mesh {
        let mut mesh = cuboid_mesh(Vector3::from(d));
        mesh.vertices.iter_mut().for_each(|v| *v += Vector3::from(d) / 2.0);
        mesh
    }

    #[test]
    fn a_filled_box_has_the_inertia_of_a_box() {
        let link = Link::new("box", Pose::identity());
        let d = [0.1, 0.2, 0.3];
        let got = inertial_of(&link, Some(&corner_box(d)));
        let mass = DEFAULT_DENSITY * 0.006;
        assert!((got.mass - mass).abs() < 1e-9);
        assert!((got.com - Vector3::from(d) / 2.0).norm() < 1e-12);
        assert!((got.inertia[(0, 0)] - mass / 12.0 * (0.04 + 0.09)).abs() < 1e-9);
        assert!(got.inertia[(0, 1)].abs() < 1e-12);
        assert_eq!(got.assumed.len(), 3);
    }

    #[test]
    fn a_link_without_a_mesh_is_a_small_ball() {
        let got = inertial_of(&Link::new("ghost", Pose::identity()), None);
        assert_eq!(got.mass, DEFAULT_MASS);
        assert!((got.inertia[(2, 2)] - 0.4 * DEFAULT_MASS * DEFAULT_RADIUS * DEFAULT_RADIUS).abs() < 1e-15);
    }
}
