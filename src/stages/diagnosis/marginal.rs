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

/// A group's model about a point of the parameters, to first order, SI: what does not depend on the noise.
#[derive(Clone, Debug)]
pub struct Tangent {
    group: usize,
    /// Predicted without random effects.
    here: Vec<f64>,
    /// Measured less predicted.
    residual: Vec<f64>,
    /// Weights of the samples.
    pub weight: Vec<f64>,
    /// Slopes by the random effects, and by the parameters.
    effects: Vec<Vec<f64>>,
    parameters: Vec<Vec<f64>>,
}

fn slope(moved: &[f64], here: &[f64], step: f64) -> Vec<f64> {
    moved.iter().zip(here).map(|(m, a)| (m - a) / step).collect()
}

impl Tangent {
    /// Without the slopes by the parameters, which the likelihood does not need.
    pub fn flat(family: &dyn Family, group: usize, point: &Point) -> Self {
        let none = vec![0.0; family.scatter().len()];
        let here = predict(family, group, point, &none);
        let measured = family.groups()[group]
            .channels
            .iter()
            .flat_map(|c| c.measured.iter().copied());
        let residual = measured.zip(&here).map(|(m, p)| m - p).collect();
        let shaken = |k: usize| {
            let step = family.scatter()[k].step;
            let mut effects = none.clone();
            effects[k] = step;
            slope(&predict(family, group, point, &effects), &here, step)
        };
        Self {
            effects: (0..none.len()).map(shaken).collect(),
            weight: weights(family, group),
            parameters: Vec::new(),
            group,
            here,
            residual,
        }
    }

    /// With the slopes by the parameters; `steps` are their finite steps.
    pub fn sloped(mut self, family: &dyn Family, point: &Point, steps: &[f64]) -> Self {
        let moved = |k: usize| {
            let mut theta = point.theta.to_vec();
            theta[k] += steps[k];
            let there = Point {
                laws: point.laws,
                theta: &theta,
            };
            let none = vec![0.0; self.effects.len()];
            slope(&predict(family, self.group, &there, &none), &self.here, steps[k])
        };
        self.parameters = (0..steps.len()).map(moved).collect();
        self
    }

    fn whitened(&self, family: &dyn Family, noise: &Noise, columns: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let one = |c: &Vec<f64>| whitened(family, self.group, noise, &self.weight, c);
        columns.iter().map(one).collect()
    }

    /// In units of the noise and freed of its correlation.
    pub fn linear(&self, family: &dyn Family, noise: &Noise) -> Linear {
        let effects = self.whitened(family, noise, &self.effects);
        let whitened = whitened(family, self.group, noise, &self.weight, &self.residual);
        let q = effects.len();
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(q, noise.tau.iter().map(|t| t.powi(-2))));
        let chol = nalgebra::Cholesky::new(DMatrix::from_fn(q, q, |i, j| dot(&effects[i], &effects[j])) + prior);
        Linear {
            covariance: chol
                .as_ref()
                .map_or_else(|| DMatrix::zeros(q, q), nalgebra::Cholesky::inverse),
            log_precision: chol.map_or(0.0, |c| 2.0 * c.l().diagonal().iter().map(|x| x.ln()).sum::<f64>()),
            whitened,
            jacobian: self.whitened(family, noise, &self.parameters),
            effects,
        }
    }

    /// Everything that the group says here at these levels of noise.
    pub fn state(&self, family: &dyn Family, noise: &Noise) -> GroupState {
        let linear = self.linear(family, noise);
        let Linear {
            whitened: r,
            jacobian,
            effects,
            covariance,
            log_precision,
        } = &linear;
        let (p, q) = (jacobian.len(), effects.len());
        let zr = DVector::from_fn(q, |i, _| dot(&effects[i], r));
        let zj = DMatrix::from_fn(q, p, |i, j| dot(&effects[i], &jacobian[j]));
        let best = covariance * &zr;
        let square = dot(r, r) - zr.dot(&best);
        let through = zj.transpose() * covariance;
        let scatter = noise.tau.iter().map(|t| 2.0 * t.ln()).sum::<f64>();
        let log_det = log_det_of_noise(family, self.group, noise) + log_precision + scatter;
        let mut direct = DMatrix::zeros(p, p);
        for i in 0..p {
            for j in i..p {
                direct[(i, j)] = dot(&jacobian[i], &jacobian[j]);
                direct[(j, i)] = direct[(i, j)];
            }
        }
        GroupState {
            log_likelihood: -0.5 * (square + log_det + r.len() as f64 * std::f64::consts::TAU.ln()),
            gradient: DVector::from_fn(p, |i, _| dot(&jacobian[i], r)) - zj.transpose() * &best,
            information: direct - &through * &zj,
            square,
            log_det,
            samples: r.len(),
            left: self.left(family, &best),
            effects: best,
            effect_covariance: linear.covariance,
        }
    }

    /// Weighted residuals without these random effects, by channel.
    fn left(&self, family: &dyn Family, effects: &DVector<f64>) -> Vec<Vec<f64>> {
        let mut left = self.residual.clone();
        for (k, slope) in self.effects.iter().enumerate() {
            for (l, s) in left.iter_mut().zip(slope) {
                *l -= effects[k] * s;
            }
        }
        for (l, w) in left.iter_mut().zip(&self.weight) {
            *l *= w;
        }
        let mut parts = Vec::new();
        for channel in &family.groups()[self.group].channels {
            let rest = left.split_off(channel.measured.len());
            parts.push(std::mem::replace(&mut left, rest));
        }
        parts
    }
}

/// A group's model in units of the noise and freed of its correlation.
pub struct Linear {
    /// Measured less predicted.
    pub whitened: Vec<f64>,
    /// Columns of the parameters, and of the random effects.
    pub jacobian: Vec<Vec<f64>>,
    pub effects: Vec<Vec<f64>>,
    /// Covariance of the random effects, and the log-determinant of its inverse.
    covariance: DMatrix<f64>,
    log_precision: f64,
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

/// Everything that a group says at `point`; `steps` are the finite steps of the parameters.
pub fn group_state(family: &dyn Family, group: usize, point: &Point, steps: &[f64], noise: &Noise) -> GroupState {
    let tangent = Tangent::flat(family, group, point).sloped(family, point, steps);
    tangent.state(family, noise)
}
