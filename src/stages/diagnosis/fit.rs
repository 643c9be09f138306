//! A penalised Gauss-Newton fit of the marginal likelihood over all interactions, the noise learnt on the way.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::family::{Family, Parameter};
use super::marginal::{GroupState, Noise, Point, Tangent};

/// A model that was fitted.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The laws that are on.
    pub laws: Vec<usize>,
    /// Base parameters, then those of each law.
    pub theta: Vec<f64>,
    pub noise: Noise,
    /// Marginal log-likelihood less the penalty of the prior.
    pub objective: f64,
    /// Laplace approximation of the log evidence.
    pub log_evidence: f64,
    /// Posterior covariance of the parameters.
    pub covariance: DMatrix<f64>,
    /// By interaction, in the order of the groups that were fitted.
    pub states: Vec<GroupState>,
    /// The groups that were fitted.
    pub groups: Vec<usize>,
}

/// The parameters of the base and of these laws.
pub fn parameters(family: &dyn Family, laws: &[usize]) -> Vec<Parameter> {
    let own = laws.iter().flat_map(|l| family.laws()[*l].parameters.iter().cloned());
    family.base().iter().cloned().chain(own).collect()
}

const ROUNDS: usize = 25;
/// Log-likelihood, nats, below which a step gains nothing; of a first look.
const ENOUGH: f64 = 0.02;
const ROUGHLY: f64 = 0.3;

struct Problem<'a> {
    family: &'a dyn Family,
    laws: &'a [usize],
    groups: &'a [usize],
    priors: Vec<Parameter>,
    steps: Vec<f64>,
}

impl Problem<'_> {
    fn flat(&self, theta: &[f64]) -> Vec<Tangent> {
        let point = Point { laws: self.laws, theta };
        let one = |g: &usize| Tangent::flat(self.family, *g, &point);
        self.groups.par_iter().map(one).collect()
    }

    fn sloped(&self, flat: Vec<Tangent>, theta: &[f64]) -> Vec<Tangent> {
        let point = Point { laws: self.laws, theta };
        let one = |t: Tangent| t.sloped(self.family, &point, &self.steps);
        flat.into_par_iter().map(one).collect()
    }

    fn states(&self, tangents: &[Tangent], noise: &Noise) -> Vec<GroupState> {
        let one = |t: &Tangent| t.state(self.family, noise);
        tangents.par_iter().map(one).collect()
    }

    fn penalty(&self, theta: &[f64]) -> f64 {
        let each = theta
            .iter()
            .zip(&self.priors)
            .map(|(t, p)| ((t - p.centre) / p.sd).powi(2));
        0.5 * each.sum::<f64>()
    }

    fn clamp(&self, theta: &mut [f64]) {
        for (t, p) in theta.iter_mut().zip(&self.priors) {
            *t = t.clamp(p.low, p.high);
        }
    }

    /// Information with the prior, and the gradient of the objective.
    fn normal(&self, theta: &[f64], states: &[GroupState]) -> (DMatrix<f64>, DVector<f64>) {
        let p = self.priors.len();
        let mut h = DMatrix::zeros(p, p);
        let mut b = DVector::zeros(p);
        for s in states {
            h += &s.information;
            b += &s.gradient;
        }
        for (k, prior) in self.priors.iter().enumerate() {
            h[(k, k)] += prior.sd.powi(-2);
            b[k] -= (theta[k] - prior.centre) / prior.sd.powi(2);
        }
        (h, b)
    }

    /// Newton step with parameters that press against a bound left out.
    fn step(&self, theta: &[f64], h: &DMatrix<f64>, b: &DVector<f64>, damping: f64) -> DVector<f64> {
        let p = theta.len();
        let stuck = |k: usize| {
            let prior = &self.priors[k];
            (theta[k] <= prior.low && b[k] < 0.0) || (theta[k] >= prior.high && b[k] > 0.0)
        };
        let free: Vec<usize> = (0..p).filter(|k| !stuck(*k)).collect();
        let n = free.len();
        let a = DMatrix::from_fn(n, n, |i, j| {
            h[(free[i], free[j])] * if i == j { 1.0 + damping } else { 1.0 }
        });
        let g = DVector::from_fn(n, |i, _| b[free[i]]);
        let mut step = DVector::zeros(p);
        if let Some(solved) = Cholesky::new(a).map(|c| c.solve(&g)) {
            for (i, k) in free.iter().enumerate() {
                step[*k] = solved[i].clamp(-3.0 * self.priors[*k].sd, 3.0 * self.priors[*k].sd);
            }
        }
        step
    }
}

/// Fits base and laws together from `start`.
pub fn fit(family: &dyn Family, laws: &[usize], start: &[f64], noise: &Noise, groups: &[usize]) -> Fit {
    climbed(family, laws, start, (noise, true, ENOUGH), groups)
}

/// The same to a few tenths of a nat: enough to tell which of several starts is worth going on from.
pub fn roughly(family: &dyn Family, laws: &[usize], start: &[f64], noise: &Noise, groups: &[usize]) -> Fit {
    climbed(family, laws, start, (noise, true, ROUGHLY), groups)
}

/// Fits base and laws together from `start` with the noise as it is.
pub fn fit_at(family: &dyn Family, laws: &[usize], start: &[f64], noise: &Noise, groups: &[usize]) -> Fit {
    climbed(family, laws, start, (noise, false, ENOUGH), groups)
}

