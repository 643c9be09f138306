//! How to run: the seed, the passes, and the settings of every stage.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::Pass;
use crate::base::Seed;
use crate::stages::{articulation, diagnosis, estimation, interaction, relations, shape, snapshots, symmetry};

/// How to run; the defaults need no change.
#[derive(Clone, Debug)]
pub struct Options {
    /// Seed of everything in which chance plays a part.
    pub seed: Seed,
    /// The passes to run.
    pub passes: Vec<Pass>,
    /// Write the wall seconds of each pass into the twin (which then differs from run to run).
    pub timings: bool,
    /// Shape pass.
    pub shape: shape::Config,
    /// Symmetry pass.
    pub symmetry: symmetry::Config,
    /// Interaction pass.
    pub interaction: interaction::Config,
    /// Physics pass.
    pub estimation: estimation::Config,
    /// Inference from snapshot pairs, in the physics pass.
    pub snapshots: snapshots::Config,
    /// Relations pass.
    pub relations: relations::Config,
    /// Articulation pass.
    pub articulation: articulation::Config,
    /// Diagnosis pass.
    pub diagnosis: diagnosis::Config,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: Seed(0),
            passes: Pass::ALL.to_vec(),
            timings: false,
            shape: shape::Config::default(),
            symmetry: symmetry::Config::default(),
            interaction: interaction::Config::default(),
            estimation: estimation::Config::default(),
            snapshots: snapshots::Config::default(),
            relations: relations::Config::default(),
            articulation: articulation::Config::default(),
            diagnosis: diagnosis::Config::default(),
        }
    }
}

impl Options {
    /// Whether a pass is to run.
    pub fn runs(&self, pass: Pass) -> bool {
        self.passes.contains(&pass)
    }

    /// The effective settings, as they are recorded beside the result.
    pub fn record(&self) -> BTreeMap<String, Value> {
        let passes: Vec<&str> = self.passes.iter().map(|p| p.name()).collect();
        let stage = |text: String| Value::String(text);
        // Where a search is kept is no setting: it ends as if it had not been.
        let unkept = snapshots::Config {
            keeper: None,
            ..self.snapshots.clone()
        };
        BTreeMap::from([
            ("passes".into(), json!(passes)),
            ("shape".into(), stage(format!("{:?}", self.shape))),
            ("symmetry".into(), stage(format!("{:?}", self.symmetry))),
            ("interaction".into(), stage(format!("{:?}", self.interaction))),
            ("estimation".into(), stage(format!("{:?}", self.estimation))),
            ("snapshots".into(), stage(format!("{unkept:?}"))),
            ("relations".into(), stage(format!("{:?}", self.relations))),
            ("articulation".into(), stage(format!("{:?}", self.articulation))),
            ("diagnosis".into(), stage(format!("{:?}", self.diagnosis))),
        ])
    }
}
