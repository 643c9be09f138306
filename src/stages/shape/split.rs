//! Things that touch are told apart: patches of one colour without a concave crease, given to the named frames.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use super::colours::UNLIKE;
use super::discover::Thing;
use super::seams::{large_patches, of_vertices};
use crate::base::Notices;
use crate::geometry::{Mesh, Plane, UnionFind, number_sets, unique_edges, vertex_normals};

/// Least share of a thing's vertices that a patch must have to be a body of its own; the second where that leaves fewer
/// patches than there are frames, as of a coin among what is large.
pub const LEAST_SHARE: [f64; 2] = [0.03, 0.008];
/// Most patches among which those of the frames are sought, the largest first.
const MOST_PATCHES: usize = 12;
/// Most vertices on the wrong side of a plane that still parts two bodies.
const PLANE_ERROR: f64 = 0.04;
/// Scale of the merge rule: how much more dissimilar than inside may a border be of a patch that is everything.
const MERGE_SCALE: f64 = 0.8;
/// The same for the smallest patches.
const MOST_SLACK: f64 = 6.0;
/// Dissimilarity of an inward fold, per unit of change of the normal along the way.
const FOLD_WEIGHT: f64 = 40.0;
/// Distance that a unit of colour difference counts for, m.
const TINT_METRES: f64 = 0.003;

/// Which body of a thing each surface vertex belongs to, and the planes that part the bodies.
pub struct Split {
    /// Index into the thing's names, per vertex.
    pub labels: Vec<u32>,
    /// `(a, b, plane)`: body `a` is below the plane, body `b` above.
    pub planes: Vec<(u32, u32, Plane)>,
    /// The other things from which such a plane parts it.
    pub touching: Vec<usize>,
}

/// Splits a thing that several named frames lie in.
pub fn split(thing: &Thing, voxel: f64, notices: &mut Notices) -> Split {
    let count = thing.named.len();
    if count < 2 {
        return Split {
            labels: vec![0; thing.surface.vertices.len()],
            planes: Vec::new(),
            touching: Vec::new(),
        };
    }
    let about = thing
        .named
        .iter()
        .map(|(n, _)| n.as_str())
        .collect::<Vec<_>>()
        .join(", ");
    let labels = match labels_of_patches(&thing.surface, &thing.named, 2.0 * voxel) {
        Some(labels) => {
            notices.note("shape", &about, "they touch: told apart by colour and creases");
            labels
        }
        None => {
            notices.warn(
                "shape",
                &about,
                "they touch and look alike: told apart by where their frames are",
            );
            labels_along_line(&thing.surface, &thing.named)
        }
    };
    let planes = parting_planes(&thing.surface, &labels, count as u32);
    Split {
        labels,
        planes,
        touching: Vec::new(),
    }
}

fn parting_planes(surface: &Mesh, labels: &[u32], count: u32) -> Vec<(u32, u32, Plane)> {
    let of = |label: u32| -> Vec<Point3<f64>> {
        let points = surface.vertices.iter().zip(labels);
        points.filter(|(_, l)| **l == label).map(|(p, _)| *p).collect()
    };
    let sets: Vec<Vec<Point3<f64>>> = (0..count).map(of).collect();
    let mut planes = Vec::new();
    for a in 0..count {
        for b in a + 1..count {
            let found = Plane::separating(&sets[a as usize], &sets[b as usize]);
            if let Some((plane, _)) = found.filter(|(_, wrong)| *wrong < PLANE_ERROR) {
                planes.push((a, b, plane));
            }
        }
    }
    planes
}

/// Patches given to frames one to one at the least total distance to the patches' middles, the remaining ones
/// to the body whose patch is nearest in place and colour; nothing where there are fewer patches than frames.
fn labels_of_patches(surface: &Mesh, named: &[(String, Point3<f64>)], cell: f64) -> Option<Vec<u32>> {
    let cells = Cells::new(surface, cell);
    let by_share = |share: f64| {
        let (patch, count) = patches(&cells, surface, share);
        labels_of_large(surface, named, (&patch, count), share)
    };
    let without_seams = || {
        let (patch, count) = large_patches(surface, &cells, &cells.borders(surface));
        let patch: Vec<u32> = of_vertices(&cells, &patch).into_iter().map(|k| k as u32).collect();
        labels_of_large(surface, named, (&patch, count), 0.0)
    };
    let [large, small] = LEAST_SHARE;
    by_share(large).or_else(without_seams).or_else(|| by_share(small))
}

