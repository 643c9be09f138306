//! A surface cut into charts: connected, each seen from one direction without folding over itself.
//!
//! Charts grow from seeds over the neighbours that face their direction best, as Sander et al. (SIGGRAPH 2001) and
//! xatlas do, the largest triangles first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Vector3};

use super::layout::across;
use super::raster::cover_triangle;
use crate::geometry::Mesh;

/// Least cosine between a triangle's normal and its chart's direction: how far a texel may be stretched.
const LEAST_FACING: f64 = 0.5;
/// The same for triangles smaller than a texel, whose stretching nobody sees.
const LEAST_FACING_SMALL: f64 = 0.15;
/// Times that normals are averaged over neighbours before a seed takes its direction from them.
const SMOOTHING: usize = 2;
/// Where the grid of the test for folds lies, texels: beside any number that a mesh may be made of.
const OFFSET: f64 = 0.381_966;

/// Triangles, and the plane in which they are laid flat.
pub struct Chart {
    pub triangles: Vec<u32>,
    /// Right-handed with the direction from which it is seen.
    pub axes: [Vector3<f64>; 2],
}

/// Every triangle in one chart; `pitch` is the edge of a texel, m.
pub fn charts(mesh: &Mesh, pitch: f64) -> Vec<Chart> {
    let Some(mut grower) = Grower::new(mesh, pitch) else {
        return Vec::new();
    };
    let smooth = grower.smooth_normals();
    let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    let area = |t: &u32| grower.scaled[*t as usize].norm();
    order.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
    let mut charts = Vec::new();
    for seed in order {
        if grower.taken[seed as usize] {
            continue;
        }
        // The direction of what a first growth reached serves the whole of it better than the seed's own.
        let facing = |d: &Vector3<f64>| grower.unit(seed).dot(d) > LEAST_FACING;
        let own = Some(smooth[seed as usize])
            .filter(|d| facing(d))
            .or_else(|| grower.scaled[seed as usize].try_normalize(1e-30))
            .unwrap_or_else(Vector3::z);
        let reached = grower.grow(seed, &own);
        let mean: Vector3<f64> = reached.iter().map(|t| grower.scaled[*t as usize]).sum();
        let direction = mean
            .try_normalize(1e-30)
            .filter(|d| grower.unit(seed).dot(d) > LEAST_FACING);
        let direction = direction.unwrap_or(own);
        let triangles = grower.grow(seed, &direction);
        for t in &triangles {
            grower.taken[*t as usize] = true;
        }
        charts.push(Chart {
            triangles,
            axes: across(&direction),
        });
    }
    charts
}

struct Grower<'a> {
    mesh: &'a Mesh,
    pitch: f64,
    middle: Point3<f64>,
    /// Twice the area times the normal of each triangle.
    scaled: Vec<Vector3<f64>>,
    /// The triangles across the edges of each.
    neighbours: Vec<Vec<u32>>,
    taken: Vec<bool>,
    /// The growth in which a triangle was last met.
    met: Vec<u32>,
    /// The growth that last covered a texel of the plane.
    plane: Vec<u32>,
    side: i64,
    growth: u32,
}

impl<'a> Grower<'a> {
    fn new(mesh: &'a Mesh, pitch: f64) -> Option<Self> {
        let (low, high) = mesh.bounds()?;
        // A grid of more texels than this would only find folds that no image of bounded size can show.
        let pitch = pitch.max((high - low).norm() / 2048.0).max(1e-9);
        let side = ((high - low).norm() / pitch).ceil() as i64 + 4;
        let count = mesh.triangles.len();
        Some(Self {
            mesh,
            pitch,
            middle: nalgebra::center(&low, &high),
            scaled: (0..count).map(|t| mesh.scaled_normal(t)).collect(),
            neighbours: neighbours(mesh),
            taken: vec![false; count],
            met: vec![0; count],
            plane: vec![0; (side * side) as usize],
            side,
            growth: 0,
        })
    }

    fn unit(&self, t: u32) -> Vector3<f64> {
        self.scaled[t as usize]
            .try_normalize(1e-30)
            .unwrap_or_else(Vector3::zeros)
    }

    fn smooth_normals(&self) -> Vec<Vector3<f64>> {
        let mut normals = self.scaled.clone();
        for _ in 0..SMOOTHING {
            let sum = |t: usize| {
                let around = self.neighbours[t].iter().map(|n| normals[*n as usize]);
                normals[t] + around.sum::<Vector3<f64>>()
            };
            normals = (0..normals.len()).map(sum).collect();
        }
        normals
            .iter()
            .map(|n| n.try_normalize(1e-30).unwrap_or_else(Vector3::zeros))
            .collect()
    }

    /// The triangles that are reached from `seed`, face `direction` and, seen along it, cover nothing twice.
    fn grow(&mut self, seed: u32, direction: &Vector3<f64>) -> Vec<u32> {
        self.growth += 1;
        let axes = across(direction);
        let mut reached = Vec::new();
        let mut open = BinaryHeap::from([Reverse((0_u32, seed))]);
        self.met[seed as usize] = self.growth;
        while let Some(Reverse((_, t))) = open.pop() {
            if !self.lay(t, &axes) && t != seed {
                continue;
            }
            reached.push(t);
            for k in 0..self.neighbours[t as usize].len() {
                let next = self.neighbours[t as usize][k];
                if self.taken[next as usize] || self.met[next as usize] == self.growth {
                    continue;
                }
                let facing = self.unit(next).dot(direction);
                let small = self.scaled[next as usize].norm() < 2.0 * self.pitch * self.pitch;
                if facing > if small { LEAST_FACING_SMALL } else { LEAST_FACING } {
                    self.met[next as usize] = self.growth;
                    open.push(Reverse((((1.0 - facing).max(0.0) * 1e6) as u32, next)));
                }
            }
        }
        reached
    }

    /// Covers the texels of a triangle, unless this growth has covered one of them already.
    fn lay(&mut self, t: u32, axes: &[Vector3<f64>; 2]) -> bool {
        let half = (self.side / 2) as f64 + OFFSET;
        let corners = self.mesh.corners(t as usize).map(|p| {
            let from = p - self.middle;
            axes.map(|a| from.dot(&a) / self.pitch + half)
        });
        let mut cells = Vec::new();
        cover_triangle(&corners, [self.side; 2], |x, y, _| {
            cells.push((y * self.side + x) as usize)
        });
        let free = cells.iter().all(|c| self.plane[*c] != self.growth);
        if free {
            for c in cells {
                self.plane[c] = self.growth;
            }
        }
        free
    }
}

/// The triangles across each triangle's edges, where an edge has two.
fn neighbours(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.push((a.min(b), a.max(b), t as u32));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![Vec::new(); mesh.triangles.len()];
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let [one, other] = group {
            neighbours[one.2 as usize].push(other.2);
            neighbours[other.2 as usize].push(one.2);
        }
    }
    neighbours
}
