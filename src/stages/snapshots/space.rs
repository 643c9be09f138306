//! The parameters that outcomes depend on, and what is believed of them beforehand, as standard normal scores.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

use super::Config;
use crate::physics::tabletop::Coefficients;

/// Parameters that are inferred.
pub const DIMENSIONS: usize = 4;

/// A point as standard normal scores under the prior.
pub type Scores = [f64; DIMENSIONS];

/// The prior of one positive parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prior {
    /// Median, standard deviation of the logarithm.
    LogNormal(f64, f64),
    /// Lowest, highest.
    LogUniform(f64, f64),
}

fn normal() -> Normal {
    Normal::standard()
}

impl Prior {
    /// The value at a standard normal score.
    pub fn value(&self, score: f64) -> f64 {
        let score = score.clamp(-6.0, 6.0);
        match self {
            Self::LogNormal(median, sd) => median * (sd * score).exp(),
            Self::LogUniform(low, high) => low * (high / low).powf(normal().cdf(score)),
        }
    }

    /// Spread of the logarithm.
    pub fn width(&self) -> f64 {
        match self {
            Self::LogNormal(_, sd) => *sd,
            Self::LogUniform(low, high) => (high / low).ln() / 12f64.sqrt(),
        }
    }

    /// The standard normal score of a value.
    pub fn score(&self, value: f64) -> f64 {
        let of_share = |share: f64| normal().inverse_cdf(share.clamp(1e-9, 1.0 - 1e-9));
        match self {
            Self::LogNormal(median, sd) => (value / median).ln() / sd,
            Self::LogUniform(low, high) => of_share((value / low).ln() / (high / low).ln()),
        }
    }
}

/// The priors of friction, rolling resistance, friction against the tool, restitution at the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// In the order of [`NAMES`].
    pub priors: [Prior; DIMENSIONS],
}

/// Time constant of a contact at the tool that does not rebound, s.
const YIELDING: f64 = 4e-3;

/// What the parameters are called.
pub const NAMES: [&str; DIMENSIONS] = ["friction", "rolling resistance", "tool friction", "restitution"];
/// Their units.
pub const UNITS: [&str; DIMENSIONS] = ["1", "m", "1", "1"];

impl Space {
    /// The settings' priors; `friction` replaces that of the support where it is known better (value, sd).
    pub fn new(config: &Config, friction: Option<(f64, f64)>) -> Self {
        let lateral = match friction {
            Some((value, sd)) => Prior::LogNormal(value, (sd / value).max(0.01)),
            None => Prior::LogNormal(config.friction.0, config.friction.1),
        };
        Self {
            priors: [
                lateral,
                Prior::LogUniform(config.rolling.0, config.rolling.1),
                Prior::LogNormal(config.tool_friction.0, config.tool_friction.1),
                Prior::LogNormal(config.restitution.0, config.restitution.1),
            ],
        }
    }

    /// The coefficients at a point.
    pub fn coefficients(&self, scores: &Scores) -> Coefficients {
        let v: Scores = std::array::from_fn(|k| self.priors[k].value(scores[k]));
        Coefficients {
            friction: v[0].min(10.0),
            rolling: v[1],
            tool_friction: v[2].min(10.0),
            restitution: v[3].min(0.9),
            yielding: YIELDING,
        }
    }
}

/// What is believed of the parameters, and the scale on which the search moves: that of a thing of which nothing is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// The prior.
    pub prior: Space,
    /// The search's.
    pub search: Space,
    /// Where things of its kind fitted best, if any are known: values.
    pub begin: Option<[f64; DIMENSIONS]>,
}

impl Scales {
    /// Both the same.
    pub fn plain(space: Space) -> Self {
        Self {
            prior: space,
            search: space,
            begin: None,
        }
    }

    /// A point of the prior's scale on that of the search.
    pub fn to_search(&self, at: &Scores) -> Scores {
        across(&self.prior, &self.search, at)
    }

    /// A point of the search's scale on that of the prior.
    pub fn to_prior(&self, at: &Scores) -> Scores {
        across(&self.search, &self.prior, at)
    }
}

fn across(from: &Space, to: &Space, at: &Scores) -> Scores {
    std::array::from_fn(|k| {
        if from.priors[k] == to.priors[k] {
            return at[k];
        }
        to.priors[k].score(from.priors[k].value(at[k])).clamp(-6.0, 6.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_and_values_lead_to_each_other() {
        let space = Space::new(&Config::default(), None);
        for prior in space.priors {
            for score in [-2.0, -0.5, 0.0, 1.0, 2.0] {
                assert!(
                    (prior.score(prior.value(score)) - score).abs() < 1e-5,
                    "{prior:?} at {score}"
                );
            }
        }
    }
}
