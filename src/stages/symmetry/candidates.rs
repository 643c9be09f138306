//! Where planes and axes may be: principal axes, even directions, pairs of points that vote, slippage.

use nalgebra::{Matrix6, Unit, Vector3, Vector6};
use rand::Rng;

use super::Config;
use super::motion::{Kind, Motion};
use super::surface::Surface;
use crate::base::rng_for;

/// Pairs of points that vote for planes.
const PAIRS: usize = 4000;
/// Points on which a candidate is rated, and the width of a miss there, share of the diagonal.
const RATED_ON: usize = 90;
const WIDTH: f64 = 0.03;
/// Candidates within this sine and this share of the diagonal are one.
const ALIKE: (f64, f64) = (0.12, 0.06);
/// Candidates that are followed up.
const FOLLOWED_PLANES: usize = 22;
const FOLLOWED_AXES: usize = 16;
/// Folds that are looked for. More than a dozen positions are as good as any turn.
pub(super) const FOLDS: [u32; 10] = [2, 3, 4, 5, 6, 7, 8, 9, 10, 12];

/// The best planes by a quick look, distinct.
pub(super) fn planes(surface: &Surface, config: &Config) -> Vec<Motion> {
    let through_middle = directions(surface, config)
        .into_iter()
        .map(|n| Motion::new(Kind::Mirror, n, Vector3::zeros()));
    let voted = voted_planes(surface, config);
    distinct(surface, through_middle.chain(voted), FOLLOWED_PLANES)
}

/// Planes that mirror one seen point with its normal onto another (Mitra, Guibas & Pauly 2006): they need not pass
/// through the middle of what was seen.
fn voted_planes(surface: &Surface, config: &Config) -> Vec<Motion> {
    let mut rng = rng_for(config.seed, "symmetry pairs");
    let samples = &surface.samples;
    let mut planes = Vec::new();
    for _ in 0..4 * PAIRS {
        let [a, b] = [0; 2].map(|_| &samples[rng.random_range(0..samples.len())]);
        let apart = b.point - a.point;
        if apart.norm() < 0.15 * surface.diagonal || planes.len() >= PAIRS {
            continue;
        }
        let n = apart.normalize();
        let mirrored = a.normal - n * (2.0 * n.dot(&a.normal));
        // Two points of one flat face vote for anything.
        if mirrored.dot(&b.normal) > 0.95 && a.normal.dot(&n).abs() > 0.15 {
            let middle = nalgebra::center(&a.point, &b.point);
            planes.push(Motion::new(Kind::Mirror, n, middle.coords));
        }
    }
    planes
}

/// Lines about which the thing may be turned on a lathe: slippage (Gelfand & Guibas 2004; Pottmann & Wallner 2001)
/// finds them also where only a side was seen; principal axes through the middle for the rest.
pub(super) fn lathe_axes(surface: &Surface) -> Vec<Motion> {
    let through_middle = named_directions(surface)
        .into_iter()
        .map(|d| Motion::new(Kind::Lathe, d, Vector3::zeros()));
    distinct(surface, slipping(surface).into_iter().chain(through_middle), 5)
}

/// Turning motions `v + w x p` that keep every point in its tangent plane: eigenvectors to the least eigenvalues of
/// the sum of `(p x n, n)(p x n, n)ᵀ`, without their pitch.
fn slipping(surface: &Surface) -> Vec<Motion> {
    let scale = 0.25 * surface.diagonal;
    let row = |p: Vector3<f64>, n: Vector3<f64>| {
        let turn = (p / scale).cross(&n);
        Vector6::new(turn.x, turn.y, turn.z, n.x, n.y, n.z)
    };
    let mut found = Vec::new();
    let mut weights = vec![1.0; surface.samples.len()];
    // Two rounds: in the second what does not slip (a handle) counts little.
    for _ in 0..2 {
        let rows = surface.samples.iter().map(|s| row(s.point.coords, s.normal));
        let sum: Matrix6<f64> = rows.clone().zip(&weights).map(|(r, w)| r * r.transpose() * *w).sum();
        let eigen = sum.symmetric_eigen();
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let least: Vector6<f64> = eigen.eigenvectors.column(order[0]).into_owned();
        for k in &order[..3] {
            let e = eigen.eigenvectors.column(*k);
            let (w, v) = (Vector3::new(e[0], e[1], e[2]), Vector3::new(e[3], e[4], e[5]));
            if w.norm() > 0.2 {
                let point = w.cross(&v) * scale / w.norm_squared();
                found.push(Motion::new(Kind::Lathe, w, point));
            }
        }
        for (w, r) in weights.iter_mut().zip(rows) {
            *w = 1.0 / (1.0 + (r.dot(&least) / 0.1).powi(2));
        }
    }
    found
}

