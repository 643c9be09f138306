//! What can be set for the symmetry pass.

use crate::base::{Error, Result, Seed};

/// Settings of the symmetry pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// A plane is claimed from this score on, 0 to 1.
    pub min_score: f64,
    /// Distance between a mirrored point and the surface that counts as a miss of one, m, plus `relative_tolerance`.
    pub tolerance: f64,
    /// The same as a share of the diagonal of the mesh's box.
    pub relative_tolerance: f64,
    /// Directions tried over the half sphere.
    pub directions: usize,
    /// Seed of the points that are mirrored.
    pub seed: Seed,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            min_score: 0.7,
            tolerance: 0.001,
            relative_tolerance: 0.01,
            directions: 160,
            seed: Seed(0),
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let tolerances = self.tolerance >= 0.0 && self.relative_tolerance >= 0.0;
        let some = self.tolerance + self.relative_tolerance > 0.0;
        if tolerances && some && (0.0..=1.0).contains(&self.min_score) && self.directions > 0 {
            return Ok(());
        }
        Err(Error::Usage(
            "symmetry: the score must be 0 to 1, the tolerances not negative and not both zero, and directions at least 1"
                .into(),
        ))
    }
}
