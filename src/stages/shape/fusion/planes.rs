//! A plane per pixel: what the readings around it say about the surface there.
//!
//! Inverse depth is linear in the image of a plane, `1/z = a u + b v + c`, and readings whose noise grows with the
//! square of the range scatter about it evenly; so a window of pixels is fitted by plain least squares, and the
//! misfit over the whole image tells the noise.

use rayon::prelude::*;

use super::depths::{InverseDepths, MARGIN};
use super::patches::{REACH, SIDE, patch};
use crate::capture::Camera;

/// Rows that are worked on at once.
const BAND: usize = 16;
/// Variance of the misfit, in variances of the noise, up to which a window is one smooth surface.
const SMOOTH: f32 = 1.7;
/// Cosine between ray and normal below which a surface is too grazing to be measured.
pub const LEAST_SLANT: f32 = 0.15;
/// Least noise that is taken to be there, of the inverse depth, 1/m.
const LEAST_NOISE: f32 = 2e-4;

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
    /// Noise of the inverse depth, 1 sd, 1/m.
    pub noise: f32,
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

/// Sums along one row over windows of [`SIDE`] pixels: of 1, q, x q and q².
struct RowSums {
    count: Vec<f32>,
    q: Vec<f32>,
    xq: Vec<f32>,
    qq: Vec<f32>,
}

/// Columns of a row that are summed at once; the sums of squares lose no digits against so near a reference.
fn row_sums(row: &[f32], width: usize, reference: f32) -> RowSums {
    let centred: Vec<f32> = row.iter().map(|q| if *q > 0.0 { q - reference } else { 0.0 }).collect();
    let valid: Vec<f32> = row.iter().map(|q| if *q > 0.0 { 1.0 } else { 0.0 }).collect();
    let skip = MARGIN - REACH;
    let mut sums = RowSums {
        count: vec![0.0; width],
        q: vec![0.0; width],
        xq: vec![0.0; width],
        qq: vec![0.0; width],
    };
    for k in 0..SIDE {
        let offset = k as f32 - REACH as f32;
        let shifted = &centred[skip + k..skip + k + width];
        let there = &valid[skip + k..skip + k + width];
        for x in 0..width {
            let q = shifted[x];
            sums.count[x] += there[x];
            sums.q[x] += q;
            sums.xq[x] += offset * q;
            sums.qq[x] += q * q;
        }
    }
    sums
}

/// Mean, slopes and variance of the misfit of the windows of one row.
struct Fit {
    whole: Vec<f32>,
    q: Vec<f32>,
    a: Vec<f32>,
    b: Vec<f32>,
    misfit: Vec<f32>,
}

fn fit_row(sums: &[RowSums], width: usize, reference: f32) -> Fit {
    let n = (SIDE * SIDE) as f32;
    // Sum of the squared offsets along one axis over the window.
    let spread = (0..SIDE).map(|k| (k as f32 - REACH as f32).powi(2)).sum::<f32>() * SIDE as f32;
    let mut fit = Fit {
        whole: vec![0.0; width],
        q: vec![0.0; width],
        a: vec![0.0; width],
        b: vec![0.0; width],
        misfit: vec![0.0; width],
    };
    for (k, row) in sums.iter().enumerate() {
        let offset = k as f32 - REACH as f32;
        for x in 0..width {
            fit.whole[x] += row.count[x];
            fit.q[x] += row.q[x];
            fit.a[x] += row.xq[x];
            fit.b[x] += offset * row.q[x];
            fit.misfit[x] += row.qq[x];
        }
    }
    for x in 0..width {
        let mean = fit.q[x] / n;
        let (a, b) = (fit.a[x] / spread, fit.b[x] / spread);
        let explained = mean * fit.q[x] + a * fit.a[x] + b * fit.b[x];
        fit.misfit[x] = (fit.misfit[x] - explained).max(0.0) / (n - 3.0);
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
        let mut records = vec![NOTHING; stride * (height + 2)];
        let lens = Lens::of(camera);
        records[stride..stride * (height + 1)]
            .par_chunks_mut(stride * BAND)
            .enumerate()
            .for_each(|(band, rows)| fit_band(depths, lens, (reference, noise), band * BAND, rows));
        Self {
            width,
            height,
            stride,
            records,
            noise,
        }
    }
}

fn fit_band(depths: &InverseDepths, lens: Lens, (reference, noise): (f32, f32), top: usize, rows: &mut [[f32; 4]]) {
    let (width, stride) = (depths.width, depths.stride);
    let row_at = |y: usize| &depths.values[(y + MARGIN - REACH) * stride..][..stride];
    let count = rows.len() / (width + 2);
    let sums: Vec<RowSums> = (top..top + count + 2 * REACH)
        .map(|y| row_sums(row_at(y), width, reference))
        .collect();
    for (k, row) in rows.chunks_exact_mut(width + 2).enumerate() {
        let y = top + k;
        let fit = fit_row(&sums[k..k + SIDE], width, reference);
        let v = y as f32;
        for (x, record) in row[1..=width].iter_mut().enumerate() {
            *record = lens.record(fit.q[x], fit.a[x], fit.b[x], x as f32, v);
        }
        let limit = SMOOTH * noise * noise;
        let whole = (SIDE * SIDE) as f32;
        for (x, record) in row[1..=width].iter_mut().enumerate() {
            let smooth = fit.whole[x] == whole && fit.misfit[x] <= limit;
            if !smooth {
                *record = patch(depths, lens, noise, x, y).unwrap_or(NOTHING);
            } else if record[3] * fit.q[x] < LEAST_SLANT {
                *record = NOTHING;
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

/// The noise of the inverse depth: the median misfit of windows all over the image, and no less than stated.
fn noise(depths: &InverseDepths, reference: f32, stated: Option<f64>) -> f32 {
    let mut misfits: Vec<f32> = Vec::new();
    for y in (0..depths.height).step_by(24) {
        let sums: Vec<RowSums> = (0..SIDE)
            .map(|k| {
                row_sums(
                    &depths.values[(y + MARGIN - REACH + k) * depths.stride..][..depths.stride],
                    depths.width,
                    reference,
                )
            })
            .collect();
        let fit = fit_row(&sums, depths.width, reference);
        let whole = (SIDE * SIDE) as f32;
        misfits.extend(
            (0..depths.width)
                .step_by(3)
                .filter(|x| fit.whole[*x] == whole)
                .map(|x| fit.misfit[x]),
        );
    }
    misfits.sort_unstable_by(f32::total_cmp);
    let median = misfits.get(misfits.len() / 2).copied().unwrap_or(0.0);
    median.sqrt().max(stated.unwrap_or(0.0) as f32).max(LEAST_NOISE)
}
