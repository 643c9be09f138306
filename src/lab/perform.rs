//! What the sensors of the lab would see without noise.

use std::collections::BTreeMap;

use nalgebra::{UnitVector3, Vector3};

use super::{Scene, Solid};
use crate::base::{Error, Pose, Progress, Result};

/// What the lab's sensors saw without noise, at fine and uniform rates.
#[derive(Clone, Debug)]
pub struct Performance {
    /// The name of the action.
    pub name: String,
    /// What was done.
    pub kind: crate::capture::Kind,
    /// The part that was meant.
    pub target: String,
    /// Kept for checking.
    pub held_out: bool,
    /// The tool, where there was one.
    pub tool: Option<crate::capture::Tool>,
    /// Seconds from the start of the action.
    pub force_time: Vec<f64>,
    /// Exerted ON the body, world axes, N; empty without a tool.
    pub force: Vec<Vector3<f64>>,
    /// About the tool's origin, world axes, N·m; empty without a tool.
    pub torque: Vec<Vector3<f64>>,
    /// World-from-tool at `force_time`.
    pub tool_pose: Vec<Pose>,
    /// Seconds from the start of the action.
    pub track_time: Vec<f64>,
    /// World-from-body at `track_time`.
    pub tracks: BTreeMap<String, Vec<Pose>>,
    /// At `track_time`; empty unless a tilt.
    pub support_normal: Vec<UnitVector3<f64>>,
}

/// Performs the script of a scene.
///
/// # Errors
/// A motion that cannot be integrated.
pub fn perform(scene: &Scene, _solids: &BTreeMap<String, Solid>, _progress: &Progress) -> Result<Vec<Performance>> {
    if scene.action.is_empty() {
        return Ok(Vec::new());
    }
    Err(Error::Failed(format!("{}: nothing moves here yet", scene.name)))
}
