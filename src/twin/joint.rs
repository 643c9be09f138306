//! Joints between the links of a body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::JointEffects;
use crate::base::Estimate;

/// The kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum JointKind {
    /// No freedom.
    Fixed,
    /// Turns about an axis.
    Revolute,
    /// Slides along an axis.
    Prismatic,
    /// Turns and slides along an axis, coupled by a pitch.
    Screw,
    /// Turns and slides along an axis, independently.
    Cylindrical,
    /// Slides in a plane and turns about its normal.
    Planar,
    /// Turns about a point.
    Spherical,
}

impl JointKind {
    /// As `twin.json` has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute => "revolute",
            Self::Prismatic => "prismatic",
            Self::Screw => "screw",
            Self::Cylindrical => "cylindrical",
            Self::Planar => "planar",
            Self::Spherical => "spherical",
        }
    }

    /// (rotational, translational) degrees of freedom; a screw counts as one rotation.
    pub fn freedom(self) -> (u8, u8) {
        match self {
            Self::Fixed => (0, 0),
            Self::Revolute | Self::Screw => (1, 0),
            Self::Prismatic => (0, 1),
            Self::Cylindrical => (1, 1),
            Self::Planar => (1, 2),
            Self::Spherical => (3, 0),
        }
    }
}

/// Another kind that the joint could be, with its probability.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct JointAlternative {
    /// The kind.
    #[serde(rename = "type")]
    pub kind: JointKind,
    /// Its probability.
    pub probability: f64,
}

/// A joint between two links of one body. Axis and origin are in the world frame at the first view.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Its kind.
    #[serde(rename = "type")]
    pub kind: JointKind,
    /// The link nearer to the root.
    pub parent: String,
    /// The other link.
    pub child: String,
    /// Probability of this kind against the others.
    pub probability: f64,
    /// All other kinds with their probabilities.
    pub alternatives: Vec<JointAlternative>,
    /// Unit axis, world at the first view: positive motion of the child turns or slides along it.
    pub axis: Estimate<[f64; 3]>,
    /// A point of the axis, m, world at the first view.
    pub origin: Estimate<[f64; 3]>,
    /// m/rad, for a screw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch: Option<Estimate>,
    /// Range, rad or m, relative to `position` = 0 at the first view; `None` where no end was reached.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Estimate<[f64; 2]>>,
    /// Range of positions that was seen, rad or m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub travelled: Option<[f64; 2]>,
    /// Position at the first view, rad or m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<Estimate>,
    /// Coulomb friction, N·m or N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<Estimate>,
    /// Viscous damping, N·m·s/rad or N·s/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Estimate>,
    /// Return spring, N·m/rad or N/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Estimate>,
    /// Position at which the spring is slack, rad or m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest: Option<Estimate>,
    /// What it took to move it, by position.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effort: Option<JointEffort>,
    /// What it does beyond that, as the diagnosis found it.
    #[serde(default, skip_serializing_if = "JointEffects::is_empty")]
    pub effects: JointEffects,
    /// Standard deviation of the place of the axis across itself, m, for the passes that follow; it is not written.
    #[serde(skip)]
    pub lateral: Option<f64>,
}

impl Joint {
    /// Whether its position is an angle.
    pub fn axis_turns(&self) -> bool {
        !matches!(self.kind, JointKind::Fixed | JointKind::Prismatic)
    }
}

/// What it took to move a joint the way it was moved, by position: friction, weight, springs and latches together.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct JointEffort {
    /// Stretch by stretch, in the order of travel.
    pub by_position: Vec<EffortAt>,
    /// What held it at first, beyond what the way after that took.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latch: Option<Latch>,
}

/// Mean load over a stretch of a joint's travel.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct EffortAt {
    /// The stretch, rad or m.
    pub position: [f64; 2],
    /// N·m or N.
    pub load: Estimate,
    /// The same at the hand, across its arm about the axis, N.
    pub force: Estimate,
}

/// A latch, a magnet or a sticking seal: what was needed to start, over what the way took after it gave way.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Latch {
    /// The peak over the level after it, N·m or N.
    pub excess: Estimate,
    /// The same at the hand, N.
    pub force: Estimate,
    /// The level after it, N·m or N.
    pub level: Estimate,
    /// Where it has given way, rad or m.
    pub until: Estimate,
}
