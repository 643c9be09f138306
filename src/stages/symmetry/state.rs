//! What was found, in the words of the twin: frame of the mesh, standard deviations, best first.

use nalgebra::{DMatrix, DVector, Vector3};

use super::detect::Found;
use super::motion::{Kind, Motion, tangents};
use super::refine::spread_of;
use super::surface::Surface;
use crate::twin::{Symmetry, SymmetryAxis, SymmetryCenter, SymmetryPlane};

/// Planes and axes of a shape that has no axis of the lathe.
pub(super) fn plain(surface: &Surface, planes: &[Found], axes: &[Found], most: usize) -> Symmetry {
    let mut planes: Vec<SymmetryPlane> = planes.iter().map(|f| plane(surface, f)).collect();
    planes.sort_by_key(|p| order(p.score, p.normal[2].abs() > 0.1, 0));
    let mut axes: Vec<SymmetryAxis> = axes.iter().map(|f| axis(surface, f)).collect();
    axes.sort_by_key(|a| order(a.score, false, -i64::from(a.fold)));
    planes.truncate(most);
    axes.truncate(most);
    Symmetry {
        planes,
        axes,
        center: None,
    }
}

/// Two planes through the axis, square to each other and as near to the frame's axes as can be, and the one across.
pub(super) fn lathe(surface: &Surface, found: &Found, across: Option<&Found>) -> Symmetry {
    let d = found.motion.direction.into_inner();
    let frame = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter();
    let first = frame
        .min_by(|a, b| (a.dot(&d).abs() + 1e-6 * a.z).total_cmp(&(b.dot(&d).abs() + 1e-6 * b.z)))
        .unwrap_or_else(Vector3::x);
    let first = (first - d * d.dot(&first)).normalize();
    let normals = [first, d.cross(&first)];
    let mut planes: Vec<SymmetryPlane> = normals.iter().map(|n| through_axis(surface, found, n)).collect();
    planes.extend(across.map(|f| plane(surface, f)));
    planes.sort_by_key(|p| order(p.score, p.normal[2].abs() > 0.1, 0));
    Symmetry {
        planes,
        axes: vec![axis(surface, found)],
        center: None,
    }
}

/// Three planes and three axes along the frame's, and the centre.
pub(super) fn ball(surface: &Surface, found: &Found) -> Symmetry {
    let point = surface.middle + found.motion.point;
    let all = [Vector3::x(), Vector3::y(), Vector3::z()];
    let sd = found.covariance.as_ref().map(|c| spread_of(c, &all));
    let score = found.verdict.score;
    let planes = (0..3).map(|k| SymmetryPlane {
        normal: all[k].into(),
        offset: point[k],
        score,
        normal_sd: Some([0.0; 3]),
        offset_sd: sd.map(|s| s[k]),
    });
    let axes = (0..3).map(|k| SymmetryAxis {
        direction: all[k].into(),
        point: point.coords.into(),
        fold: 0,
        score,
        direction_sd: Some([0.0; 3]),
        point_sd: sd,
    });
    Symmetry {
        planes: planes.collect(),
        axes: axes.collect(),
        center: Some(SymmetryCenter {
            point: point.coords.into(),
            score,
            point_sd: sd,
        }),
    }
}

/// Scores are compared in steps, so that noise does not put a lying plane before an upright one.
fn order(score: f64, lying: bool, then: i64) -> (i64, bool, i64, i64) {
    (-(score * 25.0).round() as i64, lying, then, -(score * 1e6) as i64)
}

/// The largest component is made positive, so that the same direction is always written alike.
fn sign(v: &Vector3<f64>) -> f64 {
    v[v.iamax()].signum()
}

fn plane(surface: &Surface, found: &Found) -> SymmetryPlane {
    let n = found.motion.direction.into_inner();
    let point = surface.middle.coords + found.motion.point;
    // A tilt w turns n by w x n, a shift s moves the offset by s.
    let turns: Vec<Vector3<f64>> = found.motion.tilts().iter().map(|w| w.cross(&n)).collect();
    let slopes: Vec<f64> = turns.iter().map(|t| t.dot(&point)).chain([1.0]).collect();
    told(
        n,
        point,
        found.verdict.score,
        found.covariance.as_ref(),
        &turns,
        &slopes,
    )
}

/// A plane of the family through an axis: it tilts about `normal x direction` and shifts along its normal only.
fn through_axis(surface: &Surface, found: &Found, normal: &Vector3<f64>) -> SymmetryPlane {
    let d = found.motion.direction.into_inner();
    let point = surface.middle.coords + found.motion.point;
    // n stays square to d: a tilt w of d changes n by -(n . (w x d)) d.
    let turns: Vec<Vector3<f64>> = tangents(&found.motion.direction)
        .iter()
        .map(|w| d * -normal.dot(&w.cross(&d)))
        .collect();
    let shifts = found.motion.shifts();
    let slopes: Vec<f64> = turns
        .iter()
        .map(|t| t.dot(&point))
        .chain(shifts.iter().map(|s| s.dot(normal)))
        .collect();
    told(
        *normal,
        point,
        found.verdict.score,
        found.covariance.as_ref(),
        &turns,
        &slopes,
    )
}

/// A plane with its deviations, from how the unknowns change its normal and its offset.
fn told(
    normal: Vector3<f64>,
    point: Vector3<f64>,
    score: f64,
    covariance: Option<&DMatrix<f64>>,
    turns: &[Vector3<f64>],
    slopes: &[f64],
) -> SymmetryPlane {
    let sign = sign(&normal);
    let slope = DVector::from_row_slice(slopes);
    let tilting = |c: &DMatrix<f64>| c.view((0, 0), (turns.len(), turns.len())).into_owned();
    SymmetryPlane {
        normal: (normal * sign).into(),
        offset: sign * normal.dot(&point),
        score,
        normal_sd: covariance.map(|c| spread_of(&tilting(c), turns)),
        offset_sd: covariance.map(|c| (slope.transpose() * c * &slope)[(0, 0)].max(0.0).sqrt()),
    }
}

fn axis(surface: &Surface, found: &Found) -> SymmetryAxis {
    let Motion { kind, direction, point } = found.motion;
    let d = direction.into_inner();
    let turns: Vec<Vector3<f64>> = found.motion.tilts().iter().map(|w| w.cross(&d)).collect();
    let shifts = found.motion.shifts();
    let size = turns.len();
    let part = |c: &DMatrix<f64>, at: usize, n: usize| c.view((at, at), (n, n)).into_owned();
    SymmetryAxis {
        direction: (d * sign(&d)).into(),
        point: (surface.middle + point).coords.into(),
        fold: if let Kind::Fold(n) = kind { n } else { 0 },
        score: found.verdict.score,
        direction_sd: found.covariance.as_ref().map(|c| spread_of(&part(c, 0, size), &turns)),
        point_sd: found
            .covariance
            .as_ref()
            .map(|c| spread_of(&part(c, size, shifts.len()), &shifts)),
    }
}
