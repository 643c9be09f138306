//! The separate things on the support, from the open surface above it.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::base::Notices;
use crate::geometry::{Mesh, UnionFind, number_sets, submesh};

/// Least seen area of a thing, m².
const LEAST_AREA: f64 = 3e-4;
/// Least area of a piece of a room that is a thing of its own, m².
const LEAST_LARGE: f64 = 4e-3;
/// Highest above the support that the seen surface of a thing begins, m.
const STANDING: f64 = 0.08;
/// Farthest that a small piece lies from the thing that it joins, m.
const CRUMB_REACH: f64 = 0.012;
/// Fewest vertices of a piece of a scene.
const CRUMB: usize = 60;
/// Farthest that a named frame may lie from the thing that takes its name, m.
const REACH: f64 = 0.15;
/// How much farther a frame may be from a thing that has no name yet, m.
const PASSED_OVER: f64 = 0.03;

/// Something that hangs together above the support, with the names that belong to it.
pub struct Thing {
    /// Its seen surface, in the field's frame.
    pub surface: Mesh,
    /// Names and first origins of the bodies in it, in the field's frame.
    pub named: Vec<(String, Point3<f64>)>,
}

impl Thing {
    /// Corners of the axis-aligned box around the seen surface.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        self.surface.bounds().unwrap_or((Point3::origin(), Point3::origin()))
    }
}

/// Cuts the surface at the height `floor` and sorts what is above by what hangs together; pieces less than
/// `gap` apart are one thing.
pub fn discover(surface: &Mesh, floor: f64, gap: f64, notices: &mut Notices) -> Vec<Thing> {
    let (above, _) = submesh(surface, |t| surface.corners(t).iter().all(|p| p.z > floor));
    let (labels, count) = join_pieces(&above, gap);
    let mut area = vec![0.0; count];
    for (i, t) in above.triangles.iter().enumerate() {
        area[labels[t[0] as usize] as usize] += 0.5 * above.scaled_normal(i).norm();
    }
    let small = area.iter().filter(|a| **a < LEAST_AREA).count();
    if small > 0 {
        let total: f64 = area.iter().filter(|a| **a < LEAST_AREA).sum();
        notices.note(
            "shape",
            "views",
            format!(
                "{small} bits of {:.1} cm² in all are too small to be things",
                total * 1e4
            ),
        );
    }
    (0..count)
        .filter(|c| area[*c] >= LEAST_AREA)
        .map(|c| Thing {
            surface: submesh(&above, |t| labels[above.triangles[t][0] as usize] as usize == c).0,
            named: Vec::new(),
        })
        .collect()
}

/// Components of the vertices, joined by triangles or by lying in the same or neighbouring cells of `gap`.
fn join_pieces(mesh: &Mesh, gap: f64) -> (Vec<u32>, usize) {
    let mut sets = UnionFind::new(mesh.vertices.len());
    for t in &mesh.triangles {
        sets.union(t[0], t[1]);
        sets.union(t[1], t[2]);
    }
    let mut cells: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let cell = |p: &Point3<f64>| [p.x, p.y, p.z].map(|x| (x / gap).floor() as i32);
    for (v, p) in mesh.vertices.iter().enumerate() {
        let known = *cells.entry(cell(p)).or_insert(v as u32);
        sets.union(known, v as u32);
    }
    for (key, v) in &cells {
        for step in HALF_NEIGHBOURS {
            if let Some(w) = cells.get(&[key[0] + step[0], key[1] + step[1], key[2] + step[2]]) {
                sets.union(*v, *w);
            }
        }
    }
    number_sets(&mut sets, mesh.vertices.len())
}

/// Of the pieces that a room leaves: crumbs join the larger piece they all but touch, and what neither is large
/// nor stands near the support nor bears a frame is added to `outer`.
pub fn standing(things: Vec<Thing>, frames: &[Point3<f64>], outer: &mut Mesh, notices: &mut Notices) -> Vec<Thing> {
    let is_large = |thing: &Thing| thing.surface.area() > LEAST_LARGE;
    let stands = |thing: &Thing| thing.bounds().0.z < STANDING;
    let named = |thing: &Thing| frames.iter().any(|f| distance_to_box(f, thing.bounds()) < PASSED_OVER);
    let (mut kept, rest): (Vec<Thing>, Vec<Thing>) =
        things.into_iter().partition(|t| named(t) || (is_large(t) && stands(t)));
    let mut dropped = Vec::new();
    for piece in rest {
        let near = |thing: &Thing| surface_gap(&piece.surface, &thing.surface);
        let host = (0..kept.len())
            .map(|i| (near(&kept[i]), i))
            .filter(|(gap, _)| *gap < CRUMB_REACH)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match host {
            Some((_, i)) if !is_large(&piece) => kept[i].surface.append(&piece.surface),
            _ => {
                outer.append(&piece.surface);
                let bottom = piece.bounds().0.z;
                dropped.push(format!("{:.0} cm² from {bottom:.2} m up", piece.surface.area() * 1e4));
            }
        }
    }
    if !dropped.is_empty() {
        let words = format!(
            "{} pieces do not stand on the support or are too small to be things: {}",
            dropped.len(),
            dropped.join(", ")
        );
        notices.note("shape", "views", words);
    }
    kept
}

