//! How planes and axes of one shape belong together.

use nalgebra::{Matrix3, Vector3};

use super::detect::Found;
use super::motion::{Kind, Motion};
use super::surface::Surface;

/// The point nearest to two lines.
pub(super) fn nearest_point(a: &Motion, b: &Motion) -> Vector3<f64> {
    let square = |m: &Motion| Matrix3::identity() - m.direction.into_inner() * m.direction.transpose();
    let (p, q) = (square(a), square(b));
    let right = p * a.point + q * b.point;
    (p + q).try_inverse().map_or(a.point, |inverse| inverse * right)
}

/// Heights along a direction at which a plane across may cut the shape in two: the middle between its ends.
pub(super) fn heights(surface: &Surface, direction: &Vector3<f64>) -> Vec<f64> {
    let along = surface.samples.iter().map(|s| s.point.coords.dot(direction));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
    vec![0.5 * (low + high)]
}

/// Of planes that are all but parallel the one with the most votes: a thing that ends somewhere has no two.
pub(super) fn one_per_direction(found: Vec<Found>, sine: f64) -> Vec<Found> {
    let mut sorted = found;
    let votes = |f: &Found| f.verdict.score * f.verdict.support;
    sorted.sort_by(|a, b| votes(b).total_cmp(&votes(a)));
    let mut kept: Vec<Found> = Vec::new();
    for new in sorted {
        if kept
            .iter()
            .all(|k| k.motion.direction.cross(&new.motion.direction).norm() > sine)
        {
            kept.push(new);
        }
    }
    kept
}

/// Of the turns about one line the one of the most positions.
pub(super) fn highest_folds(found: Vec<Found>, surface: &Surface, (sine, share): (f64, f64)) -> Vec<Found> {
    let mut sorted = found;
    let fold = |f: &Found| match f.motion.kind {
        Kind::Fold(n) => n,
        _ => 0,
    };
    sorted.sort_by(|a, b| fold(b).cmp(&fold(a)).then(b.verdict.score.total_cmp(&a.verdict.score)));
    let mut kept: Vec<Found> = Vec::new();
    for new in sorted {
        let on_line = |k: &Found| {
            k.motion.direction.cross(&new.motion.direction).norm() < sine
                && (k.motion.point - new.motion.point).norm() < share * surface.diagonal
        };
        if !kept.iter().any(on_line) {
            kept.push(new);
        }
    }
    kept
}
