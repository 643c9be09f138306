//! Where the world departs from plain laws: what the diagnosis found, as the twin and its exports carry it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::Estimate;

/// A departure from the plain laws that no other field of the twin holds.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Effect {
    /// A name of the catalogue of causes.
    pub cause: String,
    /// Body, link, joint, relation or `support`.
    #[serde(rename = "where")]
    pub place: String,
    /// Its probability.
    pub probability: f64,
    /// What it is parametrised by.
    pub parameters: BTreeMap<String, Estimate>,
}

/// What a joint does beyond friction, damping and a spring.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct JointEffects {
    /// What sets it going, over the friction that keeps it going, N·m or N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub static_excess: Option<Estimate>,
    /// Places that hold it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub detents: Vec<Detent>,
    /// Another joint that it follows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coupling: Option<Coupling>,
    /// Free way to either side of the middle, rad or m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub backlash: Option<Estimate>,
}

/// A place that holds a joint: pushed out of it to either side it is drawn back, until it is free.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Detent {
    /// It lies at the end of the way: a latch or a magnet.
    pub latch: bool,
    /// Where it holds, rad or m, zero at the first view.
    pub position: Estimate,
    /// The largest load with which it draws back, N·m or N.
    pub load: Estimate,
    /// Distance from its middle at which it draws back the most, rad or m.
    pub reach: Estimate,
}

/// A joint that moves as another one does, whether anybody touches it or not.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Coupling {
    /// The joint that it follows.
    pub leader: String,
    /// Its motion for each unit of the leader's, rad or m over rad or m; both are at zero at the first view.
    pub ratio: Estimate,
}

impl JointEffects {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.static_excess.is_none() && self.detents.is_empty() && self.coupling.is_none() && self.backlash.is_none()
    }
}
