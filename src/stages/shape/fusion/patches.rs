//! Planes where the window is torn: at the edges of things, at holes and folds.

use super::depths::{InverseDepths, STEEPEST};
use super::planes::{LEAST_SLANT, Lens, NOTHING};

/// Pixels to each side of a window.
pub const REACH: usize = 2;
/// Fewest readings that a plane is fitted to.
const FEWEST: f32 = 7.0;
/// Fewest of the eight next pixels that lie on the surface of a pixel: fewer is a flying pixel.
const FEWEST_NEXT: f32 = 3.0;
/// Variance of the misfit, in variances of the noise, up to which a patch is a surface.
const ROUGHEST: f32 = 6.0;
/// The same from which no better part of a window is looked for.
const PLAIN: f32 = 1.5;

/// Readings of a row that are loaded at once, a few more than a window has.
const LANES: usize = 8;
/// Offset of each lane from the middle, and whether it belongs to the window.
const OFFSETS: [f32; LANES] = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0];

/// Part of a window: first and last column and row, from the middle.
type Part = [f32; 4];
const WHOLE: Part = [-2.0, 2.0, -2.0, 2.0];
/// Beside a fold the half, and in a corner the quarter, that lies on one side of it still is one plane (Kuwahara et al.
/// 1976).
const HALVES: [Part; 4] = [
    [-2.0, 0.0, -2.0, 2.0],
    [0.0, 2.0, -2.0, 2.0],
    [-2.0, 2.0, -2.0, 0.0],
    [-2.0, 2.0, 0.0, 2.0],
];
const QUARTERS: [Part; 4] = [
    [-2.0, 0.0, -2.0, 0.0],
    [0.0, 2.0, -2.0, 0.0],
    [-2.0, 0.0, 0.0, 2.0],
    [0.0, 2.0, 0.0, 2.0],
];

/// The plane through the readings around a pixel that hang together with it, of a part of them where all make a fold;
/// nothing where they are too few to be a surface. `variance` is that of one reading.
pub fn patch(depths: &InverseDepths, lens: Lens, variance: f32, x: usize, y: usize) -> [f32; 4] {
    let centre = depths.values[depths.at(x, y)];
    if centre <= 0.0 {
        return NOTHING;
    }
    let step = (4.0 * variance.sqrt()).max(STEEPEST * centre / lens.fx);
    let fit = |part: &Part| {
        let (sums, next) = gather(depths, centre, step, (x, y), part);
        let plane = sums.plane().filter(|_| sums.n >= FEWEST)?;
        Some((plane, next))
    };
    let Some(whole) = fit(&WHOLE).filter(|(_, next)| *next >= FEWEST_NEXT) else {
        return NOTHING;
    };
    let mut best = whole.0;
    for parts in [HALVES, QUARTERS] {
        if best.3 < ROUGHEST * variance {
            break;
        }
        for (plane, _) in parts.iter().filter_map(&fit) {
            best = if plane.3 < best.3 { plane } else { best };
            if best.3 < PLAIN * variance {
                break;
            }
        }
    }
    let (q, a, b, misfit) = best;
    let q = q + centre;
    let record = lens.record(q, a, b, x as f32, y as f32);
    let good = misfit < ROUGHEST * variance && record[3] * q > LEAST_SLANT;
    if good { record } else { NOTHING }
}

/// Moments of the readings of a part that are no farther from the middle one than a surface goes, and how many of the
/// eight next ones are among them.
fn gather(depths: &InverseDepths, centre: f32, step: f32, (x, y): (usize, usize), part: &Part) -> (Sums, f32) {
    let (mut n, mut ny, mut nyy) = ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
    let (mut q, mut yq, mut qq) = ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
    let mut next = [0.0_f32; LANES];
    let first = depths.at(x, y) - REACH * (depths.stride + 1);
    let rows = (part[2] + REACH as f32) as usize..=(part[3] + REACH as f32) as usize;
    for row in rows {
        let dy = row as f32 - REACH as f32;
        let Some(values) = depths.values[first + row * depths.stride..].first_chunk::<LANES>() else {
            break;
        };
        for l in 0..LANES {
            let far = OFFSETS[l].abs().max(dy.abs()).max(1.0);
            let off = values[l] - centre;
            let near = if off.abs() < step * far { 1.0 } else { 0.0 };
            let known = if values[l] > 0.0 { near } else { 0.0 };
            let inside = OFFSETS[l] >= part[0] && OFFSETS[l] <= part[1];
            let own = if inside { known } else { 0.0 };
            n[l] += own;
            ny[l] += own * dy;
            nyy[l] += own * dy * dy;
            q[l] += own * off;
            yq[l] += own * dy * off;
            qq[l] += own * off * off;
            next[l] += if far == 1.0 { own } else { 0.0 };
        }
    }
    let along = |values: &[f32; LANES]| OFFSETS.iter().zip(values).map(|(o, v)| o * v).sum::<f32>();
    let sums = Sums {
        n: n.iter().sum(),
        x: along(&n),
        y: ny.iter().sum(),
        xx: OFFSETS.iter().zip(&n).map(|(o, v)| o * o * v).sum(),
        xy: along(&ny),
        yy: nyy.iter().sum(),
        q: q.iter().sum(),
        xq: along(&q),
        yq: yq.iter().sum(),
        qq: qq.iter().sum(),
    };
    (sums, next.iter().sum::<f32>() - 1.0)
}

/// Moments of a window: `n`, offsets, readings.
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
