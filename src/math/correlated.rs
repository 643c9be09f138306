//! Means and standard errors of samples that remember their past.

use rand::Rng;

use super::chi_squared_tail;

/// A mean with the standard error that its own correlation leaves it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanEstimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub sd: f64,
    /// How many independent samples it is worth.
    pub effective: f64,
}

fn finite_mean(samples: &[f64]) -> (f64, usize) {
    let (sum, n) = samples
        .iter()
        .filter(|x| x.is_finite())
        .fold((0.0, 0), |(s, n), x| (s + x, n + 1));
    (sum / f64::max(n as f64, 1.0), n)
}

/// Autocorrelation at `lag`; pairs with a missing sample are left out.
pub fn autocorrelation(samples: &[f64], lag: usize) -> f64 {
    let (mean, n) = finite_mean(samples);
    if n < 3 || lag >= samples.len() {
        return 0.0;
    }
    let variance: f64 = samples
        .iter()
        .filter(|x| x.is_finite())
        .map(|x| (x - mean).powi(2))
        .sum::<f64>();
    let covariance: f64 = samples
        .iter()
        .zip(&samples[lag..])
        .map(|(a, b)| (a - mean) * (b - mean))
        .filter(|p| p.is_finite())
        .sum();
    if variance > 0.0 { covariance / variance } else { 0.0 }
}

/// How many independent samples a correlated series is worth: `n / (1 + 2 Σ ρ_k)`, the sum cut where the
/// autocorrelation first falls below zero (Geyer's initial positive sequence).
pub fn effective_samples(samples: &[f64]) -> f64 {
    let n = samples.iter().filter(|x| x.is_finite()).count();
    let mut sum = 0.0;
    for lag in 1..samples.len() / 2 {
        let rho = autocorrelation(samples, lag);
        if rho <= 0.05 {
            break;
        }
        sum += rho;
    }
    (n as f64 / (1.0 + 2.0 * sum)).max(1.0)
}

/// Mean of a correlated series with its standard error; `None` where there is no finite sample.
pub fn correlated_mean(samples: &[f64]) -> Option<MeanEstimate> {
    let (mean, n) = finite_mean(samples);
    if n == 0 {
        return None;
    }
    let variance = samples
        .iter()
        .filter(|x| x.is_finite())
        .map(|x| (x - mean).powi(2))
        .sum::<f64>()
        / (n.max(2) - 1) as f64;
    let effective = effective_samples(samples);
    Some(MeanEstimate {
        mean,
        sd: (variance / effective).sqrt(),
        effective,
    })
}

/// Standard error of the mean from the scatter of `batches` consecutive batch means.
pub fn batch_means_sd(samples: &[f64], batches: usize) -> Option<f64> {
    let size = samples.len() / batches.max(2);
    if size == 0 {
        return None;
    }
    let means: Vec<f64> = samples.chunks_exact(size).map(|c| finite_mean(c).0).collect();
    let (mean, n) = finite_mean(&means);
    let variance = means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    Some((variance / n as f64).sqrt())
}

/// Standard error of `statistic` by the moving-block bootstrap with blocks of `block` samples.
pub fn block_bootstrap_sd(
    samples: &[f64],
    block: usize,
    rounds: usize,
    dice: &mut impl Rng,
    statistic: impl Fn(&[f64]) -> f64,
) -> Option<f64> {
    let block = block.clamp(1, samples.len().max(1));
    if samples.is_empty() || rounds < 2 {
        return None;
    }
    let mut found = Vec::with_capacity(rounds);
    for _ in 0..rounds {
        let mut drawn = Vec::with_capacity(samples.len() + block);
        while drawn.len() < samples.len() {
            let from = dice.random_range(0..=samples.len() - block);
            drawn.extend_from_slice(&samples[from..from + block]);
        }
        drawn.truncate(samples.len());
        found.push(statistic(&drawn));
    }
    let mean = finite_mean(&found).0;
    Some((found.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (rounds - 1) as f64).sqrt())
}

/// Ljung-Box test of whiteness over `lags` lags: the statistic and the probability of one as large by chance.
/// `fitted` is the number of parameters that were fitted to the series.
pub fn ljung_box(residuals: &[f64], lags: usize, fitted: usize) -> (f64, f64) {
    let n = residuals.iter().filter(|x| x.is_finite()).count() as f64;
    let statistic = (1..=lags)
        .map(|k| autocorrelation(residuals, k).powi(2) / (n - k as f64).max(1.0))
        .sum::<f64>()
        * n
        * (n + 2.0);
    let degrees = lags.saturating_sub(fitted).max(1) as f64;
    (statistic, chi_squared_tail(statistic, degrees))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn ar1(rho: f64, n: usize, seed: u64) -> Vec<f64> {
        let mut dice = ChaCha8Rng::seed_from_u64(seed);
        let mut x = 0.0;
        (0..n)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut dice);
                x = rho * x + (1.0 - rho * rho).sqrt() * e;
                x
            })
            .collect()
    }

    #[test]
    fn the_standard_error_of_a_correlated_mean_holds_the_truth_at_its_rate() {
        let mut inside = 0;
        for seed in 0..200 {
            let found = correlated_mean(&ar1(0.8, 600, seed)).expect("samples");
            inside += usize::from(found.mean.abs() < 1.96 * found.sd);
        }
        assert!((175..=200).contains(&inside), "{inside} of 200");
    }

    #[test]
    fn batches_and_blocks_agree_with_theory() {
        let samples = ar1(0.5, 4000, 1);
        let theory = (3.0_f64 / 4000.0).sqrt();
        let batches = batch_means_sd(&samples, 40).expect("enough");
        let mut dice = ChaCha8Rng::seed_from_u64(2);
        let blocks = block_bootstrap_sd(&samples, 40, 200, &mut dice, |s| s.iter().sum::<f64>() / s.len() as f64);
        assert!((batches / theory - 1.0).abs() < 0.35);
        assert!((blocks.expect("enough") / theory - 1.0).abs() < 0.35);
    }

    #[test]
    fn whiteness_is_told_from_memory() {
        assert!(ljung_box(&ar1(0.0, 500, 3), 20, 0).1 > 0.01);
        assert!(ljung_box(&ar1(0.5, 500, 3), 20, 0).1 < 1e-6);
    }
}
