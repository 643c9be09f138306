//! What is known of each voxel of the workspace while views are still being chosen: free, surface, or unknown.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use super::lens::unproject;
use crate::capture::{Camera, View};
use crate::geometry::Plane;

/// Most voxels of the grid; the voxel grows where the workspace is too large for it.
const MOST_VOXELS: f64 = 1.2e6;
/// Range at which a reading counts in full, m; its precision falls with the range squared.
pub(super) const FULL_RANGE: f64 = 0.45;
/// Depth step to a neighbour, over the depth, from which a pixel is an edge and is not believed.
const EDGE: f64 = 0.02;
/// Pixels to each side over which a slope is taken.
const REACH: i64 = 2;
/// Voxels from a surface within which distances to it are kept.
const FAR: u8 = 12;
/// A surface stands against this many rays through it for each that ended in it.
const SEEN_THROUGH: u32 = 6;

/// What one voxel is taken to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    Unknown,
    Free,
    Surface,
    /// The table, and all below it.
    Support,
}

#[derive(Clone, Copy, Default)]
struct Cell {
    free: u16,
    hits: u16,
    /// Best quality with which its surface was seen, 0 to 1.
    quality: f32,
    /// Whether it was seen at all, by the steepest look, 0 to 1.
    shown: f32,
    normal: [f32; 3],
}

/// A dense grid over the workspace, in the world's axes.
pub(super) struct Belief {
    pub voxel: f64,
    pub low: Point3<f64>,
    pub size: [i64; 3],
    cells: Vec<Cell>,
    /// Voxels to the nearest surface, up to [`FAR`].
    distance: Vec<u8>,
    floor: Option<(Plane, f64)>,
}

/// How well a surface is measured: the cosine of incidence over the depth noise, 1 for a straight look from near.
pub(super) fn quality(cosine: f64, range: f64) -> f64 {
    // No reading comes back at grazing incidence.
    let shown = ((cosine - 0.18) / 0.35).clamp(0.0, 1.0);
    shown * (FULL_RANGE / range).powi(2).min(1.0)
}

/// Whether a surface shows at all: no reading comes back where a look only grazes it. What nobody saw yet counts by
/// this alone: a poor look at it is worth more than the best second look at what is known.
pub(super) fn shows(cosine: f64) -> f64 {
    ((cosine - 0.05) / 0.1).clamp(0.0, 1.0)
}

impl Belief {
    pub fn new(workspace: [Point3<f64>; 2], voxel: f64, support: Option<Plane>) -> Self {
        let extent = workspace[1] - workspace[0];
        let volume = extent.x * extent.y * extent.z;
        let voxel = voxel.max((volume / MOST_VOXELS).cbrt());
        let size: [i64; 3] = std::array::from_fn(|a| ((extent[a] / voxel).ceil() as i64).max(1));
        let count = (size[0] * size[1] * size[2]) as usize;
        Self {
            voxel,
            low: workspace[0],
            size,
            cells: vec![Cell::default(); count],
            distance: vec![FAR; count],
            floor: support.map(|plane| (plane, 0.75 * voxel)),
        }
    }

    pub fn at(&self, place: [i64; 3]) -> Option<usize> {
        let inside = (0..3).all(|a| place[a] >= 0 && place[a] < self.size[a]);
        inside.then(|| (place[0] + self.size[0] * (place[1] + self.size[1] * place[2])) as usize)
    }

    pub fn place(&self, p: &Point3<f64>) -> [i64; 3] {
        std::array::from_fn(|a| ((p[a] - self.low[a]) / self.voxel).floor() as i64)
    }

    pub fn centre(&self, place: [i64; 3]) -> Point3<f64> {
        Point3::from(std::array::from_fn(|a| {
            self.low[a] + (place[a] as f64 + 0.5) * self.voxel
        }))
    }

    pub fn below_floor(&self, p: &Point3<f64>) -> bool {
        self.floor
            .as_ref()
            .is_some_and(|(plane, margin)| plane.height(p) < *margin)
    }

    pub fn state(&self, place: [i64; 3], at: usize) -> State {
        let cell = self.cells[at];
        if self.floor.is_some() && self.below_floor(&self.centre(place)) {
            State::Support
        } else if cell.hits > 0 && u32::from(cell.free) <= SEEN_THROUGH * u32::from(cell.hits) {
            State::Surface
        } else if cell.free > 0 {
            State::Free
        } else {
            State::Unknown
        }
    }

    pub fn seen_quality(&self, at: usize) -> f64 {
        f64::from(self.cells[at].quality)
    }

    pub fn normal(&self, at: usize) -> Vector3<f64> {
        Vector3::from(self.cells[at].normal.map(f64::from))
    }

    /// Voxels to the nearest surface, capped.
    pub fn to_surface(&self, at: usize) -> u8 {
        self.distance[at]
    }

    /// Area of the surface that was seen, m².
    pub fn seen_area(&self) -> f64 {
        let mut sum = 0.0;
        for z in 0..self.size[2] {
            for y in 0..self.size[1] {
                for x in 0..self.size[0] {
                    if let Some(at) = self.at([x, y, z]).filter(|at| self.cells[*at].hits > 0)
                        && self.state([x, y, z], at) == State::Surface
                    {
                        sum += f64::from(self.cells[at].shown);
                    }
                }
            }
        }
        sum * self.voxel * self.voxel
    }

