//! The planes along which a piece may be cut.

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, UnitVector3, Vector3};

use super::axis::{Axis, axis_of_revolution};
use crate::geometry::{Mesh, Plane};

/// Evenly spaced cuts along each axis of a frame.
const STEPS: usize = 7;
/// Cuts through an axis of revolution.
const SECTORS: usize = 6;
/// Largest flat faces along whose planes cuts are tried.
const FLATS: usize = 8;
/// Normals within this angle are one, rad.
const SAME_NORMAL: f64 = 0.08;

/// The candidates for one piece: planes square to the axes of the shape's own box and of the piece, the planes of its
/// large flat faces, and, where it was turned on a lathe, planes through that axis.
pub(super) fn candidates(piece: &Mesh, box_axes: &Rotation3<f64>, tolerance: f64) -> Vec<Plane> {
    let mut planes = Vec::new();
    planes.extend(flat_faces(piece, tolerance));
    for k in 0..3 {
        planes.extend(spaced(piece, &axis_of(box_axes, k), STEPS));
    }
    if let Some(axis) = axis_of_revolution(piece) {
        planes.extend(sectors(piece, &axis));
        planes.extend(spaced(piece, &axis.direction, STEPS));
    } else {
        let own = principal_axes(piece);
        for k in 0..3 {
            planes.extend(spaced(piece, &axis_of(&own, k), STEPS / 2));
        }
    }
    without_twins(planes, piece)
}

fn axis_of(frame: &Rotation3<f64>, k: usize) -> UnitVector3<f64> {
    UnitVector3::new_normalize(frame.inverse() * Vector3::ith(k, 1.0))
}

fn extent(piece: &Mesh, normal: &UnitVector3<f64>) -> (f64, f64) {
    piece
        .vertices
        .iter()
        .map(|p| normal.dot(&p.coords))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
}

fn spaced(piece: &Mesh, normal: &UnitVector3<f64>, steps: usize) -> Vec<Plane> {
    let (lo, hi) = extent(piece, normal);
    let share = |k: usize| (k + 1) as f64 / (steps + 1) as f64;
    (0..steps)
        .map(|k| Plane {
            normal: *normal,
            offset: lo + (hi - lo) * share(k),
        })
        .collect()
}

/// Planes through the axis that share the angle that the piece takes up.
fn sectors(piece: &Mesh, axis: &Axis) -> Vec<Plane> {
    let across = any_square_to(&axis.direction);
    let third = axis.direction.cross(&across);
    let mut angles: Vec<f64> = piece
        .vertices
        .iter()
        .map(|p| p - axis.point)
        .map(|d| d.dot(&third).atan2(d.dot(&across)))
        .collect();
    angles.sort_by(f64::total_cmp);
    // The piece begins after the widest gap between its angles.
    let Some(last) = angles.last().copied() else {
        return Vec::new();
    };
    let wrapped = std::iter::once(last - std::f64::consts::TAU).chain(angles.iter().copied());
    let gaps = wrapped.zip(&angles).map(|(a, b)| (b - a, *b));
    let (gap, start) = gaps.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, 0.0));
    let whole = gap < 0.6;
    let span = if whole {
        std::f64::consts::PI
    } else {
        std::f64::consts::TAU - gap
    };
    let share = |k: usize| {
        if whole {
            k as f64 / SECTORS as f64
        } else {
            (k + 1) as f64 / (SECTORS + 2) as f64
        }
    };
    (0..SECTORS + usize::from(!whole))
        .map(|k| {
            let (sin, cos) = (start + span * share(k)).sin_cos();
            let normal = UnitVector3::new_normalize(third * cos - across * sin);
            Plane::through(&axis.point, normal)
        })
        .collect()
}

fn any_square_to(axis: &Vector3<f64>) -> Vector3<f64> {
    axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize()
}

