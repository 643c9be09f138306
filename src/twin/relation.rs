//! Arcs of the relational-constraint graph.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::Estimate;

/// The name by which a relation refers to the table.
pub const SUPPORT: &str = "support";

/// How two things are held to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RelationKind {
    /// They do not bear on each other.
    Separate,
    /// One stands on the other and can be taken off.
    Resting,
    /// They move as one.
    Fixed,
    /// Hinged.
    Revolute,
    /// Sliding along a line.
    Prismatic,
    /// Screwed.
    Screw,
    /// Turning and sliding along one axis.
    Cylindrical,
    /// Sliding in a plane.
    Planar,
    /// Turning about a point.
    Spherical,
    /// Touching, but never tried: the data cannot say.
    Unknown,
}

/// An arc of the constraint graph.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Relation {
    /// `body`, `body/link` or `support`.
    pub a: String,
    /// `body`, `body/link` or `support`.
    pub b: String,
    /// How they are held to each other.
    pub kind: RelationKind,
    /// Rotational freedom of `b` against `a`, 0 to 3.
    pub rotation_dof: u8,
    /// Translational freedom of `b` against `a`, 0 to 3.
    pub translation_dof: u8,
    /// Probability of this kind against the others.
    pub probability: f64,
    /// The interactions that prove it.
    pub from: Vec<String>,
    /// The force at which a bond gave way, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub breakaway: Option<Estimate>,
}
