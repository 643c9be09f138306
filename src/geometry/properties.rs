//! Volume, centroid and inertia of the solid that a closed mesh bounds.

use nalgebra::{Matrix3, Point3, Vector3};

use super::{Mesh, is_closed_manifold};

/// Integrals over a solid of density 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidProperties {
    /// m³.
    pub volume: f64,
    /// Centre of mass of the homogeneous solid, m, frame of the mesh.
    pub centroid: Point3<f64>,
    /// Inertia tensor about the centroid, axes of the mesh, for a density of 1 kg/m³ (m⁵).
    pub inertia_per_density: Matrix3<f64>,
}

/// Exact polyhedral integrals: the divergence theorem turns them into sums over tetrahedra that share an apex
/// (Mirtich 1996, "Fast and accurate computation of polyhedral mass properties"; the closed form per
/// tetrahedron is Tonon 2004). Nothing where the mesh is open or turned inside out.
pub fn mass_properties(mesh: &Mesh) -> Option<SolidProperties> {
    is_closed_manifold(mesh).ok()?;
    integrals(mesh).filter(|p| p.volume > 0.0)
}

/// The same sums without the check of closedness, for meshes that are closed but for small faults.
fn integrals(mesh: &Mesh) -> Option<SolidProperties> {
    let (lo, hi) = mesh.bounds()?;
    let apex = nalgebra::center(&lo, &hi);
    let mut volume = 0.0;
    let mut first = Vector3::zeros();
    let mut second = Matrix3::zeros();
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i).map(|p| p - apex);
        let six_volumes = a.dot(&b.cross(&c));
        let sum = a + b + c;
        volume += six_volumes / 6.0;
        first += sum * (six_volumes / 24.0);
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose();
        second += squares * (six_volumes / 120.0);
    }
    if volume.abs() < f64::MIN_POSITIVE {
        return None;
    }
    let offset = first / volume;
    let covariance = second - offset * offset.transpose() * volume;
    Some(SolidProperties {
        volume,
        centroid: apex + offset,
        inertia_per_density: Matrix3::identity() * covariance.trace() - covariance,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, UnitQuaternion};

    use super::*;
    use crate::geometry::solids::{cuboid, cylinder, sphere};

    #[test]
    fn a_box_anywhere_has_its_textbook_inertia() {
        let [a, b, c] = [0.1, 0.2, 0.05];
        let pose = Isometry3::new(Vector3::new(3.0, -2.0, 1.0), Vector3::new(0.3, -0.7, 1.1));
        let p = mass_properties(&cuboid([a, b, c]).transformed(&pose)).unwrap();
        let m = a * b * c;
        let diagonal = Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b) * (m / 12.0);
        let rotation = pose.rotation.to_rotation_matrix();
        let expected = rotation.matrix() * Matrix3::from_diagonal(&diagonal) * rotation.matrix().transpose();
        assert!((p.volume / m - 1.0).abs() < 1e-12);
        assert!((p.centroid.coords - pose.translation.vector).norm() < 1e-12);
        assert!((p.inertia_per_density - expected).norm() < 1e-12 * expected.norm());
    }

    #[test]
    fn round_solids_come_close_to_their_formulas() {
        let ball = mass_properties(&sphere(0.05, 5)).unwrap();
        let expected = 0.4 * 0.05f64.powi(2) * ball.volume;
        assert!((ball.inertia_per_density[(0, 0)] / expected - 1.0).abs() < 2e-3);
        let turned = UnitQuaternion::from_euler_angles(1.0, 0.5, 0.2);
        let can = cylinder(0.03, 0.1, 256).transformed(&Isometry3::from_parts(Vector3::zeros().into(), turned));
        let p = mass_properties(&can).unwrap();
        let about_axis = turned.inverse().to_rotation_matrix() * p.inertia_per_density * turned.to_rotation_matrix();
        assert!((about_axis[(2, 2)] / (0.5 * 0.0009 * p.volume) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn an_open_or_inverted_mesh_has_none() {
        let mut mesh = cuboid([1.0; 3]);
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(mass_properties(&mesh), None);
        mesh.triangles.pop();
        assert_eq!(mass_properties(&mesh), None);
    }
}
