//! What the ladder of laws needs to know of a kind of experiment: its samples, its plain model, and the laws that may
//! extend it. Every law is nested: with its amplitudes at zero the model is the plain one.

use super::Quantity;
use super::asking::Imagined;
use super::fit::Fit;
use super::levels::Level;
use crate::twin::Evidence;

/// A parameter with its prior: normal with `sd` about `centre`, cut to `low..high`. With `log` the parameter is the
/// natural logarithm of a positive quantity in `unit`.
#[derive(Clone, Debug)]
pub struct Parameter {
    pub name: &'static str,
    pub unit: &'static str,
    pub centre: f64,
    pub sd: f64,
    pub low: f64,
    pub high: f64,
    pub log: bool,
}

impl Parameter {
    /// An amplitude of either sign.
    pub fn amplitude(name: &'static str, unit: &'static str, sd: f64) -> Self {
        let (centre, low, high, log) = (0.0, -8.0 * sd, 8.0 * sd, false);
        Self {
            name,
            unit,
            centre,
            sd,
            low,
            high,
            log,
        }
    }

    /// An amplitude that cannot be negative.
    pub fn positive(name: &'static str, unit: &'static str, sd: f64) -> Self {
        Self {
            low: 0.0,
            ..Self::amplitude(name, unit, sd)
        }
    }

    /// A shape parameter, normal about `centre`.
    pub fn place(name: &'static str, centre: f64, sd: f64) -> Self {
        let (low, high) = (centre - 4.0 * sd, centre + 4.0 * sd);
        Self {
            name,
            unit: "m",
            centre,
            sd,
            low,
            high,
            log: false,
        }
    }

    /// When a reading that creeps was nought, s before the capture's first moment: sensors are set to nought about then.
    pub fn nought_before() -> Self {
        Self {
            unit: "s",
            ..Self::place("since", 0.0, 3.0)
        }
    }

    /// The power of a speed with which what damps grows, below that of a linear damper.
    pub fn less_than_linear() -> Self {
        Self {
            name: "power",
            unit: "1",
            low: 0.45,
            high: 1.0,
            ..Self::place("power", 0.75, 0.15)
        }
    }

    /// The power of a speed with which what damps grows, where no other cause grows faster.
    pub fn about_linear() -> Self {
        Self {
            name: "power",
            unit: "1",
            low: 0.45,
            high: 2.0,
            ..Self::place("power", 1.0, 0.3)
        }
    }

    /// A positive shape parameter, log-normal with this median.
    pub fn scale(name: &'static str, unit: &'static str, median: f64, log_sd: f64) -> Self {
        let centre = median.ln();
        let (low, high) = (centre - 3.0 * log_sd, centre + 3.0 * log_sd);
        Self {
            name,
            unit,
            centre,
            sd: log_sd,
            low,
            high,
            log: true,
        }
    }

    /// The prior's width counts twice where only one sign is possible.
    pub fn log_prior_volume(&self) -> f64 {
        let half = self.low == self.centre || self.high == self.centre;
        self.sd.ln() - if half { std::f64::consts::LN_2 } else { 0.0 }
    }
}

/// One form of one cause.
#[derive(Clone, Debug)]
pub struct Law {
    /// A name of the catalogue of causes.
    pub cause: &'static str,
    /// Body, link, joint, relation, sensor or `support`.
    pub place: String,
    /// Which form of the cause this is, for the family's own use.
    pub form: usize,
    /// Amplitudes first.
    pub parameters: Vec<Parameter>,
    /// How many of the parameters are amplitudes.
    pub amplitudes: usize,
    /// Values of the shape parameters from which a fit may start; of those that it has beyond the forms that it extends, where it does.
    pub grid: Vec<Vec<f64>>,
    /// Forms whose shape parameters are the first of its own: it is looked for only where one of them was taken up, from there on.
    pub extends: &'static [usize],
    /// In plain words what it means.
    pub words: &'static str,
}

/// A law that is switched on, with its parameters.
#[derive(Clone, Debug)]
pub struct Active<'a> {
    pub law: &'a Law,
    pub values: &'a [f64],
}

/// Samples of one channel of one interaction.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Which of the family's channel kinds.
    pub kind: usize,
    /// SI.
    pub measured: Vec<f64>,
    /// Where a run of neighbouring samples begins.
    pub starts: Vec<bool>,
    /// Change of the signal from one sample to the next, SI: there timing errors count.
    pub change: Vec<f64>,
    /// Standard deviation of what the model leaves out on purpose, SI: the ringing after an impact.
    pub aside: Vec<f64>,
}

/// One interaction.
#[derive(Clone, Debug)]
pub struct Group {
    pub name: String,
    pub held_out: bool,
    pub channels: Vec<Channel>,
}

/// What is known of the noise of a kind of channel.
#[derive(Clone, Debug)]
pub struct ChannelKind {
    pub quantity: Quantity,
    /// Standard deviation of a sample at rest.
    pub sigma: f64,
    /// Tolerance for jitter of time, as a share of the change per sample.
    pub jitter: f64,
}

/// What is new in every interaction: a random effect.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Standard deviation before the data are seen.
    pub tau: f64,
    /// How many interactions that knowledge counts for.
    pub counts: f64,
    /// It is never taken to be smaller.
    pub floor: f64,
    /// No model could foretell it: where a surface begins, a tare.
    pub nuisance: bool,
    /// Finite step for derivatives.
    pub step: f64,
}

