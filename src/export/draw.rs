//! One draw of a number from its interval.
//!
//! The twin keeps a value and a 95 % interval, which need not be symmetric. A draw is the value where a standard normal
//! draw z is nought and an end of the interval where z is ±1.96, straight in between and beyond: a split normal (Wallis
//! 2014, Statistical Science 29(1)), and of a positive quantity with a positive interval the same in its logarithm.

use rand_distr::{Distribution, StandardNormal};

use crate::base::{Estimate, Seed, rng_for};

/// The two-sided 95 % quantile of the standard normal distribution.
const Z95: f64 = 1.959_963_984_540_054;
/// No draw goes further from the value than this many standard deviations.
const FURTHEST: f64 = 3.5;
/// What must be positive stays above this share of its value.
const LEAST: f64 = 0.01;

/// Draws for one model; each named quantity has dice of its own.
pub(super) struct Draws {
    seed: Seed,
    index: usize,
}

/// Where a quantity may lie.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Sign {
    /// Above nought.
    Positive,
    /// Not below nought.
    Nonnegative,
    /// Anywhere.
    Any,
}

impl Draws {
    /// Of the model number `index` of a seed.
    pub(super) fn new(seed: Seed, index: usize) -> Self {
        Self { seed, index }
    }

    /// A standard normal draw for a quantity, cut where no interval reaches.
    pub(super) fn z(&self, quantity: &str) -> f64 {
        let mut rng = rng_for(self.seed, &format!("variant {} {quantity}", self.index));
        let z: f64 = StandardNormal.sample(&mut rng);
        z.clamp(-FURTHEST, FURTHEST)
    }

    /// Replaces an estimate by a draw from its interval.
    pub(super) fn scalar(&self, quantity: &str, estimate: &mut Option<Estimate>, sign: Sign) {
        if let Some(e) = estimate {
            let drawn = at(e.value, e.ci95, self.z(quantity), sign);
            settle(e, drawn);
        }
    }

    /// The same for each component of a list.
    pub(super) fn list<const N: usize>(&self, quantity: &str, e: &mut Estimate<[f64; N]>, sign: Sign)
    where
        [f64; N]: crate::base::Value<Interval = [[f64; 2]; N]>,
    {
        let Some(ci95) = e.ci95.take() else { return };
        for (k, (value, interval)) in e.value.iter_mut().zip(ci95).enumerate() {
            let z = self.z(&format!("{quantity} {k}"));
            *value = at(*value, Some(interval), z, sign);
        }
        e.sd = None;
    }
}

/// Gives an estimate a drawn value, which has no doubt of its own.
pub(super) fn settle(e: &mut Estimate, drawn: f64) {
    e.value = drawn;
    e.sd = None;
    e.ci95 = None;
}

/// Where a quantity lies for a standard normal draw `z`; its value where no interval is known.
pub(super) fn at(value: f64, ci95: Option<[f64; 2]>, z: f64, sign: Sign) -> f64 {
    let Some([low, high]) = ci95.filter(|i| i.iter().all(|v| v.is_finite())) else {
        return value;
    };
    let share = z / Z95;
    if sign != Sign::Any && low > 0.0 && value > 0.0 && high > 0.0 {
        let end = if z > 0.0 { high.max(value) } else { low.min(value) };
        return value * (end / value).powf(share.abs());
    }
    let reach = if z > 0.0 { high - value } else { value - low };
    let drawn = value + share * reach.max(0.0);
    match sign {
        Sign::Positive => drawn.max(LEAST * value),
        Sign::Nonnegative => drawn.max(0.0),
        Sign::Any => drawn,
    }
}

/// Spread of the logarithm of a positive quantity, from its interval.
pub(super) fn log_sd(e: &Estimate) -> Option<f64> {
    let [low, high] = e.ci95.filter(|[low, _]| *low > 0.0)?;
    Some((high / low).ln() / (2.0 * Z95))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_keeps_the_ends_of_a_lopsided_interval() {
        let at = |z| at(2.0, Some([1.0, 5.0]), z, Sign::Positive);
        assert!((at(0.0) - 2.0).abs() < 1e-12);
        assert!((at(Z95) - 5.0).abs() < 1e-9 && (at(-Z95) - 1.0).abs() < 1e-9);
        assert!(at(-FURTHEST) > 0.0);
        assert_eq!(super::at(0.1, Some([-0.3, 0.5]), -3.0, Sign::Nonnegative), 0.0);
    }
}
