//! What the snapshots say of the parameters: a posterior by simulation, with what they do not fix left as wide as before.
//!
//! The likelihood ([`super::likelihood`]) knows the snapshots' noise and a share of the travel by which the simulation itself
//! may be off; that share is inferred too. Errors of the simulation are common to the trials of one tool and action, so that n of them
//! count as `n / (1 + (n - 1) rho)` (a coarsened likelihood, Miller and Dunson 2019). The posterior is sampled by
//! population Monte Carlo (Cappé et al. 2004) with the weights of the deterministic mixture (Owen and Zhou 2000).

use nalgebra::{Cholesky, Matrix4, Vector4};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::Config;
use super::bench::Bench;
use super::likelihood::{Level, SHARES, counts, level, log_sum};
use super::space::{DIMENSIONS, Scores, Space};
use crate::base::{Seed, rng_for};

/// Draws of a trial's unknown start at a point, at most.
const MOST_DRAWS: usize = 16;
/// Points that the weights must be worth; below that the likelihood is raised to a power below 1.
const WORTH: f64 = 40.0;
/// Times as many rounds as usual at most, where the data say so much that few points count.
const MORE: usize = 2;
/// Share of the travel by which a simulation is believed to be off before anything was measured.
const UNTOLD: f64 = 0.2;
/// Share of the proposals that go on coming from the prior, and widening of the others.
const FRESH: f64 = 0.15;
const WIDEN: f64 = 1.3;
/// Least share of a round's points that must count for the next proposal.
const TEMPER: f64 = 0.25;

/// Weighted points.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Standard normal scores under the prior.
    pub points: Vec<Scores>,
    /// They sum to 1.
    pub weights: Vec<f64>,
    /// Share of the travel by which the simulation is off: its posterior mean on the logarithmic scale.
    pub share: f64,
    /// Number of equally weighted points that the weights are worth.
    pub effective: f64,
    /// Logarithm of the mass (kg) at each point, with its variance, where recorded forces tell it.
    pub mass: Option<Vec<(f64, f64)>>,
    /// Power below 1 to which the likelihood was raised where the weights would have been worth too few points.
    pub power: f64,
}

/// One number with its spread, from weighted points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marginal {
    /// Median.
    pub median: f64,
    /// Standard deviation.
    pub sd: f64,
    /// Central 95 %.
    pub ci95: [f64; 2],
    /// Spread of the scores: 1 where nothing was learnt.
    pub contraction: f64,
}

impl Posterior {
    /// What is believed before any snapshot, as `count` points of a space-filling sequence.
    pub fn prior(count: usize) -> Self {
        Self {
            points: (0..count).map(|n| super::search::start_point(n, 0)).collect(),
            weights: vec![1.0 / count.max(1) as f64; count],
            share: UNTOLD,
            effective: count as f64,
            mass: None,
            power: 1.0,
        }
    }

    /// The marginal of parameter `k`.
    pub fn marginal(&self, space: &Space, k: usize) -> Marginal {
        let value = |p: &Scores| space.priors[k].value(p[k]);
        let mean = self.mean(|p| p[k]);
        let spread = self.mean(|p| (p[k] - mean).powi(2)).sqrt();
        let middle = self.mean(value);
        let sd = self.mean(|p| (value(p) - middle).powi(2)).sqrt();
        // Kernel width of the effective number of points: quantiles of few points are too narrow.
        let width = spread * self.effective.max(2.0).powf(-1.0 / 5.0);
        let of = |share: f64| space.priors[k].value(self.quantile(k, share, width));
        Marginal {
            median: of(0.5),
            sd,
            ci95: [of(0.025), of(0.975)],
            contraction: spread,
        }
    }

    /// Mean and variance of the logarithm of the mass, where recorded forces tell it.
    pub fn log_mass(&self) -> Option<(f64, f64)> {
        let masses = self.mass.as_ref()?;
        let each = || masses.iter().zip(&self.weights);
        let mean: f64 = each().map(|(m, w)| w * m.0).sum();
        Some((mean, each().map(|(m, w)| w * (m.1 + (m.0 - mean).powi(2))).sum()))
    }

    /// The weighted mean of a function of the points.
    pub fn mean(&self, of: impl Fn(&Scores) -> f64) -> f64 {
        self.points.iter().zip(&self.weights).map(|(p, w)| w * of(p)).sum()
    }