    /// Takes a view in: space before a reading is free, at the reading there is a surface.
    pub fn add(&mut self, camera: &Camera, view: &View) {
        let image = Image { camera, view };
        let eye = Point3::from(view.world_from_camera.translation.vector);
        for y in 0..image.height() {
            for x in 0..image.width() {
                let Some(depth) = image.depth(x, y) else { continue };
                let spot = image.point(x, y, depth);
                let normal = image.normal(x, y, depth);
                // A pixel on an edge may fly: what lies well before it is free, no more is said. A slanted look must
                // not carve the surface that it grazes.
                let slant = |n: Vector3<f64>| (-n.dot(&(spot - eye).normalize())).max(0.15);
                // The table is known: a look along it must not leave a layer unknown above it.
                let short = if self.below_floor(&spot) {
                    0.5
                } else {
                    normal.map_or(3.0, |n| 1.2 / slant(n))
                };
                self.carve(&eye, &spot, short);
                if let Some(normal) = normal {
                    self.mark(&eye, &spot, &normal);
                }
            }
        }
        self.measure_distances();
    }

    fn carve(&mut self, eye: &Point3<f64>, spot: &Point3<f64>, short: f64) {
        let way = spot - eye;
        let length = way.norm();
        let way = way / length;
        let Some((from, to)) = self.clip(eye, &way) else { return };
        let to = to.min(length - short * self.voxel);
        let step = 0.7 * self.voxel;
        let mut last = usize::MAX;
        let mut t = from;
        while t < to {
            if let Some(at) = self.at(self.place(&(eye + way * t))).filter(|at| *at != last) {
                self.cells[at].free = self.cells[at].free.saturating_add(1);
                last = at;
            }
            t += step;
        }
    }

    fn mark(&mut self, eye: &Point3<f64>, spot: &Point3<f64>, normal: &Vector3<f64>) {
        let Some(at) = self.at(self.place(spot)) else { return };
        let way = spot - eye;
        let cosine = -normal.dot(&way.normalize());
        let seen = quality(cosine, way.norm()) as f32;
        let cell = &mut self.cells[at];
        cell.shown = cell.shown.max(shows(cosine) as f32);
        cell.hits = cell.hits.saturating_add(1);
        if seen >= cell.quality {
            cell.quality = seen;
            cell.normal = [normal.x as f32, normal.y as f32, normal.z as f32];
        }
    }

    /// Where a ray enters and leaves the grid.
    pub fn clip(&self, eye: &Point3<f64>, way: &Vector3<f64>) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0_f64, f64::INFINITY);
        for a in 0..3 {
            let (low, high) = (self.low[a], self.low[a] + self.size[a] as f64 * self.voxel);
            let (s, t) = ((low - eye[a]) / way[a], (high - eye[a]) / way[a]);
            if way[a].abs() < 1e-12 {
                if eye[a] < low || eye[a] > high {
                    return None;
                }
                continue;
            }
            (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
        }
        (from < to).then_some((from, to))
    }

    /// City-block distances to the nearest surface, breadth first.
    fn measure_distances(&mut self) {
        let mut queue = VecDeque::new();
        self.distance.fill(FAR);
        for z in 0..self.size[2] {
            for y in 0..self.size[1] {
                for x in 0..self.size[0] {
                    let place = [x, y, z];
                    if let Some(at) = self.at(place).filter(|at| self.state(place, *at) == State::Surface) {
                        self.distance[at] = 0;
                        queue.push_back(place);
                    }
                }
            }
        }
        while let Some(place) = queue.pop_front() {
            let next = self.at(place).map_or(FAR, |at| self.distance[at]) + 1;
            for beside in beside(place) {
                if let Some(at) = self.at(beside).filter(|at| self.distance[*at] > next) {
                    self.distance[at] = next;
                    if next + 1 < FAR {
                        queue.push_back(beside);
                    }
                }
            }
        }
    }
}

/// The six neighbours of a place.
pub(super) fn beside(place: [i64; 3]) -> [[i64; 3]; 6] {
    std::array::from_fn(|n| {
        let mut next = place;
        next[n / 2] += if n % 2 == 0 { 1 } else { -1 };
        next
    })
}

/// A depth image with its camera.
struct Image<'a> {
    camera: &'a Camera,
    view: &'a View,
}

impl Image<'_> {
    fn width(&self) -> i64 {
        i64::from(self.view.depth.width)
    }

    fn height(&self) -> i64 {
        i64::from(self.view.depth.height)
    }

    fn depth(&self, x: i64, y: i64) -> Option<f64> {
        if x < 0 || y < 0 || x >= self.width() || y >= self.height() {
            return None;
        }
        let depth = f64::from(self.view.depth.counts[(y * self.width() + x) as usize]) * self.camera.depth_unit;
        (depth > 0.0 && depth >= self.camera.depth_min && depth <= self.camera.depth_max).then_some(depth)
    }

    fn point(&self, x: i64, y: i64, depth: f64) -> Point3<f64> {
        let (u, v) = unproject(self.camera, x as f64, y as f64);
        self.view.world_from_camera.0 * Point3::new(u * depth, v * depth, depth)
    }

    /// The normal towards the camera from the points around a pixel; none at an edge.
    fn normal(&self, x: i64, y: i64, depth: f64) -> Option<Vector3<f64>> {
        let around = |dx: i64, dy: i64| {
            let there = self.depth(x + dx, y + dy)?;
            ((there - depth).abs() < EDGE * depth).then(|| self.point(x + dx, y + dy, there))
        };
        let (left, right) = (around(-REACH, 0)?, around(REACH, 0)?);
        let (up, down) = (around(0, -REACH)?, around(0, REACH)?);
        let normal = (down - up).cross(&(right - left)).try_normalize(1e-15)?;
        let to_eye = self.view.world_from_camera.translation.vector - self.point(x, y, depth).coords;
        Some(if normal.dot(&to_eye) < 0.0 { -normal } else { normal })
    }
}
