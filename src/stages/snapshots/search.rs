//! The search for the least divergence: Bayesian optimisation with three acquisitions under GP-Hedge.
//!
//! Expected improvement, probability of improvement and lower confidence bound each propose a point; one of them is
//! taken with odds `softmax(eta g)`, where the gain `g` of each falls by what the refitted process expects at its own
//! proposal (Hoffman, Brochu and de Freitas 2011; Lima et al. 2019, section III B). Where something is believed beforehand of
//! where the least is, the acquisitions are weighted by that belief to a power that falls with every evaluation (Hvarfner et
//! al. 2022), and the process is one about a mean that rises away from the belief as far as the evaluations bear it out. The
//! belief is a mixture of what was learnt, with heavy tails, and of knowing nothing, so that a wrong one is outlived.

use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use super::process::Process;
use super::space::{DIMENSIONS, Scores};
use crate::base::{Seed, rng_for};

/// Scores beyond this are not searched.
const EDGE: f64 = 2.5;
/// Points at which the acquisitions are compared.
const CANDIDATES: usize = 400;
/// Trade of the lower confidence bound, and temper of the choice between the acquisitions.
const BETA: f64 = 1.96;
/// How many evaluations a belief beforehand is worth.
const BELIEF: f64 = 5.0;
const ETA: f64 = 1.0;
/// Share of the belief that goes with what was learnt, the rest with knowing nothing.
const LEARNT: f64 = 0.8;
/// What slopes of the mean are expected beforehand, over the values' spread: the ridge of their regression.
const RIDGE: f64 = 2.0;

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
    /// What is believed of where the least is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    guess: Option<Guess>,
}

/// A belief of where the least is, from things already seen: on the search's scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Guess {
    /// Points to evaluate first.
    pub starts: Vec<Scores>,
    /// Middle.
    pub middle: Scores,
    /// Standard deviations.
    pub sd: Scores,
}

impl Guess {
    /// Logarithm of its density: Student's t with three degrees of freedom about what was learnt, and a standard normal of
    /// the scores where that does not hold.
    fn log(&self, at: &Scores) -> f64 {
        let each = at.iter().zip(self.middle).zip(self.sd);
        let heavy = |x: f64, m: f64, s: f64| T3.ln() - s.ln() - 2.0 * (((x - m) / s).powi(2) / 3.0).ln_1p();
        let learnt: f64 = each.map(|((x, m), s)| heavy(*x, m, s)).sum();
        let vague: f64 = at.iter().map(|x| -0.5 * (x * x + std::f64::consts::TAU.ln())).sum();
        let (a, b) = (LEARNT.ln() + learnt, (1.0 - LEARNT).ln() + vague);
        a.max(b) + (-(a - b).abs()).exp().ln_1p()
    }
}

/// Density of Student's t with three degrees of freedom at its middle.
const T3: f64 = 0.367_552_596_947_861;

/// A process about a mean that rises away from what is believed.
struct Led<'a> {
    process: Process,
    slope: f64,
    guess: Option<&'a Guess>,
}

