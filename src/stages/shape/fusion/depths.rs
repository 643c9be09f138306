//! Inverse depths of one image, as a pinhole camera without distortion would have seen them.

use rayon::prelude::*;

use crate::capture::{Camera, DepthImage};
use crate::stages::shape::lens::project;

/// Pixels of margin on every side, without reading, so that no window leaves the image.
pub const MARGIN: usize = 4;

/// Rows are filled up to a multiple of this many pixels, so that they can be worked on in equal pieces.
pub const COLUMNS: usize = 128;

/// Pixels that are looked at together for missing readings.
const PIECE: usize = 32;

/// Largest change of the inverse depth of a surface from pixel to pixel, in its own units per pixel of focal length.
pub const STEEPEST: f32 = 2.5;

/// Inverse depths, 1/m, 0 where there is no reading, with a margin all around.
pub struct InverseDepths {
    pub width: usize,
    pub height: usize,
    /// Values of one row with its margins.
    pub stride: usize,
    /// A value in the middle of the readings.
    middle: f32,
    pub values: Vec<f32>,
}

impl InverseDepths {
    /// Turns counts into inverse depths; readings outside the camera's range are none.
    pub fn new(camera: &Camera, depth: &DepthImage) -> Self {
        let (width, height) = (depth.width as usize, depth.height as usize);
        let stride = width.next_multiple_of(COLUMNS) + 2 * MARGIN;
        let mut values = vec![0.0; stride * (height + 2 * MARGIN)];
        let unit = camera.depth_unit as f32;
        let (near, far) = (camera.depth_min.max(1e-3) as f32, camera.depth_max as f32);
        let straight = camera.distortion == [0.0; 5];
        values[MARGIN * stride..]
            .par_chunks_exact_mut(stride)
            .zip(depth.counts.par_chunks_exact(width))
            .with_min_len(16)
            .enumerate()
            .for_each(|(y, (row, counts))| {
                let row_values = &mut row[MARGIN..MARGIN + width];
                let inverse = |count: u16| {
                    let z = f32::from(count) * unit;
                    let (q, known) = (1.0 / z, (z >= near) & (z <= far));
                    if known { q } else { 0.0 }
                };
                if straight {
                    for (q, count) in row_values.iter_mut().zip(counts) {
                        *q = inverse(*count);
                    }
                } else {
                    for (x, q) in row_values.iter_mut().enumerate() {
                        *q = inverse(bent(camera, depth, x, y));
                    }
                }
                fill_row(&mut row[MARGIN - 1..=MARGIN + width], camera);
            });
        fill_columns(&mut values, stride, camera);
        Self {
            width,
            height,
            stride,
            middle: middle(&values),
            values,
        }
    }

    /// The reading at a pixel, or one in the middle of the image's where there is none.
    pub fn near(&self, x: usize, y: usize) -> f32 {
        let own = self.values[self.at(x.min(self.width - 1), y.min(self.height - 1))];
        if own > 0.0 { own } else { self.middle }
    }

    /// Position of a pixel.
    pub fn at(&self, x: usize, y: usize) -> usize {
        x + MARGIN + self.stride * (y + MARGIN)
    }
}

/// Fills single missing readings, as images that were registered to another camera have in whole rows and columns:
/// inverse depth is linear in the image of a plane.
fn fill_row(row: &mut [f32], camera: &Camera) {
    let end = row.len() - 1;
    for start in (1..end).step_by(PIECE) {
        let piece = start..(start + PIECE).min(end);
        if has_gap(&row[piece.clone()]) {
            for x in piece {
                if row[x] == 0.0 {
                    row[x] = between(row[x - 1], row[x + 1], camera.fx as f32);
                }
            }
        }
    }
}

/// Whether a reading is missing.
#[inline]
fn has_gap(values: &[f32]) -> bool {
    values.iter().fold(0, |gap, q| gap | u32::from(q.to_bits() == 0)) > 0
}

/// The same along columns. What is filled lies between readings, so that the order does not matter.
fn fill_columns(values: &mut [f32], stride: usize, camera: &Camera) {
    let rows = values.len() / stride;
    let found: Vec<Vec<(usize, f32)>> = (1..rows.saturating_sub(1))
        .into_par_iter()
        .with_min_len(16)
        .map(|y| {
            let [above, own, below] = [y - 1, y, y + 1].map(|y| &values[y * stride..][..stride]);
            let gaps = (0..stride)
                .step_by(PIECE)
                .filter(|x| has_gap(&own[*x..(x + PIECE).min(stride)]));
            gaps.flat_map(|x| x..(x + PIECE).min(stride))
                .filter(|x| own[*x] == 0.0)
                .map(|x| (y * stride + x, between(above[x], below[x], camera.fy as f32)))
                .filter(|(_, q)| *q > 0.0)
                .collect()
        })
        .collect();
    for (at, q) in found.into_iter().flatten() {
        values[at] = q;
    }
}

/// The middle of two readings two pixels apart that may be of one surface, else 0.
fn between(a: f32, b: f32, focal: f32) -> f32 {
    let middle = 0.5 * (a + b);
    let one = a > 0.0 && b > 0.0 && (a - b).abs() < 2.0 * STEEPEST * middle / focal;
    if one { middle } else { 0.0 }
}

/// Mean of some of the readings, 1/m.
fn middle(values: &[f32]) -> f32 {
    let few = values.iter().step_by(61).filter(|q| **q > 0.0);
    let (sum, count) = few.fold((0.0_f64, 0.0_f64), |(s, n), q| (s + f64::from(*q), n + 1.0));
    (sum / count.max(1.0)) as f32
}

/// The depth that a camera read along the ray of an undistorted pixel, m; nothing where it read none.
pub fn raw_depth(camera: &Camera, depth: &DepthImage, x: usize, y: usize) -> Option<f64> {
    let count = if camera.distortion == [0.0; 5] {
        *depth.counts.get(x + depth.width as usize * y)?
    } else {
        bent(camera, depth, x, y)
    };
    (count > 0).then(|| f64::from(count) * camera.depth_unit)
}

/// The pixel of the camera's own image, nearest to where the ray of an undistorted pixel falls.
pub fn bent_pixel(camera: &Camera, x: usize, y: usize) -> Option<usize> {
    let ray = ((x as f64 - camera.cx) / camera.fx, (y as f64 - camera.cy) / camera.fy);
    let (u, v) = project(camera, ray.0, ray.1);
    let (u, v) = ((u + 0.5).floor(), (v + 0.5).floor());
    let fits = u >= 0.0 && v >= 0.0 && u < f64::from(camera.width) && v < f64::from(camera.height);
    fits.then(|| u as usize + camera.width as usize * v as usize)
}

fn bent(camera: &Camera, depth: &DepthImage, x: usize, y: usize) -> u16 {
    bent_pixel(camera, x, y)
        .and_then(|at| depth.counts.get(at).copied())
        .unwrap_or(0)
}
