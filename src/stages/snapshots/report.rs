//! What the inference from snapshots hands on: for the page, for the diagnosis, for whoever predicts.

use super::bench::Group;
use super::effects::Effect;
use super::learnt::Seen;
use super::posterior::Marginal;
use super::space::DIMENSIONS;

/// The inference of all things of a capture.
#[derive(Clone, Debug, Default)]
pub struct Snapshots {
    /// By name.
    pub things: Vec<ThingResult>,
}

/// One thing.
#[derive(Clone, Debug)]
pub struct ThingResult {
    /// Its link.
    pub name: String,
    /// Its groups of trials.
    pub groups: Vec<GroupResult>,
    /// The optimiser's evaluations in order.
    pub search: Vec<SearchStep>,
    /// Posterior of friction, rolling resistance, friction against the tool and restitution.
    pub marginals: [Marginal; DIMENSIONS],
    /// Prior medians of the same.
    pub before: [f64; DIMENSIONS],
    /// Whether the data fixed each of them.
    pub fixed: [bool; DIMENSIONS],
    /// Whether it fell over in some of the fitted trials.
    pub tips: bool,
    /// What it tells of things of its kind.
    pub seen: Seen,
    /// Whether its mass is known or was told by forces.
    pub weighed: bool,
    /// The optimiser's best point, as values.
    pub best: [f64; DIMENSIONS],
    /// Share of the travel by which the simulation is off.
    pub share: f64,
    /// Number of points that the posterior is worth.
    pub effective: f64,
    /// Simulated trials altogether.
    pub simulated: usize,
}

/// Trials of one tool and one action.
#[derive(Clone, Debug)]
pub struct GroupResult {
    /// Tool, action, and whether it was held out.
    pub group: Group,
    /// Names of the interactions.
    pub interactions: Vec<String>,
    /// Measured displacements on the support, m.
    pub measured: Vec<Effect>,
    /// Simulated at the prior's medians.
    pub at_prior: Vec<Effect>,
    /// Simulated at draws of the posterior, with the error of the simulation itself.
    pub at_posterior: Vec<Effect>,
    /// Kullback-Leibler divergence from the prior's and the posterior's simulation, nats.
    pub divergence: [f64; 2],
    /// Energy distance to both, m.
    pub energy: [f64; 2],
    /// Predicted mean displacement and its 95 % interval per axis, m: of the mean of as many trials as were measured.
    pub predicted_mean: Effect,
    /// 95 % interval of one further trial, per axis, m.
    pub interval: [[f64; 2]; 2],
    /// Share of predictions as far from the middle as the measured mean.
    pub p_value: f64,
}

/// One evaluation of the optimiser.
#[derive(Clone, Debug)]
pub struct SearchStep {
    /// Mean divergence over the fitted groups, nats.
    pub train: f64,
    /// The same over the held-out groups, where this step improved on all before and there are any.
    pub test: Option<f64>,
    /// Whether it improved on all before.
    pub improved: bool,
    /// Whether, judged again from common starts, it did so by more than the scatter of the trials explains; the first one too.
    pub fell: bool,
    /// The values tried.
    pub values: [f64; DIMENSIONS],
}
