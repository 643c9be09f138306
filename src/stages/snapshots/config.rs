//! What can be set for the inference from snapshots.

use super::{Keeper, LearntPrior};
use crate::base::{Error, Result};

/// Settings of the inference from snapshots; the defaults need no change.
#[derive(Clone, Debug)]
pub struct Config {
    /// Evaluations of the divergence that the optimiser may ask for.
    pub evaluations: usize,
    /// Simulated trials of one evaluation, over all trials that may be fitted.
    pub simulations: usize,
    /// Rounds of the population Monte Carlo, and parameter points of each.
    pub rounds: usize,
    /// Parameter points of a round.
    pub points: usize,
    /// Correlation of the model's errors between trials of one tool and action: repeated trials share them.
    pub shared_error: f64,
    /// Doubt of where a thing stood relative to the tool, where the capture does not state it, m (1 sd per axis).
    pub place_sd: f64,
    /// Friction of an unknown pair: median and standard deviation of its logarithm.
    pub friction: (f64, f64),
    /// Friction against the tool, likewise.
    pub tool_friction: (f64, f64),
    /// Least and largest rolling resistance, m (log-uniform).
    pub rolling: (f64, f64),
    /// Restitution at the tool: median and standard deviation of its logarithm. A little of it is in every contact that
    /// yields, and how fast a thing leaves the tool decides how far it coasts.
    pub restitution: (f64, f64),
    /// Density of an unknown body, kg/m³, and the standard deviation of its logarithm.
    pub density: (f64, f64),
    /// A parameter counts as measured where the data leave at most this share of its prior spread...
    pub contraction: f64,
    /// ... and at most this share of the spread that is believed of a thing of which nothing is known.
    pub certain: f64,
    /// What was learnt from things already seen.
    pub learnt: Option<LearntPrior>,
    /// Where searches go on from, and are put down after every evaluation.
    pub keeper: Option<Keeper>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            evaluations: 40,
            simulations: 960,
            rounds: 5,
            points: 72,
            shared_error: 0.6,
            place_sd: 2e-3,
            friction: (0.35, 0.7),
            tool_friction: (0.3, 0.5),
            rolling: (1e-6, 1e-2),
            restitution: (0.05, 1.0),
            density: (700.0, 0.7),
            contraction: 0.5,
            certain: 0.25,
            learnt: None,
            keeper: None,
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let counts = self.evaluations >= 4 && self.simulations >= 8 && self.rounds >= 1 && self.points >= 16;
        let positive = [
            self.place_sd,
            self.friction.0,
            self.friction.1,
            self.tool_friction.0,
            self.tool_friction.1,
            self.rolling.0,
            self.restitution.0,
            self.restitution.1,
            self.density.0,
            self.density.1,
        ]
        .iter()
        .all(|v| *v > 0.0 && v.is_finite());
        let shares = (0.0..=1.0).contains(&self.shared_error)
            && (0.0..=1.0).contains(&self.contraction)
            && (0.0..=1.0).contains(&self.certain);
        if counts && positive && shares && self.rolling.1 > self.rolling.0 {
            return Ok(());
        }
        Err(Error::Usage("snapshots: a setting is out of its range".into()))
    }
}
