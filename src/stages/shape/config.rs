//! What can be set for the shape pass.

use crate::base::{Error, Result};

/// Settings of the shape pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Edge of a voxel, m.
    pub voxel: f64,
    /// Truncation of the signed distance, in voxels.
    pub truncation: f64,
    /// How far simplification may move a surface, in voxels.
    pub simplification: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            voxel: 0.002,
            truncation: 4.0,
            simplification: 0.1,
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        if self.voxel > 0.0 && self.truncation >= 2.0 && self.simplification >= 0.0 {
            return Ok(());
        }
        Err(Error::Usage(
            "shape: the voxel must be positive and the truncation at least 2 voxels".into(),
        ))
    }
}
