//! The plane in which things are pushed, and which way weight pulls along it.

use nalgebra::{Point3, Vector2, Vector3};

use crate::capture::Capture;
use crate::twin::Model;

/// A point of the support.
pub fn origin_of(capture: &Capture, model: &Model) -> Point3<f64> {
    let of_capture = capture.support.as_ref().map(|s| s.point);
    let of_twin = || model.twin.support.as_ref().map(|s| Point3::from(s.point));
    of_capture.or_else(of_twin).unwrap_or_else(Point3::origin)
}

/// Two unit vectors in the plane of the support: the world's axes where it is level.
pub fn plane_of(capture: &Capture, model: &Model) -> [Vector3<f64>; 2] {
    let normal = crate::stages::estimation::support_normal(capture, model).into_inner();
    let first = (Vector3::x() - normal * normal.x)
        .try_normalize(1e-3)
        .unwrap_or_else(Vector3::y);
    [first, normal.cross(&first)]
}

/// Gravity along the support over that across it.
pub fn lean_of(capture: &Capture, plane: &[Vector3<f64>; 2]) -> Vector2<f64> {
    let g = &capture.gravity;
    let across = g.dot(&plane[0].cross(&plane[1])).abs().max(1e-6);
    Vector2::new(g.dot(&plane[0]), g.dot(&plane[1])) / across
}
