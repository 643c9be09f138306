//! What the simulation still gets wrong, why, and what each extension gained (`diagnosis.json`).

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::budget::Budget;
use super::cause::CAUSES;
use crate::base::Estimate;

/// The value of `format` in `diagnosis.json`.
pub const DIAGNOSIS_FORMAT: &str = "palpate-diagnosis/1";

/// The whole of `diagnosis.json`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Diagnosis {
    /// `palpate-diagnosis/1`.
    pub format: String,
    /// The held-out error of the model as first fitted.
    pub base: BaseFit,
    /// What it comes to.
    pub verdict: Verdict,
    /// The named effects, in the order in which they were taken up.
    pub findings: Vec<Finding>,
    /// What to measure next.
    pub experiments: Vec<Experiment>,
    /// What gave each finding away, and what naming it changed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub profiles: Vec<Profile>,
    /// Of what the errors of the plain model are made.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budgets: Vec<Budget>,
    /// Where the verdict is `unknown`: what is missed most, worst first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missed: Vec<Miss>,
    /// Where the verdict is `unknown`: by what it is seen, and what it depends on beyond doubt.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left: Vec<Evidence>,
}

impl Diagnosis {
    /// Whether no prediction was laid beside a measurement: then `unknown` says nothing against the model.
    pub fn compares_nothing(&self) -> bool {
        self.base.rmse.is_empty()
    }
}

/// A quantity of one interaction that the model, with all that it has a name for, does not foretell.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Miss {
    /// Name of the interaction.
    pub interaction: String,
    /// Whether it was held out.
    pub held_out: bool,
    /// `force`, `torque`, `position`, … or a curve of the twin's: `box: across the push`.
    pub quantity: String,
    /// SI unit of it.
    pub unit: String,
    /// Root mean square error.
    pub rmse: f64,
    /// What the noise of the sensors alone would leave, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// What either is of: `means over 0.25 s`, …
    pub of: String,
}

impl Diagnosis {
    /// Causes of the catalogue that were tried and not found: those that no finding names or leaves open, and that no experiment is
    /// asked for to show. A cause that could not be tried stands in an experiment without bits.
    pub fn tried(&self) -> impl Iterator<Item = &'static str> {
        let named = |c: &str| {
            let of = |f: &Finding| f.cause == c || f.alternatives.iter().any(|a| a.cause == c);
            self.findings.iter().any(of)
        };
        let unseen = |c: &str| {
            let mut showing = self.experiments.iter().filter(|e| e.bits.is_none());
            showing.any(|e| e.parts.iter().any(|p| p == c))
        };
        CAUSES.into_iter().filter(move |c| !named(c) && !unseen(c))
    }
}

/// What is left of the measurement against what it depends on most, and one interaction, without and with a finding. SI units.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Profile {
    /// The finding's cause.
    pub cause: String,
    /// And its place.
    #[serde(rename = "where")]
    pub place: String,
    /// `force`, `torque`, `position`, …
    pub quantity: String,
    /// SI unit of it.
    pub unit: String,
    /// What the residual is laid out against, and its SI unit.
    pub covariate: String,
    /// SI unit of the covariate.
    pub covariate_unit: String,
    /// Means over stretches of the covariate, lowest first; none for what no law of a ladder told.
    pub bins: Vec<ProfileBin>,
    /// The interaction on which the finding changes most, a held-out one where there is any.
    pub interaction: String,
    /// Whether it was held out.
    pub held_out: bool,
    /// Samples of it.
    pub samples: Vec<ProfileSample>,
}

/// Measured less foretold over a stretch of the covariate, without and with the finding.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ProfileBin {
    /// Mean of the covariate.
    pub at: f64,
    /// By the model without the finding.
    pub before: f64,
    /// By the model with all findings.
    pub after: f64,
    /// Standard deviation of these means, by how much interactions differ.
    pub sd: f64,
}

/// One reading with what was foretold of it.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ProfileSample {
    /// s since the interaction's first sample.
    pub time: f64,
    /// As read.
    pub measured: f64,
    /// By the model without the finding.
    pub before: f64,
    /// By the model with all findings.
    pub after: f64,
}

/// The held-out error of the model as first fitted, by quantity (`force`, `position`, `rotation`, …).
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct BaseFit {
    /// Root mean square error by quantity, SI.
    pub rmse: BTreeMap<String, f64>,
    /// What the sensors alone would leave, by quantity, SI.
    pub noise_floor: BTreeMap<String, f64>,
    /// Share of the variance above the noise, 0 to 1.
    pub unexplained: f64,
    /// The interactions that the error was measured on.
    pub held_out: Vec<String>,
    /// Residual tests: which channel, which test, its p-value.
    #[serde(default)]
    pub tests: Vec<Evidence>,
}

/// What a diagnosis comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Nothing is left above the noise.
    Adequate,
    /// Every finding has a name.
    Explained,
    /// The data cannot tell between named causes.
    Ambiguous,
    /// Something is left that no named cause explains.
    Unknown,
}

