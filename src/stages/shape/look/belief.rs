//! What is known of each voxel of the workspace while views are still being chosen: free, surface, or unknown.

use nalgebra::{Point3, Vector3};

use super::next_view::NextViewConfig;
use super::slope::Image;
use crate::capture::{Camera, View};
use crate::geometry::Plane;

/// Most voxels of the grid; the voxel grows where the workspace is too large for it.
const MOST_VOXELS: f64 = 1.2e6;
/// A surface stands against this many rays through it for each that ended in it.
const SEEN_THROUGH: u32 = 6;
/// Cosine between two normals below which they are of two sides of one wall.
const OPPOSITE: f64 = -0.2;
/// Cosine of incidence below which no reading comes back.
const GRAZING: f64 = 0.17;

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
    /// What was seen of it from either side: a wall may be thinner than a voxel.
    sides: [Side; 2],
}

/// One side of the surface in a voxel.
#[derive(Clone, Copy, Default)]
pub(super) struct Side {
    /// Sum of the points that were read, relative to the voxel's middle, m, and their number.
    sum: [f32; 3],
    count: f32,
    normal: [f32; 3],
    /// Probability that a spot of it was read so far, and by the view that is being added.
    shown: f32,
    fresh: f32,
}

impl Side {
    /// Probability that a spot of it was read.
    pub fn shown(&self) -> f64 {
        f64::from(self.shown)
    }

    pub fn normal(&self) -> Vector3<f64> {
        Vector3::from(self.normal.map(f64::from))
    }
}

/// A dense grid over the workspace, in the world's axes.
pub(super) struct Belief {
    pub voxel: f64,
    pub low: Point3<f64>,
    pub size: [i64; 3],
    cells: Vec<Cell>,
    states: Vec<State>,
    /// Probability with which the views so far would have left surface in an unknown voxel unseen.
    missed: Vec<f32>,
    floor: Option<(Plane, f64)>,
    /// How near a reading must be to a spot that it shows it, m.
    pub tolerance: f64,
}

