//! A plane per pixel: what the readings around it say about the surface there.
//!
//! Inverse depth is linear in the image of a plane, `1/z = a u + b v + c`, and readings whose noise grows with the
//! square of the range scatter about it evenly; so a window of pixels is fitted by plain least squares, and the
//! misfit over the whole image tells the noise.

use rayon::prelude::*;

use super::depths::{COLUMNS, InverseDepths, MARGIN};
use super::patches::{REACH, SIDE, patch};
use super::pyramid::SQUARE;
use crate::capture::Camera;

/// Rows that are worked on at once.
const BAND: usize = 16;
/// Variance of the misfit, in variances of the noise, up to which a window is one smooth surface.
const SMOOTH: f32 = 1.7;
/// Readings of a whole window.
const WHOLE: f32 = (SIDE * SIDE) as f32;
/// Variance of the misfit, in variances of the noise, from which an edge runs through a window.
const TORN: f32 = 2.6;
/// Adding and taking away this rounds a float to the nearest whole number; its bits then hold the number.
const ROUND: f32 = 8_388_608.0;
/// Bits of [`ROUND`].
const ROUND_BITS: u32 = 0x4B00_0000;
/// Cosine between ray and normal below which a surface is too grazing to be measured.
pub const LEAST_SLANT: f32 = 0.15;
/// Least noise that is taken to be there, of the inverse depth, 1/m.
const LEAST_NOISE: f64 = 2e-4;

/// No surface: every point lies far behind it.
pub const NOTHING: [f32; 4] = [0.0, 0.0, 0.0, -1e30];

/// The planes of one image with a margin of one pixel of nothing.
///
/// A record `[a, b, c, d]` gives the distance of a point of the camera frame in front of the plane, m, as
/// `d - (a z u + b z v + c z)`, where `u`, `v` is the pixel that the point falls on; `d` is the distance of the plane
/// from the camera.
pub struct Planes {
    pub width: usize,
    pub height: usize,
    pub stride: usize,
    pub records: Vec<[f32; 4]>,
    /// For each square of [`SQUARE`] pixels, row by row, whether something tears it: an edge, a hole.
    pub torn: Vec<bool>,
    /// Noise of the inverse depth.
    pub noise: Noise,
}

/// Variance of an inverse depth `q`, 1/m²: `even + steep q⁴`. The first term is a depth noise that grows with the
/// square of the range, as of triangulation; the second one that does not, as of time of flight and of rounding.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    even: f32,
    steep: f32,
}

impl Noise {
    #[inline]
    pub fn variance(self, q: f32) -> f32 {
        self.even + self.steep * q * q * q * q
    }

