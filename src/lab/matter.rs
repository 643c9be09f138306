//! Mass, centre and inertia of the lab's solids, exact from their closed surfaces.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::Mesh;

/// Mass, centre of mass and inertia about it. SI units, body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Matter {
    /// kg.
    pub mass: f64,
    /// m.
    pub com: Point3<f64>,
    /// About the centre of mass, kg·m².
    pub inertia: Matrix3<f64>,
}

impl Matter {
    /// A uniform filling of a closed surface.
    ///
    /// Sums over the tetrahedra between the origin and each triangle: with corners a, b, c and d = a·(b×c), the
    /// volume is d/6, the first moment d(a+b+c)/24 and the second moment d(aaᵀ+bbᵀ+ccᵀ+ssᵀ)/120 with s = a+b+c
    /// (Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004).
    pub fn filling(mesh: &Mesh, density: f64) -> Self {
        let mut volume = 0.0;
        let mut first = Vector3::zeros();
        let mut second = Matrix3::zeros();
        for i in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(i).map(|p| p.coords);
            let d = a.dot(&b.cross(&c));
            let s = a + b + c;
            volume += d / 6.0;
            first += s * (d / 24.0);
            second += (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose()) * (d / 120.0);
        }
        let com = first / volume;
        let central = second - com * com.transpose() * volume;
        Self {
            mass: density * volume,
            com: com.into(),
            inertia: (Matrix3::identity() * central.trace() - central) * density,
        }
    }

    /// A uniform ball.
    pub fn ball(mass: f64, center: Point3<f64>, radius: f64) -> Self {
        Self {
            mass,
            com: center,
            inertia: Matrix3::identity() * (0.4 * mass * radius * radius),
        }
    }

    /// The two together (parallel axis theorem).
    pub fn with(self, other: Self) -> Self {
        let mass = self.mass + other.mass;
        let com = Point3::from((self.com.coords * self.mass + other.com.coords * other.mass) / mass);
        Self {
            mass,
            com,
            inertia: self.inertia_about(com) + other.inertia_about(com),
        }
    }

    fn inertia_about(&self, point: Point3<f64>) -> Matrix3<f64> {
        let r = self.com - point;
        self.inertia + (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * self.mass
    }
}

#[cfg(test)]
mod tests {
    use super::super::surface::surface;
    use super::*;
    use crate::lab::ShapeSpec;

    fn check(claim: &str, shape: &ShapeSpec, mass: f64, com: [f64; 3], diagonal: [f64; 3], tolerance: f64) {
        let matter = Matter::filling(&surface(shape), 1000.0);
        let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= tolerance * scale;
        assert!(
            near(matter.mass, mass, mass),
            "{claim}: mass {} not {mass}",
            matter.mass
        );
        for k in 0..3 {
            assert!((matter.com[k] - com[k]).abs() < 1e-4, "{claim}: com {}", matter.com);
            let found = matter.inertia[(k, k)];
            assert!(
                near(found, diagonal[k], diagonal[k]),
                "{claim}: inertia {k} {found} not {}",
                diagonal[k]
            );
        }
    }

    #[test]
    fn a_box_has_the_inertia_of_the_textbook() {
        let [x, y, z] = [0.1, 0.06, 0.04];
        let m = 1000.0 * x * y * z;
        let diagonal = [y * y + z * z, x * x + z * z, x * x + y * y].map(|s| m * s / 12.0);
        check("box", &ShapeSpec::Box { size: [x, y, z] }, m, [0.0; 3], diagonal, 1e-12);
    }

    #[test]
    fn round_things_have_the_inertia_of_the_textbook_but_for_their_facets() {
        let (r, h) = (0.03, 0.08);
        let m = 1000.0 * std::f64::consts::PI * r * r * h;
        let side = m * (3.0 * r * r + h * h) / 12.0;
        let shape = ShapeSpec::Cylinder { radius: r, height: h };
        check("cylinder", &shape, m, [0.0; 3], [side, side, m * r * r / 2.0], 3e-3);
        let m = 1000.0 * std::f64::consts::PI * r * r * r * 4.0 / 3.0;
        let shape = ShapeSpec::Sphere { radius: r };
        check("sphere", &shape, m, [0.0; 3], [0.4 * m * r * r; 3], 5e-3);
        let profile = vec![[0.0, 0.0], [r, 0.0], [r, h], [0.0, h]];
        let m = 1000.0 * std::f64::consts::PI * r * r * h;
        let shape = ShapeSpec::Lathe { profile, handle: None };
        check(
            "lathe",
            &shape,
            m,
            [0.0, 0.0, h / 2.0],
            [side, side, m * r * r / 2.0],
            3e-3,
        );
    }

    #[test]
    fn a_tray_is_a_box_less_its_cavity() {
        let size = [0.12, 0.10, 0.06];
        let shape = ShapeSpec::Tray {
            size,
            wall: 0.006,
            open: "-x".into(),
        };
        let outer = Matter::filling(&surface(&ShapeSpec::Box { size }), 1000.0);
        let mut cavity = Matter::filling(
            &surface(&ShapeSpec::Box {
                size: [0.114, 0.088, 0.048],
            }),
            1000.0,
        );
        cavity.com.x -= 0.003;
        let tray = Matter::filling(&surface(&shape), 1000.0);
        let whole = tray.with(cavity);
        assert!((whole.mass - outer.mass).abs() < 1e-12);
        assert!((whole.com - outer.com).norm() < 1e-12);
        assert!((whole.inertia - outer.inertia).norm() < 1e-12 * outer.inertia.norm().max(1.0));
    }

    #[test]
    fn a_hidden_weight_shifts_the_centre_and_adds_its_inertia() {
        let filling = Matter::ball(1.0, Point3::origin(), 0.1);
        let both = filling.with(Matter::ball(1.0, Point3::new(0.2, 0.0, 0.0), 0.1));
        assert!((both.com.x - 0.1).abs() < 1e-15);
        assert!((both.inertia[(1, 1)] - (2.0 * 0.4 * 0.01 + 2.0 * 0.01)).abs() < 1e-15);
        assert!((both.inertia[(0, 0)] - 2.0 * 0.4 * 0.01).abs() < 1e-15);
    }
}