    /// Quantile of the scores of parameter `k`, each point a bell of `width`.
    fn quantile(&self, k: usize, share: f64, width: f64) -> f64 {
        use statrs::distribution::{ContinuousCDF, Normal};
        let normal = Normal::standard();
        let below = |x: f64| -> f64 {
            let each = self.points.iter().zip(&self.weights);
            each.map(|(p, w)| w * normal.cdf((x - p[k]) / width.max(1e-9))).sum()
        };
        let (mut low, mut high) = (-8.0, 8.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if below(middle) < share {
                low = middle
            } else {
                high = middle
            }
        }
        0.5 * (low + high)
    }

    /// Points drawn by their weights (systematic resampling).
    pub fn draw(&self, count: usize) -> Vec<Scores> {
        let mut out = Vec::with_capacity(count);
        let (mut at, mut sum) = (0, self.weights.first().copied().unwrap_or(0.0));
        for i in 0..count {
            let share = (i as f64 + 0.5) / count as f64;
            while sum < share && at + 1 < self.points.len() {
                at += 1;
                sum += self.weights[at];
            }
            out.extend(self.points.get(at));
        }
        out
    }
}

/// A normal distribution of scores that proposals come from.
struct Kernel {
    middle: Vector4<f64>,
    factor: Cholesky<f64, nalgebra::Const<4>>,
}

impl Kernel {
    fn log_density(&self, at: &Scores) -> f64 {
        let apart = Vector4::from(*at) - self.middle;
        let standard = self
            .factor
            .l()
            .solve_lower_triangular(&apart)
            .unwrap_or_else(|| Vector4::repeat(1e6));
        let log_det: f64 = self.factor.l().diagonal().iter().map(|x| x.ln()).sum();
        -0.5 * standard.norm_squared() - log_det - 2.0 * std::f64::consts::TAU.ln()
    }

    fn draw(&self, rng: &mut impl Rng) -> Scores {
        let z = Vector4::from_fn(|_, _| StandardNormal.sample(rng));
        (self.middle + self.factor.l() * z).into()
    }
}

fn log_prior(at: &Scores) -> f64 {
    -0.5 * at.iter().map(|x| x * x).sum::<f64>() - 0.5 * DIMENSIONS as f64 * std::f64::consts::TAU.ln()
}

/// Samples the posterior. `guesses` are points where the first proposals are put besides the prior, such as the
/// optimiser's; the fitted trials of `bench` alone are looked at.
pub fn posterior(bench: &Bench, space: &Space, config: &Config, guesses: &[Scores], seed: Seed) -> Option<Posterior> {
    let fitted = bench.fitted();
    if fitted.is_empty() {
        return None;
    }
    let draws = draws_of(fitted.len(), config);
    let mut rng = rng_for(seed, &format!("snapshots/posterior/{}", bench.name));
    let mut points: Vec<Scores> = Vec::new();
    let mut levels: Vec<Level> = Vec::new();
    let counts = counts(bench, &fitted, config.shared_error);
    let mut rounds: Vec<(usize, Vec<Kernel>)> = Vec::new();
    for round in 0..MORE * config.rounds {
        if round >= config.rounds && weigh(points.clone(), &levels, &rounds).power >= 1.0 {
            break;
        }
        let kernels = if round == 0 {
            about(guesses)
        } else {
            proposal(&points, &levels, &rounds)
        };
        let count = if round == 0 { 2 * config.points } else { config.points };
        let new: Vec<Scores> = (0..count).map(|i| one_of(&kernels, i, &mut rng)).collect();
        rounds.push((count, kernels));
        let coefficients: Vec<_> = new.iter().map(|p| space.coefficients(p)).collect();
        let found = bench.outcomes(&fitted, &coefficients, draws, seed, 0);
        levels.extend(found.iter().map(|by_trial| level(bench, &fitted, by_trial, &counts)));
        points.extend(new);
    }
    Some(weigh(points, &levels, &rounds))
}

/// Draws of the unknown start of each of so many fitted trials at a point.
pub(super) fn draws_of(trials: usize, config: &Config) -> usize {
    (config.simulations / trials.max(1)).clamp(4, MOST_DRAWS)
}

fn one_of(kernels: &[Kernel], number: usize, rng: &mut impl Rng) -> Scores {
    let fresh = kernels.is_empty() || rng.random_range(0.0..1.0) < FRESH;
    if fresh {
        return std::array::from_fn(|_| StandardNormal.sample(rng));
    }
    kernels[number % kernels.len()].draw(rng)
}

/// Wide kernels about the guesses, for the first round; they leave half of the points to the prior.
fn about(guesses: &[Scores]) -> Vec<Kernel> {
    let wide = Matrix4::identity() * 0.36;
    guesses.iter().filter_map(|g| kernel(Vector4::from(*g), wide)).collect()
}

fn kernel(middle: Vector4<f64>, covariance: Matrix4<f64>) -> Option<Kernel> {
    let factor = Cholesky::new(covariance + Matrix4::identity() * 1e-6)?;
    Some(Kernel { middle, factor })
}

