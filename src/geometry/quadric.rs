//! Quadric error: squared distance to many planes at once (Garland & Heckbert 1997).

use nalgebra::{Matrix3, Point3, Vector3};

/// How strongly the middle of the edge attracts the new vertex, against the planes around it.
const MIDDLE_PULL: f64 = 1e-4;

/// `x'A x + 2 b'x + c`: the weighted sum of squared distances to planes, with the sum of the weights.
#[derive(Clone, Copy)]
pub(super) struct Quadric {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: f64,
    pub weight: f64,
}

impl Quadric {
    pub fn zero() -> Self {
        Self {
            a: Matrix3::zeros(),
            b: Vector3::zeros(),
            c: 0.0,
            weight: 0.0,
        }
    }

    pub fn plane(normal: &Vector3<f64>, through: &Point3<f64>, weight: f64) -> Self {
        let d = -normal.dot(&through.coords);
        Self {
            a: normal * normal.transpose() * weight,
            b: normal * (d * weight),
            c: d * d * weight,
            weight,
        }
    }

    pub fn add(&mut self, other: &Self) {
        self.a += other.a;
        self.b += other.b;
        self.c += other.c;
        self.weight += other.weight;
    }

    pub fn error(&self, p: &Point3<f64>) -> f64 {
        (p.coords.dot(&(self.a * p.coords + self.b * 2.0)) + self.c).max(0.0)
    }

    /// The point of least error on the plane `volume` (normal, offset) that keeps the volume, held near `middle`
    /// where the planes leave it free.
    pub fn minimum(&self, middle: &Point3<f64>, volume: &(Vector3<f64>, f64)) -> Point3<f64> {
        let pull = MIDDLE_PULL * self.weight;
        let a = self.a + Matrix3::identity() * pull;
        let Some(factor) = a.cholesky() else {
            return *middle;
        };
        let free = factor.solve(&(middle.coords * pull - self.b));
        let (normal, offset) = volume;
        let toward = factor.solve(normal);
        let slope = normal.dot(&toward);
        let step = toward * ((offset - normal.dot(&free)) / slope);
        let usable = slope > 0.0 && step.iter().all(|x| x.is_finite());
        Point3::from(if usable { free + step } else { free })
    }
}
