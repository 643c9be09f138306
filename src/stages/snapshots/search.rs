//! The search for the least divergence: Bayesian optimisation with three acquisitions under GP-Hedge.
//!
//! Expected improvement, probability of improvement and lower confidence bound each propose a point; one of them is
//! taken with odds `softmax(eta g)`, where the gain `g` of each falls by what the refitted process expects at its own
//! proposal (Hoffman, Brochu and de Freitas 2011; Lima et al. 2019, section III B). What is believed beforehand says where to
//! begin and nothing more: a belief that also led the steps after that held searches fast beside the least. Improvement means more than
//! the noise of an evaluation.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use super::process::Process;
use super::space::{DIMENSIONS, Scores};
use crate::base::{Seed, rng_for};

/// Scores beyond this are not searched.
const EDGE: f64 = 2.5;
/// Points at which the acquisitions are compared: of some hundred in four dimensions the best is far from the best there is.
const CANDIDATES: usize = 3000;
/// Trade of the lower confidence bound, and temper of the choice between the acquisitions.
const BETA: f64 = 1.96;
const ETA: f64 = 1.0;

/// A search that began with a belief looks elsewhere every so many evaluations, so many times.
const APART: usize = 3;
const ELSEWHERE: usize = 9;

/// One evaluated point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Where, as standard normal scores under the prior.
    pub at: Scores,
    /// The divergence there, nats.
    pub divergence: f64,
    /// Which acquisition asked for it; `start` before there was a process.
    pub asked_by: String,
}

/// A search under way; it can be written down after any evaluation and taken up again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Search {
    /// What was evaluated, in order.
    pub evaluations: Vec<Evaluation>,
    /// Points that are evaluated before the process takes over.
    pub first: usize,
    gains: [f64; 3],
    proposals: Option<[Scores; 3]>,
    hyper: Option<Vec<f64>>,
    seed: u64,
    /// Where it begins, instead of at the prior's median and the points of the sequence.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    starts: Vec<Scores>,
}

const ACQUISITIONS: [&str; 3] = ["EI", "PI", "LCB"];

impl Search {
    /// A new search that begins with the prior's median and further points of a space-filling sequence, `first` in all.
    pub fn new(seed: Seed, first: usize) -> Self {
        Self {
            evaluations: Vec::new(),
            first,
            gains: [0.0; 3],
            proposals: None,
            hyper: None,
            seed: seed.0,
            starts: Vec::new(),
        }
    }

    /// A new search that begins at these points.
    pub fn guided(seed: Seed, starts: Vec<Scores>) -> Self {
        Self {
            first: starts.len(),
            starts,
            ..Self::new(seed, 0)
        }
    }

    /// The best point so far.
    pub fn best(&self) -> Option<&Evaluation> {
        self.evaluations
            .iter()
            .min_by(|a, b| a.divergence.total_cmp(&b.divergence))
    }

    /// The next point to evaluate, and which acquisition wants it.
    pub fn ask(&mut self) -> (Scores, &'static str) {
        let n = self.evaluations.len();
        if let Some(at) = self.elsewhere(n) {
            return (at, "start");
        }
        let fitted = (n >= self.first.max(2)).then(|| self.process()).flatten();
        let Some(process) = fitted else {
            let believed = self.starts.get(n).copied();
            let at = match n {
                0 => [0.0; DIMENSIONS],
                _ => start_point(n, self.seed),
            };
            return (believed.unwrap_or(at), "start");
        };
        let hyper = process.hyper().to_vec();
        let mut gains = self.gains;
        if let Some(old) = self.proposals {
            // Rewards on the scale of the values seen, so that the odds do not depend on their unit.
            let (_, scale, _) = process.lengths();
            for (gain, at) in gains.iter_mut().zip(&old) {
                *gain -= process.predict(at).0 / scale.max(1e-9);
            }
        }
        let mut rng = rng_for(Seed(self.seed), &format!("snapshots/search/{n}"));
        let proposals = self.propose(&process, &mut rng);
        (self.hyper, self.gains) = (Some(hyper), gains);
        let most = self.gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let odds = self.gains.map(|g| (ETA * (g - most)).exp());
        let mut left = rng.random_range(0.0..odds.iter().sum::<f64>());
        let chosen = odds.iter().position(|o| {
            left -= o;
            left <= 0.0
        });
        let chosen = chosen.unwrap_or(0);
        self.proposals = Some(proposals);
        (proposals[chosen], ACQUISITIONS[chosen])
    }

    /// Where a search that began with a belief looks without it: every third evaluation afterwards is a point of the sequence, until as
    /// many of them as begin a search from nothing were evaluated. A process of points that lie together knows of nothing else.
    fn elsewhere(&self, n: usize) -> Option<Scores> {
        let after = n.checked_sub(self.starts.len()).filter(|_| !self.starts.is_empty())?;
        let due = after % APART == APART - 1 && after / APART < ELSEWHERE;
        due.then(|| start_point(1 + after / APART, self.seed))
    }

    /// Takes up what an evaluation gave.
    pub fn tell(&mut self, at: Scores, divergence: f64, asked_by: &str) {
        self.evaluations.push(Evaluation {
            at,
            divergence,
            asked_by: asked_by.into(),
        });
    }

    /// The process over the logarithm of 1 + divergence, which spans decades.
    pub fn process(&self) -> Option<Process> {
        let points: Vec<Vec<f64>> = self.evaluations.iter().map(|e| e.at.to_vec()).collect();
        let values: Vec<f64> = self
            .evaluations
            .iter()
            .map(|e| e.divergence.clamp(0.0, 1e9).ln_1p())
            .collect();
        Process::fit(&points, &values, self.hyper.as_deref())
    }