/// Samples, plain model and laws of a kind of experiment.
#[derive(Clone, Debug, Default)]
pub struct Sheet {
    pub groups: Vec<Group>,
    pub kinds: Vec<ChannelKind>,
    pub base: Vec<Parameter>,
    pub scatter: Vec<Scatter>,
    pub laws: Vec<Law>,
}

/// Name, unit, and values over all channels of a group, NaN where not defined.
pub type Covariate = (&'static str, &'static str, Vec<f64>);

/// The interactions of some groups, each once: a hand that goes to and fro makes several groups of one.
pub fn interactions(family: &dyn Family, groups: &[usize]) -> Vec<String> {
    let mut names: Vec<String> = groups.iter().map(|g| family.groups()[*g].name.clone()).collect();
    names.dedup();
    names
}

/// A kind of experiment with its plain model and its laws.
pub trait Family: Sync {
    fn sheet(&self) -> &Sheet;
    /// All channels of a group, one after the other.
    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64>;
    /// Covariates of a group's samples, for profiles.
    fn covariates(&self, group: usize) -> Vec<Covariate>;

    /// Covariates beside those, of which it is only asked whether what named causes leave depends on them.
    fn besides(&self, _group: usize) -> Vec<Covariate> {
        Vec::new()
    }

    /// Covariates that are made for profiles alone, beside a law with these values where there is one.
    fn only_shown(&self, _group: usize, _law: Option<(usize, &[f64])>) -> Vec<Covariate> {
        Vec::new()
    }

    /// The kind of channel that a law is about, on which its gain is measured.
    fn about(&self, _law: usize) -> usize {
        0
    }

    /// Whether a law with these values is less than what the plain model itself may be off by.
    fn negligible(&self, _law: usize, _values: &[f64]) -> bool {
        false
    }

    /// The same of a law whose values are known to these standard deviations: whether they may well be that little.
    fn may_be_negligible(&self, law: usize, values: &[f64], _sds: &[f64]) -> bool {
        self.negligible(law, values)
    }

    /// Where the base may have to start beside a law without an amplitude, which does not tell it to make room.
    fn afresh(&self, _law: usize) -> Vec<f64> {
        self.base().iter().map(|p| p.centre).collect()
    }

    /// Whether held-out interactions pass the same places as the fitted ones.
    fn passes_all_places(&self) -> bool {
        false
    }

    /// What a sample is, in words: `means over 40 ms`; nothing where it is a single reading.
    fn samples_are(&self) -> &'static str {
        ""
    }

    /// Whether neighbouring samples err freely of each other where the model is right: a hand that rings makes them not.
    fn samples_are_free(&self) -> bool {
        false
    }

    /// Whether these experiments could show a law at all; else it is neither named nor a rival, but untestable.
    fn shows(&self, _law: usize) -> bool {
        true
    }

    /// Log evidence over the plain model, nats, from which on a law with these values is named.
    fn named_from(&self, _law: usize, _values: &[f64]) -> f64 {
        super::naming::NAMED
    }

    /// Whether what is new in every interaction is the tare of a sensor, after what it read at rest was taken out.
    fn is_tare(&self, _scatter: usize) -> bool {
        false
    }

    /// How common a law is in such a setting beside others that do as well, as a factor.
    fn commonness(&self, _law: usize) -> f64 {
        1.0
    }

    /// What is known beforehand of how common a law is, nats of evidence: it decides between laws that do as well.
    fn head_start(&self, law: usize) -> f64 {
        super::named::TEMPERATURE * self.commonness(law).ln()
    }

    /// Causes, with the place, that other tests may have named and that this fit shows to be feigned by a law it took up.
    fn feigned(&self, _full: &super::fit::Fit) -> Vec<(&'static str, &str)> {
        Vec::new()
    }

    /// What differs from one repeat to the next, in the unit of the first kind of channel: no law foretells it.
    fn unforeseen(&self) -> f64 {
        0.0
    }

    /// What the plain model may take up, since it is often so, and yet foretells nothing elsewhere, where it is far more than usual.
    fn taken_up(&self, _plain: &Fit) -> Option<Evidence> {
        None
    }

    /// What speaks against a law with these values that fits what was read: then something is wrong that has no name.
    fn refuted(&self, _law: usize, _values: &[f64]) -> Option<Evidence> {
        None
    }

    /// Share by which all amplitudes may be off together.
    fn common_doubt(&self) -> f64 {
        0.0
    }

    /// Doubt of where its places are counted from, in their unit.
    fn place_doubt(&self) -> f64 {
        0.0
    }

    /// What its shared numbers are beside the effects of a fit.
    fn levels(&self, _: &Fit) -> Vec<Level> {
        Vec::new()
    }

    /// The family with touches that could be made next; nothing where it cannot foretell any.
    fn imagined(&self) -> Option<Imagined> {
        None
    }

    fn groups(&self) -> &[Group] {
        &self.sheet().groups
    }
    fn kinds(&self) -> &[ChannelKind] {
        &self.sheet().kinds
    }
    fn base(&self) -> &[Parameter] {
        &self.sheet().base
    }
    fn scatter(&self) -> &[Scatter] {
        &self.sheet().scatter
    }
    fn laws(&self) -> &[Law] {
        &self.sheet().laws
    }
}
