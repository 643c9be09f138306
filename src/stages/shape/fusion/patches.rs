//! Planes where the window is torn: at the edges of things, at holes and folds.

use wide::f32x4;

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

/// The planes through the readings around each of the four pixels of a cell that hang together with it, of a part of
/// them where all make a fold; nothing where they are too few to be a surface. `variance` is that of one reading, `x`
/// and `y` are the first pixel's. The four are worked on at once; each gets what it would get alone.
pub fn patches(depths: &InverseDepths, lens: Lens, variance: f32, x: usize, y: usize) -> [[f32; 4]; 4] {
    let (centre, step) = (four(depths, x, y), 4.0 * variance.sqrt());
    let step = f32x4::splat(step).fast_max(STEEPEST * centre / lens.fx);
    let (sums, next) = gather_four(depths, centre, step, (x, y));
    let (plane, upright) = sums.planes();
    let whole = centre.simd_gt(f32x4::ZERO)
        & upright
        & sums.n.simd_ge(f32x4::splat(FEWEST))
        & next.simd_ge(f32x4::splat(FEWEST_NEXT));
    let mut known = whole.to_bitmask();
    let rough = (whole & !plane[3].simd_lt(f32x4::splat(ROUGHEST * variance))).to_bitmask();
    let [mut q, mut a, mut b, misfit] = plane.map(f32x4::to_array);
    for n in (0..4).filter(|n| rough >> n & 1 > 0) {
        let at = (x + (n & 1), y + (n >> 1));
        let best = (q[n], a[n], b[n], misfit[n]);
        let best = best_part(depths, (centre.as_array()[n], step.as_array()[n]), variance, at, best);
        (q[n], a[n], b[n]) = (best.0, best.1, best.2);
        let good = best.3 < ROUGHEST * variance;
        known &= !(u32::from(!good) << n);
    }
    let q = f32x4::new(q) + centre;
    let u = f32x4::new([0.0, 1.0, 0.0, 1.0]) + x as f32;
    let v = f32x4::new([0.0, 0.0, 1.0, 1.0]) + y as f32;
    let [a, b, c, d] = lens.records(q, f32x4::new(a), f32x4::new(b), u, v);
    let known = known & (d * q).simd_gt(f32x4::splat(LEAST_SLANT)).to_bitmask();
    let records = f32x4::transpose([a, b, c, d]);
    std::array::from_fn(|n| {
        if known >> n & 1 > 0 {
            records[n].to_array()
        } else {
            NOTHING
        }
    })
}

/// The readings at the four pixels of a square.
#[inline]
fn four(depths: &InverseDepths, x: usize, y: usize) -> f32x4 {
    four_from(depths, depths.at(x, y))
}

/// The same, of the square whose first value stands at `upper`.
#[inline]
fn four_from(depths: &InverseDepths, upper: usize) -> f32x4 {
    let (upper, lower) = (&depths.values[upper..], &depths.values[upper + depths.stride..]);
    f32x4::new([upper[0], upper[1], lower[0], lower[1]])
}

/// The plane of the part of a window that fits best, if one fits better than the whole.
fn best_part(
    depths: &InverseDepths,
    (centre, step): (f32, f32),
    variance: f32,
    at: (usize, usize),
    whole: (f32, f32, f32, f32),
) -> (f32, f32, f32, f32) {
    let mut best = whole;
    for parts in [HALVES, QUARTERS] {
        if best.3 < ROUGHEST * variance {
            break;
        }
        for part in &parts {
            let plane = part_plane(depths, centre, step, at, part);
            best = plane.filter(|plane| plane.3 < best.3).unwrap_or(best);
            if best.3 < PLAIN * variance {
                break;
            }
        }
    }
    best
}