/// Axes of n-fold turns: through the middle in every direction, and where planes meet.
pub(super) fn fold_axes(surface: &Surface, planes: &[Motion], config: &Config) -> Vec<Motion> {
    let normals = planes.iter().map(|p| p.direction.into_inner());
    let mut lines: Vec<(Vector3<f64>, Vector3<f64>)> = directions(surface, config)
        .into_iter()
        .chain(normals)
        .map(|d| (d, Vector3::zeros()))
        .collect();
    for (i, a) in planes.iter().enumerate() {
        lines.extend(planes[..i].iter().filter_map(|b| meeting_line(a, b)));
    }
    let named = named_directions(surface);
    let folds = |d: &Vector3<f64>| {
        let special = named.iter().chain(lines[config.directions..].iter().map(|l| &l.0));
        let is_special = special.into_iter().any(|n| n.cross(d).norm() < 1e-6);
        if is_special { &FOLDS[..] } else { &FOLDS[..2] }
    };
    let tried: Vec<Motion> = lines
        .iter()
        .flat_map(|(d, p)| folds(d).iter().map(|n| Motion::new(Kind::Fold(*n), *d, *p)))
        .collect();
    distinct(surface, tried.into_iter(), FOLLOWED_AXES)
}

/// Direction and a point of the line in which two planes meet; nothing where they are nearly parallel.
fn meeting_line(a: &Motion, b: &Motion) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let direction = Unit::try_new(a.direction.cross(&b.direction), 0.2)?.into_inner();
    let rows = nalgebra::Matrix3::from_rows(&[a.direction.transpose(), b.direction.transpose(), direction.transpose()]);
    let offsets = Vector3::new(a.direction.dot(&a.point), b.direction.dot(&b.point), 0.0);
    Some((direction, rows.try_inverse()? * offsets))
}

/// The axes of the mesh's frame and the principal ones of the seen surface.
fn named_directions(surface: &Surface) -> Vec<Vector3<f64>> {
    let principal = surface.moments().symmetric_eigen().eigenvectors;
    let frame = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter();
    frame.chain((0..3).map(|i| principal.column(i).into_owned())).collect()
}

/// Evenly spread directions over the half sphere (Fibonacci lattice), then the named ones.
fn directions(surface: &Surface, config: &Config) -> Vec<Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let even = (0..config.directions).map(|i| {
        let z = (i as f64 + 0.5) / config.directions as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    });
    even.chain(named_directions(surface)).collect()
}

/// The best by a quick look, no two alike.
fn distinct(surface: &Surface, candidates: impl Iterator<Item = Motion>, most: usize) -> Vec<Motion> {
    let width = WIDTH * surface.diagonal;
    let mut rated: Vec<(f64, Motion)> = candidates
        .map(|m| (surface.rough_score(&m, RATED_ON, width), m))
        .collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut kept: Vec<Motion> = Vec::new();
    for (_, motion) in rated {
        if kept.len() == most {
            break;
        }
        if !kept
            .iter()
            .any(|k| k.is_near(&motion, ALIKE.0, ALIKE.1 * surface.diagonal))
        {
            kept.push(motion);
        }
    }
    kept
}
