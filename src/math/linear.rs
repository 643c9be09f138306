//! Linear least squares with covariance: weighted, robust, and with a prior.

use nalgebra::{DMatrix, DVector};

use super::mad_sd;

/// A linear fit `A x ≈ b`.
#[derive(Clone, Debug)]
pub struct LinearFit {
    /// The solution.
    pub x: DVector<f64>,
    /// Its covariance.
    pub covariance: DMatrix<f64>,
    /// `b - A x`.
    pub residuals: DVector<f64>,
}

impl LinearFit {
    /// Standard deviation of component `i`.
    pub fn sd(&self, i: usize) -> f64 {
        self.covariance[(i, i)].max(0.0).sqrt()
    }
}

fn solve(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    weights: &DVector<f64>,
    prior: Option<(&DVector<f64>, &DVector<f64>)>,
) -> Option<LinearFit> {
    let mut weighted = a.clone();
    for (i, mut row) in weighted.row_iter_mut().enumerate() {
        row *= weights[i];
    }
    let mut normal = a.transpose() * &weighted;
    let mut right = weighted.transpose() * b;
    if let Some((mean, sd)) = prior {
        for i in 0..mean.len() {
            normal[(i, i)] += sd[i].powi(-2);
            right[i] += mean[i] * sd[i].powi(-2);
        }
    }
    let covariance = normal.cholesky()?.inverse();
    let x = &covariance * right;
    let residuals = b - a * &x;
    x.iter().all(|v| v.is_finite()).then_some(LinearFit {
        x,
        covariance,
        residuals,
    })
}

/// Least squares with `weights` = 1/variance of each row; `None` where the columns are dependent.
pub fn weighted_linear(a: &DMatrix<f64>, b: &DVector<f64>, weights: &DVector<f64>) -> Option<LinearFit> {
    solve(a, b, weights, None)
}

/// Least squares with an independent normal prior on each unknown.
pub fn bayesian_linear(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    weights: &DVector<f64>,
    prior_mean: &DVector<f64>,
    prior_sd: &DVector<f64>,
) -> Option<LinearFit> {
    solve(a, b, weights, Some((prior_mean, prior_sd)))
}

/// Least squares by iteratively reweighted Tukey biweights; the noise is taken from the residuals, and the
/// covariance is that of independent samples of that noise.
pub fn robust_linear(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<LinearFit> {
    let mut weights = DVector::from_element(b.len(), 1.0);
    let mut fit = weighted_linear(a, b, &weights)?;
    for round in 0..40 {
        let scale = mad_sd(fit.residuals.as_slice())?.max(1e-12 * b.amax().max(1e-300));
        for (w, r) in weights.iter_mut().zip(fit.residuals.iter()) {
            // Huber's convex loss first, so that the biweight starts near the bulk.
            *w = if round < 15 {
                (1.345 * scale / r.abs().max(1e-300)).min(1.0)
            } else {
                (1.0 - (r / (4.685 * scale)).powi(2)).max(0.0).powi(2)
            };
        }
        let next = weighted_linear(a, b, &weights)?;
        let moved = (&next.x - &fit.x).amax();
        fit = next;
        if round > 15 && moved <= 1e-10 * fit.x.amax() {
            break;
        }
    }
    let used: f64 = weights.sum();
    let square: f64 = fit.residuals.iter().zip(weights.iter()).map(|(r, w)| w * r * r).sum();
    fit.covariance *= square / (used - a.ncols() as f64).max(1.0);
    Some(fit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_through_outliers() {
        let a = DMatrix::from_fn(50, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let b = DVector::from_fn(50, |i, _| {
            2.0 + 0.5 * i as f64
                + if i % 7 == 0 {
                    40.0
                } else {
                    0.01 * ((i * 37 % 11) as f64 - 5.0)
                }
        });
        let fit = robust_linear(&a, &b).expect("solvable");
        assert!((fit.x[1] - 0.5).abs() < 3.0 * fit.sd(1).max(1e-4));
    }

    #[test]
    fn dependent_columns_are_refused_and_a_prior_mends_them() {
        let a = DMatrix::from_element(4, 2, 1.0);
        let b = DVector::from_element(4, 2.0);
        let w = DVector::from_element(4, 1.0);
        assert!(weighted_linear(&a, &b, &w).is_none_or(|f| f.sd(0) > 1e3));
        let one = DVector::from_element(2, 1.0);
        let fit = bayesian_linear(&a, &b, &w, &one, &one).expect("solvable");
        assert!((fit.x[0] - 1.0).abs() < 1e-9 && fit.sd(0) > 0.5);
    }
}