fn labels_of_large(
    surface: &Mesh,
    named: &[(String, Point3<f64>)],
    (patch, count): (&[u32], usize),
    least_share: f64,
) -> Option<Vec<u32>> {
    let mut size = vec![0_usize; count];
    let mut tints = vec![Vector3::<f64>::zeros(); count];
    let mut bounds = vec![(Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3])); count];
    for (v, p) in surface.vertices.iter().enumerate() {
        let k = patch[v] as usize;
        size[k] += 1;
        let step = (tint(surface.colors.get(v)) - tints[k]) / size[k] as f64;
        tints[k] += step;
        bounds[k] = (bounds[k].0.inf(p), bounds[k].1.sup(p));
    }
    let least = least_share * surface.vertices.len() as f64;
    let mut large: Vec<usize> = (0..count).filter(|k| size[*k] as f64 >= least).collect();
    large.sort_by_key(|k| std::cmp::Reverse(size[*k]));
    large.truncate(MOST_PATCHES);
    if large.len() < named.len() {
        return None;
    }
    let middle = |k: usize| nalgebra::center(&bounds[k].0, &bounds[k].1);
    let cost: Vec<Vec<f64>> = named
        .iter()
        .map(|(_, o)| large.iter().map(|k| (o - middle(*k)).norm()).collect())
        .collect();
    let chosen: Vec<usize> = cheapest_assignment(&cost).into_iter().map(|i| large[i]).collect();
    // A scrap is a thing of its own where its colour says so: of what is all of one colour the frames know better.
    let alike = |a: usize, b: usize| (tints[chosen[a]] - tints[chosen[b]]).norm() < UNLIKE;
    if least_share < LEAST_SHARE[0] && (0..chosen.len()).any(|a| (0..a).any(|b| alike(a, b))) {
        return None;
    }
    let owner: Vec<u32> = (0..count)
        .map(|k| {
            let unlike = |other: usize| TINT_METRES * (tints[k] - tints[other]).norm();
            let far = |body: usize| box_gap(&bounds[k], &bounds[chosen[body]]) + unlike(chosen[body]);
            let direct = chosen.iter().position(|c| *c == k);
            let near = || (0..chosen.len()).min_by(|a, b| far(*a).total_cmp(&far(*b)));
            direct.or_else(near).unwrap_or(0) as u32
        })
        .collect();
    Some(patch.iter().map(|k| owner[*k as usize]).collect())
}

/// Distance between two boxes, and of their middles where they meet (as a small addition).
fn box_gap(a: &(Point3<f64>, Point3<f64>), b: &(Point3<f64>, Point3<f64>)) -> f64 {
    let gap = (b.0 - a.1).sup(&(a.0 - b.1)).sup(&Vector3::zeros()).norm();
    gap + 0.1 * (nalgebra::center(&a.0, &a.1) - nalgebra::center(&b.0, &b.1)).norm()
}

/// For each row a column of its own, by exhaustive search: there are few columns.
fn cheapest_assignment(cost: &[Vec<f64>]) -> Vec<usize> {
    fn go(cost: &[Vec<f64>], taken: &mut Vec<usize>, sum: f64, best: &mut (f64, Vec<usize>)) {
        let row = taken.len();
        if sum >= best.0 {
            return;
        }
        if row == cost.len() {
            *best = (sum, taken.clone());
            return;
        }
        for column in 0..cost[row].len() {
            if !taken.contains(&column) {
                taken.push(column);
                go(cost, taken, sum + cost[row][column], best);
                taken.pop();
            }
        }
    }
    let mut best = (f64::INFINITY, (0..cost.len()).collect());
    go(cost, &mut Vec::new(), 0.0, &mut best);
    best.1
}

