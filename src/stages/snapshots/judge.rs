//! The divergence at one parameter point, and whether one point is better than another beyond what the trials can tell.
//!
//! What falls over is judged apart from what goes on standing: a Gaussian over both is one of neither, and how often a thing at
//! its edge falls is not a figure that a simulator has. A group's divergence is that of the trials that stood from the
//! simulated ones that did, and that of the shares that fell from half way towards the simulated ones, which is at most ln 2.

use super::Config;
use super::bench::Bench;
use super::effects::{Effect, Gaussian};
use super::infer::{draws_of, floor};
use crate::base::Seed;
use crate::physics::tabletop::Coefficients;

/// Fewest trials whose Gaussian is taken apart from those that fell.
const LEAST: usize = 3;
/// Share of the trials that stood below which too few stand in simulation.
const RARE: f64 = 0.5;
/// Standard errors by which a divergence must have fallen to be called lower.
const BEYOND: f64 = 2.0;

/// A point as the trials judge it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// The mean divergence of the measured from the simulated effects over the groups, nats.
    pub divergence: f64,
    /// By group and trial: the logarithm of how likely it was.
    logs: Vec<Vec<f64>>,
}

impl Judged {
    /// The standard error of the difference between two points: each trial's own difference scatters (Vuong 1989), by group.
    pub fn doubt(&self, other: &Self) -> f64 {
        let groups = self.logs.len() as f64;
        let of_mean = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            let apart: Vec<f64> = a.iter().zip(b).map(|(x, y)| x - y).collect();
            let n = apart.len() as f64;
            let mean = apart.iter().sum::<f64>() / n.max(1.0);
            match apart.len() {
                0 | 1 => mean * mean,
                _ => apart.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / ((n - 1.0) * n),
            }
        };
        self.logs.iter().zip(&other.logs).map(of_mean).sum::<f64>().sqrt() / groups
    }

    /// Whether this point's divergence is lower than the other's by more than the trials' scatter explains.
    pub fn fell_from(&self, other: &Self) -> bool {
        other.divergence - self.divergence > BEYOND * self.doubt(other)
    }
}

/// Judges a point by the groups that are held out, or that are not; nothing where there are none. Starts are drawn afresh for
/// every `round`.
pub fn judge(
    bench: &Bench,
    point: &Coefficients,
    held_out: bool,
    config: &Config,
    seed: Seed,
    round: usize,
) -> Option<Judged> {
    let groups: Vec<usize> = (0..bench.groups.len())
        .filter(|g| bench.groups[*g].held_out == held_out)
        .collect();
    let trials: usize = groups.iter().map(|g| bench.of_group(*g).len()).sum();
    let draws = draws_of(trials, config.simulations);
    let each: Vec<(f64, Vec<f64>)> = groups
        .iter()
        .filter_map(|g| group(bench, *g, point, draws, seed, round))
        .collect();
    if each.is_empty() {
        return None;
    }
    let divergence = each.iter().map(|e| e.0).sum::<f64>() / each.len() as f64;
    let logs = each.into_iter().map(|e| e.1).collect();
    Some(Judged { divergence, logs })
}

/// Divergence of one group, and the logarithms of its trials' likelihoods.
fn group(
    bench: &Bench,
    group: usize,
    point: &Coefficients,
    draws: usize,
    seed: Seed,
    round: usize,
) -> Option<(f64, Vec<f64>)> {
    let trials = bench.of_group(group);
    let found = bench.outcomes(&trials, std::slice::from_ref(point), draws, seed, round);
    let simulated: Vec<(Effect, bool)> = found
        .into_iter()
        .flatten()
        .flatten()
        .map(|s| (s.effect, s.fell))
        .collect();
    let measured: Vec<(Effect, bool)> = trials
        .iter()
        .map(|i| (bench.trials[*i].effect, bench.trials[*i].fell))
        .collect();
    let standing = |of: &[(Effect, bool)]| -> Vec<Effect> { of.iter().filter(|e| !e.1).map(|e| e.0).collect() };
    let every = |of: &[(Effect, bool)]| -> Vec<Effect> { of.iter().map(|e| e.0).collect() };
    let share = |of: &[(Effect, bool)]| of.iter().filter(|e| e.1).count() as f64 / of.len().max(1) as f64;
    let (stood, apart) = (standing(&measured), standing(&simulated));
    let gaussian = |of: &[Effect]| Gaussian::of(of, floor(bench));
    if stood.len() < LEAST.min(measured.len()) {
        // Too few stood to say how what stands moves.
        let (ours, theirs) = (gaussian(&every(&measured))?, gaussian(&every(&simulated))?);
        let logs = measured.iter().map(|e| theirs.log_density(&e.0)).collect();
        return Some((ours.divergence(&theirs), logs));
    }
    // Where most of what stood falls in simulation, those few that do not are not what is compared.
    let rare = (1.0 - share(&simulated)) < RARE * (1.0 - share(&measured));
    let theirs = gaussian(&if rare { every(&simulated) } else { apart })?;
    let (seen, half) = (share(&measured), 0.5 * (share(&measured) + share(&simulated)));
    let term = |share: f64, believed: f64| {
        if share > 0.0 {
            share * (share / believed).ln()
        } else {
            0.0
        }
    };
    let divergence = gaussian(&stood)?.divergence(&theirs) + term(seen, half) + term(1.0 - seen, 1.0 - half);
    let log = |e: &(Effect, bool)| match e.1 {
        true => half.ln(),
        false => theirs.log_density(&e.0) + (1.0 - half).ln(),
    };
    Some((divergence, measured.iter().map(log).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(divergence: f64, logs: &[&[f64]]) -> Judged {
        Judged {
            divergence,
            logs: logs.iter().map(|g| g.to_vec()).collect(),
        }
    }

    #[test]
    fn only_what_most_trials_agree_on_is_a_fall() {
        let before = judged(0.5, &[&[1.0, 1.0, 1.0, 1.0], &[0.0, 0.0, 0.0, 0.0]]);
        // Every trial is a little likelier.
        let after = judged(0.4, &[&[1.1, 1.12, 1.08, 1.1], &[0.1, 0.1, 0.11, 0.09]]);
        assert!(after.doubt(&before) < 0.02 && after.fell_from(&before));
        assert!(!before.fell_from(&after));
        // One trial alone is much likelier.
        let lucky = judged(0.4, &[&[1.8, 1.0, 1.0, 1.0], &[0.0, 0.0, 0.0, 0.0]]);
        assert!((lucky.doubt(&before) - 0.1).abs() < 1e-12 && !lucky.fell_from(&before));
    }
}
