//! A coarse table of the surface around every place: what makes thousands of candidates affordable.

use nalgebra::{Point3, Vector3};

use crate::geometry::SurfaceSample;

/// Cells along the diagonal of the box.
const CELLS: f64 = 34.0;
/// Free margin around the box, cells.
const MARGIN: f64 = 5.0;
const NOTHING: u32 = u32::MAX;

/// The sample of the surface that is nearest to each cell of a box; coordinates are from the middle.
pub(super) struct Lookup {
    low: Vector3<f64>,
    cell: f64,
    size: [usize; 3],
    nearest: Vec<u32>,
    samples: Vec<(SurfaceSample, f64)>,
    /// Mean distance between samples, m.
    pub spacing: f64,
}

impl Lookup {
    /// From samples with their weights, spread over `area`.
    pub fn new(samples: Vec<(SurfaceSample, f64)>, diagonal: f64, area: f64) -> Self {
        let cell = diagonal / CELLS;
        let first = samples.first().map_or_else(Point3::origin, |s| s.0.point);
        let (low, high) = samples
            .iter()
            .fold((first, first), |(lo, hi), (s, _)| (lo.inf(&s.point), hi.sup(&s.point)));
        let margin = Vector3::repeat(MARGIN * cell);
        let low = low.coords - margin;
        let extent = high.coords + margin - low;
        let size: [usize; 3] = std::array::from_fn(|a| (extent[a] / cell).ceil() as usize + 1);
        let mut lookup = Self {
            low,
            cell,
            size,
            nearest: vec![NOTHING; size.iter().product()],
            spacing: (area / samples.len().max(1) as f64).sqrt(),
            samples,
        };
        lookup.fill();
        lookup
    }

    fn index(&self, p: &Vector3<f64>) -> Option<usize> {
        let at = (p - self.low) / self.cell;
        let fits = (0..3).all(|a| at[a] >= 0.0 && (at[a] as usize) < self.size[a]);
        fits.then(|| at[0] as usize + self.size[0] * (at[1] as usize + self.size[1] * at[2] as usize))
    }

    fn centre(&self, x: i64, y: i64, z: i64) -> Vector3<f64> {
        self.low + Vector3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5) * self.cell
    }

    fn fill(&mut self) {
        for i in 0..self.samples.len() {
            if let Some(at) = self.index(&self.samples[i].0.point.coords) {
                self.nearest[at] = i as u32;
            }
        }
        // Two sweeps there and back carry the nearest sample from cell to cell (vector distance transform,
        // Danielsson 1980, over the whole neighbourhood).
        for _ in 0..2 {
            self.sweep(1);
            self.sweep(-1);
        }
    }

    fn sweep(&mut self, sense: i64) {
        let [nx, ny, nz] = self.size.map(|n| n as i64);
        let run = |n: i64| (0..n).map(move |i| if sense > 0 { i } else { n - 1 - i });
        for z in run(nz) {
            for y in run(ny) {
                for x in run(nx) {
                    self.take_from_neighbours([x, y, z], sense);
                }
            }
        }
    }

    fn take_from_neighbours(&mut self, [x, y, z]: [i64; 3], sense: i64) {
        let [nx, ny, nz] = self.size.map(|n| n as i64);
        let at = |x: i64, y: i64, z: i64| (x + nx * (y + ny * z)) as usize;
        let centre = self.centre(x, y, z);
        let far = |this: &Self, i: u32| match this.samples.get(i as usize) {
            Some((s, _)) => (s.point.coords - centre).norm_squared(),
            None => f64::INFINITY,
        };
        let here = at(x, y, z);
        let (mut best, mut distance) = (self.nearest[here], far(self, self.nearest[here]));
        for step in BEFORE {
            let [i, j, k] = [x - sense * step[0], y - sense * step[1], z - sense * step[2]];
            if i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz {
                continue;
            }
            let other = self.nearest[at(i, j, k)];
            let d = far(self, other);
            if d < distance {
                (best, distance) = (other, d);
            }
        }
        self.nearest[here] = best;
    }

    /// The sample nearest to a place, with its weight; nothing far outside the box.
    pub fn nearest(&self, p: &Vector3<f64>) -> Option<&(SurfaceSample, f64)> {
        self.samples.get(self.nearest[self.index(p)?] as usize)
    }

    /// Distance of a place from the surface at a sample, m: along its normal, and across it beyond what a sample
    /// stands for.
    pub fn distance(&self, p: &Vector3<f64>, sample: &SurfaceSample) -> f64 {
        let apart = p - sample.point.coords;
        let height = apart.dot(&sample.normal);
        let across = (apart.norm_squared() - height * height).max(0.0).sqrt();
        height.hypot((across - self.spacing).max(0.0))
    }
}

/// The neighbours that a sweep has passed already.
const BEFORE: [[i64; 3]; 13] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 1, 0],
    [-1, 1, 0],
    [1, 0, 1],
    [-1, 0, 1],
    [0, 1, 1],
    [0, -1, 1],
    [1, 1, 1],
    [-1, 1, 1],
    [1, -1, 1],
    [-1, -1, 1],
];
