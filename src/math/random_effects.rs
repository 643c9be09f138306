//! One number from repeated trials that scatter more than each one's own noise says.

use super::t_quantile;

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

/// How many trials the prior scatter counts for.
const PRIOR_TRIALS: f64 = 2.0;

/// Mean of `values` with own standard errors `sds` by the random-effects model; the scatter between trials
/// follows from the data and `prior_between`, what is known of it before (counted as two trials), so that
/// one trial alone is not taken as exact. `None` where there is no finite value.
///
/// Moment estimator of DerSimonian and Laird (1986), interval after Hartung and Knapp (2001).
pub fn random_effects(values: &[f64], sds: &[f64], prior_between: f64) -> Option<Pooled> {
    random_effects_expecting(values, sds, prior_between, PRIOR_TRIALS)
}

/// The same, `prior_between` counted as `prior_trials` trials.
pub fn random_effects_expecting(values: &[f64], sds: &[f64], prior_between: f64, prior_trials: f64) -> Option<Pooled> {
    let trials: Vec<(f64, f64)> = values
        .iter()
        .zip(sds)
        .map(|(v, s)| (*v, s.max(1e-300)))
        .filter(|(v, s)| v.is_finite() && s.is_finite())
        .collect();
    if trials.is_empty() {
        return None;
    }
    let n = trials.len() as f64;
    let weigh = |between: f64| {
        let weights: Vec<f64> = trials.iter().map(|(_, s)| 1.0 / (s * s + between * between)).collect();
        let total: f64 = weights.iter().sum();
        let mean = trials.iter().zip(&weights).map(|((v, _), w)| v * w).sum::<f64>() / total;
        (mean, total, weights)
    };
    // Equal weights keep one over-confident trial from carrying the first pass.
    let plain = trials.iter().map(|(v, _)| v).sum::<f64>() / n;
    let scatter = trials.iter().map(|(v, _)| (v - plain).powi(2)).sum::<f64>();
    let own = trials.iter().map(|(_, s)| s * s).sum::<f64>() / n;
    let excess = (scatter - (n - 1.0) * own).max(0.0);
    let between = ((excess + prior_trials * prior_between.powi(2)) / (n - 1.0 + prior_trials)).sqrt();
    let (mean, total, _) = weigh(between);
    let sd = total.recip().sqrt();
    let half95 = t_quantile(0.975, n - 1.0 + prior_trials) * sd;
    Some(Pooled {
        mean,
        sd,
        between,
        half95,
    })
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
    fn one_trial_keeps_the_prior_scatter() {
        let pooled = random_effects(&[2.0], &[0.001], 0.03).expect("one");
        assert!(pooled.sd > 0.025);
    }
}
