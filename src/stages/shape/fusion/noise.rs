//! The noise of an image, measured on itself.

use wide::f32x4;

use super::depths::InverseDepths;
use super::planes::TILE;
use super::windows::{CellSums, fit_cells};

/// Least noise that is taken to be there, of the inverse depth, 1/m.
const LEAST_NOISE: f64 = 2e-4;
/// Noise that is assumed where it is neither stated nor can be measured, for want of whole windows, 1/m.
const ASSUMED_NOISE: f64 = 1.5e-3;
/// Fewest windows that tell the noise.
const FEWEST: usize = 20;
/// Rows of cells from one that is looked at to the next.
const ROWS: usize = 12;
/// Cells from one that is looked at to the next.
const CELLS: usize = 3;

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

    /// Variances of four inverse depths.
    #[inline]
    pub fn variances(self, q: f32x4) -> f32x4 {
        f32x4::splat(self.even) + f32x4::splat(self.steep) * q * q * q * q
    }

    /// The median misfit of windows all over the image, among the nearer and the farther half of them, and no less
    /// than `stated`, the camera's own depth noise at 1 m, m.
    pub fn measure(depths: &InverseDepths, stated: Option<f64>) -> Self {
        let mut found = misfits(depths);
        let unknown = if found.len() < FEWEST { ASSUMED_NOISE } else { 0.0 };
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let half = found.len() / 2;
        let middle = found.get(half).map_or(1.0, |f| f.0);
        let (far, near) = found.split_at_mut(half);
        let least = stated.unwrap_or(unknown).max(LEAST_NOISE).powi(2) as f32;
        let mut measured = Self::through(median(near), median(far));
        measured.even = measured.even.max(least - measured.steep * middle.powi(4));
        measured
    }

    /// The terms that pass through two measured variances, none of them negative.
    fn through(near: (f32, f32), far: (f32, f32)) -> Self {
        let (near_q, far_q) = (near.0.powi(4), far.0.powi(4));
        let steep = ((near.1 - far.1) / (near_q - far_q).max(1e-6)).clamp(0.0, far.1 / far_q.max(1e-6));
        let even = (far.1 - steep * far_q).max(0.0);
        Self { even, steep }
    }
}

/// Inverse depth and variance of the misfit of whole windows all over the image.
fn misfits(depths: &InverseDepths) -> Vec<(f32, f32)> {
    let mut found: Vec<(f32, f32)> = Vec::new();
    let columns = depths.width.div_ceil(2);
    for row in (0..depths.height.div_ceil(2)).step_by(ROWS) {
        for left in (row / ROWS % 2 * TILE..columns).step_by(2 * TILE) {
            let reference = depths.near(2 * left + TILE, 2 * row);
            let sums: [CellSums; 3] = std::array::from_fn(|k| CellSums::new(depths, left, row + k, reference));
            let fit = fit_cells(&sums, reference);
            for x in (0..TILE).step_by(CELLS).filter(|x| fit.low[*x] > 0.0) {
                found.push((fit.q[x], fit.misfit[x].max(0.0)));
            }
        }
    }
    found
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
