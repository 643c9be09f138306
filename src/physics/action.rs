//! What was commanded, without anything that was measured of the outcome.

use std::collections::BTreeMap;

use nalgebra::{Point3, UnitVector3, Vector3};

use crate::base::Pose;

/// How the tool holds what it touches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// It can only push.
    Push,
    /// Rigidly.
    Grip,
    /// By a free pivot.
    Pin,
}

/// The path of a tool. World frame, m.
#[derive(Clone, Debug)]
pub struct ToolMotion {
    /// Radius of the tool's tip, m.
    pub radius: f64,
    /// How it holds.
    pub hold: Hold,
    /// Seconds.
    pub time: Vec<f64>,
    /// World-from-tool positions.
    pub position: Vec<Point3<f64>>,
    /// By how much it has turned about the normal since it began, rad; empty where nobody tells.
    pub turned: Vec<f64>,
}

/// One commanded interaction.
#[derive(Clone, Debug)]
pub struct Action {
    /// The link that the tool means to touch.
    pub target: String,
    /// The tool.
    pub tool: ToolMotion,
    /// World-from-link of every link at the start.
    pub start: BTreeMap<String, Pose>,
    /// Unit normal of the support, world.
    pub normal: UnitVector3<f64>,
    /// Magnitude of gravity along that normal, m/s².
    pub gravity: f64,
}

/// What the sensors would see, at the times of the tool's path.
#[derive(Clone, Debug, Default)]
pub struct Prediction {
    /// Seconds.
    pub time: Vec<f64>,
    /// Force of the tool on the body, N, world; NaN where this model does not say.
    pub force: Vec<Vector3<f64>>,
    /// World-from-link of every link that this model moves.
    pub poses: BTreeMap<String, Vec<Pose>>,
}
