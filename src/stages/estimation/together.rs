//! Mass and friction of one link from all that was done to it, together.
//!
//! Each interaction has been reduced by its own forward model to a logarithm with a standard deviation: a lift to
//! `ln m`, a push to `ln m + ln mu`, a tilt or a coasting to `ln mu`. Friction scatters from one sliding to the next
//! (a random effect whose size is integrated out: the interval is that of what is then believed, which has heavier tails
//! than a normal one and need not be even), and all forces of pushes share the doubt of their law. The rest is a normal linear model with priors from shape and materials: its information says
//! what is fixed, what only as a product, and what each interaction moved.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::pool::REPEATS;
use crate::math::{mixture_quantile, normalised, scatters};

/// Doubt of a push's force, as a share of that of all pushes, from which on it counts as near its noise.
pub(super) const NOISY: f64 = 0.05;

/// One interaction's word: `row · (ln m, ln mu, doubt of the push law) = value ± sd`.
#[derive(Clone, Debug)]
pub(super) struct Word {
    pub interaction: String,
    pub row: [f64; 3],
    pub value: f64,
    pub sd: f64,
    /// Friction takes part: it scatters from one sliding to the next.
    pub scatters: bool,
}

impl Word {
    fn new(interaction: &str, row: [f64; 3], (value, sd): (f64, f64), scatters: bool) -> Option<Self> {
        (value > 0.0 && sd > 0.0 && sd.is_finite()).then(|| Self {
            interaction: interaction.into(),
            row,
            value: value.ln(),
            sd: sd / value,
            scatters,
        })
    }

    /// A mass, kg.
    pub fn weighed(interaction: &str, mass: (f64, f64)) -> Option<Self> {
        Self::new(interaction, [1.0, 0.0, 0.0], mass, false)
    }

    /// A friction force over gravity, kg.
    pub fn pushed(interaction: &str, product: (f64, f64)) -> Option<Self> {
        Self::new(interaction, [1.0, 1.0, 1.0], product, true)
    }

    /// The same where it is near its noise: its logarithm about that of the force of all, for by its own, what is low by chance
    /// would count for less than what is high.
    pub fn pushed_about(interaction: &str, (value, sd): (f64, f64), about: f64) -> Option<Self> {
        if sd < NOISY * about {
            return Self::pushed(interaction, (value, sd));
        }
        let word = Self::new(interaction, [1.0, 1.0, 1.0], (about, sd), true)?;
        Some(Self {
            value: word.value + (value / about - 1.0).clamp(-1.0, 1.0),
            ..word
        })
    }

    /// The mass (kg) and the friction force over gravity (kg) of one motion, with the covariance of their logarithms, as
    /// two words that share no error: the mass, and what the friction says beyond it.
    pub fn driven(interaction: &str, mass: (f64, f64), product: (f64, f64), shared: f64) -> Vec<Self> {
        let sds = [mass.1 / mass.0, product.1 / product.0];
        let slope = shared / (sds[0] * sds[0]);
        let left = sds[1] * sds[1] - slope * shared;
        let beyond = (product.0 > 0.0 && left > 0.0).then(|| Self {
            interaction: interaction.into(),
            row: [1.0 - slope, 1.0, 0.0],
            value: product.0.ln() - slope * mass.0.ln(),
            sd: left.sqrt(),
            scatters: true,
        });
        Self::weighed(interaction, mass).into_iter().chain(beyond).collect()
    }

    /// A coefficient of friction.
    pub fn slid(interaction: &str, friction: (f64, f64)) -> Option<Self> {
        Self::new(interaction, [0.0, 1.0, 0.0], friction, true)
    }
}

/// Means and standard deviations before any interaction: `ln m`, `ln mu`, the push law.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prior {
    pub mean: [f64; 3],
    pub sd: [f64; 3],
}

