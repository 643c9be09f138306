//! Merging of pieces while little is lost.

use nalgebra::Vector3;

use super::piece::joint_hull;
use crate::geometry::Mesh;

/// A part: the hull of some pieces.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub hull: Mesh,
    /// Of the hull, m³.
    pub volume: f64,
}

/// A pair of parts, what they would add in volume, and the part they would make.
struct Pair {
    a: usize,
    b: usize,
    added: f64,
    hull: Mesh,
}

/// Merges the pair that adds the least volume, again and again: down to `most` parts, and further while a merge adds
/// less than `free`, m³, all such merges together less than `budget`, m³, and `fits` takes the hull.
pub(super) fn merge(parts: Vec<Part>, most: usize, free: f64, budget: f64, fits: impl Fn(&Mesh) -> bool) -> Vec<Part> {
    let mut parts: Vec<Option<Part>> = parts.into_iter().map(Some).collect();
    let mut count = parts.len();
    let mut pairs = Vec::new();
    for b in 0..parts.len() {
        for a in 0..b {
            pairs.extend(pair(&parts, a, b));
        }
    }
    let mut spent = 0.0;
    while let Some(next) = least(&pairs) {
        let added = pairs[next].added.max(0.0);
        let cheap = added < free && spent + added < budget;
        if count <= most && !cheap {
            break;
        }
        let Pair { a, b, hull, .. } = pairs.swap_remove(next);
        if count <= most && !fits(&hull) {
            continue;
        }
        spent += added;
        parts[a] = Some(Part {
            volume: hull.volume(),
            hull,
        });
        parts[b] = None;
        count -= 1;
        pairs.retain(|p| ![a, b].contains(&p.a) && ![a, b].contains(&p.b));
        for other in (0..parts.len()).filter(|i| *i != a) {
            pairs.extend(pair(&parts, a.min(other), a.max(other)));
        }
    }
    parts.into_iter().flatten().collect()
}

fn least(pairs: &[Pair]) -> Option<usize> {
    let key = |i: &usize| (pairs[*i].added, pairs[*i].a, pairs[*i].b);
    (0..pairs.len()).min_by(|i, j| {
        let ((x, a, b), (y, c, d)) = (key(i), key(j));
        x.total_cmp(&y).then((a, b).cmp(&(c, d)))
    })
}

/// Nothing for parts whose boxes do not meet: they are never merged.
fn pair(parts: &[Option<Part>], a: usize, b: usize) -> Option<Pair> {
    let (x, y) = (parts[a].as_ref()?, parts[b].as_ref()?);
    let ((xl, xh), (yl, yh)) = (x.hull.bounds()?, y.hull.bounds()?);
    let gap = (yl - xh).sup(&(xl - yh)).sup(&Vector3::zeros()).norm();
    if gap > 1e-4 {
        return None;
    }
    let hull = joint_hull(&x.hull, &y.hull)?;
    Some(Pair {
        a,
        b,
        added: hull.volume() - x.volume - y.volume,
        hull,
    })
}
