//! The dense neighbourhood of one thing, in which every voxel is decided: inside, outside, and whose.

use std::collections::VecDeque;

use nalgebra::Point3;

use super::fields::{blocks_of_box, integrate};
use super::range::Range;
use crate::base::Result;
use crate::geometry::{BLOCK, BlockGrid, Mesh};

/// No body was reached from here.
pub const NOBODY: u32 = u32::MAX;
/// A neighbouring thing.
pub const FOREIGN: u32 = u32::MAX - 1;
/// A neighbouring thing that a plane parts from this one.
pub const NEIGHBOUR: u32 = u32::MAX - 2;

/// A box of voxels around one thing.
pub struct Volume {
    /// What was observed.
    pub field: BlockGrid,
    /// Global index of the first voxel.
    pub low: [i32; 3],
    /// Global height index of the lowest layer that is clear of the support.
    pub clear: i32,
    /// Number of voxels per axis.
    pub size: [usize; 3],
    /// Signed distance, m, negative inside; decided everywhere. x fastest.
    pub distance: Vec<f32>,
    /// Whether the distance was observed, rather than concluded.
    pub observed: Vec<bool>,
    /// Whether the distance is that of an image of an observed sample.
    pub mirrored: Vec<bool>,
    /// The body that an inside voxel belongs to.
    pub owner: Vec<u32>,
}

impl Volume {
    /// Fuses the views once more in the whole box, and decides what was not seen: space under a seen surface
    /// and never seen through is inside, the rest outside. Below `floor` the support blurs the views, so that
    /// the layer at `floor` is continued down.
    pub fn build(
        ranges: &[Range],
        voxel: f64,
        truncation: f64,
        floor: f64,
        bounds: (Point3<f64>, Point3<f64>),
    ) -> Result<Self> {
        let pad = nalgebra::Vector3::repeat(6.0 * voxel);
        let (mut low, high) = (bounds.0 - pad, bounds.1 + pad);
        low.z = low.z.min(-4.0 * voxel);
        let keys: Vec<[i32; 3]> = blocks_of_box(voxel, &low, &high).collect();
        let mut field = BlockGrid::with_keys(voxel, &keys);
        integrate(&mut field, ranges, truncation)?;
        let first = field.keys().first().copied().unwrap_or_default();
        let last = field.keys().last().copied().unwrap_or_default();
        let low = first.map(|k| k * BLOCK);
        let size = std::array::from_fn(|a| ((last[a] - first[a] + 1) * BLOCK) as usize);
        let count = size.iter().product();
        let mut volume = Self {
            field,
            low,
            clear: low[2].max((floor / voxel - 0.5).ceil().max(-1e9) as i32),
            size,
            distance: vec![0.0; count],
            observed: vec![false; count],
            mirrored: vec![false; count],
            owner: vec![NOBODY; count],
        };
        volume.decide_with(&[], truncation as f32);
        Ok(volume)
    }

    /// Decides every sample: as observed, else as `filled` says (which may be empty), else by its column. Nobody owns
    /// anything afterwards.
    pub fn decide_with(&mut self, filled: &[Option<f32>], truncation: f32) {
        self.owner.fill(NOBODY);
        self.observed.fill(false);
        self.mirrored.fill(false);
        self.decide_columns(filled, truncation);
        self.continue_below(filled);
        self.fill_voids(self.field.voxel as f32);
    }

    /// Position of a voxel in the arrays.
    pub fn at(&self, x: usize, y: usize, z: usize) -> usize {
        x + self.size[0] * (y + self.size[1] * z)
    }

    /// The place in the box at a position in the arrays.
    pub fn place(&self, at: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [at % nx, at / nx % ny, at / (nx * ny)]
    }

    /// Position of a global index, if it is in the box.
    pub fn at_global(&self, index: [i32; 3]) -> Option<usize> {
        let local: [i32; 3] = std::array::from_fn(|a| index[a] - self.low[a]);
        let fits = (0..3).all(|a| local[a] >= 0 && (local[a] as usize) < self.size[a]);
        fits.then(|| self.at(local[0] as usize, local[1] as usize, local[2] as usize))
    }

    /// Global index of a place in the box.
    pub fn global(&self, x: usize, y: usize, z: usize) -> [i32; 3] {
        [self.low[0] + x as i32, self.low[1] + y as i32, self.low[2] + z as i32]
    }

    /// Coordinates of a sample.
    pub fn point(&self, index: [i32; 3]) -> Point3<f64> {
        let p = index.map(|i| (f64::from(i) + 0.5) * self.field.voxel);
        Point3::new(p[0], p[1], p[2])
    }

    fn on_border(&self, x: usize, y: usize, z: usize) -> bool {
        [x, y, z].iter().zip(self.size).any(|(i, n)| *i == 0 || *i + 1 == n)
    }

