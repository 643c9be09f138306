//! What a made-up or surveyed scene really is. Written by the lab, read by `score` alone.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::JointKind;

/// The right answers; every key is optional, what is absent is not scored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Truth {
    /// By body or link name, in the track's frame.
    pub bodies: BTreeMap<String, TrueBody>,
    /// World frame at the first view.
    pub joints: Vec<TrueJoint>,
    /// By `a|b`.
    pub relations: BTreeMap<String, TrueRelation>,
    /// Names of the catalogue of causes.
    pub causes: Vec<String>,
    /// Their parameters.
    pub cause_parameters: BTreeMap<String, BTreeMap<String, f64>>,
}

/// The right answers for one body or link. SI units.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrueBody {
    /// kg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Coefficient against the support.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_static: Option<f64>,
    /// Coefficient against the support.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_kinetic: Option<f64>,
    /// m, track frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub com: Option<[f64; 3]>,
    /// ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg·m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia: Option<[f64; 6]>,
    /// N/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
    /// N·s/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// Coefficient of restitution.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<f64>,
    /// OBJ in the track's frame, relative to the truth file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Planes of reflection.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub symmetry: Vec<TruePlane>,
}

/// A plane `normal · x = offset`, track frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruePlane {
    /// Unit normal.
    pub normal: [f64; 3],
    /// m.
    #[serde(default)]
    pub offset: f64,
}

/// The right answers for one joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrueJoint {
    /// Parent link.
    pub a: String,
    /// Child link.
    pub b: String,
    /// Kind.
    #[serde(rename = "type")]
    pub kind: JointKind,
    /// World direction.
    pub axis: [f64; 3],
    /// World point of the axis.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<[f64; 3]>,
    /// rad or m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<[f64; 2]>,
    /// N·m or N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
    /// N·m·s/rad or N·s/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<f64>,
    /// N·m/rad or N/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<f64>,
}

/// The right answer for one arc of the graph: freedoms, or a word.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TrueRelation {
    /// [rotational, translational] freedom.
    Freedom([u8; 2]),
    /// `resting` or `separate`.
    Word(String),
}