/// What all words say together.
#[derive(Clone, Debug)]
pub(super) struct Together {
    /// `ln m`, `ln mu`, the push law.
    pub x: Vector3<f64>,
    pub covariance: Matrix3<f64>,
    /// 95 % intervals of `ln m` and `ln mu`: wider than 1.96 standard deviations either way where it is the scatter of few
    /// slidings that makes the doubt.
    pub ci95: [[f64; 2]; 2],
}

impl Together {
    /// Standard deviation of a combination of the logarithms.
    pub fn sd(&self, row: [f64; 3]) -> f64 {
        let row = Vector3::from(row);
        row.dot(&(self.covariance * row)).max(0.0).sqrt()
    }
}

/// By how much one interaction moved the logarithms of mass and friction, and their doubt without it.
#[derive(Clone, Debug)]
pub(super) struct Moved {
    pub interaction: String,
    /// With it less without it.
    pub by: [f64; 2],
    /// Standard deviation without it over that with it.
    pub doubt: [f64; 2],
}

/// Degrees of freedom of the weights that make the fit robust against one bad interaction.
const TAILS: f64 = 6.0;
const ROUNDS: usize = 30;
/// Degrees of freedom of a word's own standard deviation, which is an estimate too.
const OWN: f64 = 30.0;

/// Fits all words; `expected` is the scatter of friction that is expected before any is seen.
pub(super) fn together(words: &[Word], prior: &Prior, expected: f64) -> Option<Together> {
    let nodes = scatters(expected, REPEATS);
    let at: Vec<(f64, Vector3<f64>, Matrix3<f64>)> = nodes
        .iter()
        .filter_map(|(scatter, log_prior)| {
            let (x, covariance, log_likelihood) = at_scatter(words, *scatter, prior)?;
            Some((log_prior + log_likelihood, x, covariance))
        })
        .collect();
    let of = |k: usize| {
        let parts = at.iter().map(|(log, x, c)| (*log, x[k], c[(k, k)].max(0.0).sqrt()));
        normalised(parts.collect())
    };
    let weights: Vec<f64> = of(0).iter().map(|p| p.0).collect();
    let all = || weights.iter().zip(&at);
    let x: Vector3<f64> = all().map(|(w, (_, x, _))| x * *w).sum();
    let covariance: Matrix3<f64> = all()
        .map(|(w, (_, at, c))| (c + (at - x) * (at - x).transpose()) * *w)
        .sum();
    let ci95 = [0, 1].map(|k| [0.025, 0.975].map(|p| mixture_quantile(&of(k), p, OWN)));
    (!at.is_empty()).then_some(Together { x, covariance, ci95 })
}

/// The fit at one scatter, and the logarithm of that scatter's likelihood (by Laplace's method).
fn at_scatter(words: &[Word], scatter: f64, prior: &Prior) -> Option<(Vector3<f64>, Matrix3<f64>, f64)> {
    let variance = |word: &Word| word.sd * word.sd + if word.scatters { scatter * scatter } else { 0.0 };
    let mut weights = vec![1.0; words.len()];
    let mut solved = solve(words, &weights, scatter, prior)?;
    for _ in 0..ROUNDS {
        for (word, weight) in words.iter().zip(&mut weights) {
            let row = Vector3::from(word.row);
            let (left, all) = (word.value - row.dot(&solved.0), variance(word));
            // A word that the others hardly check must not be struck off for it: the leverage is taken off.
            let leverage = (row.dot(&(solved.1 * row)) / all).min(0.95);
            *weight = ((TAILS + 1.0) / (TAILS + left * left / (all * (1.0 - leverage).max(0.05)))).min(1.0);
        }
        let next = solve(words, &weights, scatter, prior)?;
        let settled = (next.0 - solved.0).amax() < 1e-9;
        solved = next;
        if settled {
            break;
        }
    }
    let told: f64 = words
        .iter()
        .map(|word| {
            let left = word.value - Vector3::from(word.row).dot(&solved.0);
            let all = variance(word);
            -0.5 * (all.ln() + (TAILS + 1.0) * (left * left / (TAILS * all)).ln_1p())
        })
        .sum();
    let strayed = Vector3::from_fn(|k, _| (solved.0[k] - prior.mean[k]) / prior.sd[k]);
    let log = told - 0.5 * strayed.norm_squared() + 0.5 * solved.1.determinant().max(1e-300).ln();
    Some((solved.0, solved.1, log))
}

