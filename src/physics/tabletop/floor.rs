//! Where a thing meets the support: at most four corners that carry it.

use super::lanes::{F, M3, V3, all, less, more, pick};
use super::solid::Solid;

/// Corners that are kept.
pub(super) const SPOTS: usize = 4;
/// Height over reach that a corner farther out may have before a nearer, lower one is kept instead.
const STEEP: f32 = 30.0;

/// A place where two surfaces meet or are about to: from the centroid, and how far they are apart (negative inside).
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub r: V3,
    pub gap: F,
}

/// The corner with the highest score so far.
struct Best {
    score: F,
    at: V3,
}

impl Best {
    fn none() -> Self {
        Self {
            score: all(-1e30),
            at: V3::ZERO,
        }
    }

    #[inline(always)]
    fn offer(&mut self, score: F, at: V3) {
        let better = more(score, self.score);
        self.score = pick(better, score, self.score);
        self.at = V3::pick(better, at, self.at);
    }
}

/// The spots of a thing whose centroid is `height` over the support, turned by `turn`; `corners` is room to work in.
///
/// A ball has one. A hull keeps the corner that is farthest in one direction, the one farthest from it, and the
/// farthest to the left and right of the line between them, all of them low.
pub(super) fn floor_spots(solid: &Solid, turn: &M3, height: F, corners: &mut Vec<V3>) -> ([Spot; SPOTS], usize) {
    let spot = |at: V3| Spot {
        r: at,
        gap: at.z + height,
    };
    if let Some(radius) = solid.ball {
        let under = V3::new(F::ZERO, F::ZERO, all(-radius));
        return ([spot(under); SPOTS], 1);
    }
    corners.clear();
    let mut lowest = all(1e30);
    let mut first = Best::none();
    for p in &solid.hull.points {
        let at = turn.apply(V3::all(*p));
        lowest = lowest.fast_min(at.z);
        first.offer(at.x + at.y * all(0.37) - at.z * all(STEEP), at);
        corners.push(at);
    }
    let a = first.at;
    let steep = all(STEEP * solid.reach);
    let mut second = Best::none();
    for at in corners.iter() {
        let (x, y) = (at.x - a.x, at.y - a.y);
        second.offer(x * x + y * y - (at.z - lowest) * steep, *at);
    }
    let b = second.at;
    let (ex, ey) = (b.x - a.x, b.y - a.y);
    let (mut left, mut right) = (Best::none(), Best::none());
    for at in corners.iter() {
        let side = ex * (at.y - a.y) - ey * (at.x - a.x);
        let cost = (at.z - lowest) * steep;
        left.offer(side - cost, *at);
        right.offer(-side - cost, *at);
    }
    ([spot(a), spot(b), spot(left.at), spot(right.at)], SPOTS)
}

/// The lowest gap of the spots.
pub(super) fn lowest(spots: &[Spot]) -> F {
    spots
        .iter()
        .fold(all(1e30), |low, s| pick(less(s.gap, low), s.gap, low))
}
