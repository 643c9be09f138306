//! What can be set for the symmetry pass.

use crate::base::{Error, Result, Seed};

/// Settings of the symmetry pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Least share of what can be compared that must find its image, 0 to 1.
    pub min_score: f64,
    /// Least share of the seen surface that must find its image, 0 to 1: what falls on surface that nobody saw
    /// says nothing.
    pub min_support: f64,
    /// Largest share of the seen surface in one patch that may be without an image, 0 to 1: a handle is no noise.
    pub max_flaw: f64,
    /// Distance between a moved point and the surface within which they are one, m, plus `relative_tolerance` and
    /// twice the noise of the surface.
    pub tolerance: f64,
    /// The same as a share of the diagonal of the mesh's box.
    pub relative_tolerance: f64,
    /// Directions tried over the half sphere.
    pub directions: usize,
    /// Seed of the points that are moved.
    pub seed: Seed,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            min_score: 0.97,
            min_support: 0.3,
            max_flaw: 0.02,
            tolerance: 0.0005,
            relative_tolerance: 0.003,
            directions: 400,
            seed: Seed(0),
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let tolerances = self.tolerance >= 0.0 && self.relative_tolerance >= 0.0;
        let some = self.tolerance + self.relative_tolerance > 0.0;
        let shares = [self.min_score, self.min_support, self.max_flaw];
        if tolerances && some && shares.iter().all(|s| (0.0..=1.0).contains(s)) && self.directions > 0 {
            return Ok(());
        }
        Err(Error::Usage(
            "symmetry: shares must be 0 to 1, the tolerances not negative and not both zero, and directions at least 1"
                .into(),
        ))
    }
}
