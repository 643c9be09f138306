//! Merging of parts while little is lost.

use nalgebra::{Point3, Vector3};

use super::DecompositionConfig;
use super::parts::{HULL_TOLERANCE, protrusion};
use crate::geometry::{Mesh, SurfaceDistance, convex_hull, slim_hull};

/// A pair of parts, what they would add in volume, and the part they would make.
struct Pair {
    a: usize,
    b: usize,
    added: f64,
    hull: Mesh,
    /// Once it was asked for, m.
    protrusion: Option<f64>,
}

/// How fast the limit of what may stand out is raised.
const LIMIT_STEP: f64 = 1.1892;

/// Merges the pair that adds the least volume, again and again, among those that stand out little; how little is
/// raised step by step to `max_protrusion`, and beyond it while there are too many parts.
pub(super) fn merge(hulls: Vec<Mesh>, surface: &SurfaceDistance, config: &DecompositionConfig) -> Vec<Mesh> {
    let mut parts: Vec<Option<Mesh>> = hulls.into_iter().map(Some).collect();
    let mut pairs = Vec::new();
    for b in 0..parts.len() {
        for a in 0..b {
            pairs.extend(pair(&parts, a, b, config));
        }
    }
    let mut limit = 0.25 * config.max_protrusion;
    loop {
        pairs.sort_by(|x, y| x.added.total_cmp(&y.added).then((x.a, x.b).cmp(&(y.a, y.b))));
        let Some(next) = choose(&mut pairs, surface, limit) else {
            let too_many = parts.iter().flatten().count() > config.max_parts;
            if pairs.is_empty() || limit >= config.max_protrusion && !too_many {
                break;
            }
            limit *= LIMIT_STEP;
            continue;
        };
        let Pair { a, b, hull, .. } = pairs.remove(next);
        parts[a] = Some(hull);
        parts[b] = None;
        pairs.retain(|p| ![a, b].contains(&p.a) && ![a, b].contains(&p.b));
        for other in (0..parts.len()).filter(|i| *i != a) {
            pairs.extend(pair(&parts, a.min(other), a.max(other), config));
        }
    }
    let slim = |part: &Mesh| slim_hull(&part.vertices, config.max_vertices, HULL_TOLERANCE);
    parts.iter().flatten().filter_map(slim).collect()
}

/// The pair of least added volume that stands out by no more than `limit`.
fn choose(pairs: &mut [Pair], surface: &SurfaceDistance, limit: f64) -> Option<usize> {
    pairs.iter_mut().position(|p| {
        let out = *p.protrusion.get_or_insert_with(|| protrusion(&p.hull, surface));
        out <= limit
    })
}

/// Nothing for parts that are far apart: they are never merged.
fn pair(parts: &[Option<Mesh>], a: usize, b: usize, config: &DecompositionConfig) -> Option<Pair> {
    let (x, y) = (parts[a].as_ref()?, parts[b].as_ref()?);
    if boxes_apart(x, y)? > config.max_protrusion {
        return None;
    }
    let points: Vec<Point3<f64>> = x.vertices.iter().chain(&y.vertices).copied().collect();
    let hull = convex_hull(&points)?;
    Some(Pair {
        a,
        b,
        added: hull.volume() - x.volume() - y.volume(),
        hull,
        protrusion: None,
    })
}

/// Gap between two boxes, m.
fn boxes_apart(x: &Mesh, y: &Mesh) -> Option<f64> {
    let ((xl, xh), (yl, yh)) = (x.bounds()?, y.bounds()?);
    let gap = (yl - xh).sup(&(xl - yh));
    Some(gap.sup(&Vector3::zeros()).norm())
}
