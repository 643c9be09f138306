//! Eight trials side by side: numbers, vectors, matrices and turns over SIMD lanes.

use nalgebra::{UnitQuaternion, Vector3};
use std::ops::{Add, Mul, Neg, Sub};
use wide::f32x8;

/// Trials that are computed side by side.
pub(super) const LANES: usize = 8;

/// One number of each of eight trials.
pub(super) type F = f32x8;

/// The same number in every lane.
#[inline(always)]
pub(super) fn all(x: f32) -> F {
    F::splat(x)
}

/// `a` where the mask is set, else `b`.
#[inline(always)]
pub(super) fn pick(mask: F, a: F, b: F) -> F {
    mask.bitselect(a, b)
}

/// Mask of `a < b`.
#[inline(always)]
pub(super) fn less(a: F, b: F) -> F {
    a.simd_lt(b)
}

/// Mask of `a > b`.
#[inline(always)]
pub(super) fn more(a: F, b: F) -> F {
    a.simd_gt(b)
}

/// A vector of each of eight trials.
#[derive(Clone, Copy, Debug)]
pub(super) struct V3 {
    pub x: F,
    pub y: F,
    pub z: F,
}

impl V3 {
    pub(super) const ZERO: Self = Self {
        x: F::ZERO,
        y: F::ZERO,
        z: F::ZERO,
    };

    #[inline(always)]
    pub(super) fn new(x: F, y: F, z: F) -> Self {
        Self { x, y, z }
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub(super) fn all(v: [f32; 3]) -> Self {
        Self::new(all(v[0]), all(v[1]), all(v[2]))
    }

    #[inline(always)]
    pub(super) fn dot(self, o: Self) -> F {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub(super) fn cross(self, o: Self) -> Self {
        Self::new(
            self.y * o.z - self.z * o.y,
            self.z * o.x - self.x * o.z,
            self.x * o.y - self.y * o.x,
        )
    }

    #[inline(always)]
    pub(super) fn norm2(self) -> F {
        self.dot(self)
    }

    #[inline(always)]
    pub(super) fn pick(mask: F, a: Self, b: Self) -> Self {
        Self::new(pick(mask, a.x, b.x), pick(mask, a.y, b.y), pick(mask, a.z, b.z))
    }

    /// Length one; the zero vector stays near zero.
    #[inline(always)]
    pub(super) fn unit(self) -> Self {
        self * (all(1.0) / (self.norm2() + all(1e-20)).sqrt())
    }
}

impl Add for V3 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl Sub for V3 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Neg for V3 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl Mul<F> for V3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: F) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

/// Three rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct M3 {
    pub a: V3,
    pub b: V3,
    pub c: V3,
}

impl M3 {
    #[inline(always)]
    pub(super) fn apply(&self, v: V3) -> V3 {
        V3::new(self.a.dot(v), self.b.dot(v), self.c.dot(v))
    }

    #[inline(always)]
    pub(super) fn apply_transposed(&self, v: V3) -> V3 {
        self.a * v.x + self.b * v.y + self.c * v.z
    }

    /// `self^T * o`.
    #[inline(always)]
    pub(super) fn transposed_times(&self, o: &Self) -> Self {
        let column = |k: fn(&V3) -> F| o.a * k(&self.a) + o.b * k(&self.b) + o.c * k(&self.c);
        Self {
            a: column(|v| v.x),
            b: column(|v| v.y),
            c: column(|v| v.z),
        }
    }

    /// `R diag(d) R^T` of a rotation `R`.
    #[inline(always)]
    pub(super) fn turned_diagonal(&self, d: [f32; 3]) -> Self {
        let d = V3::all(d);
        let scaled = |r: V3| V3::new(r.x * d.x, r.y * d.y, r.z * d.z);
        let (a, b, c) = (scaled(self.a), scaled(self.b), scaled(self.c));
        let (ab, ac, bc) = (a.dot(self.b), a.dot(self.c), b.dot(self.c));
        Self {
            a: V3::new(a.dot(self.a), ab, ac),
            b: V3::new(ab, b.dot(self.b), bc),
            c: V3::new(ac, bc, c.dot(self.c)),
        }
    }
}

/// A unit quaternion of each of eight trials, scalar first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub w: F,
    pub v: V3,
}

impl Turn {
    pub(super) fn gather(turns: &[UnitQuaternion<f64>; LANES]) -> Self {
        let of = |pick: fn(&UnitQuaternion<f64>) -> f64| F::new(std::array::from_fn(|k| pick(&turns[k]) as f32));
        Self {
            w: of(|q| q.w),
            v: V3::new(of(|q| q.i), of(|q| q.j), of(|q| q.k)),
        }
    }

    #[inline(always)]
    pub(super) fn matrix(&self) -> M3 {
        let (w, V3 { x, y, z }) = (self.w, self.v);
        let (x2, y2, z2) = (x + x, y + y, z + z);
        let (xx, yy, zz) = (x * x2, y * y2, z * z2);
        let (xy, xz, yz) = (x * y2, x * z2, y * z2);
        let (wx, wy, wz) = (w * x2, w * y2, w * z2);
        let one = all(1.0);
        M3 {
            a: V3::new(one - yy - zz, xy - wz, xz + wy),
            b: V3::new(xy + wz, one - xx - zz, yz - wx),
            c: V3::new(xz - wy, yz + wx, one - xx - yy),
        }
    }

    /// After turning with the angular velocity `w` (world axes) for `h`.
    #[inline(always)]
    pub(super) fn advanced(&self, w: V3, h: F) -> Self {
        let d = w * (h * all(0.5));
        let turned = Self {
            w: self.w - d.dot(self.v),
            v: self.v + d * self.w + d.cross(self.v),
        };
        let scale = all(1.0) / (turned.w * turned.w + turned.v.norm2()).sqrt();
        Self {
            w: turned.w * scale,
            v: turned.v * scale,
        }
    }
}

/// Vectors of eight trials, side by side.
pub(super) fn gather(vectors: &[Vector3<f64>; LANES]) -> V3 {
    let of = |axis: usize| F::new(std::array::from_fn(|k| vectors[k][axis] as f32));
    V3::new(of(0), of(1), of(2))
}