fn solve(words: &[Word], weights: &[f64], scatter: f64, prior: &Prior) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let mut information = Matrix3::from_diagonal(&Vector3::from(prior.sd.map(|s| s.powi(-2))));
    let mut right = Vector3::from_fn(|i, _| prior.mean[i] * prior.sd[i].powi(-2));
    for (word, weight) in words.iter().zip(weights) {
        let row = Vector3::from(word.row);
        let variance = word.sd * word.sd + if word.scatters { scatter * scatter } else { 0.0 };
        information += row * row.transpose() * (weight / variance);
        right += row * (weight * word.value / variance);
    }
    let covariance = information.cholesky()?.inverse();
    Some((covariance * right, covariance))
}

/// The ledger: each interaction left out in turn.
pub(super) fn ledger(words: &[Word], prior: &Prior, expected: f64) -> Vec<Moved> {
    let Some(all) = together(words, prior, expected) else {
        return Vec::new();
    };
    let mut names: Vec<&String> = words.iter().map(|w| &w.interaction).collect();
    names.dedup();
    let moved = |name: &String| {
        let rest: Vec<Word> = words.iter().filter(|w| w.interaction != *name).cloned().collect();
        let without = together(&rest, prior, expected)?;
        Some(Moved {
            interaction: name.clone(),
            by: [0, 1].map(|k| all.x[k] - without.x[k]),
            doubt: [0, 1].map(|k| (without.covariance[(k, k)] / all.covariance[(k, k)]).sqrt()),
        })
    };
    names.into_iter().filter_map(moved).collect()
}

/// What the words leave open, in words; nothing where mass and friction are both fixed to within `enough`.
pub(super) fn left_open(found: &Together, enough: f64) -> Option<String> {
    let (mass, friction, product) = (
        found.sd([1.0, 0.0, 0.0]),
        found.sd([0.0, 1.0, 0.0]),
        found.sd([1.0, 1.0, 0.0]),
    );
    if mass < enough && friction < enough {
        return None;
    }
    let remedy = "lift it, let it coast after a fast push, or tilt the support until it slides";
    let percent = |sd: f64| format!("{:.1} %", 100.0 * sd);
    let factor = |sd: f64| format!("a factor of {:.1}", (1.96 * sd).exp());
    Some(match (product < enough, mass < enough, friction < enough) {
        (true, ..) => format!(
            "mass times friction is known to {}, mass alone only to within {}: {remedy}",
            percent(product),
            factor(mass)
        ),
        (_, true, false) => format!("mass is known to {}, friction is not: push it", percent(mass)),
        (_, false, true) => format!(
            "friction is known to {}, mass is not: lift it or push it",
            percent(friction)
        ),
        _ => format!("neither mass nor friction is known: push it, and {remedy}"),
    })
}