    /// The terms that pass through two measured variances, none of them negative.
    fn through(near: (f32, f32), far: (f32, f32)) -> Self {
        let (near_q, far_q) = (near.0.powi(4), far.0.powi(4));
        let steep = ((near.1 - far.1) / (near_q - far_q).max(1e-6)).clamp(0.0, far.1 / far_q.max(1e-6));
        let even = (far.1 - steep * far_q).max(0.0);
        Self { even, steep }
    }
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

/// Columns that are fitted at once.
const TILE: usize = COLUMNS;

/// Sums along one row over windows of [`SIDE`] pixels, per column: of 1, q, x q and q².
struct RowSums {
    count: [f32; TILE],
    q: [f32; TILE],
    xq: [f32; TILE],
    qq: [f32; TILE],
}

/// Sums of the windows around the columns of a tile whose first pixel is `row[REACH]`; the sums of squares lose no
/// digits against so near a reference.
fn row_sums(row: &[f32], reference: f32) -> RowSums {
    let mut centred = [0.0_f32; TILE + SIDE - 1];
    let mut valid = [0.0_f32; TILE + SIDE - 1];
    for ((q, c), v) in row.iter().zip(&mut centred).zip(&mut valid) {
        *v = if *q > 0.0 { 1.0 } else { 0.0 };
        *c = if *q > 0.0 { q - reference } else { 0.0 };
    }
    let mut sums = RowSums {
        count: [0.0; TILE],
        q: [0.0; TILE],
        xq: [0.0; TILE],
        qq: [0.0; TILE],
    };
    for k in 0..SIDE {
        let offset = k as f32 - REACH as f32;
        for x in 0..TILE {
            let q = centred[x + k];
            sums.count[x] += valid[x + k];
            sums.q[x] += q;
            sums.xq[x] += offset * q;
            sums.qq[x] += q * q;
        }
    }
    sums
}

/// Number of readings, mean, slopes and variance of the misfit of windows.
struct Fit {
    count: [f32; TILE],
    q: [f32; TILE],
    a: [f32; TILE],
    b: [f32; TILE],
    misfit: [f32; TILE],
}

fn fit_row(sums: &[RowSums], reference: f32) -> Fit {
    // Sum of the squared offsets along one axis over the window.
    let spread = (0..SIDE).map(|k| (k as f32 - REACH as f32).powi(2)).sum::<f32>() * SIDE as f32;
    let mut fit = Fit {
        count: [0.0; TILE],
        q: [0.0; TILE],
        a: [0.0; TILE],
        b: [0.0; TILE],
        misfit: [0.0; TILE],
    };
    for (k, row) in sums.iter().enumerate() {
        let offset = k as f32 - REACH as f32;
        for x in 0..TILE {
            fit.count[x] += row.count[x];
            fit.q[x] += row.q[x];
            fit.a[x] += row.xq[x];
            fit.b[x] += offset * row.q[x];
            fit.misfit[x] += row.qq[x];
        }
    }
    for x in 0..TILE {
        let mean = fit.q[x] / WHOLE;
        let (a, b) = (fit.a[x] / spread, fit.b[x] / spread);
        let explained = mean * fit.q[x] + a * fit.a[x] + b * fit.b[x];
        fit.misfit[x] = (fit.misfit[x] - explained) / (WHOLE - 3.0);
        fit.q[x] = mean + reference;
        (fit.a[x], fit.b[x]) = (a, b);
    }
    fit
}

impl Planes {
    /// Fits the planes of an image; `stated` is the camera's own depth noise at 1 m, m.
    pub fn new(camera: &Camera, depths: &InverseDepths, stated: Option<f64>) -> Self {
        let (width, height) = (depths.width, depths.height);
        let reference = reference(depths);
        let noise = noise(depths, reference, stated);
        let stride = width + 2;
        let columns = width.div_ceil(SQUARE);
        let mut records = vec![NOTHING; stride * (height + 2)];
        let mut torn = vec![false; columns * height.div_ceil(BAND) * (BAND / SQUARE)];
        let lens = Lens::of(camera);
        records[stride..stride * (height + 1)]
            .par_chunks_mut(stride * BAND)
            .zip(torn.par_chunks_mut(columns * (BAND / SQUARE)))
            .enumerate()
            .for_each(|(band, (rows, torn))| fit_band(depths, lens, (reference, noise), band * BAND, rows, torn));
        Self {
            width,
            height,
            stride,
            records,
            torn,
            noise,
        }
    }

    /// The record of that number.
    #[inline]
    pub fn record(&self, place: u32) -> [f32; 4] {
        *self.records.get(place as usize).unwrap_or(&NOTHING)
    }

