//! Halving of parts that stand out of the shape.

use nalgebra::Point3;

use super::DecompositionConfig;
use super::parts::protrudes;
use crate::geometry::{Mesh, SurfaceDistance, convex_hull};

/// A part is halved at most so many times in a row.
pub(super) const MAX_SPLITS: usize = 5;

/// The hull of a part, or, while it stands out of the shape too far, of its halves: V-HACD stops early at thin walls,
/// whose hulls hold little volume but may bridge a wide arc. Points within `margin`, m, of
/// the cut belong to both halves.
pub(super) fn split(
    points: Vec<Point3<f64>>,
    surface: Option<&SurfaceDistance>,
    config: &DecompositionConfig,
    margin: f64,
    left: usize,
) -> Vec<Mesh> {
    let Some(hull) = convex_hull(&points) else {
        return Vec::new();
    };
    let fits = surface.is_none_or(|s| !protrudes(&hull, s, config.max_protrusion));
    let Some((lo, hi)) = hull.bounds().filter(|_| !fits && left > 0) else {
        return vec![hull];
    };
    let halves = [0, 1, 2].map(|axis| halves(&points, axis, 0.5 * (lo[axis] + hi[axis]), margin));
    let volume = |half: &Vec<Point3<f64>>| convex_hull(half).map_or(f64::INFINITY, |h| h.volume());
    let sums = halves.each_ref().map(|[a, b]| volume(a) + volume(b));
    let best = (0..3).min_by(|a, b| sums[*a].total_cmp(&sums[*b])).unwrap_or(0);
    if !sums[best].is_finite() {
        return vec![hull];
    }
    let [a, b] = halves[best].clone();
    let mut parts = split(a, surface, config, margin, left - 1);
    parts.extend(split(b, surface, config, margin, left - 1));
    parts
}

fn halves(points: &[Point3<f64>], axis: usize, at: f64, margin: f64) -> [Vec<Point3<f64>>; 2] {
    [
        points.iter().filter(|p| p[axis] <= at + margin).copied().collect(),
        points.iter().filter(|p| p[axis] >= at - margin).copied().collect(),
    ]
}
