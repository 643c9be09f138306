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

/// Merges the pair that adds the least volume, again and again: all that stand out little enough, then more
/// until there are few enough.
pub(super) fn merge(hulls: Vec<Mesh>, surface: &SurfaceDistance, config: &DecompositionConfig) -> Vec<Mesh> {
    let mut parts: Vec<Option<Mesh>> = hulls.into_iter().map(Some).collect();
    let mut pairs = Vec::new();
    for b in 0..parts.len() {
        for a in 0..b {
            pairs.extend(pair(&parts, a, b, config));
        }
    }
    loop {
        let alive = parts.iter().flatten().count();
        pairs.sort_by(|x, y| x.added.total_cmp(&y.added).then((x.a, x.b).cmp(&(y.a, y.b))));
        let Some(next) = choose(&mut pairs, surface, config, alive > config.max_parts) else {
            break;
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

/// The first pair that may be merged; where there are too many parts, else the one that stands out least.
fn choose(pairs: &mut [Pair], surface: &SurfaceDistance, config: &DecompositionConfig, forced: bool) -> Option<usize> {
    for (i, p) in pairs.iter_mut().enumerate().filter(|(_, p)| p.protrusion.is_none()) {
        let protrusion = protrusion(&p.hull, surface);
        p.protrusion = Some(protrusion);
        if protrusion <= config.max_protrusion {
            return Some(i);
        }
    }
    let out = |i: &usize| pairs[*i].protrusion.unwrap_or(f64::INFINITY);
    let least = (0..pairs.len()).min_by(|a, b| out(a).total_cmp(&out(b)));
    least.filter(|_| forced)
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
