//! A plane per cell of 2 x 2 pixels: what the readings around it say about the surface there.
//!
//! Inverse depth is linear in the image of a plane, `1/z = a u + b v + c`, and readings whose noise grows with the
//! square of the range scatter about it evenly; so a window of pixels is fitted by plain least squares, and the
//! misfit over the whole image tells the noise. Where the window of a cell is torn, each pixel has a plane of its own.

use rayon::prelude::*;
use wide::f32x4;

use super::depths::{COLUMNS, InverseDepths};
use super::noise::Noise;
use super::patches::patch;
use super::windows::{CellSums, Fit, fit_cells, larger};
use crate::capture::Camera;

/// Rows of cells that are worked on at once.
pub const BAND: usize = 12;
/// Cells of a row that are fitted at once.
pub const TILE: usize = COLUMNS / 2;
/// Variance of the misfit, in variances of the noise, up to which a window is one smooth surface.
const SMOOTH: f32 = 2.0;
/// Adding and taking away this rounds a float to the nearest whole number; its bits then hold the number.
const ROUND: f32 = 8_388_608.0;
/// Bits of [`ROUND`].
const ROUND_BITS: u32 = 0x4B00_0000;
/// Cosine between ray and normal below which a surface is too grazing to be measured.
pub const LEAST_SLANT: f32 = 0.15;

/// No surface: every point lies far behind it.
pub const NOTHING: [f32; 4] = [0.0, 0.0, 0.0, -1e30];
/// Distance of a record that stands for nothing, or below.
const NONE: f32 = -1e29;

/// The planes of one image with a margin of one cell of nothing.
///
/// A record `[a, b, c, d]` gives the distance of a point of the camera frame in front of the plane, m, as
/// `d - (a z u + b z v + c z)`, where `u`, `v` is the pixel that the point falls on; `d` is the distance of the plane
/// from the camera. A cell that something tears has `d = -1 - n`, where `n` counts the torn cells of its band, and the
/// inverse depth of the farthest and of the nearest reading around it, the latter beyond all bounds beside a hole.
pub struct Planes {
    pub width: usize,
    pub height: usize,
    columns: usize,
    last_row: f32,
    cells: Vec<[f32; 4]>,
    /// For each band, the planes of the four pixels of each torn cell.
    torn: Vec<Vec<[[f32; 4]; 4]>>,
    /// Noise of the inverse depth.
    pub noise: Noise,
}

/// What a cell shows.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    Smooth,
    Torn,
    Nothing,
}

/// What a pixel shows.
#[derive(Clone, Copy)]
pub enum Sight {
    Nothing,
    /// No surface of its own; the depth of the nearest reading around it, m.
    Torn(f32),
    /// The plane with this record.
    Surface([f32; 4]),
}

/// What is needed of the camera.
#[derive(Clone, Copy)]
pub struct Lens {
    pub fx: f32,
    pub fy: f32,
    pub cx: f32,
    pub cy: f32,
}

impl Lens {
    pub fn of(camera: &Camera) -> Self {
        let [fx, fy, cx, cy] = [camera.fx, camera.fy, camera.cx, camera.cy].map(|x| x as f32);
        Self { fx, fy, cx, cy }
    }

    /// The record of the plane with inverse depth `q` and slopes `a`, `b` per pixel at a pixel.
    #[inline]
    pub fn record(self, q: f32, a: f32, b: f32, u: f32, v: f32) -> [f32; 4] {
        let (nx, ny) = (a * self.fx, b * self.fy);
        let nz = q - a * (u - self.cx) - b * (v - self.cy);
        let d = 1.0 / (nx * nx + ny * ny + nz * nz).sqrt();
        [a * d, b * d, (q - a * u - b * v) * d, d]
    }
}

impl Planes {
    /// Fits the planes of an image; `stated` is the camera's own depth noise at 1 m, m.
    pub fn new(camera: &Camera, depths: &InverseDepths, stated: Option<f64>) -> Self {
        let (width, height) = (depths.width, depths.height);
        let noise = Noise::measure(depths, stated);
        let (columns, rows) = (width.div_ceil(2) + 2, height.div_ceil(2) + 2);
        let mut cells = vec![NOTHING; columns * rows];
        let lens = Lens::of(camera);
        let torn = cells[columns..columns * (rows - 1)]
            .par_chunks_mut(columns * BAND)
            .enumerate()
            .map(|(band, cells)| fit_band(depths, lens, noise, band * BAND, cells))
            .collect();
        Self {
            width,
            height,
            columns,
            last_row: (rows - 1) as f32,
            cells,
            torn,
            noise,
        }
    }

    /// The record of the cell of that number.
    #[inline]
    pub fn cell(&self, place: u32) -> [f32; 4] {
        *self.cells.get(place as usize).unwrap_or(&NOTHING)
    }

    /// Numbers of the cells that hold places of the image, of one of nothing outside it.
    #[inline]
    pub fn places(&self, u: f32x4, v: f32x4) -> [u32; 4] {
        let x = (u * 0.5 + 0.75)
            .fast_max(f32x4::ZERO)
            .fast_min(f32x4::splat(self.last_column()));
        let y = (v * 0.5 + 0.75)
            .fast_max(f32x4::ZERO)
            .fast_min(f32x4::splat(self.last_row()));
        let (x, y) = ((x + ROUND) - ROUND, (y + ROUND) - ROUND);
        whole(y * (self.last_column() + 1.0) + x)
    }

