//! Quantiles and tails of the distributions that intervals and tests are made of.

use statrs::distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT};

/// The `p`-quantile of the standard normal distribution.
pub fn normal_quantile(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p)
}

/// The `p`-quantile of Student's t; the normal one beyond 1e6 degrees of freedom.
pub fn t_quantile(p: f64, degrees: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, degrees) {
        Ok(t) if degrees < 1e6 => t.inverse_cdf(p),
        _ => normal_quantile(p),
    }
}

/// The `p`-quantile of a mixture of Student's t (normal where `degrees` is without bound), each part a weight, a middle and a
/// scale; weights sum to one.
pub fn mixture_quantile(parts: &[(f64, f64, f64)], p: f64, degrees: f64) -> f64 {
    let student = StudentsT::new(0.0, 1.0, degrees).ok().filter(|_| degrees < 1e6);
    let below = |z: f64| student.map_or_else(|| Normal::standard().cdf(z), |t| t.cdf(z));
    let share = |x: f64| parts.iter().map(|(w, m, s)| w * below((x - m) / s)).sum::<f64>();
    // No part's own quantile is passed by that of all.
    let reach = t_quantile(p, degrees);
    let own = || parts.iter().map(|(_, m, s)| m + reach * s);
    let (mut low, mut high) = (
        own().fold(f64::INFINITY, f64::min),
        own().fold(f64::NEG_INFINITY, f64::max),
    );
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if share(middle) < p { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The two-sided tail probability of `t` under Student's t.
pub fn t_tail(t: f64, degrees: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, degrees) {
        Ok(d) => 2.0 * (1.0 - d.cdf(t.abs())),
        Err(_) => 1.0,
    }
}

/// The `p`-quantile of chi-squared.
pub fn chi_squared_quantile(p: f64, degrees: f64) -> f64 {
    ChiSquared::new(degrees).map_or(f64::NAN, |d| d.inverse_cdf(p))
}

/// The probability that chi-squared exceeds `x`.
pub fn chi_squared_tail(x: f64, degrees: f64) -> f64 {
    ChiSquared::new(degrees).map_or(f64::NAN, |d| 1.0 - d.cdf(x.max(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mixture_lies_between_its_parts() {
        let alone = mixture_quantile(&[(1.0, 2.0, 0.5)], 0.975, f64::INFINITY);
        assert!((alone - (2.0 + 0.5 * 1.959_964)).abs() < 1e-5, "{alone}");
        // Half narrow, half three times as wide: 2.5 % lie beyond 4.93.
        let both = mixture_quantile(&[(0.5, 0.0, 1.0), (0.5, 0.0, 3.0)], 0.975, f64::INFINITY);
        assert!((both - 4.9346).abs() < 1e-2, "{both}");
    }

    #[test]
    fn quantiles_agree_with_printed_tables() {
        for (found, printed) in [
            (normal_quantile(0.975), 1.95996),
            (t_quantile(0.975, 4.0), 2.77645),
            (chi_squared_quantile(0.95, 3.0), 7.81473),
            (chi_squared_tail(7.81473, 3.0), 0.05),
        ] {
            assert!((found - printed).abs() < 1e-4, "{found} {printed}");
        }
    }
}
