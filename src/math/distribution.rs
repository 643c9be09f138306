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