    /// Where each acquisition is best: candidates all over, and about the best point so far.
    fn propose(&self, process: &Process, rng: &mut impl Rng) -> [Scores; 3] {
        let (mut least, mut best) = (f64::INFINITY, [0.0; DIMENSIONS]);
        for e in &self.evaluations {
            let expected = process.predict(&e.at).0;
            if expected < least {
                (least, best) = (expected, e.at);
            }
        }
        // What is less than the noise of an evaluation is no improvement: without this margin the probability of improvement
        // asks for points beside the least for ever.
        least -= process.lengths().2;
        let mut found = [(f64::NEG_INFINITY, best); 3];
        for i in 0..CANDIDATES {
            let at: Scores = if i % 2 == 0 {
                std::array::from_fn(|_| rng.random_range(-EDGE..EDGE))
            } else {
                let width = [0.6, 0.2, 0.05][i / 2 % 3];
                std::array::from_fn(|k| {
                    let z: f64 = StandardNormal.sample(rng);
                    (best[k] + width * z).clamp(-EDGE, EDGE)
                })
            };
            let values = acquisitions(process.predict(&at), least);
            for (place, value) in found.iter_mut().zip(values) {
                if value > place.0 {
                    *place = (value, at);
                }
            }
        }
        found.map(|f| f.1)
    }
}

/// The logarithms of EI and PI, and the negative LCB, of a prediction against what an improvement has to reach.
fn acquisitions((mean, sd): (f64, f64), least: f64) -> [f64; 3] {
    let normal = Normal::standard();
    let z = (least - mean) / sd;
    let improvement = (least - mean) * normal.cdf(z) + sd * normal.pdf(z);
    let log = |x: f64| x.max(f64::MIN_POSITIVE).ln();
    [log(improvement), log(normal.cdf(z)), -mean + BETA * sd]
}

/// The `n`-th point of a Halton sequence, shifted by the seed (Cranley and Patterson 1976), as normal scores.
pub(super) fn start_point(n: usize, seed: u64) -> Scores {
    let mut rng = rng_for(Seed(seed), "snapshots/halton");
    let normal = Normal::standard();
    std::array::from_fn(|k| {
        let shift: f64 = rng.random_range(0.0..1.0);
        let share = (radical_inverse(n as u64 + 1, [2, 3, 5, 7][k]) + shift).fract();
        normal.inverse_cdf(share.clamp(0.005, 0.995))
    })
}

fn radical_inverse(mut n: u64, base: u64) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0 / base as f64);
    while n > 0 {
        value += (n % base) as f64 * digit;
        n /= base;
        digit /= base as f64;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bowl(at: &Scores) -> f64 {
        3.0 * (at[0] - 0.7).powi(2) + 0.5 * (at[2] + 0.4).powi(2)
    }

    fn run(search: &mut Search, until: usize) {
        while search.evaluations.len() < until {
            let (at, by) = search.ask();
            search.tell(at, bowl(&at), by);
        }
    }

    #[test]
    fn it_finds_the_bottom_of_a_bowl() {
        let mut search = Search::new(Seed(3), 10);
        run(&mut search, 40);
        let best = search.best().expect("some");
        assert!(best.divergence < 0.03, "{best:?}");
    }

    #[test]
    fn noise_does_not_hold_it_beside_a_shallow_dent() {
        // A shallow dent where it begins, a deep one elsewhere, under noise: it has to go and look.
        let deep = |at: &Scores| {
            let apart = |x: f64, y: f64| (at[0] - x).powi(2) + (at[2] - y).powi(2);
            2.0 - 0.5 * (-2.0 * apart(-0.8, 0.0)).exp() - 1.8 * (-0.7 * apart(1.1, 0.6)).exp()
        };
        let mut found = 0;
        for seed in 0..6 {
            let starts = vec![[-0.8, 0.0, 0.0, 0.0], [-0.6, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.1, 0.0]];
            let mut search = Search::guided(Seed(seed), starts);
            let mut dice = rng_for(Seed(seed), "test");
            while search.evaluations.len() < 40 {
                let (at, by) = search.ask();
                search.tell(at, deep(&at) + dice.random_range(-0.02..0.02), by);
            }
            found += usize::from(search.best().expect("some").divergence < 0.5);
        }
        assert!(found >= 5, "{found} of 6");
    }

    #[test]
    fn a_wrong_belief_is_outlived_and_a_right_one_is_quick() {
        let guided = |middle: Scores| vec![middle, [middle[0] + 0.2, middle[1], middle[2], middle[3]]];
        let mut right = Search::guided(Seed(3), guided([0.65, 0.0, -0.35, 0.0]));
        run(&mut right, 8);
        assert!(right.best().expect("some").divergence < 0.03, "{:?}", right.best());
        let mut wrong = Search::guided(Seed(3), guided([-1.2, 0.0, 1.0, 0.0]));
        run(&mut wrong, 40);
        assert!(wrong.best().expect("some").divergence < 0.06, "{:?}", wrong.best());
    }

    #[test]
    fn a_search_that_was_put_down_goes_on_as_if_it_had_not_been() {
        let mut whole = Search::new(Seed(1), 8);
        run(&mut whole, 20);
        let mut parted = Search::new(Seed(1), 8);
        run(&mut parted, 13);
        let text = serde_json::to_string(&parted).expect("writes");
        let mut again: Search = serde_json::from_str(&text).expect("reads");
        run(&mut again, 20);
        assert_eq!(whole, again);
    }
}
