//! The marginal likelihood of one interaction: correlated noise AR(1) per channel, random effects per interaction.

use nalgebra::{DMatrix, DVector};

use super::family::{Active, Family};

/// Levels of noise that are learnt with every model.
#[derive(Clone, Debug)]
pub struct Noise {
    /// By channel kind.
    pub sigma: Vec<f64>,
    /// Correlation of neighbouring samples, by channel kind.
    pub rho: Vec<f64>,
    /// Standard deviations of the random effects.
    pub tau: Vec<f64>,
}

impl Noise {
    pub fn start(family: &dyn Family) -> Self {
        Self {
            sigma: family.kinds().iter().map(|k| 1.2 * k.sigma).collect(),
            rho: vec![0.3; family.kinds().len()],
            tau: family.scatter().iter().map(|s| s.tau).collect(),
        }
    }

    /// These levels with one kind at a time as in `learnt`: each channel kind's, then those of the scatter.
    pub fn one_by_one(&self, learnt: &Self) -> Vec<Self> {
        let kind = |k: usize| {
            let mut one = self.clone();
            (one.sigma[k], one.rho[k]) = (learnt.sigma[k], learnt.rho[k]);
            one
        };
        let mut all: Vec<Self> = (0..self.sigma.len()).map(kind).collect();
        all.push(Self {
            tau: learnt.tau.clone(),
            ..self.clone()
        });
        all
    }
}

/// What one interaction says at one point of the parameters.
#[derive(Clone, Debug)]
pub struct GroupState {
    /// Log-likelihood, random effects integrated out.
    pub log_likelihood: f64,
    /// Gradient and information of the parameters.
    pub gradient: DVector<f64>,
    pub information: DMatrix<f64>,
    /// Whitened squared residual and the log-determinant, without the constant.
    pub square: f64,
    pub log_det: f64,
    pub samples: usize,
    /// Best random effects and their covariance.
    pub effects: DVector<f64>,
    pub effect_covariance: DMatrix<f64>,
    /// Weighted residuals without the random effects, by channel.
    pub left: Vec<Vec<f64>>,
}

/// Weight of each sample: less where the signal changes fast.
pub fn weights(family: &dyn Family, group: usize) -> Vec<f64> {
    let of = |c: &super::family::Channel| {
        let kind = &family.kinds()[c.kind];
        let weight = |(d, a): (&f64, &f64)| {
            1.0 / (1.0 + (kind.jitter * d / kind.sigma).powi(2) + (a / kind.sigma).powi(2)).sqrt()
        };
        c.change.iter().zip(&c.aside).map(weight).collect::<Vec<f64>>()
    };
    family.groups()[group].channels.iter().flat_map(of).collect()
}

/// `w x` freed of its correlation, in units of the noise.
pub fn whitened(family: &dyn Family, group: usize, noise: &Noise, weight: &[f64], x: &[f64]) -> Vec<f64> {
    let mut out = Vec::with_capacity(x.len());
    let mut at = 0;
    for channel in &family.groups()[group].channels {
        let (sigma, rho) = (noise.sigma[channel.kind], noise.rho[channel.kind]);
        let inner = sigma * (1.0 - rho * rho).sqrt();
        for start in &channel.starts {
            let own = weight[at] * x[at];
            out.push(if *start {
                own / sigma
            } else {
                (own - rho * weight[at - 1] * x[at - 1]) / inner
            });
            at += 1;
        }
    }
    out
}

fn log_det_of_noise(family: &dyn Family, group: usize, noise: &Noise) -> f64 {
    let channel = |c: &super::family::Channel| {
        let (sigma, rho) = (noise.sigma[c.kind], noise.rho[c.kind]);
        let inside = c.starts.iter().filter(|s| !**s).count() as f64;
        2.0 * c.starts.len() as f64 * sigma.ln() + inside * (1.0 - rho * rho).ln()
    };
    family.groups()[group].channels.iter().map(channel).sum()
}

fn columns(
    family: &dyn Family,
    group: usize,
    noise: &Noise,
    weight: &[f64],
    at: &[f64],
    all: impl Iterator<Item = (Vec<f64>, f64)>,
) -> Vec<Vec<f64>> {
    all.map(|(moved, step)| {
        let slope: Vec<f64> = moved.iter().zip(at).map(|(m, a)| (m - a) / step).collect();
        whitened(family, group, noise, weight, &slope)
    })
    .collect()
}

/// The parameters of the base and of every law that is on, in one row.
pub struct Point<'a> {
    pub laws: &'a [usize],
    pub theta: &'a [f64],
}

