//! The surface of a thing, vertex by vertex, as it is divided between parts that move.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Vector3};

use super::foreign::Foreign;
use super::picture::{Picture, Verdict};
use super::surfels::{Surfels, smooth_normals};
use crate::geometry::{Mesh, UnionFind, number_sets};

/// Cost of a border between neighbouring points of a smooth surface, and at a crease, in images' votes.
const BORDER: f64 = 0.7;
const CREASE: f64 = 0.12;
/// Cosine from which a surface counts as seen from behind.
const BEHIND: f64 = 0.3;
/// The least thickness that is taken for granted below a surface, m.
const THICKNESS: f64 = 0.002;

/// The surface of one thing as it was fused, vertex by vertex.
pub struct Skin<'a> {
    mesh: &'a Mesh,
    /// m, body frame.
    pub points: Vec<Point3<f64>>,
    normals: Vec<Vector3<f64>>,
    /// Area of each vertex over the mean.
    pub shares: Vec<f64>,
    /// Whether a view showed it.
    pub seen: Vec<bool>,
    /// Neighbours, with what a border between them costs.
    pub ties: Vec<(u32, u32, f64)>,
}

impl<'a> Skin<'a> {
    /// Of a closed mesh.
    pub fn new(mesh: &'a Mesh) -> Self {
        let normals = smooth_normals(mesh);
        let (areas, borders) = measured(mesh);
        let edge = (areas.iter().sum::<f64>() / areas.len().max(1) as f64).sqrt().max(1e-9);
        // Parts meet where the surface is hollow (the minima rule of Hoffman and Richards 1984), not at outer edges.
        let tie = |((a, b), length): (&(u32, u32), &f64)| {
            let (na, nb) = (normals[*a as usize], normals[*b as usize]);
            let way = mesh.vertices[*b as usize] - mesh.vertices[*a as usize];
            let hollow = (nb - na).dot(&way) < 0.0;
            let smooth = if hollow { na.dot(&nb).clamp(0.0, 1.0) } else { 1.0 };
            let cost = CREASE + (BORDER - CREASE) * ((smooth - 0.8) / 0.2).clamp(0.0, 1.0);
            (*a, *b, cost * length / edge)
        };
        Self {
            ties: borders.iter().map(tie).collect(),
            mesh,
            points: mesh.vertices.clone(),
            shares: areas.iter().map(|a| a / (edge * edge)).collect(),
            seen: if mesh.seen.is_empty() {
                vec![true; mesh.vertices.len()]
            } else {
                mesh.seen.clone()
            },
            normals,
        }
    }

    /// What an image says of every seen vertex under a pose; a reading on the tool says nothing.
    pub fn judged(&self, picture: &Picture, foreign: &Foreign, pose: &Isometry3<f64>) -> Vec<Verdict> {
        let judge = |i: usize| {
            if !self.seen[i] {
                return Verdict::Unknown;
            }
            let (p, n) = (pose * self.points[i], pose.rotation * self.normals[i]);
            let facing = -(p - picture.eye()).normalize().dot(&n);
            if facing < -BEHIND {
                // From behind a surface cannot be seen, but its thickness cannot be seen through either.
                let inside = p - n * THICKNESS;
                let through = picture.clear_behind(&inside);
                return if through { Verdict::Through } else { Verdict::Unknown };
            }
            if facing < 0.2 {
                return Verdict::Unknown;
            }
            match picture.judge(&p, &n, 0.0012) {
                // Beside an outline a pixel shows what is behind as soon as a pose is off by as much.
                Verdict::Through if !picture.clear_behind(&p) => Verdict::Unknown,
                Verdict::Hidden if picture.reading(&p).is_some_and(|r| foreign.on_tool(&r)) => Verdict::Unknown,
                verdict => verdict,
            }
        };
        (0..self.points.len()).map(judge).collect()
    }

    /// The surface with one label. Where it is cut from the other it has an edge, but no outline that an image could
    /// show before the cut is sure: there it is not counted as seen.
    pub fn part(&self, labels: &[bool], which: bool) -> Option<Surfels> {
        let kept: Vec<usize> = (0..labels.len())
            .filter(|i| labels[*i] == which && self.seen[*i])
            .collect();
        let mut skin = self.mesh.clone();
        skin.seen = self.seen.clone();
        for (a, b) in self.ties.iter().map(|(a, b, _)| (*a as usize, *b as usize)) {
            if labels[a] != labels[b] {
                (skin.seen[a], skin.seen[b]) = (false, false);
            }
        }
        Surfels::new(
            kept.iter().map(|i| self.points[*i]).collect(),
            kept.iter().map(|i| self.normals[*i]).collect(),
            skin.subset(|t| skin.triangles[t].iter().all(|v| labels[*v as usize] == which)),
        )
    }

    /// The largest connected set of marked vertices.
    pub fn largest(&self, marked: &[bool]) -> Vec<bool> {
        let mut sets = UnionFind::new(marked.len());
        for (a, b, _) in &self.ties {
            if marked[*a as usize] && marked[*b as usize] {
                sets.union(*a, *b);
            }
        }
        let (of, _) = number_sets(&mut sets, marked.len());
        let mut sizes: BTreeMap<u32, usize> = BTreeMap::new();
        for i in (0..marked.len()).filter(|i| marked[*i]) {
            *sizes.entry(of[i]).or_default() += 1;
        }
        let best = sizes
            .iter()
            .max_by_key(|(set, n)| (**n, u32::MAX - **set))
            .map(|(set, _)| *set);
        (0..marked.len()).map(|i| marked[i] && Some(of[i]) == best).collect()
    }
}

/// The area around each vertex, and the length of the border between the areas of every two neighbours, so that a cut
/// costs what it is long, however the mesh is cut into triangles (Boykov and Kolmogorov 2003).
fn measured(mesh: &Mesh) -> (Vec<f64>, BTreeMap<(u32, u32), f64>) {
    let mut areas = vec![0.0; mesh.vertices.len()];
    let mut borders: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(t);
        let middle = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
        let third = mesh.scaled_normal(t).norm() / 6.0;
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            areas[a as usize] += third;
            let length = (middle - nalgebra::center(&corners[k], &corners[(k + 1) % 3])).norm();
            *borders.entry((a.min(b), a.max(b))).or_default() += length;
        }
    }
    (areas, borders)
}