/// The planes of large flat faces that go through the piece, each also a little on either side: a scanned face is
/// not quite flat.
fn flat_faces(piece: &Mesh, tolerance: f64) -> Vec<Plane> {
    let mut found: Vec<(f64, Plane)> = Vec::new();
    let mut order: Vec<(f64, usize)> = (0..piece.triangles.len())
        .map(|t| (piece.scaled_normal(t).norm(), t))
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let total: f64 = order.iter().map(|o| o.0).sum();
    for (area, t) in order {
        let Some(normal) = UnitVector3::try_new(piece.scaled_normal(t), 1e-15) else {
            continue;
        };
        let [a, b, c] = piece.corners(t);
        let plane = Plane::through(&Point3::from((a.coords + b.coords + c.coords) / 3.0), normal);
        let alike = |p: &Plane| {
            let cosine = p.normal.dot(&normal);
            cosine.abs() > SAME_NORMAL.cos() && (p.offset - cosine.signum() * plane.offset).abs() < 0.5 * tolerance
        };
        match found.iter().position(|(_, p)| alike(p)) {
            Some(i) => found[i].0 += area,
            None if found.len() < 64 => found.push((area, plane)),
            None => {}
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let large = found.into_iter().filter(|f| f.0 > 0.01 * total).map(|f| f.1);
    let through = large.filter(|p| {
        let (lo, hi) = extent(piece, &p.normal);
        lo + tolerance < p.offset && p.offset < hi - tolerance
    });
    through
        .take(FLATS)
        .flat_map(|p| {
            [0.0, 0.15 * tolerance, -0.15 * tolerance].map(|shift| Plane {
                offset: p.offset + shift,
                ..p
            })
        })
        .collect()
}

fn without_twins(planes: Vec<Plane>, piece: &Mesh) -> Vec<Plane> {
    let scale = piece.bounds().map_or(1.0, |(lo, hi)| (hi - lo).norm());
    let mut kept: Vec<Plane> = Vec::new();
    for plane in planes {
        let twin = |p: &Plane| {
            let cosine = p.normal.dot(&plane.normal);
            cosine.abs() > 1.0 - 1e-6 && (p.offset - cosine.signum() * plane.offset).abs() < 1e-4 * scale
        };
        if !kept.iter().any(twin) {
            kept.push(plane);
        }
    }
    kept
}

/// The turn that gives the mesh the smallest box: none if that is nearly as good, about z, or onto principal axes.
pub(super) fn box_rotation(mesh: &Mesh) -> Rotation3<f64> {
    let volume = |r: &Rotation3<f64>| {
        let turned = mesh.vertices.iter().map(|v| (r * v).coords);
        let first = Vector3::repeat(f64::INFINITY);
        let (lo, hi) = turned.fold((first, -first), |(lo, hi), v| (lo.inf(&v), hi.sup(&v)));
        (hi - lo).product()
    };
    let yaw = |degrees: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    let least = |candidates: &[Rotation3<f64>]| {
        let rated = candidates.iter().map(|r| (volume(r), *r));
        rated
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, Rotation3::identity()))
    };
    let coarse: Vec<f64> = (0..30).map(|i| f64::from(3 * i)).collect();
    let start = coarse
        .iter()
        .copied()
        .min_by(|a, b| volume(&yaw(*a)).total_cmp(&volume(&yaw(*b))));
    let fine: Vec<_> = (-20..=20)
        .map(|i| yaw(start.unwrap_or(0.0) + 0.1 * f64::from(i)))
        .collect();
    let best = [least(&fine), least(&[principal_axes(mesh)])];
    let best = if best[1].0 < 0.98 * best[0].0 { best[1] } else { best[0] };
    if best.0 < 0.98 * volume(&Rotation3::identity()) {
        best.1
    } else {
        Rotation3::identity()
    }
}

/// The turn onto the principal axes of the surface.
fn principal_axes(mesh: &Mesh) -> Rotation3<f64> {
    let mut total = 1e-300;
    let (mut mean, mut spread) = (Vector3::zeros(), Matrix3::zeros());
    for t in 0..mesh.triangles.len() {
        let area = mesh.scaled_normal(t).norm();
        let [a, b, c] = mesh.corners(t);
        let middle = (a.coords + b.coords + c.coords) / 3.0;
        total += area;
        mean += middle * area;
        spread += middle * middle.transpose() * area;
    }
    mean /= total;
    let mut axes = (spread / total - mean * mean.transpose())
        .symmetric_eigen()
        .eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let turn = Rotation3::from_matrix_unchecked(axes.transpose());
    UnitQuaternion::from_rotation_matrix(&turn).to_rotation_matrix()
}
