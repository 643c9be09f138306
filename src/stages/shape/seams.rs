//! Patches of one colour without an inward fold that are large enough to be things.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::split::{Cells, LEAST_SHARE, patches, tint};
use crate::geometry::Mesh;
use crate::math::median;

/// Least seen area of a thing, m².
pub const LEAST_AREA: f64 = 6e-4;

/// A patch of one colour without an inward fold.
pub struct Patch {
    /// Its colour.
    pub tint: Vector3<f64>,
    /// Vertices that reach down to the support.
    pub foot: usize,
    /// Mean of its vertices.
    pub middle: Point3<f64>,
}

/// The patch of every cell, without those that are too small to be things: where two things touch, the fused surface blends
/// their colours over some voxels. Each goes to the neighbour whose colour is nearest.
pub fn large_patches(surface: &Mesh, cells: &Cells, borders: &[(f64, u32, u32)]) -> (Vec<usize>, usize) {
    let (patch, count) = patches(cells, surface, LEAST_SHARE[1]);
    let mut owner = vec![0_usize; cells.middle.len()];
    let mut size = vec![0_usize; count];
    for (v, c) in cells.of_vertex.iter().enumerate() {
        owner[*c as usize] = patch[v] as usize;
        size[patch[v] as usize] += 1;
    }
    let least = LEAST_AREA / surface.area() * surface.vertices.len() as f64;
    let tints: Vec<Vector3<f64>> = described(surface, &of_vertices(cells, &owner), count, 0.0)
        .into_iter()
        .map(|p| p.tint)
        .collect();
    let mut host: Vec<usize> = (0..count).collect();
    loop {
        let small = |k: usize| (size[k] as f64) < least && host[k] == k;
        let mut best: BTreeMap<usize, (f64, usize)> = BTreeMap::new();
        for (_, a, b) in borders {
            let (a, b) = (host[owner[*a as usize]], host[owner[*b as usize]]);
            for (from, to) in [(a, b), (b, a)] {
                let far = (tints[from] - tints[to]).norm();
                if small(from) && from != to && size[to] >= size[from] && best.get(&from).is_none_or(|f| far < f.0) {
                    best.insert(from, (far, to));
                }
            }
        }
        // The smallest first, one at a time: what it joins may be large enough then.
        let Some((from, (_, to))) = best.into_iter().min_by_key(|(k, _)| (size[*k], *k)) else {
            break;
        };
        size[to] += size[from];
        for h in &mut host {
            if *h == from {
                *h = to;
            }
        }
    }
    let mut number: BTreeMap<usize, usize> = BTreeMap::new();
    for k in &host {
        let next = number.len();
        number.entry(*k).or_insert(next);
    }
    (owner.iter().map(|k| number[&host[*k]]).collect(), number.len())
}

/// What every cell has, by vertices.
pub fn of_vertices(cells: &Cells, owner: &[usize]) -> Vec<usize> {
    cells.of_vertex.iter().map(|c| owner[*c as usize]).collect()
}

/// Colour, foot and place of every patch of vertices; the colour is the median, which a seam does not shift.
pub fn described(surface: &Mesh, patch: &[usize], count: usize, foot: f64) -> Vec<Patch> {
    let mut tints: Vec<[Vec<f64>; 3]> = vec![Default::default(); count];
    let mut sums = vec![(0.0, Vector3::zeros(), 0_usize); count];
    for (v, p) in surface.vertices.iter().enumerate() {
        let (sum, color) = (&mut sums[patch[v]], tint(surface.colors.get(v)));
        (0..3).for_each(|k| tints[patch[v]][k].push(color[k]));
        *sum = (sum.0 + 1.0, sum.1 + p.coords, sum.2 + usize::from(p.z < foot));
    }
    let of = |k: usize| Patch {
        tint: Vector3::from_fn(|c, _| median(&tints[k][c]).unwrap_or_default()),
        middle: Point3::from(sums[k].1 / f64::max(sums[k].0, 1.0)),
        foot: sums[k].2,
    };
    (0..count).map(of).collect()
}