/// Cells of the surface that lie together and face the same way, with their means.
pub struct Cells {
    pub of_vertex: Vec<u32>,
    pub middle: Vec<Point3<f64>>,
    pub normal: Vec<Vector3<f64>>,
    tint: Vec<Vector3<f64>>,
}

impl Cells {
    pub fn new(surface: &Mesh, edge: f64) -> Self {
        let normals = vertex_normals(surface);
        let key = |v: usize| {
            let p = surface.vertices[v];
            let main = normals[v].iamax();
            let cell = [p.x, p.y, p.z].map(|x| (x / edge).floor() as i32);
            (cell, main, normals[v][main] > 0.0)
        };
        let mut number = BTreeMap::new();
        let of_vertex: Vec<u32> = (0..surface.vertices.len())
            .map(|v| {
                let next = number.len() as u32;
                *number.entry(key(v)).or_insert(next)
            })
            .collect();
        let n = number.len();
        let mut sums = vec![(0.0, Vector3::zeros(), Vector3::zeros(), Vector3::zeros()); n];
        for (v, cell) in of_vertex.iter().enumerate() {
            let sum = &mut sums[*cell as usize];
            sum.0 += 1.0;
            sum.1 += surface.vertices[v].coords;
            sum.2 += normals[v];
            sum.3 += tint(surface.colors.get(v));
        }
        Self {
            of_vertex,
            middle: sums.iter().map(|s| Point3::from(s.1 / s.0)).collect(),
            normal: sums
                .iter()
                .map(|s| s.2.try_normalize(1e-9).unwrap_or_else(Vector3::z))
                .collect(),
            tint: sums.iter().map(|s| s.3 / s.0).collect(),
        }
    }

    /// Colour difference, and how far the surface folds inwards from one cell to the next.
    fn dissimilarity(&self, a: u32, b: u32) -> f64 {
        let (i, j) = (a as usize, b as usize);
        let along = self.middle[j] - self.middle[i];
        let opening = (self.normal[j] - self.normal[i]).dot(&along) / along.norm().max(1e-9);
        (self.tint[i] - self.tint[j]).norm() + FOLD_WEIGHT * (-opening - 0.15).max(0.0)
    }

    /// Pairs of cells that some mesh edge joins, with their dissimilarity, the most similar first.
    pub fn borders(&self, surface: &Mesh) -> Vec<(f64, u32, u32)> {
        let of = |v: u32| self.of_vertex[v as usize];
        let joined = unique_edges(surface)
            .into_iter()
            .map(|(a, b)| (of(a).min(of(b)), of(a).max(of(b))));
        let mut pairs: Vec<(u32, u32)> = joined.filter(|(a, b)| a != b).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut weighted: Vec<(f64, u32, u32)> = pairs
            .into_iter()
            .map(|(a, b)| (self.dissimilarity(a, b), a, b))
            .collect();
        weighted.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
        weighted
    }
}

/// Patches without strong inner borders (Felzenszwalb and Huttenlocher 2004) over small cells: neighbours are
/// dissimilar by their colour and where the surface folds inwards (Stein et al. 2014, LCCP).
pub fn patches(cells: &Cells, surface: &Mesh, least_share: f64) -> (Vec<u32>, usize) {
    let weighted = cells.borders(surface);
    let n = cells.middle.len();
    let scale = MERGE_SCALE * n as f64;
    let mut sets = UnionFind::new(n);
    let mut inner = vec![MOST_SLACK; n];
    let mut size = vec![1_u32; n];
    for (weight, a, b) in &weighted {
        let (a, b) = (sets.find(*a), sets.find(*b));
        if a != b && *weight <= inner[a as usize].min(inner[b as usize]) {
            let total = size[a as usize] + size[b as usize];
            let root = sets.union(a, b) as usize;
            size[root] = total;
            inner[root] = weight + (scale / f64::from(total)).min(MOST_SLACK);
        }
    }
    // Slivers join their most similar neighbour.
    let least = (least_share * n as f64) as u32;
    for (_, a, b) in &weighted {
        let (a, b) = (sets.find(*a), sets.find(*b));
        if a != b && size[a as usize].min(size[b as usize]) < least {
            let total = size[a as usize] + size[b as usize];
            size[sets.union(a, b) as usize] = total;
        }
    }
    let (patch, count) = number_sets(&mut sets, n);
    (cells.of_vertex.iter().map(|c| patch[*c as usize]).collect(), count)
}