    /// Number of the record at the pixel that is nearest to a place, of one of nothing outside the image.
    #[inline]
    pub fn place(&self, u: f32, v: f32) -> u32 {
        let (u, v) = (u + 1.0, v + 1.0);
        let (most_u, most_v) = (self.width as f32 + 1.0, self.height as f32 + 1.0);
        let u = if u > 0.0 { u } else { 0.0 };
        let v = if v > 0.0 { v } else { 0.0 };
        let u = if u < most_u { u } else { most_u };
        let v = if v < most_v { v } else { most_v };
        let (u, v) = ((u + ROUND) - ROUND, (v + ROUND) - ROUND);
        (v * self.stride as f32 + u + ROUND).to_bits() - ROUND_BITS
    }
}

fn fit_band(
    depths: &InverseDepths,
    lens: Lens,
    (reference, noise): (f32, Noise),
    top: usize,
    rows: &mut [[f32; 4]],
    torn: &mut [bool],
) {
    let width = depths.width;
    let columns = width.div_ceil(SQUARE);
    let count = rows.len() / (width + 2);
    for left in (0..width).step_by(TILE) {
        let window = |y: usize| &depths.values[(y + MARGIN - REACH) * depths.stride + left + MARGIN - REACH..];
        let sums: Vec<RowSums> = (top..top + count + 2 * REACH)
            .map(|y| row_sums(&window(y)[..TILE + SIDE - 1], reference))
            .collect();
        for (k, row) in rows.chunks_exact_mut(width + 2).enumerate() {
            let fit = fit_row(&sums[k..k + SIDE], reference);
            let v = (top + k) as f32;
            let mut found = [NOTHING; TILE];
            for (x, record) in found.iter_mut().enumerate() {
                *record = lens.record(fit.q[x], fit.a[x], fit.b[x], (left + x) as f32, v);
            }
            let end = (left + TILE).min(width);
            for (x, record) in row[left + 1..=end].iter_mut().enumerate() {
                *record = found[x];
                let variance = noise.variance(fit.q[x]);
                if fit.count[x] != WHOLE || fit.misfit[x] > SMOOTH * variance {
                    *record = patch(depths, lens, variance, left + x, top + k);
                    let is_torn = fit.count[x] != WHOLE || fit.misfit[x] > TORN * variance;
                    torn[(left + x) / SQUARE + k / SQUARE * columns] |= is_torn;
                } else if record[3] * fit.q[x] < LEAST_SLANT {
                    *record = NOTHING;
                }
            }
        }
    }
}

/// A value in the middle of the readings, 1/m.
fn reference(depths: &InverseDepths) -> f32 {
    let few = depths.values.iter().step_by(61).filter(|q| **q > 0.0);
    let (sum, count) = few.fold((0.0_f64, 0.0_f64), |(s, n), q| (s + f64::from(*q), n + 1.0));
    (sum / count.max(1.0)) as f32
}

/// The noise of the inverse depth: the median misfit of windows all over the image, among the nearer and the farther
/// half of them, and no less than stated.
fn noise(depths: &InverseDepths, reference: f32, stated: Option<f64>) -> Noise {
    let mut found: Vec<(f32, f32)> = Vec::new();
    for y in (0..depths.height).step_by(24) {
        for x in (0..depths.width).step_by(2 * TILE) {
            let sums: Vec<RowSums> = (0..SIDE)
                .map(|k| (y + MARGIN - REACH + k) * depths.stride + x + MARGIN - REACH)
                .map(|at| row_sums(&depths.values[at..at + TILE + SIDE - 1], reference))
                .collect();
            let fit = fit_row(&sums, reference);
            let whole = |x: &usize| fit.count[*x] == WHOLE;
            found.extend(
                (0..TILE)
                    .step_by(3)
                    .filter(whole)
                    .map(|x| (fit.q[x], fit.misfit[x].max(0.0))),
            );
        }
    }
    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let half = found.len() / 2;
    let (far, near) = found.split_at_mut(half);
    let least = stated.unwrap_or(0.0).max(LEAST_NOISE).powi(2) as f32;
    let mut measured = Noise::through(median(near), median(far));
    measured.even = measured.even.max(least - measured.steep * reference.powi(4));
    measured
}

/// Middle value of the inverse depths, which are in order, and of the variances.
fn median(found: &mut [(f32, f32)]) -> (f32, f32) {
    let middle = found.len() / 2;
    let Some(q) = found.get(middle).map(|f| f.0) else {
        return (1.0, 0.0);
    };
    let (_, at, _) = found.select_nth_unstable_by(middle, |a, b| a.1.total_cmp(&b.1));
    (q, at.1)
}