    #[inline]
    fn last_column(&self) -> f32 {
        (self.columns - 1) as f32
    }

    #[inline]
    fn last_row(&self) -> f32 {
        self.last_row
    }

    /// Columns and rows of the pixels that are nearest to places of the image, counted from the margin.
    #[inline]
    pub fn pixels(&self, u: f32x4, v: f32x4) -> ([u32; 4], [u32; 4]) {
        let (last_x, last_y) = (2.0 * self.last_column() + 1.0, 2.0 * self.last_row() + 1.0);
        let x = (u + 2.0).fast_max(f32x4::ZERO).fast_min(f32x4::splat(last_x));
        let y = (v + 2.0).fast_max(f32x4::ZERO).fast_min(f32x4::splat(last_y));
        (whole(x), whole(y))
    }

    /// What the pixel in column `x` and row `y` shows.
    pub fn sight(&self, x: usize, y: usize) -> Sight {
        let record = self.pixel(x as u32 + 2, y as u32 + 2);
        if record[3] > 0.0 {
            return Sight::Surface(record);
        }
        let cell = self.cell(((y / 2 + 1) * self.columns + x / 2 + 1) as u32);
        match Cell::of(&cell) {
            Cell::Torn if cell[1] < f32::MAX => Sight::Torn(1.0 / cell[1]),
            _ => Sight::Nothing,
        }
    }

    /// The record at a pixel, counted from the margin.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> [f32; 4] {
        let (row, column) = ((y >> 1) as usize, (x >> 1) as usize);
        let cell = *self.cells.get(row * self.columns + column).unwrap_or(&NOTHING);
        if Cell::of(&cell) != Cell::Torn {
            return cell;
        }
        let (number, which) = ((-1.0 - cell[3]) as usize, (x & 1 | (y & 1) << 1) as usize);
        let patches = self.torn.get((row - 1) / BAND).and_then(|t| t.get(number));
        patches.map_or(NOTHING, |p| p[which])
    }
}

/// The nearest whole numbers, of 0 or more.
#[inline]
fn whole(x: f32x4) -> [u32; 4] {
    (x + ROUND).to_array().map(|x| x.to_bits() - ROUND_BITS)
}

impl Cell {
    #[inline]
    pub fn of(record: &[f32; 4]) -> Self {
        if record[3] > 0.0 {
            Self::Smooth
        } else if record[3] > NONE {
            Self::Torn
        } else {
            Self::Nothing
        }
    }
}

/// Fits the cells of a band from row `top` on; gives the planes of the pixels of its torn cells.
fn fit_band(
    depths: &InverseDepths,
    lens: Lens,
    noise: Noise,
    top: usize,
    cells: &mut [[f32; 4]],
) -> Vec<[[f32; 4]; 4]> {
    let columns = depths.width.div_ceil(2);
    let rows = cells.len() / (columns + 2);
    let mut torn = Vec::new();
    for left in (0..columns).step_by(TILE) {
        let reference = depths.near(2 * left + TILE, 2 * top + rows);
        let sums: Vec<CellSums> = (0..rows + 2)
            .map(|k| CellSums::new(depths, left, top + k, reference))
            .collect();
        let end = (left + TILE).min(columns);
        for (k, row) in cells.chunks_exact_mut(columns + 2).enumerate() {
            let fit = fit_cells(&sums[k..k + 3], reference);
            let found = records(&fit, lens, noise, left, top + k);
            for (x, (cell, record)) in row[left + 1..=end].iter_mut().zip(found).enumerate() {
                *cell = record;
                if Cell::of(cell) == Cell::Torn {
                    cell[3] = -1.0 - torn.len() as f32;
                    torn.push(patches(depths, lens, noise.variance(fit.q[x]), left + x, top + k));
                }
            }
        }
    }
    torn
}

/// The records of smooth cells; of the others whether there is nothing, and the range that the readings span.
fn records(fit: &Fit, lens: Lens, noise: Noise, left: usize, row: usize) -> [[f32; 4]; TILE] {
    let mut found = [NOTHING; TILE];
    let v = 2.0 * row as f32 + 0.5;
    for (x, record) in found.iter_mut().enumerate() {
        let u = 2.0 * (left + x) as f32 + 0.5;
        let variance = noise.variance(fit.q[x]);
        // A plane lies inside of what is bent: the middle is moved out, by as much as the bend stands out of the noise
        // (the positive part of James and Stein's estimator).
        let sure = larger(1.0 - variance / larger(fit.power[x], 1e-12), 0.0);
        let [a, b, c, d] = lens.record(fit.q[x] - sure * fit.bend[x], fit.a[x], fit.b[x], u, v);
        let smooth = fit.low[x] > 0.0 && fit.misfit[x] <= SMOOTH * variance;
        let torn = if fit.near[x] > 0.0 { -1.0 } else { NOTHING[3] };
        let upright = if d * fit.q[x] > LEAST_SLANT { d } else { NOTHING[3] };
        let through = if fit.low[x] > 0.0 { fit.near[x] } else { f32::MAX };
        record[0] = if smooth { a } else { fit.far[x] };
        record[1] = if smooth { b } else { through };
        record[2] = if smooth { c } else { fit.low[x] };
        record[3] = if smooth { upright } else { torn };
    }
    found
}

fn patches(depths: &InverseDepths, lens: Lens, variance: f32, x: usize, y: usize) -> [[f32; 4]; 4] {
    std::array::from_fn(|n| patch(depths, lens, variance, 2 * x + (n & 1), 2 * y + (n >> 1)))
}
