//! Small dense nonlinear least squares with robust losses and covariance.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Entries of a Jacobian from which on its columns are worth a thread each.
const MANY: usize = 2000;

/// How a residual (in units of its standard deviation) is charged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Its square.
    Squares,
    /// Its square up to the given size, linear beyond (Huber).
    Huber(f64),
    /// Flat beyond the given size (Tukey's biweight).
    Tukey(f64),
}

impl Loss {
    fn weight(self, r: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber(k) => {
                if r.abs() <= k {
                    1.0
                } else {
                    k / r.abs()
                }
            }
            Self::Tukey(k) => (1.0 - (r / k).powi(2)).max(0.0).powi(2),
        }
    }

    fn cost(self, r: f64) -> f64 {
        match self {
            Self::Squares => 0.5 * r * r,
            Self::Huber(k) => {
                if r.abs() <= k {
                    0.5 * r * r
                } else {
                    k * (r.abs() - 0.5 * k)
                }
            }
            Self::Tukey(k) => k * k / 6.0 * (1.0 - (1.0 - (r / k).powi(2)).max(0.0).powi(3)),
        }
    }
}

/// Settings of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// The loss.
    pub loss: Loss,
    /// Most iterations.
    pub iterations: usize,
    /// Stop where the cost falls by less than this share.
    pub tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            loss: Loss::Squares,
            iterations: 100,
            tolerance: 1e-10,
        }
    }
}

/// A finished fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The solution.
    pub x: DVector<f64>,
    /// Inverse of the weighted normal matrix: the covariance where residuals are in units of their sd.
    pub covariance: DMatrix<f64>,
    /// Residuals at the solution.
    pub residuals: DVector<f64>,
    /// Robust cost at the solution.
    pub cost: f64,
    /// It stopped because nothing was left to gain.
    pub converged: bool,
}

impl Fit {
    /// Standard deviation of component `i`.
    pub fn sd(&self, i: usize) -> f64 {
        self.covariance[(i, i)].max(0.0).sqrt()
    }
}

fn jacobian(
    x: &DVector<f64>,
    steps: &DVector<f64>,
    rows: usize,
    residuals: &(impl Fn(&DVector<f64>) -> DVector<f64> + Sync),
) -> DMatrix<f64> {
    let column = |j: usize| {
        let (mut up, mut down) = (x.clone(), x.clone());
        up[j] += steps[j];
        down[j] -= steps[j];
        (residuals(&up) - residuals(&down)) / (2.0 * steps[j])
    };
    let columns: Vec<DVector<f64>> = if rows * x.len() < MANY {
        (0..x.len()).map(column).collect()
    } else {
        (0..x.len()).into_par_iter().map(column).collect()
    };
    let mut out = DMatrix::zeros(rows, x.len());
    for (j, column) in columns.iter().enumerate() {
        out.set_column(j, column);
    }
    out
}

/// Minimises the loss of `residuals(x)` from `start`; `steps` are the central-difference steps of the
/// unknowns. `None` where the residuals are not finite at the start or the problem is singular.
pub fn levenberg_marquardt(
    start: &DVector<f64>,
    steps: &DVector<f64>,
    settings: Settings,
    residuals: impl Fn(&DVector<f64>) -> DVector<f64> + Sync,
) -> Option<Fit> {
    let slopes = |x: &DVector<f64>, rows: usize| jacobian(x, steps, rows, &residuals);
    minimise(start, settings, &residuals, slopes)
}

/// The same where the residuals' derivatives are known: `slopes(x)` has a row for each residual.
pub fn levenberg_marquardt_exact(
    start: &DVector<f64>,
    settings: Settings,
    residuals: impl Fn(&DVector<f64>) -> DVector<f64>,
    slopes: impl Fn(&DVector<f64>) -> DMatrix<f64>,
) -> Option<Fit> {
    minimise(start, settings, &residuals, |x, _| slopes(x))
}

fn minimise(
    start: &DVector<f64>,
    settings: Settings,
    residuals: &impl Fn(&DVector<f64>) -> DVector<f64>,
    slopes: impl Fn(&DVector<f64>, usize) -> DMatrix<f64>,
) -> Option<Fit> {
    let cost_of = |r: &DVector<f64>| r.iter().map(|v| settings.loss.cost(*v)).sum::<f64>();
    let mut x = start.clone();
    let mut r = residuals(&x);
    let mut cost = cost_of(&r);
    if !cost.is_finite() || r.len() < x.len() {
        return None;
    }
    let mut damping = 1e-3;
    let mut converged = false;
    let weighted = |r: &DVector<f64>, j: &DMatrix<f64>| {
        let mut wj = j.clone();
        for (i, mut row) in wj.row_iter_mut().enumerate() {
            row *= settings.loss.weight(r[i]);
        }
        wj
    };
    for _ in 0..settings.iterations {
        let j = slopes(&x, r.len());
        let wj = weighted(&r, &j);
        let normal = j.transpose() * &wj;
        let gradient = wj.transpose() * &r;
        let mut improved = false;
        while damping < 1e12 {
            let mut damped = normal.clone();
            for i in 0..x.len() {
                damped[(i, i)] += damping * normal[(i, i)].max(1e-12);
            }
            let step = damped.cholesky().map(|c| c.solve(&gradient));
            if let Some(step) = step {
                let trial = &x - step;
                let trial_r = residuals(&trial);
                let trial_cost = cost_of(&trial_r);
                if trial_cost.is_finite() && trial_cost <= cost {
                    converged = cost - trial_cost <= settings.tolerance * cost.max(1e-300);
                    (x, r, cost) = (trial, trial_r, trial_cost);
                    damping = (damping * 0.2).max(1e-12);
                    improved = true;
                    break;
                }
            }
            damping *= 4.0;
        }
        if !improved || converged {
            converged = true;
            break;
        }
    }
    let j = slopes(&x, r.len());
    let covariance = (j.transpose() * weighted(&r, &j)).cholesky()?.inverse();
    Some(Fit {
        x,
        covariance,
        residuals: r,
        cost,
        converged,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decay_is_recovered_in_spite_of_outliers() {
        let truth = [3.0, 0.7];
        let data: Vec<(f64, f64)> = (0..40)
            .map(|i| {
                let t = 0.1 * i as f64;
                let wild = if i % 9 == 4 { 5.0 } else { 0.0 };
                (
                    t,
                    truth[0] * (-truth[1] * t).exp() + wild + 0.01 * ((i * 7 % 5) as f64 - 2.0),
                )
            })
            .collect();
        let settings = Settings {
            loss: Loss::Tukey(4.7),
            ..Settings::default()
        };
        let fit = levenberg_marquardt(
            &DVector::from_vec(vec![2.0, 0.5]),
            &DVector::from_vec(vec![1e-5, 1e-5]),
            Settings {
                loss: Loss::Huber(1.5),
                ..settings
            },
            |x| DVector::from_iterator(40, data.iter().map(|(t, y)| (y - x[0] * (-x[1] * t).exp()) / 0.02)),
        )
        .expect("fits");
        let fit = levenberg_marquardt(&fit.x, &DVector::from_vec(vec![1e-5, 1e-5]), settings, |x| {
            DVector::from_iterator(40, data.iter().map(|(t, y)| (y - x[0] * (-x[1] * t).exp()) / 0.02))
        })
        .expect("fits");
        assert!(fit.converged);
        for (i, truth) in truth.iter().enumerate() {
            assert!((fit.x[i] - truth).abs() < 3.0 * fit.sd(i), "{} {}", fit.x[i], fit.sd(i));
        }
    }
}