/// One named effect.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// A name of the catalogue of causes.
    pub cause: String,
    /// Body, link, joint, relation, sensor or `support`.
    #[serde(rename = "where")]
    pub place: String,
    /// Its probability.
    pub probability: f64,
    /// All that these data cannot rule out.
    pub alternatives: Vec<CauseOdds>,
    /// What the extension is parametrised by.
    pub parameters: BTreeMap<String, Estimate>,
    /// Which residual showed it.
    pub evidence: Vec<Evidence>,
    /// What it gained on interactions that it did not fit.
    pub gain: Gain,
    /// The joint that leads, of one that follows another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub leader: Option<String>,
    /// What was believed of each parameter before the data; none where an estimator of its own gave them without any belief.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub priors: BTreeMap<String, Prior>,
}

/// What is below this probability is less likely than not.
const EVEN: f64 = 0.5;

impl Finding {
    /// Whether neither its cause nor another one that would do is likely: something without a name is.
    pub fn doubtful(&self) -> bool {
        let others = self.alternatives.iter().map(|a| a.probability);
        self.probability + others.sum::<f64>() < EVEN
    }

    /// Keeps so large a share of all of its odds.
    pub fn less_likely(&mut self, share: f64) {
        self.probability *= share;
        self.alternatives.iter_mut().for_each(|a| a.probability *= share);
    }
}

/// What was believed of a parameter before the data.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Prior {
    /// Its distribution, cut to the bounds.
    pub family: PriorFamily,
    /// Mean of a normal one, median of a log-normal one, in `unit`.
    pub centre: f64,
    /// Standard deviation: in `unit`, or of the natural logarithm.
    pub sd: f64,
    /// Least and largest value, in `unit`.
    pub bounds: [f64; 2],
    /// SI, `1` for a pure number.
    pub unit: String,
}

/// The distribution of a prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PriorFamily {
    /// About its mean.
    Normal,
    /// Of its logarithm.
    LogNormal,
}

/// A cause and its probability.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct CauseOdds {
    /// A name of the catalogue of causes.
    pub cause: String,
    /// Its probability.
    pub probability: f64,
}

/// A residual, the test that was made of it, and the p-value.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Evidence {
    /// Which residual, e.g. `force of push-03 against speed`.
    pub residual: String,
    /// Which test, e.g. `Ljung-Box, 20 lags`.
    pub test: String,
    /// Its statistic.
    pub statistic: f64,
    /// Its p-value.
    pub p_value: f64,
    /// In plain words.
    pub words: String,
}

/// The measured gain of an extension on held-out interactions.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Gain {
    /// `force`, `position`, …
    pub quantity: String,
    /// Before the extension.
    pub rmse_before: f64,
    /// After the extension.
    pub rmse_after: f64,
    /// SI unit of both.
    pub unit: String,
    /// The interactions that it was measured on.
    pub held_out: Vec<String>,
    /// Share of the error above the noise floor that went away.
    pub reduction: f64,
    /// What both errors are of: `means over 40 ms`, …; empty where they are of single readings.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub of: String,
    /// What the noise of the sensors alone would leave of the same, where that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
}

/// An experiment that would tell causes apart.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Experiment {
    /// What to do, in words.
    pub words: String,
    /// The causes that it would tell apart.
    pub parts: Vec<String>,
    /// Expected information, bits; absent where it was not computed.
    #[serde(default)]
    pub bits: Option<f64>,
    /// The touches of which it consists, one after the other, where they were worked out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub touches: Vec<AskedTouch>,
}

/// What tells most first, and last what would only show something of which nothing is known.
pub fn in_order(experiments: &mut [Experiment]) {
    let bits = |e: &Experiment| e.bits.unwrap_or(f64::NEG_INFINITY);
    experiments.sort_by(|a, b| bits(b).total_cmp(&bits(a)));
}

/// A touch that is asked for, as a robot could make it. World frame, SI units; the keys that the rig protocol has too mean
/// the same.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AskedTouch {
    /// `push`, `pull`, `press` or `lift`.
    pub kind: String,
    /// Body or link.
    pub target: String,
    /// Where the tool meets or holds it, with the target where it was at first, m.
    pub start: [f64; 3],
    /// Where the tool goes from there at first, a unit vector.
    pub direction: [f64; 3],
    /// How far it goes behind the contact, m; along the arc of a hinge where the target hangs on one.
    pub travel: f64,
    /// m/s.
    pub speed: f64,
    /// How long it stays at the end, s.
    pub duration: f64,
    /// How long nothing touches the target before, s.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub wait: f64,
    /// With which force the tool presses down what it moves, N.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub down: f64,
    /// By how much the tool is turned about the support's normal from how it was held before, rad; in a lift, by how much what
    /// hangs on it is twisted to and fro, twice.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub turned: f64,
    /// The tool goes back the same way.
    #[serde(default, skip_serializing_if = "is_false")]
    pub back: bool,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

fn is_false(x: &bool) -> bool {
    !*x
}
