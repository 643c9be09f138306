//! Volume, centroid and inertia of a closed mesh at unit density.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::Mesh;

/// A solid of density 1 kg/m³.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    /// m³.
    pub volume: f64,
    /// Centroid, mesh frame, m.
    pub centroid: Point3<f64>,
    /// Inertia about the centroid, mesh axes, m⁵.
    pub inertia: Matrix3<f64>,
    /// Largest extent along each axis, m.
    pub extent: Vector3<f64>,
}

/// Mass properties by summing signed tetrahedra to the origin (divergence theorem); `None` where the mesh
/// encloses nothing.
pub(super) fn solid_of(mesh: &Mesh) -> Option<Solid> {
    let (low, high) = mesh.bounds()?;
    let middle = nalgebra::center(&low, &high);
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i).map(|p| p - middle);
        let six = a.dot(&b.cross(&c));
        let sum = a + b + c;
        volume += six / 6.0;
        first += six / 24.0 * sum;
        second += six / 120.0 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
    }
    let extent = high - low;
    if volume.is_nan() || volume <= 1e-6 * extent.product().abs() {
        return None;
    }
    let centroid = first / volume;
    let covariance = second - volume * centroid * centroid.transpose();
    Some(Solid {
        volume,
        centroid: middle + centroid,
        inertia: Matrix3::identity() * covariance.trace() - covariance,
        extent,
    })
}

/// A closed box, for tests.
#[cfg(test)]
pub(super) fn box_mesh(half: Vector3<f64>, centre: Vector3<f64>) -> Mesh {
    let corner = |i: u32| {
        let s = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
        Point3::from(centre + Vector3::new(s(1) * half.x, s(2) * half.y, s(4) * half.z))
    };
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
            .collect(),
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_off_the_origin_has_the_textbook_inertia() {
        let (half, centre) = (Vector3::new(0.1, 0.05, 0.02), Vector3::new(1.0, -2.0, 0.5));
        let solid = solid_of(&box_mesh(half, centre)).expect("closed");
        let volume = 8.0 * half.product();
        assert!((solid.volume / volume - 1.0).abs() < 1e-12);
        assert!((solid.centroid.coords - centre).norm() < 1e-12);
        let ixx = volume / 3.0 * (half.y.powi(2) + half.z.powi(2));
        assert!((solid.inertia[(0, 0)] / ixx - 1.0).abs() < 1e-9);
        assert!(solid.inertia[(0, 1)].abs() < 1e-12);
    }
}