/// Splits a row of parameters.
pub fn predict(family: &dyn Family, group: usize, point: &Point, scatter: &[f64]) -> Vec<f64> {
    let (base, mut rest) = point.theta.split_at(family.base().len());
    let mut active = Vec::with_capacity(point.laws.len());
    for law in point.laws {
        let law = &family.laws()[*law];
        let (values, others) = rest.split_at(law.parameters.len());
        active.push(Active { law, values });
        rest = others;
    }
    family.predict(group, base, &active, scatter)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// A group's model about `point`, to first order, in units of the noise and freed of its correlation.
pub struct Linear {
    /// Weights of the samples.
    pub weight: Vec<f64>,
    /// Measured less predicted, SI.
    pub residual: Vec<f64>,
    /// The same, whitened.
    pub whitened: Vec<f64>,
    /// Columns of the parameters, whitened.
    pub jacobian: Vec<Vec<f64>>,
    /// Columns of the random effects, whitened, and in SI.
    pub effects: Vec<Vec<f64>>,
    pub slopes: Vec<Vec<f64>>,
    /// Covariance of the random effects, and the log-determinant of its inverse.
    pub covariance: DMatrix<f64>,
    pub log_precision: f64,
}

impl Linear {
    /// Inner products of columns that are whitened, the random effects integrated out.
    pub fn inner(&self, a: &[Vec<f64>], b: &[Vec<f64>]) -> DMatrix<f64> {
        let through =
            |x: &[Vec<f64>]| DMatrix::from_fn(self.effects.len(), x.len(), |i, j| dot(&self.effects[i], &x[j]));
        let direct = DMatrix::from_fn(a.len(), b.len(), |i, j| dot(&a[i], &b[j]));
        direct - through(a).transpose() * &self.covariance * through(b)
    }
}

/// The linear model of a group; `steps` are the finite steps of the parameters.
pub fn linear(family: &dyn Family, group: usize, point: &Point, steps: &[f64], noise: &Noise) -> Linear {
    let none = vec![0.0; noise.tau.len()];
    let here = predict(family, group, point, &none);
    let weight = weights(family, group);
    let measured = family.groups()[group]
        .channels
        .iter()
        .flat_map(|c| c.measured.iter().copied());
    let residual: Vec<f64> = measured.zip(&here).map(|(m, p)| m - p).collect();
    let moved = (0..steps.len()).map(|k| {
        let mut theta = point.theta.to_vec();
        theta[k] += steps[k];
        let there = Point {
            laws: point.laws,
            theta: &theta,
        };
        (predict(family, group, &there, &none), steps[k])
    });
    let jacobian = columns(family, group, noise, &weight, &here, moved);
    let shaken = (0..none.len()).map(|k| {
        let step = family.scatter()[k].step;
        let mut effects = none.clone();
        effects[k] = step;
        (predict(family, group, point, &effects), step)
    });
    let raw: Vec<(Vec<f64>, f64)> = shaken.collect();
    let slopes = raw
        .iter()
        .map(|(m, step)| m.iter().zip(&here).map(|(m, a)| (m - a) / step).collect())
        .collect();
    let effects = columns(family, group, noise, &weight, &here, raw.into_iter());
    let whitened = whitened(family, group, noise, &weight, &residual);
    let q = effects.len();
    let prior = DMatrix::from_diagonal(&DVector::from_iterator(q, noise.tau.iter().map(|t| t.powi(-2))));
    let chol = nalgebra::Cholesky::new(DMatrix::from_fn(q, q, |i, j| dot(&effects[i], &effects[j])) + prior);
    Linear {
        covariance: chol
            .as_ref()
            .map_or_else(|| DMatrix::zeros(q, q), nalgebra::Cholesky::inverse),
        log_precision: chol.map_or(0.0, |c| 2.0 * c.l().diagonal().iter().map(|x| x.ln()).sum::<f64>()),
        weight,
        residual,
        whitened,
        jacobian,
        effects,
        slopes,
    }
}

/// Everything that a group says at `point`; `steps` are the finite steps of the parameters.
pub fn group_state(family: &dyn Family, group: usize, point: &Point, steps: &[f64], noise: &Noise) -> GroupState {
    let Linear {
        weight,
        residual,
        whitened: r,
        jacobian,
        effects,
        slopes,
        covariance,
        log_precision,
    } = linear(family, group, point, steps, noise);
    let (p, q) = (jacobian.len(), effects.len());
    let zr = DVector::from_fn(q, |i, _| dot(&effects[i], &r));
    let zj = DMatrix::from_fn(q, p, |i, j| dot(&effects[i], &jacobian[j]));
    let square = dot(&r, &r) - zr.dot(&(&covariance * &zr));
    let gradient = DVector::from_fn(p, |i, _| dot(&jacobian[i], &r)) - zj.transpose() * (&covariance * &zr);
    let information =
        DMatrix::from_fn(p, p, |i, j| dot(&jacobian[i], &jacobian[j])) - zj.transpose() * &covariance * &zj;
    let log_det =
        log_det_of_noise(family, group, noise) + log_precision + noise.tau.iter().map(|t| 2.0 * t.ln()).sum::<f64>();
    let best = &covariance * &zr;
    let mut left: Vec<f64> = residual;
    for (k, slope) in slopes.iter().enumerate() {
        for (l, s) in left.iter_mut().zip(slope) {
            *l -= best[k] * s;
        }
    }
    for (l, w) in left.iter_mut().zip(&weight) {
        *l *= w;
    }
    let mut parts = Vec::new();
    for channel in &family.groups()[group].channels {
        let rest = left.split_off(channel.measured.len());
        parts.push(std::mem::replace(&mut left, rest));
    }
    let samples = r.len();
    GroupState {
        log_likelihood: -0.5 * (square + log_det + samples as f64 * std::f64::consts::TAU.ln()),
        gradient,
        information,
        square,
        log_det,
        samples,
        effects: best,
        effect_covariance: covariance,
        left: parts,
    }
}
