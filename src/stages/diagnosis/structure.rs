//! What a smooth dependence that no law names would still explain of the residuals: the measure of what a model leaves.
//!
//! Kennedy and O'Hagan (2001) add such a term to every model; here it never explains, it only says that something is left.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::family::{Covariate, Family};
use super::fit::{Fit, parameters};
use super::marginal::{Linear, Point, Tangent, whitened};
use super::shows_in::TIME;

/// Gaussians along one covariate; along each of two.
const ALONE: usize = 10;
const TOGETHER: usize = 5;
/// Standard deviations of a Gaussian's height that are tried, in units of the noise.
const HEIGHTS: [f64; 4] = [0.3, 1.0, 3.0, 10.0];

/// What is told of the time of a sample where nothing is named.
const SINCE: &str = "time since the touch began";

/// A smooth dependence of what is left on one covariate or on two.
#[derive(Clone, Debug)]
pub struct Structure {
    /// The covariates, by name.
    pub on: Vec<&'static str>,
    /// Log evidence for it over the model without it, nats.
    pub gain: f64,
    /// Among how many it is the best.
    pub tries: usize,
}

/// Everything about a fit that the search needs, once.
struct Left<'a> {
    family: &'a dyn Family,
    fit: &'a Fit,
    groups: Vec<(Tangent, Linear)>,
    /// Covariates of each group's samples.
    covariates: Vec<Vec<Vec<f64>>>,
    names: Vec<&'static str>,
    base: Cholesky<f64, nalgebra::Dyn>,
    slope: DVector<f64>,
}

/// The smooth dependence that gains most, if the family has covariates.
///
/// Linear about the fit: no interaction is simulated anew. What parameters or random effects can take up is no structure.
pub fn structure(family: &dyn Family, fit: &Fit) -> Option<Structure> {
    let left = Left::of(family, fit)?;
    let count = left.names.len();
    let alone = (0..count).map(|k| vec![k]);
    let pairs = (0..count).flat_map(|a| (a + 1..count).map(move |b| vec![a, b]));
    let tries = count * (count + 1) / 2;
    let all = alone.chain(pairs).filter_map(|on| {
        let gain = left.gain(&on)?;
        let on = on.iter().map(|k| left.names[*k]).collect();
        Some(Structure { on, gain, tries })
    });
    all.max_by(|a, b| a.gain.total_cmp(&b.gain))
}

/// What samples of a group differ in; where it is `unnamed`, how long the tool has touched as well: what an arm does so long after
/// it touched is no law, but laws that relax, or wear, in another form than nature do leave what depends on that.
fn told_by(family: &dyn Family, group: usize, unnamed: bool) -> Vec<Covariate> {
    let mut all = family.covariates(group);
    all.extend(family.besides(group));
    let times = all.iter().find(|c| c.0 == TIME).filter(|_| unnamed);
    let since = times.map(|(_, unit, times)| {
        let begun = times.iter().copied().fold(f64::INFINITY, f64::min);
        (SINCE, *unit, times.iter().map(|t| t - begun).collect())
    });
    all.extend(since);
    all
}

impl<'a> Left<'a> {
    fn of(family: &'a dyn Family, fit: &'a Fit) -> Option<Self> {
        let priors = parameters(family, &fit.laws);
        let steps: Vec<f64> = priors.iter().map(|p| 1e-4 * p.sd).collect();
        let point = Point {
            laws: &fit.laws,
            theta: &fit.theta,
        };
        let of = |g: &usize| {
            let tangent = Tangent::flat(family, *g, &point).sloped(family, &point, &steps);
            let linear = tangent.linear(family, &fit.noise);
            (tangent, linear)
        };
        let groups: Vec<(Tangent, Linear)> = fit.groups.par_iter().map(of).collect();
        let all = |g: usize| told_by(family, g, fit.laws.is_empty());
        let names: Vec<&'static str> = all(*fit.groups.first()?).iter().map(|c| c.0).collect();
        let covariates = fit
            .groups
            .iter()
            .map(|g| all(*g).into_iter().map(|c| c.2).collect::<Vec<_>>());
        let p = priors.len();
        let mut h = DMatrix::from_diagonal(&DVector::from_iterator(p, priors.iter().map(|x| x.sd.powi(-2))));
        let pull = priors
            .iter()
            .zip(&fit.theta)
            .map(|(x, t)| -(t - x.centre) / x.sd.powi(2));
        let mut slope = DVector::from_iterator(p, pull);
        for ((_, linear), state) in groups.iter().zip(&fit.states) {
            debug_assert_eq!(linear.jacobian.len(), p);
            h += &state.information;
            slope += &state.gradient;
        }
        Some(Self {
            covariates: covariates.collect(),
            base: Cholesky::new(h)?,
            family,
            fit,
            groups,
            names,
            slope,
        })
    }

    fn values(&self, group: usize, on: usize) -> &[f64] {
        &self.covariates[group][on]
    }

    /// Log evidence of Gaussians of these covariates, nats.
    fn gain(&self, on: &[usize]) -> Option<f64> {
        let per = if on.len() == 1 { ALONE } else { TOGETHER };
        let ranges: Vec<(f64, f64)> = on.iter().map(|k| self.range(*k)).collect::<Option<_>>()?;
        let count = per.pow(on.len() as u32);
        let sigma = self.fit.noise.sigma[0];
        let p = self.slope.len();
        let (mut dd, mut dj, mut dr) = (
            DMatrix::zeros(count, count),
            DMatrix::zeros(count, p),
            DVector::zeros(count),
        );
        for (k, (tangent, linear)) in self.groups.iter().enumerate() {
            let height = |c: usize, i: usize| -> f64 {
                let mut at = c;
                let each = on.iter().zip(&ranges).map(|(axis, (low, high))| {
                    let centre = low + (high - low) * (at % per) as f64 / (per - 1) as f64;
                    at /= per;
                    let width = (high - low) / (per - 1) as f64;
                    let value = self.values(k, *axis)[i];
                    if value.is_finite() {
                        (-0.5 * ((value - centre) / width).powi(2)).exp()
                    } else {
                        0.0
                    }
                });
                sigma * each.product::<f64>()
            };
            let n = linear.whitened.len();
            let columns: Vec<Vec<f64>> = (0..count)
                .map(|c| {
                    let raw: Vec<f64> = (0..n).map(|i| height(c, i)).collect();
                    whitened(self.family, self.fit.groups[k], &self.fit.noise, &tangent.weight, &raw)
                })
                .collect();
            dd += linear.inner(&columns, &columns);
            dj += linear.inner(&columns, &linear.jacobian);
            dr += linear.inner(&columns, std::slice::from_ref(&linear.whitened)).column(0);
        }
        let solved = self.base.solve(&dj.transpose());
        let information = dd - &dj * solved;
        let gradient = dr - &dj * self.base.solve(&self.slope);
        let one = |height: &f64| {
            let precision = &information + DMatrix::identity(count, count) * height.powi(-2);
            let chol = Cholesky::new(precision)?;
            let log_det =
                2.0 * chol.l().diagonal().iter().map(|x| x.ln()).sum::<f64>() + 2.0 * count as f64 * height.ln();
            Some(0.5 * gradient.dot(&chol.solve(&gradient)) - 0.5 * log_det)
        };
        HEIGHTS.iter().filter_map(one).max_by(f64::total_cmp)
    }

    fn range(&self, on: usize) -> Option<(f64, f64)> {
        let each = (0..self.groups.len()).flat_map(|g| self.values(g, on));
        let (low, high) = each
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        (high - low > 1e-9).then_some((low, high))
    }
}
