//! A plane per cell of 2 x 2 pixels: what the readings around it say about the surface there.
//!
//! Inverse depth is linear in the image of a plane, `1/z = a u + b v + c`, and readings whose noise grows with the
//! square of the range scatter about it evenly; so a window of pixels is fitted by plain least squares, and the
//! misfit over the whole image tells the noise. Where the window of a cell is torn, each pixel has a plane of its own.

use rayon::prelude::*;
use wide::f32x4;

use super::depths::{COLUMNS, InverseDepths};
use super::noise::Noise;
use super::patches::patches;
use super::windows::{CellSums, Fit, fit_cells};
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
pub const NONE: f32 = -1e29;

/// The planes of one image with a margin of one cell of nothing.
///
/// A record `[a, b, c, d]` gives the distance of a point of the camera frame in front of the plane, m, as
/// `d - (a z u + b z v + c z)`, where `u`, `v` is the pixel that the point falls on; `d` is the distance of the plane
/// from the camera. A cell that something tears has `d = -1 - n`, where `n` is the number of the first of its four
/// pixels' records, and the inverse depth of the farthest and of the nearest reading around it, the latter beyond all bounds beside a hole.
pub struct Planes {
    pub width: usize,
    pub height: usize,
    columns: usize,
    last_row: f32,
    /// The records of all cells, then those of the four pixels of each torn one.
    records: Vec<[f32; 4]>,
    /// Noise of the inverse depth.
    pub noise: Noise,
}

/// Cells of a line of the memory.
const LINE: usize = 4;

/// Where in its band a torn cell is, and the records of its pixels.
type Torn = (usize, [[f32; 4]; 4]);

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

    /// Components of the records of the planes with inverse depths `q` and slopes `a`, `b` per pixel at four pixels.
    #[inline]
    pub fn records(self, q: f32x4, a: f32x4, b: f32x4, u: f32x4, v: f32x4) -> [f32x4; 4] {
        let (nx, ny) = (a * self.fx, b * self.fy);
        let nz = q - a * (u - self.cx) - b * (v - self.cy);
        let d = f32x4::ONE / (nx * nx + ny * ny + nz * nz).sqrt();
        [a * d, b * d, (q - a * u - b * v) * d, d]
    }
}

impl Planes {
    /// Fits the planes of an image; `stated` is the camera's own depth noise at 1 m, m.
    pub fn new(camera: &Camera, depths: &InverseDepths, stated: Option<f64>) -> Self {
        let (width, height) = (depths.width, depths.height);
        let noise = Noise::measure(depths, stated);
        let (columns, rows) = (width.div_ceil(2) + 2, height.div_ceil(2) + 2);
        let mut cells = Vec::with_capacity(columns * rows * 3 / 2);
        cells.resize(columns * rows, NOTHING);
        let lens = Lens::of(camera);
        let torn: Vec<Vec<Torn>> = cells[columns..columns * (rows - 1)]
            .par_chunks_mut(columns * BAND)
            .enumerate()
            .map(|(band, cells)| fit_band(depths, lens, noise, band * BAND, cells))
            .collect();
        for (band, torn) in torn.iter().enumerate() {
            let start = columns * (1 + band * BAND);
            for (at, patches) in torn {
                cells[start + at][3] = -1.0 - cells.len() as f32;
                cells.extend_from_slice(patches);
            }
        }
        Self {
            width,
            height,
            columns,
            last_row: (rows - 1) as f32,
            records: cells,
            noise,
        }
    }

    /// The record of the cell of that number.
    #[inline]
    pub fn cell(&self, place: u32) -> [f32; 4] {
        *self.records.get(place as usize).unwrap_or(&NOTHING)
    }

