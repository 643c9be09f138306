//! Planes where the window is torn: at the edges of things, at holes and folds.

use super::depths::InverseDepths;
use super::planes::{LEAST_SLANT, Lens};

/// Pixels to each side of a window.
pub const REACH: usize = 2;
/// Pixels along a window.
pub const SIDE: usize = 2 * REACH + 1;
/// Fewest readings that a plane is fitted to.
const FEWEST: f32 = 7.0;
/// Fewest of the eight next pixels that lie on the surface of a pixel: fewer is a flying pixel.
const FEWEST_NEXT: u32 = 3;
/// Variance of the misfit, in variances of the noise, up to which a patch is a surface.
const ROUGHEST: f32 = 6.0;

/// The plane through the readings around a pixel that hang together with it, if they are enough to be a surface.
pub fn patch(depths: &InverseDepths, lens: Lens, noise: f32, x: usize, y: usize) -> Option<[f32; 4]> {
    let centre = depths.values[depths.at(x, y)];
    if centre <= 0.0 {
        return None;
    }
    let step = (4.0 * noise).max(2.5 * centre / lens.fx);
    let mut sums = Sums::default();
    let mut next = 0;
    for (dy, row) in depths.values[depths.at(x, y) - REACH * (depths.stride + 1)..]
        .chunks(depths.stride)
        .take(SIDE)
        .enumerate()
    {
        for (dx, q) in row[..SIDE].iter().enumerate() {
            let (dx, dy) = (dx as f32 - REACH as f32, dy as f32 - REACH as f32);
            let far = dx.abs().max(dy.abs());
            let off = q - centre;
            if *q > 0.0 && off.abs() < step * far.max(1.0) {
                sums.add(dx, dy, off);
                next += u32::from(far == 1.0);
            }
        }
    }
    if sums.n < FEWEST || next < FEWEST_NEXT {
        return None;
    }
    let (q, a, b, misfit) = sums.plane()?;
    let q = q + centre;
    let record = lens.record(q, a, b, x as f32, y as f32);
    (misfit < ROUGHEST * noise * noise && record[3] * q > LEAST_SLANT).then_some(record)
}

/// Moments of a window: `n`, offsets, readings.
#[derive(Default)]
struct Sums {
    n: f32,
    x: f32,
    y: f32,
    xx: f32,
    xy: f32,
    yy: f32,
    q: f32,
    xq: f32,
    yq: f32,
    qq: f32,
}

impl Sums {
    fn add(&mut self, x: f32, y: f32, q: f32) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
        self.q += q;
        self.xq += x * q;
        self.yq += y * q;
        self.qq += q * q;
    }

    /// Value at the middle, slopes, variance of the misfit; nothing where the readings lie along a line.
    fn plane(&self) -> Option<(f32, f32, f32, f32)> {
        let (mx, my, mq) = (self.x / self.n, self.y / self.n, self.q / self.n);
        let xx = self.xx - mx * self.x;
        let xy = self.xy - mx * self.y;
        let yy = self.yy - my * self.y;
        let xq = self.xq - mx * self.q;
        let yq = self.yq - my * self.q;
        let det = xx * yy - xy * xy;
        if det < 0.5 * self.n {
            return None;
        }
        let a = (xq * yy - yq * xy) / det;
        let b = (yq * xx - xq * xy) / det;
        let misfit = (self.qq - mq * self.q - a * xq - b * yq).max(0.0) / (self.n - 3.0).max(1.0);
        Some((mq - a * mx - b * my, a, b, misfit))
    }
}
