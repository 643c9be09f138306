//! Trials side by side: numbers, vectors, matrices and turns over SIMD lanes, as wide as the processor has them.
//!
//! Every operation is exact in IEEE arithmetic and acts on one lane alone, without fused multiply-adds, so that a trial ends
//! in the same bits on every processor.

use std::ops::{Add, BitAnd, Mul, Neg, Sub};

use pulp::Simd;

/// The widest registers have this many lanes.
pub(super) const MOST_LANES: usize = 16;

/// One number of each trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct F<S: Simd> {
    simd: S,
    v: S::f32s,
}

/// One truth of each trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mask<S: Simd> {
    simd: S,
    m: S::m32s,
}

impl<S: Simd> Mask<S> {
    #[inline(always)]
    pub(super) fn any(self) -> bool {
        self.simd.first_true_m32s(self.m) < S::F32_LANES
    }
}

impl<S: Simd> BitAnd for Mask<S> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, o: Self) -> Self {
        Self {
            simd: self.simd,
            m: self.simd.and_m32s(self.m, o.m),
        }
    }
}

impl<S: Simd> F<S> {
    /// The same number in every lane.
    #[inline(always)]
    pub(super) fn all(simd: S, x: f32) -> Self {
        Self {
            simd,
            v: simd.splat_f32s(x),
        }
    }

    /// A number by lane.
    #[inline(always)]
    pub(super) fn each(simd: S, of: impl Fn(usize) -> f32) -> Self {
        let mut values = [0.0; MOST_LANES];
        for (k, value) in values.iter_mut().enumerate().take(S::F32_LANES) {
            *value = of(k);
        }
        Self {
            simd,
            v: S::as_simd_f32s(&values).0[0],
        }
    }

    #[inline(always)]
    pub(super) fn to_array(self) -> [f32; MOST_LANES] {
        let mut values = [0.0; MOST_LANES];
        S::as_mut_simd_f32s(&mut values).0[0] = self.v;
        values
    }

    #[inline(always)]
    fn of(self, v: S::f32s) -> Self {
        Self { simd: self.simd, v }
    }

    /// The same number in every lane, beside this one.
    #[inline(always)]
    pub(super) fn like(self, x: f32) -> Self {
        Self::all(self.simd, x)
    }

    #[inline(always)]
    pub(super) fn min(self, o: Self) -> Self {
        self.of(self.simd.min_f32s(self.v, o.v))
    }

    #[inline(always)]
    pub(super) fn max(self, o: Self) -> Self {
        self.of(self.simd.max_f32s(self.v, o.v))
    }

    /// Zero where it is below.
    #[inline(always)]
    pub(super) fn positive(self) -> Self {
        self.max(self.like(0.0))
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        self.of(self.simd.abs_f32s(self.v))
    }

    #[inline(always)]
    pub(super) fn sqrt(self) -> Self {
        self.of(self.simd.sqrt_f32s(self.v))
    }

    /// One over it.
    #[inline(always)]
    pub(super) fn inverse(self) -> Self {
        self.of(self.simd.div_f32s(self.simd.splat_f32s(1.0), self.v))
    }

    #[inline(always)]
    pub(super) fn over(self, o: Self) -> Self {
        self.of(self.simd.div_f32s(self.v, o.v))
    }
}

impl<S: Simd> Add for F<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.of(self.simd.add_f32s(self.v, o.v))
    }
}

impl<S: Simd> Sub for F<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.of(self.simd.sub_f32s(self.v, o.v))
    }
}

impl<S: Simd> Mul for F<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        self.of(self.simd.mul_f32s(self.v, o.v))
    }
}

impl<S: Simd> Neg for F<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.of(self.simd.sub_f32s(self.simd.splat_f32s(0.0), self.v))
    }
}

impl<S: Simd> Add<f32> for F<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, x: f32) -> Self {
        self + self.like(x)
    }
}

impl<S: Simd> Sub<f32> for F<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, x: f32) -> Self {
        self - self.like(x)
    }
}

impl<S: Simd> Mul<f32> for F<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, x: f32) -> Self {
        self * self.like(x)
    }
}

/// `a` where the mask is set, else `b`.
#[inline(always)]
pub(super) fn pick<S: Simd>(mask: Mask<S>, a: F<S>, b: F<S>) -> F<S> {
    a.of(mask.simd.select_f32s(mask.m, a.v, b.v))
}

/// Mask of `a < b`.
#[inline(always)]
pub(super) fn less<S: Simd>(a: F<S>, b: F<S>) -> Mask<S> {
    Mask {
        simd: a.simd,
        m: a.simd.less_than_f32s(a.v, b.v),
    }
}

/// Mask of `a > b`.
#[inline(always)]
pub(super) fn more<S: Simd>(a: F<S>, b: F<S>) -> Mask<S> {
    less(b, a)
}

/// A vector of each trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct V3<S: Simd> {
    pub x: F<S>,
    pub y: F<S>,
    pub z: F<S>,
}

impl<S: Simd> V3<S> {
    #[inline(always)]
    pub(super) fn new(x: F<S>, y: F<S>, z: F<S>) -> Self {
        Self { x, y, z }
    }

    /// The same vector in every lane.
    #[inline(always)]
    pub(super) fn all(simd: S, v: [f32; 3]) -> Self {
        Self::new(F::all(simd, v[0]), F::all(simd, v[1]), F::all(simd, v[2]))
    }

    #[inline(always)]
    pub(super) fn zero(simd: S) -> Self {
        Self::all(simd, [0.0; 3])
    }

    /// A vector by lane.
    #[inline(always)]
    pub(super) fn each(simd: S, of: impl Fn(usize) -> [f32; 3]) -> Self {
        Self::new(
            F::each(simd, |k| of(k)[0]),
            F::each(simd, |k| of(k)[1]),
            F::each(simd, |k| of(k)[2]),
        )
    }

    #[inline(always)]
    pub(super) fn dot(self, o: Self) -> F<S> {
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
    pub(super) fn norm2(self) -> F<S> {
        self.dot(self)
    }

    #[inline(always)]
    pub(super) fn pick(mask: Mask<S>, a: Self, b: Self) -> Self {
        Self::new(pick(mask, a.x, b.x), pick(mask, a.y, b.y), pick(mask, a.z, b.z))
    }

    /// Length one; the zero vector stays near zero.
    #[inline(always)]
    pub(super) fn unit(self) -> Self {
        self * (self.norm2() + 1e-20).sqrt().inverse()
    }
}

impl<S: Simd> Add for V3<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<S: Simd> Sub for V3<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<S: Simd> Neg for V3<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<S: Simd> Mul<F<S>> for V3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: F<S>) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}

impl<S: Simd> Mul<f32> for V3<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: f32) -> Self {
        self * self.x.like(s)
    }
}