/// Probability that a spot of a surface is read to within `tolerance` along the ray: over one pixel, which is `pixel` m wide
/// there, the depth changes by that times the tangent of the incidence.
pub(super) fn shows(cosine: f64, pixel: f64, tolerance: f64) -> f64 {
    if cosine < GRAZING {
        return 0.0;
    }
    let half = 0.5 * pixel * (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    (tolerance / half.max(1e-9)).min(1.0)
}

impl Belief {
    pub fn new(workspace: [Point3<f64>; 2], config: &NextViewConfig, support: Option<Plane>) -> Self {
        let extent = workspace[1] - workspace[0];
        let volume = extent.x * extent.y * extent.z;
        let voxel = config.voxel.max((volume / MOST_VOXELS).cbrt());
        let size: [i64; 3] = std::array::from_fn(|a| ((extent[a] / voxel).ceil() as i64).max(1));
        let count = (size[0] * size[1] * size[2]) as usize;
        let mut belief = Self {
            voxel,
            low: workspace[0],
            size,
            cells: vec![Cell::default(); count],
            states: vec![State::Unknown; count],
            missed: vec![1.0; count],
            floor: support.map(|plane| (plane, 0.75 * voxel)),
            tolerance: config.tolerance,
        };
        belief.settle();
        belief
    }

    /// What a voxel is taken to be.
    pub fn state(&self, at: usize) -> State {
        self.states[at]
    }

    /// Number of voxels.
    pub fn count(&self) -> usize {
        self.states.len()
    }

    pub fn missed(&self, at: usize) -> f64 {
        f64::from(self.missed[at])
    }

    /// A view that should have shown surface in a voxel with probability `shown` did not.
    pub fn miss(&mut self, at: usize, shown: f64) {
        self.missed[at] *= (1.0 - shown) as f32;
    }

    pub fn at(&self, place: [i64; 3]) -> Option<usize> {
        let inside = (0..3).all(|a| place[a] >= 0 && place[a] < self.size[a]);
        inside.then(|| (place[0] + self.size[0] * (place[1] + self.size[1] * place[2])) as usize)
    }

    pub fn place_of(&self, at: usize) -> [i64; 3] {
        let at = at as i64;
        let [nx, ny, _] = self.size;
        [at % nx, at / nx % ny, at / (nx * ny)]
    }

    pub fn place(&self, p: &Point3<f64>) -> [i64; 3] {
        std::array::from_fn(|a| ((p[a] - self.low[a]) / self.voxel).floor() as i64)
    }

    pub fn centre(&self, place: [i64; 3]) -> Point3<f64> {
        Point3::from(std::array::from_fn(|a| {
            self.low[a] + (place[a] as f64 + 0.5) * self.voxel
        }))
    }

    fn below_floor(&self, p: &Point3<f64>) -> bool {
        self.floor
            .as_ref()
            .is_some_and(|(plane, margin)| plane.height(p) < *margin)
    }

    /// The sides of a surface voxel that were seen, with where they are.
    pub fn sides(&self, at: usize) -> impl Iterator<Item = (Point3<f64>, &Side)> {
        let middle = self.centre(self.place_of(at));
        self.cells[at]
            .sides
            .iter()
            .filter(|s| s.count > 0.0)
            .map(move |s| (middle + Vector3::from(s.sum.map(|x| f64::from(x / s.count))), s))
    }

    /// Area of a surface of this normal in a voxel that it crosses, on the average.
    pub fn area(&self, normal: &Vector3<f64>) -> f64 {
        self.voxel * self.voxel / (normal.x.abs() + normal.y.abs() + normal.z.abs()).max(1.0)
    }

    /// Area of the surface that was seen, m².
    pub fn seen_area(&self) -> f64 {
        (0..self.cells.len())
            .filter(|at| self.states[*at] == State::Surface)
            .flat_map(|at| self.sides(at))
            .map(|(_, s)| s.shown() * self.area(&s.normal()))
            .sum()
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
                let way = (spot - eye).normalize();
                // A pixel on an edge may fly: what lies well before it is free, no more is said. A slanted look must
                // not carve the surface that it grazes.
                // The table is known: a look along it must not leave a layer unknown above it.
                let short = if self.below_floor(&spot) {
                    0.5
                } else {
                    normal.map_or(3.0, |n| 1.2 / (-n.dot(&way)).max(0.15))
                };
                self.carve(&eye, &spot, short);
                if let Some(normal) = normal {
                    let pixel = depth / camera.fx;
                    self.mark(&spot, &normal, shows(-normal.dot(&way), pixel, self.tolerance));
                }
            }
        }
        self.settle();
    }

    /// Takes the view's probabilities in, and decides what every voxel is.
    fn settle(&mut self) {
        for at in 0..self.cells.len() {
            let centre = self.centre(self.place_of(at));
            let below = self.below_floor(&centre);
            let cell = &mut self.cells[at];
            for side in &mut cell.sides {
                side.shown = 1.0 - (1.0 - side.shown) * (1.0 - side.fresh);
                side.fresh = 0.0;
            }
            self.states[at] = if below {
                State::Support
            } else if cell.hits > 0 && u32::from(cell.free) <= SEEN_THROUGH * u32::from(cell.hits) {
                State::Surface
            } else if cell.free > 0 {
                State::Free
            } else {
                State::Unknown
            };
        }
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

    fn mark(&mut self, spot: &Point3<f64>, normal: &Vector3<f64>, shows: f64) {
        let place = self.place(spot);
        let Some(at) = self.at(place) else { return };
        let offset = spot - self.centre(place);
        let cell = &mut self.cells[at];
        cell.hits = cell.hits.saturating_add(1);
        let which = usize::from(cell.sides[0].count > 0.0 && cell.sides[0].normal().dot(normal) < OPPOSITE);
        let side = &mut cell.sides[which];
        let mean = side.normal() * f64::from(side.count) + normal;
        let mean = mean.try_normalize(1e-9).unwrap_or(*normal);
        side.normal = [mean.x as f32, mean.y as f32, mean.z as f32];
        side.count += 1.0;
        for a in 0..3 {
            side.sum[a] += offset[a] as f32;
        }
        side.fresh = side.fresh.max(shows as f32);
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

    /// Chessboard distances to the nearest voxel for which `is` holds, up to `most`, by two passes (Rosenfeld and Pfaltz
    /// 1968).
    pub fn distances(&self, most: u8, is: impl Fn(State) -> bool) -> Vec<u8> {
        let far = |state: &State| if is(*state) { 0 } else { most };
        let mut out: Vec<u8> = self.states.iter().map(far).collect();
        let count = out.len();
        // Of the 26 neighbours those that come before in the order of the array.
        let before: [[i64; 3]; 13] = std::array::from_fn(|n| around(n as i64));
        for forward in [true, false] {
            for i in 0..count {
                let at = if forward { i } else { count - 1 - i };
                let place = self.place_of(at);
                let sign = if forward { 1 } else { -1 };
                let near = before
                    .iter()
                    .filter_map(|d| self.at(std::array::from_fn(|a| place[a] + sign * d[a])))
                    .map(|there| out[there].saturating_add(1))
                    .min();
                out[at] = out[at].min(near.unwrap_or(most));
            }
        }
        out
    }
}

/// The `n`-th of the 27 steps to a voxel and its neighbours, in the order of the array; the 14th stays.
pub(super) fn around(n: i64) -> [i64; 3] {
    [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]
}

/// The six neighbours of a place.
pub(super) fn beside(place: [i64; 3]) -> [[i64; 3]; 6] {
    std::array::from_fn(|n| {
        let mut next = place;
        next[n / 2] += if n % 2 == 0 { 1 } else { -1 };
        next
    })
}
