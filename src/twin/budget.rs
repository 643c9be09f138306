//! Of what the error of the plain model is made.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::diagnosis::Finding;

/// Of what the mean squared error of the plain model is made, as shares of it that sum to one.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Budget {
    /// `force`, `torque`, `position`, …
    pub quantity: String,
    /// SI unit of it.
    pub unit: String,
    /// Root mean square error of the plain model.
    pub rmse: f64,
    /// The same without what fitting the contact of each touch anew takes away, where findings are told from what that leaves: what
    /// their gains begin with.
    #[serde(default)]
    pub beside_contact: f64,
    /// What it is of, as in a gain.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub of: String,
    /// The interactions that it is about.
    pub interactions: Vec<String>,
    /// The causes that are named of these interactions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub causes: Vec<String>,
    /// What the findings take away.
    pub named: f64,
    /// What they take away where none of them is likely.
    #[serde(default)]
    pub doubtful: f64,
    /// What differs from repeat to repeat of the same touch: the level of friction or stiffness.
    pub friction_law: f64,
    /// What each contact leaves open: where the surface begins, its direction, a tare.
    pub geometry: f64,
    /// When exactly a reading was taken, and what still rings.
    pub timing: f64,
    /// What the sensors read at rest.
    pub noise: f64,
    /// The rest.
    pub unexplained: f64,
}

impl Budget {
    /// What findings take away is not explained by them where none is likely.
    pub fn doubted(mut self, findings: &[Finding]) -> Self {
        let own = || findings.iter().filter(|f| self.causes.contains(&f.cause));
        if own().next().is_some() && own().all(Finding::doubtful) {
            self.doubtful += std::mem::take(&mut self.named);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::twin::{CauseOdds, Gain};

    fn budget() -> Budget {
        Budget {
            beside_contact: 0.0,
            quantity: "force".into(),
            unit: "N".into(),
            rmse: 0.3,
            of: String::new(),
            interactions: Vec::new(),
            causes: vec!["support-tilt".into()],
            named: 0.9,
            doubtful: 0.0,
            friction_law: 0.0,
            geometry: 0.0,
            timing: 0.0,
            noise: 0.1,
            unexplained: 0.0,
        }
    }

    fn finding(cause: &str, odds: [f64; 2]) -> Finding {
        Finding {
            leader: None,
            priors: BTreeMap::new(),
            cause: cause.into(),
            place: "support".into(),
            probability: odds[0],
            alternatives: vec![CauseOdds {
                cause: "gravity-error".into(),
                probability: odds[1],
            }],
            evidence: Vec::new(),
            parameters: BTreeMap::new(),
            gain: Gain::default(),
        }
    }

    #[test]
    fn an_unlikely_name_explains_nothing_and_one_of_two_does() {
        let shares = |found: Finding| {
            let b = budget().doubted(&[found]);
            [b.named, b.doubtful]
        };
        assert_eq!(shares(finding("support-tilt", [0.2, 0.05])), [0.0, 0.9]);
        assert_eq!(shares(finding("support-tilt", [0.49, 0.48])), [0.9, 0.0]);
        // Renamed since, as two causes that are one.
        assert_eq!(shares(finding("nonuniform-density", [0.2, 0.05])), [0.9, 0.0]);
    }
}