    /// Has the cells of a rectangle of the image brought from memory all at once, so that looks at them wait less.
    #[inline]
    pub fn fetch(&self, [left, top]: [usize; 2], [right, bottom]: [usize; 2]) {
        let mut any = 0;
        for row in top / 2 + 1..=bottom / 2 + 1 {
            let start = row * self.columns;
            let cells = self
                .records
                .get(start + left / 2 + 1..=start + right / 2 + 1)
                .unwrap_or(&[]);
            any |= cells.iter().step_by(LINE).fold(0, |any, cell| any | cell[0].to_bits());
            any |= cells.last().map_or(0, |cell| cell[0].to_bits());
        }
        std::hint::black_box(any);
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

    /// The four components of the records of the pixels that are nearest to places of the image.
    #[inline]
    pub fn pixels(&self, u: f32x4, v: f32x4) -> [f32x4; 4] {
        let last = |cell: f32| f32x4::splat(2.0 * cell + 1.0);
        let x = (u + 2.0).fast_max(f32x4::ZERO).fast_min(last(self.last_column()));
        let y = (v + 2.0).fast_max(f32x4::ZERO).fast_min(last(self.last_row()));
        let (x, y) = ((x + ROUND) - ROUND, (y + ROUND) - ROUND);
        let (column, row) = (((x * 0.5 - 0.25) + ROUND) - ROUND, ((y * 0.5 - 0.25) + ROUND) - ROUND);
        let cell = row * (self.last_column() + 1.0) + column;
        let [i, j, k, l] = whole(cell);
        let kind = f32x4::new([self.cell(i)[3], self.cell(j)[3], self.cell(k)[3], self.cell(l)[3]]);
        let torn = kind.simd_lt(f32x4::ZERO) & kind.simd_gt(f32x4::splat(NONE));
        let which = (x - column * 2.0) + (y - row * 2.0) * 2.0;
        let [i, j, k, l] = whole(torn.bitselect(which - kind - 1.0, cell));
        columns([self.cell(i), self.cell(j), self.cell(k), self.cell(l)])
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
        let cell = self.cell((y >> 1) * self.columns as u32 + (x >> 1));
        if Cell::of(&cell) != Cell::Torn {
            return cell;
        }
        self.cell((-1.0 - cell[3]) as u32 + (x & 1 | (y & 1) << 1))
    }
}

/// Four records as their four components.
#[inline]
pub fn columns([a, b, c, d]: [[f32; 4]; 4]) -> [f32x4; 4] {
    f32x4::transpose([f32x4::new(a), f32x4::new(b), f32x4::new(c), f32x4::new(d)])
}

/// The nearest whole numbers, of 0 or more.
#[inline]
fn whole(x: f32x4) -> [u32; 4] {
    let [a, b, c, d] = (x + ROUND).to_array();
    [
        a.to_bits() - ROUND_BITS,
        b.to_bits() - ROUND_BITS,
        c.to_bits() - ROUND_BITS,
        d.to_bits() - ROUND_BITS,
    ]
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
fn fit_band(depths: &InverseDepths, lens: Lens, noise: Noise, top: usize, cells: &mut [[f32; 4]]) -> Vec<Torn> {
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
            let start = k * (columns + 2) + left + 1;
            let fit = fit_cells(&sums[k..k + 3], reference);
            let found = records(&fit, lens, noise, left, top + k);
            for (x, (cell, record)) in row[left + 1..=end].iter_mut().zip(found).enumerate() {
                *cell = record;
                if Cell::of(cell) == Cell::Torn {
                    let patches = patches(depths, lens, noise.variance(fit.q[x]), 2 * (left + x), 2 * (top + k));
                    torn.push((start + x, patches));
                }
            }
        }
    }
    torn
}

/// The records of smooth cells; of the others whether there is nothing, and the range that the readings span.
fn records(fit: &Fit, lens: Lens, noise: Noise, left: usize, row: usize) -> [[f32; 4]; TILE] {
    let mut found = [NOTHING; TILE];
    let v = f32x4::splat(2.0 * row as f32 + 0.5);
    let (zero, nothing) = (f32x4::ZERO, f32x4::splat(NOTHING[3]));
    for x in (0..TILE).step_by(4) {
        let four = |values: &[f32; TILE]| f32x4::new([values[x], values[x + 1], values[x + 2], values[x + 3]]);
        let (low, near, far) = (four(&fit.low), four(&fit.near), four(&fit.far));
        let u = f32x4::new([0.5, 2.5, 4.5, 6.5]) + 2.0 * (left + x) as f32;
        let q = four(&fit.q);
        let variance = noise.variances(q);
        // A plane lies inside of what is bent: the middle is moved out, by as much as the bend stands out of the noise
        // (the positive part of James and Stein's estimator).
        let power = four(&fit.power).fast_max(f32x4::splat(1e-12));
        let sure = (f32x4::ONE - variance / power).fast_max(zero);
        let [a, b, c, d] = lens.records(q - sure * four(&fit.bend), four(&fit.a), four(&fit.b), u, v);
        let whole = low.simd_gt(zero);
        let smooth = whole & four(&fit.misfit).simd_le(SMOOTH * variance);
        let torn = near.simd_gt(zero).bitselect(f32x4::splat(-1.0), nothing);
        let upright = (d * q).simd_gt(f32x4::splat(LEAST_SLANT)).bitselect(d, nothing);
        let through = whole.bitselect(near, f32x4::splat(f32::MAX));
        let records = f32x4::transpose([
            smooth.bitselect(a, far),
            smooth.bitselect(b, through),
            smooth.bitselect(c, low),
            smooth.bitselect(upright, torn),
        ]);
        for (into, record) in found[x..].iter_mut().zip(records) {
            *into = record.to_array();
        }
    }
    found
}