fn climbed(
    family: &dyn Family,
    laws: &[usize],
    start: &[f64],
    (noise, learns, enough): (&Noise, bool, f64),
    groups: &[usize],
) -> Fit {
    let priors = parameters(family, laws);
    let steps = priors.iter().map(|p| 1e-4 * p.sd).collect();
    let problem = Problem {
        family,
        laws,
        groups,
        priors,
        steps,
    };
    let mut theta = start.to_vec();
    problem.clamp(&mut theta);
    let mut noise = noise.clone();
    let mut tangents = problem.sloped(problem.flat(&theta), &theta);
    let mut states = problem.states(&tangents, &noise);
    let objective = |states: &[GroupState], theta: &[f64], noise: &Noise| {
        states.iter().map(|s| s.log_likelihood).sum::<f64>() - problem.penalty(theta) + scatter_prior(family, noise)
    };
    let mut best = objective(&states, &theta, &noise);
    let mut damping = 1e-3;
    for _ in 0..ROUNDS {
        let (h, b) = problem.normal(&theta, &states);
        let mut gained = 0.0;
        for _ in 0..5 {
            let step = problem.step(&theta, &h, &b, damping);
            let mut tried: Vec<f64> = theta.iter().zip(step.iter()).map(|(t, s)| t + s).collect();
            problem.clamp(&mut tried);
            let flat = problem.flat(&tried);
            let value = objective(&problem.states(&flat, &noise), &tried, &noise);
            if value > best {
                gained = value - best;
                tangents = problem.sloped(flat, &tried);
                states = problem.states(&tangents, &noise);
                (theta, best) = (tried, value);
                damping = (damping * 0.3).max(1e-6);
                break;
            }
            damping = (damping * 8.0).min(1e6);
        }
        // Steps of expectation and maximisation raise the likelihood of the samples as they are, which the weights by
        // the signal's change are not quite: where all levels together do not, one kind of them may.
        let learnt = learns.then(|| learn(family, groups, &noise, &states));
        let levels = learnt
            .iter()
            .flat_map(|l| std::iter::once(l.clone()).chain(noise.one_by_one(l)));
        for tried in levels.collect::<Vec<_>>() {
            let there = problem.states(&tangents, &tried);
            let value = objective(&there, &theta, &tried);
            if value > best {
                gained += value - best;
                (noise, states, best) = (tried, there, value);
                break;
            }
        }
        if gained < enough {
            break;
        }
    }
    finish(&problem, theta, noise, states, best)
}

/// Log density, up to a constant, of what is known of the scatter between interactions: inverse gamma.
fn scatter_prior(family: &dyn Family, noise: &Noise) -> f64 {
    let each = family
        .scatter()
        .iter()
        .zip(&noise.tau)
        .map(|(s, tau)| -0.5 * s.counts * (2.0 * (tau / s.tau).ln() + (s.tau / tau).powi(2)));
    each.sum()
}

fn finish(problem: &Problem, theta: Vec<f64>, noise: Noise, states: Vec<GroupState>, objective: f64) -> Fit {
    let (h, _) = problem.normal(&theta, &states);
    let chol = Cholesky::new(h.clone());
    let log_det = chol
        .as_ref()
        .map_or(0.0, |c| 2.0 * c.l().diagonal().iter().map(|x| x.ln()).sum::<f64>());
    let volume: f64 = problem.priors.iter().map(Parameter::log_prior_volume).sum();
    Fit {
        laws: problem.laws.to_vec(),
        theta,
        noise,
        objective,
        log_evidence: objective - volume - 0.5 * log_det,
        covariance: chol.map_or_else(|| DMatrix::zeros(h.nrows(), h.nrows()), |c| c.inverse()),
        states,
        groups: problem.groups.to_vec(),
    }
}

/// One step of expectation and maximisation for the levels of noise.
fn learn(family: &dyn Family, groups: &[usize], noise: &Noise, states: &[GroupState]) -> Noise {
    let mut out = noise.clone();
    for (k, scatter) in family.scatter().iter().enumerate() {
        let each = states
            .iter()
            .map(|s| s.effects[k].powi(2) + s.effect_covariance[(k, k)]);
        let mean = (each.sum::<f64>() + scatter.counts * scatter.tau.powi(2)) / (states.len() as f64 + scatter.counts);
        out.tau[k] = mean.sqrt().max(scatter.floor);
    }
    for (kind, known) in family.kinds().iter().enumerate() {
        let (mut square, mut lagged, mut count) = (0.0, 0.0, 0.0);
        for (group, state) in groups.iter().zip(states) {
            let channels = family.groups()[*group].channels.iter().zip(&state.left);
            for (channel, left) in channels.filter(|(c, _)| c.kind == kind) {
                square += left.iter().map(|e| e * e).sum::<f64>();
                count += left.len() as f64;
                let pairs = (1..left.len()).filter(|i| !channel.starts[*i]);
                lagged += pairs.map(|i| left[i] * left[i - 1]).sum::<f64>();
            }
        }
        if count > 10.0 {
            out.sigma[kind] = (square / count).sqrt().max(0.85 * known.sigma);
            out.rho[kind] = (lagged / square.max(1e-300)).clamp(0.0, 0.97);
        }
    }
    out
}