impl Led<'_> {
    /// Mean and standard deviation at a point.
    fn predict(&self, at: &Scores) -> (f64, f64) {
        let (mean, sd) = self.process.predict(at);
        (mean - self.guess.map_or(0.0, |g| self.slope * g.log(at)), sd)
    }
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
            guess: None,
        }
    }

    /// A new search that begins where it is believed that the least is.
    pub fn guided(seed: Seed, guess: Guess) -> Self {
        Self {
            first: guess.starts.len(),
            guess: Some(guess),
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
        let led = (n >= self.first.max(2)).then(|| self.led()).flatten();
        let Some(process) = led else {
            let believed = self.guess.as_ref().and_then(|g| g.starts.get(n).copied());
            let at = match n {
                0 => [0.0; DIMENSIONS],
                _ => start_point(n, self.seed),
            };
            return (believed.unwrap_or(at), "start");
        };
        let hyper = process.process.hyper().to_vec();
        let mut gains = self.gains;
        if let Some(old) = self.proposals {
            // Rewards on the scale of the values seen, so that the odds do not depend on their unit.
            let (_, scale, _) = process.process.lengths();
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

    /// The process about the mean that what is believed calls for. How steep that mean is, is a ridge regression of the
    /// values on the logarithm of the belief: a belief that the values do not bear out has none.
    fn led(&self) -> Option<Led<'_>> {
        let Some(guess) = &self.guess else {
            let process = self.process()?;
            return Some(Led {
                process,
                slope: 0.0,
                guess: None,
            });
        };
        let points: Vec<Vec<f64>> = self.evaluations.iter().map(|e| e.at.to_vec()).collect();
        let value = |e: &Evaluation| e.divergence.clamp(0.0, 1e9).ln_1p();
        let values: Vec<f64> = self.evaluations.iter().map(value).collect();
        let logs: Vec<f64> = self.evaluations.iter().map(|e| guess.log(&e.at)).collect();
        let n = values.len() as f64;
        let middle = |of: &[f64]| of.iter().sum::<f64>() / n;
        let (level, log) = (middle(&values), middle(&logs));
        let cross: f64 = values.iter().zip(&logs).map(|(v, l)| (v - level) * (log - l)).sum();
        let square: f64 = logs.iter().map(|l| (l - log).powi(2)).sum();
        let slope = (cross / (square + RIDGE)).max(0.0);
        let left: Vec<f64> = values.iter().zip(&logs).map(|(v, l)| v + slope * l).collect();
        let process = Process::fit(&points, &left, self.hyper.as_deref())?;
        Some(Led {
            process,
            slope,
            guess: Some(guess),
        })
    }

    /// Where each acquisition is best: candidates all over, and about the best point so far.
    fn propose(&self, process: &Led, rng: &mut impl Rng) -> [Scores; 3] {
        let least = self
            .evaluations
            .iter()
            .map(|e| process.predict(&e.at).0)
            .fold(f64::INFINITY, f64::min);
        let best = self.best().map_or([0.0; DIMENSIONS], |e| e.at);
        let mut found = [(f64::NEG_INFINITY, best); 3];
        let (_, scale, _) = process.process.lengths();
        let power = BELIEF / self.evaluations.len().max(1) as f64;
        for i in 0..CANDIDATES {
            let believed = self.guess.as_ref().filter(|_| i % 4 == 0);
            let at: Scores = if let Some(guess) = believed {
                std::array::from_fn(|k| {
                    let z: f64 = StandardNormal.sample(rng);
                    (guess.middle[k] + guess.sd[k] * z).clamp(-EDGE, EDGE)
                })
            } else if i % 2 == 0 {
                std::array::from_fn(|_| rng.random_range(-EDGE..EDGE))
            } else {
                let width = [0.6, 0.2, 0.05][i / 2 % 3];
                std::array::from_fn(|k| {
                    let z: f64 = StandardNormal.sample(rng);
                    (best[k] + width * z).clamp(-EDGE, EDGE)
                })
            };
            let belief = self.guess.as_ref().map_or(0.0, |g| power * g.log(&at));
            let values = acquisitions(process.predict(&at), least, belief, scale);
            for (place, value) in found.iter_mut().zip(values) {
                if value > place.0 {
                    *place = (value, at);
                }
            }
        }
        found.map(|f| f.1)
    }
}

/// The logarithms of EI and PI, and the negative LCB, of a prediction against the least mean so far, each with the
/// logarithm of what is believed; `scale` is that of the process.
fn acquisitions((mean, sd): (f64, f64), least: f64, belief: f64, scale: f64) -> [f64; 3] {
    let normal = Normal::standard();
    let z = (least - mean) / sd;
    let improvement = (least - mean) * normal.cdf(z) + sd * normal.pdf(z);
    let log = |x: f64| x.max(f64::MIN_POSITIVE).ln();
    [
        log(improvement) + belief,
        log(normal.cdf(z)) + belief,
        -mean + BETA * sd + scale * belief,
    ]
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
    fn a_wrong_belief_is_outlived_and_a_right_one_is_quick() {
        let guided = |middle: Scores| Guess {
            starts: vec![middle, [middle[0] + 0.2, middle[1], middle[2], middle[3]]],
            middle,
            sd: [0.15; DIMENSIONS],
        };
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
