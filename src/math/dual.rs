//! Numbers that carry their derivatives: a model that is written once for [`Real`] numbers gives its own exact Jacobian.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What a smooth model can be computed in: plain numbers, or numbers with derivatives.
pub trait Real:
    Copy
    + Debug
    + PartialEq
    + 'static
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// A constant.
    fn of(value: f64) -> Self;
    /// The number without its derivatives.
    fn value(self) -> f64;
    /// Square root; at nought it is held to have no slope.
    fn sqrt(self) -> Self;
    /// The exponential.
    fn exp(self) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// The larger of the two.
    fn larger(self, other: Self) -> Self {
        if self.value() >= other.value() { self } else { other }
    }
    /// Itself, or the end of the span that it lies beyond.
    fn within(self, low: f64, high: f64) -> Self {
        if self.value() < low {
            Self::of(low)
        } else if self.value() > high {
            Self::of(high)
        } else {
            self
        }
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
}

/// A number with its derivatives by `N` unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The number.
    pub value: f64,
    /// Its derivatives.
    pub slopes: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The unknown `k`.
    pub fn variable(value: f64, k: usize) -> Self {
        let mut slopes = [0.0; N];
        slopes[k] = 1.0;
        Self { value, slopes }
    }

    /// A function of this number that has this value and slope.
    #[inline]
    fn through(self, value: f64, slope: f64) -> Self {
        let mut slopes = self.slopes;
        slopes.iter_mut().for_each(|s| *s *= slope);
        Self { value, slopes }
    }

    #[inline]
    fn mixed(self, other: Self, value: f64, a: f64, b: f64) -> Self {
        let mut slopes = self.slopes;
        for (s, o) in slopes.iter_mut().zip(&other.slopes) {
            *s = *s * a + o * b;
        }
        Self { value, slopes }
    }
}

impl<const N: usize> Real for Dual<N> {
    fn of(value: f64) -> Self {
        Self {
            value,
            slopes: [0.0; N],
        }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.through(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    fn exp(self) -> Self {
        let e = self.value.exp();
        self.through(e, e)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.through(sin, cos), self.through(cos, -sin))
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.through(-self.value, -1.0)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        self.slopes.iter_mut().zip(&other.slopes).for_each(|(s, o)| *s += o);
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(mut self, other: Self) -> Self {
        self.value -= other.value;
        self.slopes.iter_mut().zip(&other.slopes).for_each(|(s, o)| *s -= o);
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        self.mixed(other, self.value * other.value, other.value, self.value)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        let per = other.value.recip();
        self.mixed(other, quotient, per, -quotient * per)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(mut self, other: f64) -> Self {
        self.value += other;
        self
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(mut self, other: f64) -> Self {
        self.value -= other;
        self
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: f64) -> Self {
        self.through(self.value * other, other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law<T: Real>(x: T, y: T) -> T {
        let (sin, cos) = (x * y).sin_cos();
        (sin / (y + 2.0) - cos * 0.5).exp() + (x * x + y * y).sqrt().larger(y) - x.within(0.0, 0.1)
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let (x, y, h) = (0.7, 1.3, 1e-6);
        let found = law(Dual::<2>::variable(x, 0), Dual::<2>::variable(y, 1));
        assert_eq!(found.value, law(x, y));
        let by = [
            (law(x + h, y) - law(x - h, y)) / (2.0 * h),
            (law(x, y + h) - law(x, y - h)) / (2.0 * h),
        ];
        for (a, b) in found.slopes.iter().zip(by) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }
}
