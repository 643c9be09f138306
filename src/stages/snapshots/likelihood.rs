//! How likely the measured trials are at one parameter point: displacements, and impulses where force was recorded.
//!
//! A displacement is one of Student-t bells about those simulated from starts drawn afresh. An impulse is the mass times the
//! simulated impulse per kg, up to the same share of error; the mass, which moves nothing on a prescribed path, is
//! integrated out about its most likely value (Laplace), with its prior by volume or as the capture knows it.
//!
//! A trial that stood is compared with the simulated ones that did. How often a thing at its edge falls is not a figure that a
//! simulator has: the simulated odds count half, the other half is even, and a trial that fell tells no more than that it did.

use super::Effect;
use super::bench::{Bench, Simulated};

/// Shares of the travel by which the simulation may be off, one a factor two above the other.
pub(super) const SHARES: [f64; 7] = [0.0125, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8];
/// Error of contact geometry that no snapshot noise covers, m.
const GEOMETRY: f64 = 1e-3;
/// Degrees of freedom of the bells.
const FREEDOM: f64 = 4.0;
/// An impulse comes from the speeds whose squares make the travel: its share of error is half that of the travel. Beside
/// it the sensor's own scale is believed to this share.
const OF_TRAVEL: f64 = 0.5;
const SCALE: f64 = 0.02;
/// Impulse per kg below which a simulated tool has missed, m/s.
const MISSED: f64 = 1e-4;
/// Rounds of reweighting for the most likely mass.
const ROUNDS: usize = 6;

/// The logarithm of the likelihood at each share, and that of the mass there with its variance where forces tell it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    pub log: [f64; SHARES.len()],
    pub mass: Option<[(f64, f64); SHARES.len()]>,
}

/// Simulated displacements and outcomes of one trial, by draw of its start.
type Draws = Vec<Simulated>;

pub(super) fn log_sum(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + values.map(|v| (v - most).exp()).sum::<f64>().ln()
}

/// How much each fitted trial counts: repeated trials of one tool and action share the errors of the simulation.
pub(super) fn counts(bench: &Bench, fitted: &[usize], shared: f64) -> Vec<f64> {
    let sizes: Vec<usize> = (0..bench.groups.len())
        .map(|g| fitted.iter().filter(|i| bench.trials[**i].group == g).count())
        .collect();
    let of = |i: &usize| 1.0 / (1.0 + (sizes[bench.trials[*i].group] as f64 - 1.0) * shared);
    fitted.iter().map(of).collect()
}

/// `simulated` by trial and draw; `counts` by trial.
pub(super) fn level(bench: &Bench, fitted: &[usize], simulated: &[Draws], counts: &[f64]) -> Level {
    let noise = 2.0 * bench.place_sd.powi(2) + GEOMETRY.powi(2);
    let mut log = [0.0; SHARES.len()];
    for ((i, draws), counts) in fitted.iter().zip(simulated).zip(counts) {
        let trial = &bench.trials[*i];
        let fell = draws.iter().filter(|s| s.fell).count();
        let odds = 0.5 * (fell as f64 / draws.len() as f64 + 0.5);
        if trial.fell {
            // Where a tumble ends no simulator tells.
            log.iter_mut().for_each(|value| *value += counts * odds.ln());
            continue;
        }
        let like = |s: &&Simulated| !s.fell || fell == draws.len();
        let kept: Vec<Effect> = draws.iter().filter(like).map(|s| s.effect).collect();
        for (value, share) in log.iter_mut().zip(SHARES) {
            let bells = kept.iter().map(|effect| {
                let variance = noise + (share * effect.norm()).powi(2);
                let squared = (trial.effect - effect).norm_squared() / variance;
                -variance.ln() - 0.5 * (FREEDOM + 2.0) * (1.0 + squared / FREEDOM).ln()
            });
            *value += counts * (log_sum(bells) - (kept.len() as f64).ln() + (1.0 - odds).ln());
        }
    }
    let felt = ratios(bench, fitted, simulated, counts);
    if felt.len() < 2 {
        return Level { log, mass: None };
    }
    let weighed = SHARES.map(|share| weigh(&felt, share, bench.mass));
    for (value, w) in log.iter_mut().zip(weighed) {
        *value += w.2;
    }
    Level {
        log,
        mass: Some(weighed.map(|w| (w.0, w.1))),
    }
}

