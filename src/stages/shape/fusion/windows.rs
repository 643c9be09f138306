//! Sums over windows of 6 x 6 pixels around cells of 2 x 2, and the planes that they give by least squares, with how much
//! the surface bends.

use super::depths::{InverseDepths, MARGIN};
use super::planes::TILE;

/// Readings of a whole window.
const WHOLE: f32 = 36.0;
/// Sum of the squared offsets along one axis over a window, pixels².
const SPREAD: f32 = 105.0;
/// Mean of the squared offsets, pixels², and the sum of the squares of what they differ from it, pixels⁴.
const BEND: f32 = 35.0 / 12.0;
const BEND_SPREAD: f32 = 224.0;

/// Sums over the cells to the left, at and to the right of each cell of a tile of one row: of the readings, of the
/// readings times their offsets in x and in y and times the squared offsets in x, of their squares; the least value, 0 where a reading is missing, the
/// least and the largest reading.
pub struct CellSums {
    q: [f32; TILE],
    x: [f32; TILE],
    y: [f32; TILE],
    xx: [f32; TILE],
    qq: [f32; TILE],
    low: [f32; TILE],
    far: [f32; TILE],
    near: [f32; TILE],
}

/// Cells of a tile and its neighbours to either side.
const WIDE: usize = TILE + 2;

impl CellSums {
    /// Sums of the tile that begins at cell `left` of row `row - 1` of cells; the sums of squares lose no digits
    /// against a near reference.
    pub fn new(depths: &InverseDepths, left: usize, row: usize, reference: f32) -> Self {
        let at = depths.stride * (2 * row + MARGIN - 2) + 2 * left + MARGIN - 2;
        let upper = &depths.values[at..][..2 * WIDE];
        let lower = &depths.values[at + depths.stride..][..2 * WIDE];
        let (mut q, mut x, mut y, mut qq) = ([0.0_f32; WIDE], [0.0_f32; WIDE], [0.0_f32; WIDE], [0.0_f32; WIDE]);
        let (mut low, mut far, mut near) = ([0.0_f32; WIDE], [0.0_f32; WIDE], [0.0_f32; WIDE]);
        for k in 0..WIDE {
            let raw = [upper[2 * k], upper[2 * k + 1], lower[2 * k], lower[2 * k + 1]];
            let [a, b, c, d] = raw.map(|q| q - reference);
            q[k] = (a + b) + (c + d);
            x[k] = 0.5 * ((b + d) - (a + c));
            y[k] = 0.5 * ((c + d) - (a + b));
            qq[k] = (a * a + b * b) + (c * c + d * d);
            let seen = raw.map(|q| if q > 0.0 { q } else { f32::MAX });
            low[k] = smaller(smaller(raw[0], raw[1]), smaller(raw[2], raw[3]));
            far[k] = smaller(smaller(seen[0], seen[1]), smaller(seen[2], seen[3]));
            near[k] = larger(larger(raw[0], raw[1]), larger(raw[2], raw[3]));
        }
        let mut sums = Self {
            q: [0.0; TILE],
            x: [0.0; TILE],
            y: [0.0; TILE],
            xx: [0.0; TILE],
            qq: [0.0; TILE],
            low: [0.0; TILE],
            far: [0.0; TILE],
            near: [0.0; TILE],
        };
        for k in 0..TILE {
            // Columns of a cell are 0.5 to either side of its middle, which is 2 from the next one's.
            sums.xx[k] = 0.25 * q[k + 1] + 4.25 * (q[k] + q[k + 2]) + 4.0 * (x[k + 2] - x[k]);
            sums.q[k] = q[k] + q[k + 1] + q[k + 2];
            sums.x[k] = x[k] + x[k + 1] + x[k + 2] + 2.0 * (q[k + 2] - q[k]);
            sums.y[k] = y[k] + y[k + 1] + y[k + 2];
            sums.qq[k] = qq[k] + qq[k + 1] + qq[k + 2];
            sums.low[k] = smaller(smaller(low[k], low[k + 1]), low[k + 2]);
            sums.far[k] = smaller(smaller(far[k], far[k + 1]), far[k + 2]);
            sums.near[k] = larger(larger(near[k], near[k + 1]), near[k + 2]);
        }
        sums
    }
}

#[inline]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Value in the middle, slopes per pixel and variance of the misfit of windows, which hold only where the least value
/// `low` is not 0; how far the surface bends away from the plane in the middle, and the square of how much it bends, in
/// variances that noise alone would make of it; the farthest and the nearest reading.
pub struct Fit {
    pub q: [f32; TILE],
    pub a: [f32; TILE],
    pub b: [f32; TILE],
    pub misfit: [f32; TILE],
    pub bend: [f32; TILE],
    pub power: [f32; TILE],
    pub low: [f32; TILE],
    pub far: [f32; TILE],
    pub near: [f32; TILE],
}

/// Fits the windows around the cells of a row from the sums of it and of the rows above and below.
pub fn fit_cells(rows: &[CellSums], reference: f32) -> Fit {
    let mut fit = Fit {
        q: [0.0; TILE],
        a: [0.0; TILE],
        b: [0.0; TILE],
        misfit: [0.0; TILE],
        bend: [0.0; TILE],
        power: [0.0; TILE],
        low: [0.0; TILE],
        far: [0.0; TILE],
        near: [0.0; TILE],
    };
    let [above, own, below] = rows else {
        return fit;
    };
    for k in 0..TILE {
        let q = above.q[k] + own.q[k] + below.q[k];
        let x = above.x[k] + own.x[k] + below.x[k];
        let y = above.y[k] + own.y[k] + below.y[k] + 2.0 * (below.q[k] - above.q[k]);
        let qq = above.qq[k] + own.qq[k] + below.qq[k];
        let (mean, a, b) = (q / WHOLE, x / SPREAD, y / SPREAD);
        fit.misfit[k] = (qq - mean * q - a * x - b * y) / (WHOLE - 3.0);
        let xx = above.xx[k] + own.xx[k] + below.xx[k];
        let yy = 0.25 * own.q[k] + 4.25 * (above.q[k] + below.q[k]) + 4.0 * (below.y[k] - above.y[k]);
        let (u, v) = ((xx - BEND * q) / BEND_SPREAD, (yy - BEND * q) / BEND_SPREAD);
        fit.bend[k] = BEND * (u + v);
        fit.power[k] = 0.5 * BEND_SPREAD * (u * u + v * v);
        fit.q[k] = mean + reference;
        fit.a[k] = a;
        fit.b[k] = b;
        fit.low[k] = smaller(smaller(above.low[k], own.low[k]), below.low[k]);
        fit.far[k] = smaller(smaller(above.far[k], own.far[k]), below.far[k]);
        fit.near[k] = larger(larger(above.near[k], own.near[k]), below.near[k]);
    }
    fit
}
