//! What an interaction measured beside what the twin predicts, as curves to be drawn.

use std::collections::BTreeMap;

use crate::base::Pose;

/// What a curve is of; errors are gathered by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// N.
    Force,
    /// N·m.
    Torque,
    /// m.
    Position,
    /// rad.
    Rotation,
    /// m, of a thrown body over the rest of its flight.
    Flight,
    /// m, of a thrown body after its first bounce, foretold in one go: impacts are chaotic.
    Bounced,
}

impl Quantity {
    /// Its name in `diagnosis.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Torque => "torque",
            Self::Position => "position",
            Self::Rotation => "rotation",
            Self::Flight => "position-in-flight",
            Self::Bounced => "position-after-bounce",
        }
    }

    /// Its SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Torque => "N·m",
            Self::Position | Self::Flight | Self::Bounced => "m",
            Self::Rotation => "rad",
        }
    }

    /// An amount of it as people say it, with its unit.
    pub fn spoken(self, amount: f64) -> String {
        match self {
            Self::Force => format!("{amount:.3} N"),
            Self::Torque => format!("{:.2} N·mm", 1e3 * amount),
            Self::Position | Self::Flight | Self::Bounced => format!("{:.2} mm", 1e3 * amount),
            Self::Rotation => format!("{:.2} degrees", amount.to_degrees()),
        }
    }
}

/// One quantity over time, measured and predicted, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// E.g. `force along the push`, `tin: along the push`.
    pub label: String,
    /// What it is of.
    pub quantity: Quantity,
    /// Seconds.
    pub time: Vec<f64>,
    /// As measured; NaN where missing.
    pub measured: Vec<f64>,
    /// As the twin predicts; NaN where it does not say, empty where there is no prediction.
    pub predicted: Vec<f64>,
    /// One standard deviation of the sensor.
    pub noise: Option<f64>,
}

/// The curves of one interaction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Its name.
    pub interaction: String,
    /// It was not used to fit.
    pub held_out: bool,
    /// Why there is no prediction, or what was fitted anew for this interaction.
    pub remark: Option<String>,
    /// Its curves.
    pub curves: Vec<Curve>,
    /// How far each of them may be off for what is not known of the twin's numbers (1 sd), in the curve's unit at its times;
    /// empty where that was not asked.
    pub doubt: Vec<Vec<f64>>,
    /// Where the twin has each link go, by its name; links of which it does not say are left out.
    pub paths: BTreeMap<String, Path>,
}

/// A predicted motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Path {
    /// Seconds, as in the recording.
    pub time: Vec<f64>,
    /// World-from-link.
    pub poses: Vec<Pose>,
}

/// What was predicted of one interaction.
#[derive(Clone, Debug, Default)]
pub(super) struct Predicted {
    pub(super) curves: Vec<Curve>,
    /// Their doubts.
    pub(super) doubt: Vec<Vec<f64>>,
    /// What was fitted anew.
    pub(super) remark: Option<String>,
    pub(super) paths: BTreeMap<String, Path>,
}