/// Kernels about points drawn by tempered weights, as wide as those points spread.
fn proposal(points: &[Scores], levels: &[Level], rounds: &[(usize, Vec<Kernel>)]) -> Vec<Kernel> {
    let found = weigh_at_least(points.to_vec(), levels, rounds, TEMPER * points.len() as f64 / 2.0);
    let mean = (0..points.len())
        .map(|i| Vector4::from(points[i]) * found.weights[i])
        .sum::<Vector4<f64>>();
    let spread: Matrix4<f64> = (0..points.len())
        .map(|i| {
            let d = Vector4::from(points[i]) - mean;
            d * d.transpose() * found.weights[i]
        })
        .sum();
    // Silverman's width for the kernels of a mixture in four dimensions.
    let shrink = found.effective.max(4.0).powf(-1.0 / 8.0) * WIDEN;
    let narrow = spread * shrink * shrink;
    let mut kernels: Vec<Kernel> = found
        .draw(24)
        .iter()
        .filter_map(|p| kernel(Vector4::from(*p), narrow * 0.5))
        .collect();
    kernels.extend(kernel(mean, spread * WIDEN));
    kernels
}

/// Log weights by the deterministic mixture of all rounds' proposals, without the likelihood.
fn log_base(points: &[Scores], rounds: &[(usize, Vec<Kernel>)]) -> Vec<f64> {
    let total: usize = rounds.iter().map(|r| r.0).sum();
    let density = |at: &Scores| {
        let each = rounds.iter().map(|(count, kernels)| {
            let share = (*count as f64 / total as f64).ln();
            if kernels.is_empty() {
                return share + log_prior(at);
            }
            let mixed = log_sum(
                kernels
                    .iter()
                    .map(|k| k.log_density(at))
                    .collect::<Vec<_>>()
                    .into_iter(),
            ) - (kernels.len() as f64).ln();
            share + log_sum([FRESH.ln() + log_prior(at), (1.0 - FRESH).ln() + mixed].into_iter())
        });
        log_sum(each.collect::<Vec<_>>().into_iter())
    };
    points.iter().map(|p| log_prior(p) - density(p)).collect()
}

fn weigh(points: Vec<Scores>, levels: &[Level], rounds: &[(usize, Vec<Kernel>)]) -> Posterior {
    weigh_at_least(points, levels, rounds, WORTH)
}

/// The weights; where they would be worth fewer than `least` points, those of a likelihood raised to a power below 1.
fn weigh_at_least(points: Vec<Scores>, levels: &[Level], rounds: &[(usize, Vec<Kernel>)], least: f64) -> Posterior {
    let base = log_base(&points, rounds);
    let at_power = |power: f64| {
        let logs: Vec<f64> = base
            .iter()
            .zip(levels)
            .map(|(b, l)| b + log_sum(l.log.iter().map(|v| power * v)))
            .collect();
        let total = log_sum(logs.iter().copied());
        let weights: Vec<f64> = logs.iter().map(|l| (l - total).exp()).collect();
        let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        (weights, effective)
    };
    let mut power = 1.0;
    let (mut weights, mut effective) = at_power(power);
    if effective < least {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..30 {
            power = 0.5 * (low + high);
            (weights, effective) = at_power(power);
            if effective < least { high = power } else { low = power }
        }
    }
    let share = share_of(levels, &weights, power);
    let mass = levels.iter().map(|l| mass_at(l, power)).collect();
    Posterior {
        points,
        weights,
        share,
        effective,
        mass,
        power,
    }
}

/// The logarithm of the mass at a point over the shares of error: mean and variance.
fn mass_at(level: &Level, power: f64) -> Option<(f64, f64)> {
    let masses = level.mass?;
    let total = log_sum(level.log.iter().map(|v| power * v));
    let odds = level.log.map(|v| (power * v - total).exp());
    let mean: f64 = odds.iter().zip(masses).map(|(o, m)| o * m.0).sum();
    let each = odds.iter().zip(masses);
    Some((mean, each.map(|(o, m)| o * (m.1 + (m.0 - mean).powi(2))).sum()))
}

/// The geometric posterior mean of the share of model error.
fn share_of(levels: &[Level], weights: &[f64], power: f64) -> f64 {
    let mut mean = 0.0;
    for (level, weight) in levels.iter().zip(weights) {
        let total = log_sum(level.log.iter().map(|v| power * v));
        mean += weight
            * level
                .log
                .iter()
                .zip(SHARES)
                .map(|(v, s)| (power * v - total).exp() * s.ln())
                .sum::<f64>();
    }
    mean.exp()
}