    fn decide_columns(&mut self, filled: &[Option<f32>], truncation: f32) {
        for x in 0..self.size[0] {
            for y in 0..self.size[1] {
                let mut inside = false;
                for z in (0..self.size[2]).rev() {
                    let at = self.at(x, y, z);
                    let index = self.global(x, y, z);
                    if let Some(distance) = self.field.observed(index) {
                        // Never exactly zero, so that the sign always decides.
                        self.distance[at] = if distance.abs() < 1e-7 { 1e-7 } else { distance };
                        self.observed[at] = true;
                        inside = distance < 0.0;
                    } else if let Some(distance) = filled.get(at).copied().flatten() {
                        self.distance[at] = distance;
                        self.mirrored[at] = true;
                        inside = distance < 0.0;
                    } else {
                        inside &= !self.field.is_free(index);
                        self.distance[at] = if inside { -truncation } else { truncation };
                    }
                }
            }
        }
    }

    fn continue_below(&mut self, filled: &[Option<f32>]) {
        let Some(layer) = usize::try_from(self.clear - self.low[2])
            .ok()
            .filter(|l| *l < self.size[2])
        else {
            return;
        };
        let plane = self.size[0] * self.size[1];
        for z in 0..layer {
            self.distance.copy_within(layer * plane..(layer + 1) * plane, z * plane);
            self.observed.copy_within(layer * plane..(layer + 1) * plane, z * plane);
            self.mirrored.copy_within(layer * plane..(layer + 1) * plane, z * plane);
        }
        for (at, distance) in filled.iter().enumerate().take(layer * plane) {
            if let Some(distance) = distance {
                self.distance[at] = *distance;
                self.observed[at] = false;
                self.mirrored[at] = true;
            }
        }
    }

    /// Outside that cannot be reached from the border of the box is a flaw of the views.
    fn fill_voids(&mut self, voxel: f32) {
        let mut open = vec![false; self.distance.len()];
        let mut queue = VecDeque::new();
        for z in 0..self.size[2] {
            for y in 0..self.size[1] {
                for x in 0..self.size[0] {
                    let at = self.at(x, y, z);
                    if self.on_border(x, y, z) && self.distance[at] > 0.0 {
                        open[at] = true;
                        queue.push_back([x, y, z]);
                    }
                }
            }
        }
        while let Some(place) = queue.pop_front() {
            for next in self.neighbours(place) {
                let at = self.at(next[0], next[1], next[2]);
                if !open[at] && self.distance[at] > 0.0 {
                    open[at] = true;
                    queue.push_back(next);
                }
            }
        }
        for (at, open) in open.iter().enumerate() {
            if !open && self.distance[at] > 0.0 {
                self.distance[at] = -voxel;
                self.observed[at] = false;
                self.mirrored[at] = false;
            }
        }
    }

    pub fn neighbours(&self, place: [usize; 3]) -> impl Iterator<Item = [usize; 3]> + use<> {
        let size = self.size;
        (0..6).filter_map(move |n| {
            let (axis, up) = (n / 2, n % 2 == 1);
            let mut next = place;
            next[axis] = if up {
                place[axis] + 1
            } else {
                place[axis].checked_sub(1)?
            };
            (next[axis] < size[axis]).then_some(next)
        })
    }

    /// Gives every inside voxel to the labelled surface that it is nearest to, through the inside.
    pub fn claim(&mut self, surfaces: &[(&Mesh, &[u32])]) {
        let mut queue = VecDeque::new();
        for (surface, labels) in surfaces {
            for (p, label) in surface.vertices.iter().zip(*labels) {
                self.seed(p, *label, &mut queue);
            }
        }
        while let Some(place) = queue.pop_front() {
            let owner = self.owner[self.at(place[0], place[1], place[2])];
            for next in self.neighbours(place) {
                let at = self.at(next[0], next[1], next[2]);
                if self.owner[at] == NOBODY && self.distance[at] < 0.0 {
                    self.owner[at] = owner;
                    queue.push_back(next);
                }
            }
        }
    }

    /// Claims the inside corners of the cell around a surface point.
    fn seed(&mut self, p: &Point3<f64>, label: u32, queue: &mut VecDeque<[usize; 3]>) {
        let cell = [p.x, p.y, p.z].map(|x| (x / self.field.voxel - 0.5).floor() as i32);
        for corner in 0..8 {
            let index = [
                cell[0] + (corner & 1),
                cell[1] + ((corner >> 1) & 1),
                cell[2] + (corner >> 2),
            ];
            let free = |at: &usize| self.distance[*at] < 0.0 && self.owner[*at] == NOBODY;
            if let Some(at) = self.at_global(index).filter(free) {
                self.owner[at] = label;
                queue.push_back(std::array::from_fn(|a| (index[a] - self.low[a]) as usize));
            }
        }
    }
}
