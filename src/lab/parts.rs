//! Convex pieces that cover a shape, for contact. Cavities of turned things are filled: they are touched from outside.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::lathe;
use super::surface::face;
use super::{ConvexPart, PartShape, ShapeSpec};
use crate::base::Pose;
use crate::geometry::Mesh;

/// Slices of a slanted stretch of a turned profile.
const SLICES: usize = 6;
/// Straight pieces of a handle.
const HANDLE_PIECES: usize = 8;

/// The convex pieces of `shape`, body frame; a mesh file is covered by the box around it.
pub(super) fn parts(shape: &ShapeSpec, mesh: &Mesh) -> Vec<ConvexPart> {
    match shape {
        ShapeSpec::Box { size } => vec![box_at(Vector3::from(*size) / 2.0, Vector3::zeros())],
        ShapeSpec::Cylinder { radius, height } => vec![cylinder_at(*radius, height / 2.0, Vector3::zeros())],
        ShapeSpec::Sphere { radius } => vec![ConvexPart {
            shape: PartShape::Sphere { radius: *radius },
            body_from_part: Pose::identity(),
        }],
        ShapeSpec::Lathe { profile, handle } => {
            let mut parts = slices(profile);
            if let Some(spec) = handle {
                parts.extend(
                    lathe::handle_pieces(profile, *spec, HANDLE_PIECES)
                        .into_iter()
                        .map(|ends| rod(ends, spec[1])),
                );
            }
            parts
        }
        ShapeSpec::Tray { size, wall, open } => walls(Vector3::from(*size) / 2.0, *wall, open),
        ShapeSpec::Mesh { .. } => mesh
            .bounds()
            .map(|(low, high)| box_at((high - low) / 2.0, (low.coords + high.coords) / 2.0))
            .into_iter()
            .collect(),
    }
}

fn at(center: Vector3<f64>) -> Pose {
    Pose(Isometry3::from_parts(
        Translation3::from(center),
        UnitQuaternion::identity(),
    ))
}

fn box_at(half: Vector3<f64>, center: Vector3<f64>) -> ConvexPart {
    ConvexPart {
        shape: PartShape::Box { half },
        body_from_part: at(center),
    }
}

fn cylinder_at(radius: f64, half_height: f64, center: Vector3<f64>) -> ConvexPart {
    ConvexPart {
        shape: PartShape::Cylinder { radius, half_height },
        body_from_part: at(center),
    }
}

/// Cylinders of the outer radius between the heights of the profile, several where it is slanted.
fn slices(profile: &[[f64; 2]]) -> Vec<ConvexPart> {
    let mut heights: Vec<f64> = profile.iter().map(|p| p[1]).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup_by(|a, b| (*a - *b).abs() < 1e-6);
    let mut parts = Vec::new();
    for pair in heights.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        let radius = |t: f64| lathe::wall(profile, low + t * (high - low)).0;
        let straight = (radius(0.05) - radius(0.95)).abs() < 1e-6;
        let n = if straight { 1 } else { SLICES };
        let step = (high - low) / n as f64;
        parts.extend((0..n).map(|i| {
            let t = (i as f64 + 0.5) / n as f64;
            cylinder_at(radius(t), step / 2.0, Vector3::z() * (low + t * (high - low)))
        }));
    }
    parts
}

/// A cylinder of radius `tube` between two points.
fn rod([a, b]: [Point3<f64>; 2], tube: f64) -> ConvexPart {
    let along = b - a;
    let rotation = Rotation3::rotation_between(&Vector3::z(), &along)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    ConvexPart {
        shape: PartShape::Cylinder {
            radius: tube,
            half_height: along.norm() / 2.0,
        },
        body_from_part: Pose(Isometry3::from_parts(
            Translation3::from(nalgebra::center(&a, &b).coords),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )),
    }
}

/// The floor and the four walls of a tray as boxes.
fn walls(half: Vector3<f64>, wall: f64, open: &str) -> Vec<ConvexPart> {
    let (open_axis, open_sign) = face(open).unwrap_or((2, 1.0));
    let mut parts = Vec::with_capacity(5);
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            if axis == open_axis && sign == open_sign {
                continue;
            }
            let mut plate = half;
            plate[axis] = wall / 2.0;
            let mut center = Vector3::zeros();
            center[axis] = sign * (half[axis] - wall / 2.0);
            parts.push(box_at(plate, center));
        }
    }
    parts
}