/// Moments of the readings of the windows of a cell's four pixels, as [`gather`] gives those of a part of one, and how
/// many of the eight next ones are among them.
#[inline]
fn gather_four(depths: &InverseDepths, centre: f32x4, step: f32x4, (x, y): (usize, usize)) -> (Sums<f32x4>, f32x4) {
    let zero = f32x4::ZERO;
    let mut sums = Sums {
        n: zero,
        x: zero,
        y: zero,
        xx: zero,
        xy: zero,
        yy: zero,
        q: zero,
        xq: zero,
        yq: zero,
        qq: zero,
    };
    let mut next = zero;
    // A border is kept around the readings, so that the window never leaves them.
    let corner = depths.at(x, y) - REACH * (depths.stride + 1);
    for (column, dx) in OFFSETS.into_iter().enumerate().take(2 * REACH + 1) {
        let (mut n, mut ny, mut nyy) = (zero, zero, zero);
        let (mut q, mut yq, mut qq, mut beside) = (zero, zero, zero, zero);
        for (row, dy) in OFFSETS.into_iter().enumerate().take(2 * REACH + 1) {
            let values = four_from(depths, corner + column + row * depths.stride);
            let far = dx.abs().max(dy.abs()).max(1.0);
            let off = values - centre;
            let near = off.abs().simd_lt(step * far) & values.simd_gt(zero);
            let (own, off) = (near & f32x4::ONE, near & off);
            n += own;
            ny += own * dy;
            nyy += own * dy * dy;
            q += off;
            yq += dy * off;
            qq += off * off;
            if far == 1.0 {
                beside += own;
            }
        }
        sums.n += n;
        sums.x += dx * n;
        sums.y += ny;
        sums.xx += dx * dx * n;
        sums.xy += dx * ny;
        sums.yy += nyy;
        sums.q += q;
        sums.xq += dx * q;
        sums.yq += yq;
        sums.qq += qq;
        next += beside;
    }
    (sums, next - 1.0)
}

/// The plane of a part, if its readings tell one.
fn part_plane(
    depths: &InverseDepths,
    centre: f32,
    step: f32,
    at: (usize, usize),
    part: &Part,
) -> Option<(f32, f32, f32, f32)> {
    let sums = gather(depths, centre, step, at, part);
    sums.plane().filter(|_| sums.n >= FEWEST)
}

/// Moments of the readings of a part that are no farther from the middle one than a surface goes, and how many of the
/// eight next ones are among them.
fn gather(depths: &InverseDepths, centre: f32, step: f32, (x, y): (usize, usize), part: &Part) -> Sums<f32> {
    let (mut n, mut ny, mut nyy) = ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
    let (mut q, mut yq, mut qq) = ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f32; LANES]);
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
        }
    }
    let along = |values: &[f32; LANES]| OFFSETS.iter().zip(values).map(|(o, v)| o * v).sum::<f32>();
    Sums {
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
    }
}

/// Moments of a window: `n`, offsets, readings.
struct Sums<T> {
    n: T,
    x: T,
    y: T,
    xx: T,
    xy: T,
    yy: T,
    q: T,
    xq: T,
    yq: T,
    qq: T,
}

impl Sums<f32> {
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

impl Sums<f32x4> {
    /// Value at the middle, slopes, variance of the misfit; whether the readings span a plane.
    #[inline]
    fn planes(&self) -> ([f32x4; 4], f32x4) {
        let (mx, my, mq) = (self.x / self.n, self.y / self.n, self.q / self.n);
        let xx = self.xx - mx * self.x;
        let xy = self.xy - mx * self.y;
        let yy = self.yy - my * self.y;
        let xq = self.xq - mx * self.q;
        let yq = self.yq - my * self.q;
        let det = xx * yy - xy * xy;
        let a = (xq * yy - yq * xy) / det;
        let b = (yq * xx - xq * xy) / det;
        let misfit = (self.qq - mq * self.q - a * xq - b * yq).fast_max(f32x4::ZERO);
        let misfit = misfit / (self.n - 3.0).fast_max(f32x4::ONE);
        ([mq - a * mx - b * my, a, b, misfit], !det.simd_lt(0.5 * self.n))
    }
}
