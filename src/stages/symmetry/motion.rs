//! Motions that may leave a shape as it is: reflections, turns about an axis, turns about a point.

use nalgebra::{DVector, Matrix3, Rotation3, Unit, Vector3};
use std::f64::consts::TAU;

/// Which group of motions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The reflection in the plane through the point, square to the direction.
    Mirror,
    /// Turns by multiples of a full circle over this number about the axis.
    Fold(u32),
    /// Any turn about the axis.
    Lathe,
    /// Any turn about the point.
    Ball,
}

/// A group of motions `x -> c + L (x - c)`; coordinates are from the middle of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub kind: Kind,
    /// Normal of the plane, or direction of the axis.
    pub direction: Unit<Vector3<f64>>,
    /// The point of the plane or axis that is nearest to the middle; the centre of a ball.
    pub point: Vector3<f64>,
}

/// Turns that stand for all: for every fold up to a dozen one of them is far from all multiples of its angle.
const ANGLES: [f64; 6] = [41.0, -75.0, 100.0, -157.0, -24.0, 16.0];

impl Motion {
    pub fn new(kind: Kind, direction: Vector3<f64>, point: Vector3<f64>) -> Self {
        let mut motion = Self {
            kind,
            direction: Unit::new_normalize(direction),
            point,
        };
        motion.recentre();
        motion
    }

    /// The point stays in the plane or on the axis, nearest to the middle.
    fn recentre(&mut self) {
        let d = self.direction.into_inner();
        let along = d * d.dot(&self.point);
        match self.kind {
            Kind::Mirror => self.point = along,
            Kind::Fold(_) | Kind::Lathe => self.point -= along,
            Kind::Ball => {}
        }
    }

    /// The linear parts of the motions that are tried.
    pub fn linears(&self) -> Vec<Matrix3<f64>> {
        let d = self.direction;
        let turn = |angle: f64| Rotation3::from_axis_angle(&d, angle).into_inner();
        match self.kind {
            Kind::Mirror => vec![Matrix3::identity() - 2.0 * d.into_inner() * d.transpose()],
            Kind::Fold(n) => (1..=n / 2).map(|k| turn(TAU * f64::from(k) / f64::from(n))).collect(),
            Kind::Lathe => ANGLES.iter().map(|a| turn(a.to_radians())).collect(),
            Kind::Ball => (0..2 * ANGLES.len())
                .map(|i| {
                    let axis =
                        Unit::new_normalize(Vector3::new(1.0, 0.7 * i as f64 - 4.0, 2.5 - (1.3 * i as f64) % 5.0));
                    Rotation3::from_axis_angle(&axis, ANGLES[i % ANGLES.len()].to_radians()).into_inner()
                })
                .collect(),
        }
    }

    pub fn moved(&self, linear: &Matrix3<f64>, p: &Vector3<f64>) -> Vector3<f64> {
        self.point + linear * (p - self.point)
    }

    /// Small turns that change the plane or axis.
    pub fn tilts(&self) -> Vec<Vector3<f64>> {
        match self.kind {
            Kind::Ball => Vec::new(),
            _ => tangents(&self.direction).to_vec(),
        }
    }

    /// Small shifts that change it.
    pub fn shifts(&self) -> Vec<Vector3<f64>> {
        match self.kind {
            Kind::Mirror => vec![self.direction.into_inner()],
            Kind::Fold(_) | Kind::Lathe => tangents(&self.direction).to_vec(),
            Kind::Ball => vec![Vector3::x(), Vector3::y(), Vector3::z()],
        }
    }

    /// By how much the image of `p` moves along `normal` for each tilt and shift. With `v = p - c` a tilt `w` moves
    /// the image by `w x L v - L (w x v)`, a shift `s` by `(I - L) s`.
    pub fn row(&self, linear: &Matrix3<f64>, p: &Vector3<f64>, normal: &Vector3<f64>) -> DVector<f64> {
        let arm = p - self.point;
        let image = linear * arm;
        let tilts = self
            .tilts()
            .into_iter()
            .map(|w| normal.dot(&(w.cross(&image) - linear * w.cross(&arm))));
        let shifts = self.shifts().into_iter().map(|s| normal.dot(&(s - linear * s)));
        let values: Vec<f64> = tilts.chain(shifts).collect();
        DVector::from_vec(values)
    }

    /// Tilted and shifted by a step in the order of `row`.
    pub fn stepped(&self, step: &DVector<f64>) -> Self {
        let tilts = self.tilts();
        let turn: Vector3<f64> = tilts.iter().zip(step.iter()).map(|(t, s)| t * *s).sum();
        let shift: Vector3<f64> = self
            .shifts()
            .iter()
            .zip(step.iter().skip(tilts.len()))
            .map(|(t, s)| t * *s)
            .sum();
        let direction = Rotation3::new(turn) * self.direction.into_inner();
        Self::new(self.kind, direction, self.point + shift)
    }

    /// Whether two motions are the same within a sine of the angle and a distance.
    pub fn is_near(&self, other: &Self, sine: f64, distance: f64) -> bool {
        let apart = self.point - other.point;
        self.kind == other.kind
            && (self.kind == Kind::Ball || self.direction.cross(&other.direction).norm() < sine)
            && apart.norm() < distance
    }
}

/// Two unit vectors square to `n` and to each other.
pub(super) fn tangents(n: &Unit<Vector3<f64>>) -> [Vector3<f64>; 2] {
    let t1 = n.cross(&Vector3::ith(n.iamin(), 1.0)).normalize();
    [t1, n.cross(&t1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivatives_are_those_of_the_motion() {
        let p = Vector3::new(0.3, -0.2, 0.5);
        let normal = Vector3::new(0.3, 0.5, -0.4);
        for kind in [Kind::Mirror, Kind::Fold(5), Kind::Lathe, Kind::Ball] {
            let motion = Motion::new(kind, Vector3::new(0.2, -0.4, 0.9), Vector3::new(0.05, 0.02, -0.03));
            let linear = motion.linears()[0];
            let row = motion.row(&linear, &p, &normal);
            for k in 0..row.len() {
                let image = |h: f64| {
                    let mut step = DVector::zeros(row.len());
                    step[k] = h;
                    let m = motion.stepped(&step);
                    normal.dot(&m.moved(&m.linears()[0], &p))
                };
                // The axes of a ball's turns stay as they are; only its centre moves.
                let slope = (image(1e-6) - image(-1e-6)) / 2e-6;
                assert!((slope - row[k]).abs() < 1e-6, "{kind:?} {k}: {slope} {}", row[k]);
            }
        }
    }
}