/// Colour as chromaticity, which shading leaves alone, with a little brightness.
pub fn tint(color: Option<&[u8; 3]>) -> Vector3<f64> {
    let [r, g, b] = color.copied().unwrap_or([128; 3]).map(f64::from);
    let sum = (r + g + b).max(30.0);
    Vector3::new(r / sum * 255.0, g / sum * 255.0, 0.05 * sum)
}

/// Parts the thing by planes across the line of the frames, so that each frame is as near to the middle of its
/// piece as can be: with the ends `b0`, `bk` of the thing, least squares of `(b_i + b_{i+1}) / 2 = o_i`.
fn labels_along_line(surface: &Mesh, named: &[(String, Point3<f64>)]) -> Vec<u32> {
    let k = named.len();
    let far = |i: usize| named.iter().map(|(_, o)| (o - named[i].1).norm()).fold(0.0, f64::max);
    let end = (0..k).max_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap_or(0);
    let other = (0..k).max_by(|a, b| {
        let d = |i: usize| (named[i].1 - named[end].1).norm();
        d(*a).total_cmp(&d(*b))
    });
    let line = other
        .and_then(|o| (named[o].1 - named[end].1).try_normalize(1e-6))
        .unwrap_or_else(Vector3::z);
    let place = |p: &Point3<f64>| line.dot(&p.coords);
    let mut order: Vec<usize> = (0..k).collect();
    order.sort_by(|a, b| place(&named[*a].1).total_cmp(&place(&named[*b].1)));
    let ends = surface.vertices.iter().map(place);
    let (low, high) = ends.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    // The thing stands on the support, though its surface is only known from a little above it.
    let low = if line.z > 0.9 { low.min(0.0) } else { low };
    let high = if line.z < -0.9 { high.max(0.0) } else { high };
    let origins: Vec<f64> = order.iter().map(|i| place(&named[*i].1)).collect();
    let borders = middle_borders(&origins, low, high);
    let piece = |p: &Point3<f64>| borders.iter().filter(|b| place(p) > **b).count();
    surface.vertices.iter().map(|p| order[piece(p)] as u32).collect()
}

fn middle_borders(origins: &[f64], low: f64, high: f64) -> Vec<f64> {
    let k = origins.len();
    let mut matrix = DMatrix::<f64>::zeros(k, k - 1);
    let mut right = DVector::<f64>::zeros(k);
    for (i, origin) in origins.iter().enumerate() {
        right[i] = *origin;
        match i {
            0 => right[i] -= 0.5 * low,
            _ => matrix[(i, i - 1)] = 0.5,
        }
        if i + 1 == k {
            right[i] -= 0.5 * high;
        } else {
            matrix[(i, i)] = 0.5;
        }
    }
    let solved = matrix.svd(true, true).solve(&right, 1e-12);
    solved
        .map(|b| b.iter().copied().collect())
        .unwrap_or_else(|_| origins.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_border_puts_both_frames_in_the_middle_of_their_pieces() {
        let borders = middle_borders(&[0.03, 0.08], 0.0, 0.10);
        assert!((borders[0] - 0.06).abs() < 1e-12);
        let borders = middle_borders(&[0.01, 0.035, 0.065], 0.0, 0.08);
        assert!((borders[0] - 0.02).abs() < 1e-12 && (borders[1] - 0.05).abs() < 1e-12);
    }

    #[test]
    fn the_cheapest_assignment_is_one_to_one() {
        assert_eq!(cheapest_assignment(&[vec![1.0, 2.0], vec![1.0, 9.0]]), vec![1, 0]);
    }
}