/// Smallest distance between vertices of two surfaces, of every few vertices, m; large where their boxes are
/// farther apart than crumbs are joined over.
fn surface_gap(a: &Mesh, b: &Mesh) -> f64 {
    let (Some(one), Some(two)) = (a.bounds(), b.bounds()) else {
        return f64::INFINITY;
    };
    let apart = (two.0 - one.1)
        .sup(&(one.0 - two.1))
        .sup(&nalgebra::Vector3::zeros())
        .norm();
    if apart > CRUMB_REACH {
        return f64::INFINITY;
    }
    let few = |m: &Mesh| -> Vec<Point3<f64>> {
        let step = (m.vertices.len() / 2000).max(1);
        m.vertices.iter().step_by(step).copied().collect()
    };
    let (one, two) = (few(a), few(b));
    one.iter()
        .flat_map(|p| two.iter().map(move |q| (p - q).norm()))
        .fold(f64::INFINITY, f64::min)
}

/// The surface without the pieces that are too small to matter.
pub fn without_crumbs(surface: &Mesh) -> Mesh {
    let (piece, count) = crate::geometry::vertex_components(surface);
    let mut size = vec![0_usize; count];
    for p in &piece {
        size[*p as usize] += 1;
    }
    submesh(surface, |t| {
        size[piece[surface.triangles[t][0] as usize] as usize] >= CRUMB
    })
    .0
}

/// One of each opposite pair of the 26 neighbours of a cell.
const HALF_NEIGHBOURS: [[i32; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [1, -1, 0],
    [1, 0, 1],
    [1, 0, -1],
    [0, 1, 1],
    [0, 1, -1],
    [1, 1, 1],
    [1, 1, -1],
    [1, -1, 1],
    [1, -1, -1],
];

/// Gives each named frame to the thing that it lies in, or to the nearest within reach; a thing that has a name
/// already is passed over for one that has none and is hardly farther. Returns the names that found none.
pub fn give_names(things: &mut [Thing], named: Vec<(String, Point3<f64>)>) -> Vec<String> {
    let distance = |origin: &Point3<f64>, thing: &Thing| {
        let bounds = thing.bounds();
        let middle = nalgebra::center(&bounds.0, &bounds.1);
        distance_to_box(origin, bounds) + 0.01 * (origin - middle).norm()
    };
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (n, (_, origin)) in named.iter().enumerate() {
        pairs.extend(
            things
                .iter()
                .enumerate()
                .map(|(t, thing)| (distance(origin, thing), n, t)),
        );
    }
    pairs.retain(|p| p.0 < REACH);
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut owner: Vec<Option<usize>> = vec![None; named.len()];
    let nearest = |n: usize| pairs.iter().find(|p| p.1 == n);
    for (far, n, t) in &pairs {
        let hardly_farther = nearest(*n).is_some_and(|p| *far < p.0 + PASSED_OVER);
        if owner[*n].is_none() && !owner.contains(&Some(*t)) && hardly_farther {
            owner[*n] = Some(*t);
        }
    }
    let owner: Vec<Option<usize>> = (0..named.len()).map(|n| owner[n].or(nearest(n).map(|p| p.2))).collect();
    let mut lost = Vec::new();
    for ((name, origin), owner) in named.into_iter().zip(owner) {
        match owner {
            Some(t) => things[t].named.push((name, origin)),
            None => lost.push(name),
        }
    }
    lost
}

fn distance_to_box(p: &Point3<f64>, (low, high): (Point3<f64>, Point3<f64>)) -> f64 {
    // The box reaches down to the support.
    let low = Point3::new(low.x, low.y, low.z.min(0.0));
    (p - p.sup(&low).inf(&high)).norm()
}
