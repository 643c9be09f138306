//! Shapes from the lathe: whole families of planes through an axis, told by a few.

use nalgebra::{Matrix3, Unit, Vector3};

use super::mirror::{Mirror, Plane};

/// An axis about which any turn leaves the shape as it is; the point is taken from the mirror's center.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub point: Vector3<f64>,
    pub direction: Unit<Vector3<f64>>,
}

/// Turns that no regular polygon of up to a dozen corners has in common.
const ANGLES: [f64; 3] = [0.47, 1.13, 2.29];
/// Two directions nearer than this (cosine of 8°) are one.
const SAME: f64 = 0.990;

/// Axes of revolution among the lines in which pairs of planes meet, in the order of the pairs.
pub(super) fn axes(mirror: &Mirror, planes: &[Plane], min_score: f64) -> Vec<Axis> {
    let mut found: Vec<Axis> = Vec::new();
    let mut tried: Vec<Unit<Vector3<f64>>> = Vec::new();
    for (i, a) in planes.iter().enumerate().take(8) {
        for b in &planes[..i] {
            let Some(axis) = meeting_line(a, b) else {
                continue;
            };
            if tried.iter().any(|t| t.dot(&axis.direction).abs() > SAME) {
                continue;
            }
            tried.push(axis.direction);
            let score = |angle: &f64| mirror.rotation_score(&axis.point, &axis.direction, *angle);
            if ANGLES.iter().all(|angle| score(angle) >= min_score) {
                found.push(axis);
            }
        }
    }
    found
}

/// Where two planes meet, its point nearest to the center; nothing where they are nearly parallel.
fn meeting_line(a: &Plane, b: &Plane) -> Option<Axis> {
    let direction = Unit::try_new(a.normal.cross(&b.normal), 0.3)?;
    let rows = Matrix3::from_rows(&[a.normal.transpose(), b.normal.transpose(), direction.transpose()]);
    let point = rows.try_inverse()? * Vector3::new(a.offset, b.offset, 0.0);
    Some(Axis { point, direction })
}

/// The planes that stand for the families: two through a single axis, square to each other and as near to the
/// frame's axes as can be, with the planes across it; three for a ball.
pub(super) fn representatives(axes: &[Axis], planes: &[Plane]) -> Vec<Plane> {
    let through = |normal: Vector3<f64>, axis: &Axis| {
        let normal = Unit::new_normalize(normal);
        Plane {
            normal,
            offset: normal.dot(&axis.point),
        }
    };
    let [axis, rest @ ..] = axes else {
        return planes.to_vec();
    };
    if !rest.is_empty() {
        return [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|n| through(n, axis))
            .to_vec();
    }
    let d = axis.direction.into_inner();
    let most_square = [Vector3::x(), Vector3::y(), Vector3::z()]
        .into_iter()
        .min_by(|a, b| (a.dot(&d).abs() + 1e-6 * a.z).total_cmp(&(b.dot(&d).abs() + 1e-6 * b.z)))
        .unwrap_or_else(Vector3::x);
    let first = through(most_square - d * d.dot(&most_square), axis);
    let second = through(d.cross(&first.normal), axis);
    let across = planes.iter().filter(|p| p.normal.dot(&d).abs() > SAME).copied();
    [first, second].into_iter().chain(across).collect()
}
