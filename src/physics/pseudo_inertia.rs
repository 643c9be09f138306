//! The ten inertial parameters of a rigid body by the log-Cholesky factor of its pseudo-inertia (Rucker and Wensing 2022).
//!
//! `J = [[S, h], [h', m]] = U U'` with the second moments `S`, `h = m com` and `U = exp(a) [[A, t], [0, 1]]`, `A` upper
//! triangular with an exponential diagonal: every choice of the ten numbers is a body that matter can make (positive mass,
//! positive definite inertia, triangle inequality), and every such body has one such choice.

use nalgebra::{Matrix3, Vector3};

/// `a`, the logarithms of the diagonal of `A`, its entries 12, 23, 13, and `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PseudoInertia(pub [f64; 10]);

impl PseudoInertia {
    /// From mass (kg), centre of mass (m) and inertia about it (kg·m²); nothing where no matter is like that.
    pub fn of(mass: f64, com: &Vector3<f64>, inertia: &Matrix3<f64>) -> Option<Self> {
        let moments = (Matrix3::identity() * (0.5 * inertia.trace()) - inertia) / mass;
        // Cholesky from the far corner, which is the usual one with rows and columns turned about.
        let turned = Matrix3::from_fn(|i, j| moments[(2 - i, 2 - j)]);
        let lower = turned.cholesky()?.l();
        let upper = |i: usize, j: usize| lower[(2 - i, 2 - j)];
        let logs = [0, 1, 2].map(|k| upper(k, k).ln());
        (mass > 0.0).then(|| {
            Self([
                0.5 * mass.ln(),
                logs[0],
                logs[1],
                logs[2],
                upper(0, 1),
                upper(1, 2),
                upper(0, 2),
                com.x,
                com.y,
                com.z,
            ])
        })
    }

    /// kg.
    pub fn mass(&self) -> f64 {
        (2.0 * self.0[0]).exp()
    }

    /// m.
    pub fn com(&self) -> Vector3<f64> {
        Vector3::new(self.0[7], self.0[8], self.0[9])
    }

    /// About the centre of mass, kg·m².
    pub fn inertia(&self) -> Matrix3<f64> {
        let [_, x, y, z, xy, yz, xz, ..] = self.0;
        let a = Matrix3::new(x.exp(), xy, xz, 0.0, y.exp(), yz, 0.0, 0.0, z.exp());
        let moments = a * a.transpose() * self.mass();
        Matrix3::identity() * moments.trace() - moments
    }

    /// Radius of gyration about an axis through the centre of mass with this unit direction, m.
    pub fn gyration_radius(&self, axis: &Vector3<f64>) -> f64 {
        (axis.dot(&(self.inertia() * axis)) / self.mass()).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_is_given_back() {
        let half = Vector3::new(0.05, 0.03, 0.02);
        let diagonal = Vector3::new(0.0009 + 0.0004, 0.0025 + 0.0004, 0.0025 + 0.0009) * (0.4 / 3.0);
        let turn = nalgebra::Rotation3::new(Vector3::new(0.3, -0.2, 0.5)).into_inner();
        let inertia = turn * Matrix3::from_diagonal(&diagonal) * turn.transpose();
        let body = PseudoInertia::of(0.4, &half, &inertia).expect("a box");
        assert!((body.mass() - 0.4).abs() < 1e-12 && (body.com() - half).norm() < 1e-15);
        assert!((body.inertia() - inertia).norm() < 1e-12);
        let axis = turn * Vector3::z();
        assert!((body.gyration_radius(&axis).powi(2) - 0.0034 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn any_ten_numbers_are_a_body_that_can_be() {
        for seed in 0..200u32 {
            let number = |k: u32| f64::from((seed * 7919 + k * 104_729) % 1000) / 500.0 - 1.0;
            let body = PseudoInertia(std::array::from_fn(|k| number(k as u32)));
            let principal = body.inertia().symmetric_eigenvalues();
            let all = principal.sum();
            assert!(body.mass() > 0.0);
            assert!(
                principal.iter().all(|i| *i > 0.0 && 2.0 * i <= all * (1.0 + 1e-12)),
                "{principal}"
            );
        }
    }

    #[test]
    fn what_no_matter_can_be_is_refused() {
        let flat = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 3.0));
        assert!(PseudoInertia::of(1.0, &Vector3::zeros(), &flat).is_none());
    }
}
