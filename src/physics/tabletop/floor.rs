//! Where a thing meets the support: at most four corners that carry it.

use pulp::Simd;

use super::lanes::{F, V3, less, more, pick};
use super::solid::Solid;
use super::turns::M3;

/// Corners that are kept.
pub(super) const SPOTS: usize = 4;
/// Height over reach that a corner farther out may have before a nearer, lower one is kept instead.
const STEEP: f32 = 30.0;
/// Corners higher than this share of the reach over the lowest never carry: their height costs more (by [`STEEP`]) than
/// the widest foot gains.
const HIGH: f32 = 0.3;

/// A place where two surfaces meet or are about to: from the centroid, and how far they are apart (negative inside).
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot<S: Simd> {
    pub r: V3<S>,
    pub gap: F<S>,
}

/// The corner with the highest score so far.
struct Best<S: Simd> {
    score: F<S>,
    at: V3<S>,
}

impl<S: Simd> Best<S> {
    #[inline(always)]
    fn none(simd: S) -> Self {
        Self {
            score: F::all(simd, -1e30),
            at: V3::zero(simd),
        }
    }

    #[inline(always)]
    fn offer(&mut self, score: F<S>, at: V3<S>) {
        let better = more(score, self.score);
        self.score = pick(better, score, self.score);
        self.at = V3::pick(better, at, self.at);
    }
}

/// The spots of a thing whose centroid is `height` over the support, turned by `turn`; `corners` is room to work in.
///
/// A ball has one. A hull keeps the corner that is farthest in one direction, the one farthest from it, and the
/// farthest to the left and right of the line between them, all of them low.
#[inline(always)]
pub(super) fn floor_spots<S: Simd>(
    simd: S,
    solid: &Solid,
    turn: &M3<S>,
    height: F<S>,
    corners: &mut Vec<V3<S>>,
) -> ([Spot<S>; SPOTS], usize) {
    if let Some(radius) = solid.ball {
        let under = V3::all(simd, [0.0, 0.0, -radius]);
        let spot = Spot {
            r: under,
            gap: under.z + height,
        };
        return ([spot; SPOTS], 1);
    }
    let mut lowest = F::all(simd, 1e30);
    for p in &solid.hull.points {
        lowest = lowest.min(turn.c.dot(V3::all(simd, *p)));
    }
    let highest = lowest + HIGH * solid.reach;
    corners.clear();
    let mut first = Best::none(simd);
    for p in &solid.hull.points {
        let p = V3::all(simd, *p);
        if !less(turn.c.dot(p), highest).any() {
            continue;
        }
        let at = turn.apply(p);
        first.offer(at.x + at.y * 0.37 - at.z * STEEP, at);
        corners.push(at);
    }
    let a = first.at;
    let steep = STEEP * solid.reach;
    let mut second = Best::none(simd);
    for at in corners.iter() {
        let (x, y) = (at.x - a.x, at.y - a.y);
        second.offer(x * x + y * y - (at.z - lowest) * steep, *at);
    }
    let b = second.at;
    let (ex, ey) = (b.x - a.x, b.y - a.y);
    let (mut left, mut right) = (Best::none(simd), Best::none(simd));
    for at in corners.iter() {
        let side = ex * (at.y - a.y) - ey * (at.x - a.x);
        let cost = (at.z - lowest) * steep;
        left.offer(side - cost, *at);
        right.offer(-side - cost, *at);
    }
    let of = [a, b, left.at, right.at];
    let mut spots = [Spot { r: a, gap: lowest }; SPOTS];
    for (spot, r) in spots.iter_mut().zip(of) {
        *spot = Spot { r, gap: r.z + height };
    }
    (spots, SPOTS)
}

/// The lowest gap of the spots.
#[inline(always)]
pub(super) fn lowest<S: Simd>(spots: &[Spot<S>]) -> F<S> {
    let mut low = spots[0].gap;
    for spot in spots {
        low = low.min(spot.gap);
    }
    low
}
