//! The common part of two faces that meet.

use pulp::Simd;

use super::floor::Spot;
use super::lanes::{F, Mask, V3, less, more, pick};

/// Corners within this of the nearest one belong to the touching face, m.
const FACE: f32 = 1.5e-3;

/// The extent of a face across the normal, and how far its ends lie behind the nearest corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent<S: Simd> {
    low: F<S>,
    high: F<S>,
    behind_low: F<S>,
    behind_high: F<S>,
}

/// An end of the common part, and how far it lies behind.
type End<S> = (F<S>, F<S>);

impl<S: Simd> Extent<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Self {
            low: F::all(simd, 1e30),
            high: F::all(simd, -1e30),
            behind_low: F::all(simd, 0.0),
            behind_high: F::all(simd, 0.0),
        }
    }

    #[inline(always)]
    fn take(&mut self, there: Mask<S>, value: F<S>, behind: F<S>) {
        let lower = there & less(value, self.low);
        self.low = pick(lower, value, self.low);
        self.behind_low = pick(lower, behind, self.behind_low);
        let higher = there & more(value, self.high);
        self.high = pick(higher, value, self.high);
        self.behind_high = pick(higher, behind, self.behind_high);
    }

    /// The ends that both have; one point where they do not overlap.
    #[inline(always)]
    fn common(&self, o: &Self) -> [End<S>; 2] {
        let mine = more(self.low, o.low);
        let low = (pick(mine, self.low, o.low), pick(mine, self.behind_low, o.behind_low));
        let mine = less(self.high, o.high);
        let high = (
            pick(mine, self.high, o.high),
            pick(mine, self.behind_high, o.behind_high),
        );
        let crossed = more(low.0, high.0);
        let middle = (low.0 + high.0) * 0.5;
        let zero = middle.like(0.0);
        [
            (pick(crossed, middle, low.0), pick(crossed, zero, low.1)),
            (pick(crossed, middle, high.0), pick(crossed, zero, high.1)),
        ]
    }
}

/// How far the corners reach along `n`, and the extents along both tangents of those within [`FACE`] of the foremost.
#[inline(always)]
pub(super) fn extents<S: Simd>(simd: S, corners: &[V3<S>], n: V3<S>, t: &[V3<S>; 2]) -> (F<S>, [Extent<S>; 2]) {
    let mut foremost = F::all(simd, -1e30);
    for u in corners {
        foremost = foremost.max(u.dot(n));
    }
    let mut out = [Extent::none(simd), Extent::none(simd)];
    for u in corners {
        let behind = foremost - u.dot(n);
        let there = less(behind, behind.like(FACE));
        if !there.any() {
            continue;
        }
        out[0].take(there, u.dot(t[0]), behind);
        out[1].take(there, u.dot(t[1]), behind);
    }
    (foremost, out)
}

/// The corners of the common part of two faces: of the thing and of a tool's part, which reaches `level` along `n`.
#[inline(always)]
pub(super) fn face<S: Simd>(
    body: &[Extent<S>; 2],
    tool: &[Extent<S>; 2],
    gap: F<S>,
    level: F<S>,
    n: V3<S>,
    t: &[V3<S>; 2],
) -> [Spot<S>; 4] {
    let a = body[0].common(&tool[0]);
    let b = body[1].common(&tool[1]);
    let mut spots = [Spot { r: n, gap }; 4];
    for (k, spot) in spots.iter_mut().enumerate() {
        let (a, b) = (a[k / 2], b[k % 2]);
        spot.gap = gap + a.1.max(b.1);
        spot.r = n * (level + spot.gap) + t[0] * a.0 + t[1] * b.0;
    }
    spots
}