/// Eigenvalues of the posterior relative to the prior, least known first: near 1 nothing was learnt.
pub(super) fn learnt(found: &Together, prior: &Prior) -> Option<DVector<f64>> {
    let scale = DMatrix::from_diagonal(&DVector::from_iterator(3, prior.sd.iter().map(|s| 1.0 / s)));
    let covariance = DMatrix::from_iterator(3, 3, found.covariance.iter().copied());
    let mut values: Vec<f64> = (&scale * covariance * &scale)
        .symmetric_eigenvalues()
        .iter()
        .copied()
        .collect();
    values.sort_by(|a, b| b.total_cmp(a));
    Some(DVector::from_vec(values))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, rng_for};
    use rand_distr::{Distribution, StandardNormal};

    const PRIOR: Prior = Prior {
        mean: [-1.0, -1.0, 0.0],
        sd: [0.7, 0.5, 0.007],
    };

    /// Four pushes, and a lift, a coasting or nothing else; returns words for m = 0.5, mu = 0.3.
    fn words(seed: u64, way: &str) -> Vec<Word> {
        let mut dice = rng_for(Seed(seed), way);
        let mut noise = |sd: f64| -> f64 {
            let z: f64 = StandardNormal.sample(&mut dice);
            (sd * z).exp()
        };
        let law = noise(0.007);
        let mut out: Vec<Word> = (0..4)
            .filter_map(|i| Word::pushed(&format!("push-{i}"), (0.15 * law * noise(0.015) * noise(0.004), 0.0006)))
            .collect();
        match way {
            "lift" => out.extend(Word::weighed("lift", (0.5 * noise(0.002), 0.001))),
            "coast" => out.extend(
                (0..2).filter_map(|i| Word::slid(&format!("fast-{i}"), (0.3 * noise(0.015) * noise(0.01), 0.003))),
            ),
            _ => {}
        }
        out
    }

    #[test]
    fn intervals_hold_the_truth_at_their_rate() {
        for way in ["lift", "coast"] {
            let mut inside = [0; 2];
            for seed in 0..300 {
                let found = together(&words(seed, way), &PRIOR, 0.015).expect("solved");
                for (k, truth) in [0.5f64.ln(), 0.3f64.ln()].into_iter().enumerate() {
                    inside[k] += usize::from(found.ci95[k][0] < truth && truth < found.ci95[k][1]);
                }
            }
            assert!(
                inside.iter().all(|n| (279..=300).contains(n)),
                "{way}: {inside:?} of 300"
            );
        }
    }

    #[test]
    fn slow_pushes_alone_say_what_they_leave_open() {
        let found = together(&words(1, "slow"), &PRIOR, 0.015).expect("solved");
        assert!(found.sd([1.0, 0.0, 0.0]) > 0.3 && found.sd([1.0, 1.0, 0.0]) < 0.02);
        let said = left_open(&found, 0.1).expect("something is open");
        assert!(
            said.starts_with("mass times friction is known to 1") && said.contains("lift it"),
            "{said}"
        );
        assert!(learnt(&found, &PRIOR).expect("eigenvalues")[0] > 0.9);
    }

    #[test]
    fn the_ledger_names_the_lift_that_fixed_the_mass() {
        let ledger = ledger(&words(2, "lift"), &PRIOR, 0.015);
        let fixed = ledger
            .iter()
            .max_by(|a, b| a.doubt[0].total_cmp(&b.doubt[0]))
            .expect("entries");
        assert_eq!(fixed.interaction, "lift");
        assert!(fixed.doubt[0] > 50.0);
    }

    #[test]
    fn forces_near_their_noise_are_not_drawn_to_the_higher_ones() {
        // 0.1 N with 20 % of noise: by their own logarithms the high ones would count for more.
        let all = [0.07, 0.12, 0.11, 0.08, 0.12].map(|f| (f / 9.81, 0.02 / 9.81));
        let pushed = all.iter().filter_map(|f| Word::pushed_about("push", *f, 0.1 / 9.81));
        let words: Vec<Word> = Word::weighed("lift", (0.05, 1e-4)).into_iter().chain(pushed).collect();
        let prior = Prior {
            sd: [0.7, 5.0, 0.007],
            ..PRIOR
        };
        let found = together(&words, &prior, 0.015).expect("solved");
        assert!(
            (found.x[1].exp() / (0.1 / 0.4905) - 1.0).abs() < 0.02,
            "{}",
            found.x[1].exp()
        );
    }

    #[test]
    fn one_bad_push_does_not_carry_the_rest() {
        let mut all = words(3, "lift");
        all[0].value += 0.3;
        let found = together(&all, &PRIOR, 0.015).expect("solved");
        assert!((found.x[1] - 0.3f64.ln()).abs() < 0.06, "{}", found.x[1].exp());
    }
}
