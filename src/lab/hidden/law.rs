//! What a hidden effect is: a cause of the catalogue (or none of it), where it acts, and its numbers.

use std::collections::BTreeMap;

use super::elastic::ElasticLaw;
use super::fault::Fault;
use super::jointed::JointLaw;
use super::setting::Setting;
use super::slide::{Make, SlideLaw};

/// Where an effect acts.
#[derive(Clone, Debug)]
pub(in crate::lab) enum Act {
    /// On what is done, or on what the scene is made of.
    Setting(Setting),
    /// On how the body stands or how heavy it moves.
    Make(Make),
    /// On the body while it slides.
    Slide(SlideLaw),
    /// On what is pressed.
    Elastic(ElasticLaw),
    /// Along a joint.
    Joint(JointLaw),
    /// In what the sensors write down.
    Fault(Fault),
}

/// An effect with its numbers drawn.
#[derive(Clone, Debug)]
pub(in crate::lab) struct Effect {
    /// As the truth file calls it.
    pub cause: &'static str,
    /// What it does.
    pub act: Act,
    /// For the truth file, SI units.
    pub parameters: BTreeMap<String, f64>,
}