/// A trial whose force was recorded: the logarithm of measured impulse over impulse per kg, the variance of that which no
/// share of error has part in, and how much it counts.
struct Ratio {
    log: f64,
    variance: f64,
    counts: f64,
}

fn ratios(bench: &Bench, fitted: &[usize], simulated: &[Draws], counts: &[f64]) -> Vec<Ratio> {
    let of = |((i, draws), counts): ((&usize, &Draws), &f64)| {
        let (impulse, sd) = bench.trials[*i].impulse?;
        let n = draws.len() as f64;
        let mean = draws.iter().map(|s| s.outcome.impulse.norm()).sum::<f64>() / n;
        let scatter = draws
            .iter()
            .map(|s| (s.outcome.impulse.norm() - mean).powi(2))
            .sum::<f64>()
            / (n - 1.0).max(1.0);
        let per_kg = mean.max(MISSED);
        Some(Ratio {
            log: (impulse / per_kg).ln(),
            variance: (sd / impulse).powi(2) + scatter / (per_kg * per_kg),
            counts: *counts,
        })
    };
    fitted.iter().zip(simulated).zip(counts).filter_map(of).collect()
}

/// The logarithm of the mass with its variance, and the logarithm of the likelihood with the mass integrated out.
/// `prior` is the median (kg) and the standard deviation of the logarithm.
fn weigh(felt: &[Ratio], share: f64, prior: (f64, f64)) -> (f64, f64, f64) {
    let variance = |r: &Ratio| r.variance + (OF_TRAVEL * share).powi(2) + SCALE * SCALE;
    let (middle, narrow) = (prior.0.ln(), prior.1.powi(-2));
    let mut mass = crate::math::median(&felt.iter().map(|r| r.log).collect::<Vec<_>>()).unwrap_or(middle);
    let mut precision = narrow;
    for _ in 0..ROUNDS {
        let (mut top, mut bottom) = (narrow * middle, narrow);
        for r in felt {
            let v = variance(r);
            let weight = r.counts * (FREEDOM + 1.0) / (FREEDOM + (r.log - mass).powi(2) / v) / v;
            top += weight * r.log;
            bottom += weight;
        }
        (mass, precision) = (top / bottom, bottom);
    }
    let fit: f64 = felt
        .iter()
        .map(|r| {
            let v = variance(r);
            let squared = (r.log - mass).powi(2) / v;
            r.counts * (-0.5 * v.ln() - 0.5 * (FREEDOM + 1.0) * (1.0 + squared / FREEDOM).ln())
        })
        .sum();
    let before = -0.5 * narrow * (mass - middle).powi(2) + 0.5 * (narrow / precision).ln();
    // The sensor's scale is common to all trials.
    (mass, 1.0 / precision + SCALE * SCALE, fit + before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impulses_weigh_a_thing_and_prefer_the_point_that_agrees() {
        let felt = |logs: &[f64]| -> Vec<Ratio> {
            let each = logs.iter().map(|log| Ratio {
                log: *log,
                variance: 1e-4,
                counts: 1.0,
            });
            each.collect()
        };
        let prior = (0.5, 0.7);
        let (mass, variance, agreeing) = weigh(&felt(&[-1.61, -1.60, -1.62, -1.61]), 0.05, prior);
        assert!((mass.exp() - 0.2).abs() < 0.002, "{}", mass.exp());
        assert!(variance.sqrt() < 0.04);
        let (_, _, apart) = weigh(&felt(&[-1.61, -1.2, -2.0, -1.61]), 0.05, prior);
        assert!(agreeing > apart + 2.0, "{agreeing} {apart}");
        // One trial that missed does not carry the mass away.
        let (mass, _, _) = weigh(&felt(&[-1.61, -1.60, -1.62, 4.0]), 0.05, prior);
        assert!((mass.exp() - 0.2).abs() < 0.01, "{}", mass.exp());
    }
}
