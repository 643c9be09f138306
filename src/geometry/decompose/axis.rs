//! The axis about which a surface was turned, if it was.

use nalgebra::{Matrix3, Point3, UnitVector3, Vector3};

use crate::geometry::Mesh;

/// Share of the area that must be turned about the axis.
const LEAST_SHARE: f64 = 0.6;
/// Sine of the angle between the normal and the plane through the axis up to which a spot counts as turned.
const TURNED: f64 = 0.12;
const ROUNDS: usize = 12;

/// A line: the axis of a surface of revolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub point: Point3<f64>,
    pub direction: UnitVector3<f64>,
}

struct Spot {
    at: Vector3<f64>,
    normal: Vector3<f64>,
    area: f64,
}

/// The axis that the normals of the surface meet: a rotation with velocity `c + w x p` slides the surface in itself
/// where `n . (c + w x p) = 0` (Pottmann & Wallner 2001, "Computational line geometry", ch. 4), solved by least
/// squares, reweighted against handles and cut faces. Flat spots square to the axis fit any axis and do not vote.
pub(super) fn axis_of_revolution(mesh: &Mesh) -> Option<Axis> {
    let (lo, hi) = mesh.bounds()?;
    let middle = nalgebra::center(&lo, &hi).coords;
    let scale = 0.5 * (hi - lo).norm();
    let spots: Vec<Spot> = (0..mesh.triangles.len())
        .filter_map(|t| {
            let scaled = mesh.scaled_normal(t);
            let [a, b, c] = mesh.corners(t);
            Some(Spot {
                at: ((a.coords + b.coords + c.coords) / 3.0 - middle) / scale,
                normal: scaled.try_normalize(1e-15)?,
                area: scaled.norm(),
            })
        })
        .collect();
    let starts = [None, Some(Vector3::x()), Some(Vector3::y()), Some(Vector3::z())];
    let tried = starts.iter().filter_map(|start| fit(&spots, *start));
    let (share, axis) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (share >= LEAST_SHARE).then(|| Axis {
        point: Point3::from(axis.point.coords * scale + middle),
        direction: axis.direction,
    })
}

fn fit(spots: &[Spot], start: Option<Vector3<f64>>) -> Option<(f64, Axis)> {
    let mut weights: Vec<f64> = spots.iter().map(|s| s.area).collect();
    let mut axis = solve(spots, &weights, start)?;
    for round in 0..ROUNDS {
        let width = TURNED.max(0.5 * 0.7f64.powi(round as i32));
        for (w, s) in weights.iter_mut().zip(spots) {
            let (sine, _) = misfit(s, &axis);
            *w = s.area / (1.0 + (sine / width).powi(2)).powi(2);
        }
        axis = solve(spots, &weights, None)?;
    }
    let (mut turned, mut all) = (0.0, 0.0);
    for s in spots {
        let (sine, around) = misfit(s, &axis);
        if around {
            all += s.area;
            turned += if sine.abs() < TURNED { s.area } else { 0.0 };
        }
    }
    (all > 0.2 * spots.iter().map(|s| s.area).sum::<f64>()).then(|| (turned / all, axis))
}

/// Sine of the angle by which the normal misses the axis, and whether the spot is one that can tell.
fn misfit(spot: &Spot, axis: &Axis) -> (f64, bool) {
    let lever = axis.direction.cross(&(spot.at - axis.point.coords));
    let sine = lever.try_normalize(1e-6).map_or(0.0, |l| spot.normal.dot(&l));
    (sine, spot.normal.dot(&axis.direction).abs() < 0.95)
}

fn solve(spots: &[Spot], weights: &[f64], direction: Option<Vector3<f64>>) -> Option<Axis> {
    let (mut nn, mut nm, mut mm) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
    for (s, w) in spots.iter().zip(weights) {
        let moment = s.at.cross(&s.normal);
        nn += s.normal * s.normal.transpose() * *w;
        nm += s.normal * moment.transpose() * *w;
        mm += moment * moment.transpose() * *w;
    }
    // A straight pipe may slide along its axis too: the slide is held at nothing.
    let inverse = (nn + Matrix3::identity() * (1e-6 * nn.trace())).try_inverse()?;
    let reduced = mm - nm.transpose() * inverse * nm;
    let eigen = reduced.symmetric_eigen();
    let turn = direction.unwrap_or_else(|| eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned());
    let slide = -inverse * nm * turn;
    Some(Axis {
        point: Point3::from(turn.cross(&slide)),
        direction: UnitVector3::try_new(turn, 1e-9)?,
    })
}
