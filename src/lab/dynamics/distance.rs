//! Signed distance to a convex piece, with the face that a touching thing leans against.

use nalgebra::{Matrix3, Vector3};

use super::body::Frame;
use crate::lab::{ConvexPart, PartShape, Solid};

/// A point this far outside a side face still counts as above the top face, m.
const EDGE: f64 = 2e-6;

/// Distance (negative inside) and outward unit normal, in the piece's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub distance: f64,
    pub normal: Vector3<f64>,
}

/// Radius of the sphere about the piece's origin that encloses it.
pub(crate) fn reach(shape: &PartShape) -> f64 {
    match shape {
        PartShape::Box { half } => half.norm(),
        PartShape::Cylinder { radius, half_height } => radius.hypot(*half_height),
        PartShape::Sphere { radius } => *radius,
    }
}

/// How far the shape reaches from its origin along a direction of its own frame.
pub(crate) fn support_radius(shape: &PartShape, direction: &Vector3<f64>) -> f64 {
    match shape {
        PartShape::Box { half } => half.dot(&direction.abs()),
        PartShape::Cylinder { radius, half_height } => radius * direction.xy().norm() + half_height * direction.z.abs(),
        PartShape::Sphere { radius } => *radius,
    }
}

/// The nearest surface of `shape` to `p`. Inside, only faces are considered beyond which `other` (the centre of the
/// thing that touches) lies: a body never leaves another one through the face it did not enter by.
#[inline]
pub(crate) fn nearest(shape: &PartShape, p: &Vector3<f64>, other: &Vector3<f64>) -> Nearest {
    match shape {
        PartShape::Box { half } => nearest_on_box(half, p, other),
        PartShape::Cylinder { radius, half_height } => nearest_on_cylinder(*radius, *half_height, p, other),
        PartShape::Sphere { radius } => {
            let length = p.norm();
            Nearest {
                distance: length - radius,
                normal: if length > 1e-12 { p / length } else { Vector3::z() },
            }
        }
    }
}

fn nearest_on_box(half: &Vector3<f64>, p: &Vector3<f64>, other: &Vector3<f64>) -> Nearest {
    let q = p.abs() - half;
    if q.max() > EDGE {
        let out = q.sup(&Vector3::zeros());
        let distance = out.norm();
        let normal = out.zip_map(p, |o, x| if x < 0.0 { -o } else { o }) / distance;
        return Nearest { distance, normal };
    }
    let mut best = Nearest {
        distance: f64::NEG_INFINITY,
        normal: Vector3::z(),
    };
    let mut best_faces_other = false;
    for axis in 0..3 {
        let sign = if other[axis].abs() > half[axis] {
            other[axis]
        } else {
            p[axis]
        }
        .signum();
        let faces_other = other[axis].abs() > half[axis];
        let distance = sign * p[axis] - half[axis];
        if (faces_other, distance) > (best_faces_other, best.distance) {
            best_faces_other = faces_other;
            best.distance = distance;
            best.normal = Vector3::ith(axis, sign);
        }
    }
    best
}

fn nearest_on_cylinder(radius: f64, half_height: f64, p: &Vector3<f64>, other: &Vector3<f64>) -> Nearest {
    let (rho, rho_other) = (p.xy().norm(), other.xy().norm());
    let radial = if rho > 1e-12 {
        Vector3::new(p.x / rho, p.y / rho, 0.0)
    } else {
        Vector3::x()
    };
    let (beside, beyond) = (rho - radius, p.z.abs() - half_height);
    if beside.max(beyond) > EDGE {
        let (r, z) = (beside.max(0.0), beyond.max(0.0));
        let distance = r.hypot(z);
        let normal = (radial * r + Vector3::z() * (z * p.z.signum())) / distance;
        return Nearest { distance, normal };
    }
    let cap_faces = other.z.abs() > half_height;
    let side_faces = rho_other > radius;
    let sign = if cap_faces { other.z } else { p.z }.signum();
    let cap = sign * p.z - half_height;
    if (cap_faces, cap) > (side_faces, beside) {
        Nearest {
            distance: cap,
            normal: Vector3::z() * sign,
        }
    } else {
        Nearest {
            distance: beside,
            normal: radial,
        }
    }
}

/// A convex piece as it hangs on a frame.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    pub shape: PartShape,
    pub offset: Vector3<f64>,
    pub matrix: Matrix3<f64>,
    pub reach: f64,
}

impl Piece {
    /// The piece of a solid, about its centre of mass.
    pub fn of(solid: &Solid, part: &ConvexPart) -> Self {
        Self {
            shape: part.shape.clone(),
            offset: part.body_from_part.0.translation.vector - solid.com.coords,
            matrix: part.body_from_part.0.rotation.to_rotation_matrix().into_inner(),
            reach: reach(&part.shape),
        }
    }

    /// A shape at the origin of its frame (a tool).
    pub fn alone(shape: PartShape) -> Self {
        Self {
            offset: Vector3::zeros(),
            matrix: Matrix3::identity(),
            reach: reach(&shape),
            shape,
        }
    }

    /// World position of its origin and its axes in the world.
    #[inline]
    pub fn placed(&self, frame: &Frame) -> (Vector3<f64>, Matrix3<f64>) {
        (frame.point(&self.offset), frame.matrix * self.matrix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_under_the_top_face_is_pushed_up_by_what_stands_above() {
        let shape = PartShape::Box {
            half: Vector3::new(0.03, 0.03, 0.03),
        };
        let found = nearest(&shape, &Vector3::new(0.03, 0.03, 0.0299), &Vector3::new(0.0, 0.0, 0.06));
        assert_eq!(found.normal, Vector3::z());
        assert!((found.distance + 1e-4).abs() < 1e-12);
    }

    #[test]
    fn the_foot_of_a_neighbour_is_pushed_sideways() {
        let shape = PartShape::Box {
            half: Vector3::new(0.03, 0.03, 0.03),
        };
        let found = nearest(&shape, &Vector3::new(0.0299, 0.0, -0.03), &Vector3::new(0.06, 0.0, 0.0));
        assert_eq!(found.normal, Vector3::x());
    }
}
