//! One number from repeated trials that scatter more than each one's own noise says.

use super::{median, mixture_quantile, t_quantile};

/// The mean over trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pooled {
    /// The mean.
    pub mean: f64,
    /// Its standard error, with the scatter between trials.
    pub sd: f64,
    /// Standard deviation between trials beyond their own noise.
    pub between: f64,
    /// Half the width of the 95 % interval; wider than 1.96 sd where trials are few.
    pub half95: f64,
}

/// Standard errors, in units of their median, from which on a trial says nothing of the scatter.
const VAGUE: f64 = 6.0;
/// How many trials the prior scatter counts for.
const PRIOR_TRIALS: f64 = 2.0;

/// Mean of `values` with own standard errors `sds` by the random-effects model; the scatter between trials
/// follows from the data and `prior_between`, what is known of it before (counted as two trials), so that
/// one trial alone is not taken as exact. `None` where there is no finite value.
///
/// Moment estimator of DerSimonian and Laird (1986), interval after Hartung and Knapp (2001).
pub fn random_effects(values: &[f64], sds: &[f64], prior_between: f64) -> Option<Pooled> {
    let trials = finite(values, sds)?;
    // A trial that tells next to nothing must not hide how the others scatter.
    let sds: Vec<f64> = trials.iter().map(|t| t.1).collect();
    let most = VAGUE * median(&sds)?;
    let telling: Vec<&(f64, f64)> = trials.iter().filter(|t| t.1 <= most).collect();
    let n = telling.len() as f64;
    // Equal weights keep one over-confident trial from carrying the first pass.
    let plain = telling.iter().map(|(v, _)| v).sum::<f64>() / n;
    let scatter = telling.iter().map(|(v, _)| (v - plain).powi(2)).sum::<f64>();
    let own = telling.iter().map(|(_, s)| s * s).sum::<f64>() / n;
    let excess = (scatter - (n - 1.0) * own).max(0.0);
    let between = ((excess + PRIOR_TRIALS * prior_between.powi(2)) / (n - 1.0 + PRIOR_TRIALS)).sqrt();
    let (mean, sd, _) = weighed(&trials, between);
    let half95 = t_quantile(0.975, n - 1.0 + PRIOR_TRIALS) * sd;
    Some(Pooled {
        mean,
        sd,
        between,
        half95,
    })
}

/// The mean over trials, the scatter between them integrated out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marginal {
    /// The mean.
    pub mean: f64,
    /// Standard deviation of what is believed of it.
    pub sd: f64,
    /// Its 95 % interval: quantiles of what is believed, which need not be normal.
    pub ci95: [f64; 2],
}

/// The same model with the scatter between trials integrated out, which is believed beforehand to be `expected`, give or take
/// the factor `exp(log_sd)` (1 sd): a single trial has the tails that this gives it, and many tell their own scatter.
pub fn random_effects_marginal(values: &[f64], sds: &[f64], expected: f64, log_sd: f64) -> Option<Marginal> {
    let trials = finite(values, sds)?;
    let nodes = scatters(expected, log_sd).map(|(between, log_prior)| {
        let (mean, sd, log_likelihood) = weighed(&trials, between);
        (log_prior + log_likelihood, mean, sd)
    });
    let parts = normalised(nodes.to_vec());
    let mean = parts.iter().map(|p| p.0 * p.1).sum::<f64>();
    let variance = parts
        .iter()
        .map(|p| p.0 * (p.2 * p.2 + (p.1 - mean).powi(2)))
        .sum::<f64>();
    let ci95 = [0.025, 0.975].map(|p| mixture_quantile(&parts, p, f64::INFINITY));
    Some(Marginal {
        mean,
        sd: variance.sqrt(),
        ci95,
    })
}

/// Values of a scatter with the logarithms of what is believed of each beforehand, evenly in its logarithm: a normal belief, but
/// for a scatter ten times as large as expected, which real things may have, it falls off exponentially only.
pub fn scatters(expected: f64, log_sd: f64) -> [(f64, f64); 22] {
    std::array::from_fn(|i| {
        let z = (i as f64 - 6.0) * 0.4;
        let log = if z > TAIL {
            -TAIL * (z - 0.5 * TAIL)
        } else {
            -0.5 * z * z
        };
        (expected * (log_sd * z).exp(), log)
    })
}

/// Standard deviations of its logarithm from which on a large scatter is believed in more than a normal law would.
const TAIL: f64 = 2.0;

/// Logarithms of weights as weights that sum to one.
pub fn normalised(mut parts: Vec<(f64, f64, f64)>) -> Vec<(f64, f64, f64)> {
    let most = parts.iter().map(|p| p.0).fold(f64::NEG_INFINITY, f64::max);
    parts.iter_mut().for_each(|p| p.0 = (p.0 - most).exp());
    let total: f64 = parts.iter().map(|p| p.0).sum();
    parts.iter_mut().for_each(|p| p.0 /= total);
    parts
}

fn finite(values: &[f64], sds: &[f64]) -> Option<Vec<(f64, f64)>> {
    let trials: Vec<(f64, f64)> = values
        .iter()
        .zip(sds)
        .map(|(v, s)| (*v, s.max(1e-300)))
        .filter(|(v, s)| v.is_finite() && s.is_finite())
        .collect();
    (!trials.is_empty()).then_some(trials)
}

/// Weighted mean at a scatter, its standard error, and the logarithm of the likelihood of the scatter (restricted: the mean is
/// integrated out).
fn weighed(trials: &[(f64, f64)], between: f64) -> (f64, f64, f64) {
    let variance = |s: f64| s * s + between * between;
    let total: f64 = trials.iter().map(|(_, s)| variance(*s).recip()).sum();
    let mean = trials.iter().map(|(v, s)| v / variance(*s)).sum::<f64>() / total;
    let misses: f64 = trials
        .iter()
        .map(|(v, s)| (v - mean).powi(2) / variance(*s) + variance(*s).ln())
        .sum();
    (mean, total.recip().sqrt(), -0.5 * (misses + total.ln()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_interval_holds_the_truth_at_its_rate() {
        let mut dice = ChaCha8Rng::seed_from_u64(5);
        let mut inside = 0;
        for _ in 0..500 {
            let values: Vec<f64> = (0..4)
                .map(|_| {
                    let (a, b): (f64, f64) = (StandardNormal.sample(&mut dice), StandardNormal.sample(&mut dice));
                    1.0 + 0.02 * a + 0.005 * b
                })
                .collect();
            let pooled = random_effects(&values, &[0.005; 4], 0.015).expect("values");
            inside += usize::from((pooled.mean - 1.0).abs() < pooled.half95);
        }
        assert!(inside >= 460, "{inside} of 500");
    }

    #[test]
    fn an_unknown_scatter_is_allowed_for_and_learnt() {
        let mut dice = ChaCha8Rng::seed_from_u64(6);
        for n in [1, 2, 8] {
            let mut inside = 0;
            for _ in 0..600 {
                let z: f64 = StandardNormal.sample(&mut dice);
                let scatter = 0.015 * (0.45 * z).exp();
                let values: Vec<f64> = (0..n)
                    .map(|_| {
                        let a: f64 = StandardNormal.sample(&mut dice);
                        1.0 + scatter.hypot(0.003) * a
                    })
                    .collect();
                let found = random_effects_marginal(&values, &vec![0.003; n], 0.015, 0.45).expect("values");
                inside += usize::from(found.ci95[0] < 1.0 && 1.0 < found.ci95[1]);
            }
            assert!((552..=588).contains(&inside), "{n} trials: {inside} of 600");
        }
    }

    #[test]
    fn a_vague_trial_does_not_hide_the_scatter() {
        let sds = [0.3, 0.005, 0.007];
        let pooled = random_effects(&[0.0, 0.21, 0.007], &sds, 0.01).expect("values");
        assert!(pooled.sd > 0.05 && pooled.between > 0.05);
        let alike = random_effects(&[0.0, 0.21, 0.21], &sds, 0.01).expect("values");
        assert!(alike.sd < 0.01 && (alike.mean - 0.21).abs() < 0.005);
    }

    #[test]
    fn one_trial_keeps_the_prior_scatter() {
        let pooled = random_effects(&[2.0], &[0.001], 0.03).expect("one");
        assert!(pooled.sd > 0.025);
    }
}
