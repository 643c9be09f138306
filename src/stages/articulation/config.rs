//! What can be set for the articulation pass.

use crate::base::{Error, Result};

/// Settings of the articulation pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Largest gap between the surfaces of two links that are joined, m.
    pub gap: f64,
    /// The same of a hinge that their motion proves: what hangs on a pin that nobody saw need not lie against it.
    pub hinge_gap: f64,
    /// Largest distance of the origins of two joined links whose surfaces are not known, m.
    pub origin_distance: f64,
    /// Largest radius of a hinge, in sizes of the pair.
    pub reach: f64,
    /// Largest radius of a hinge against the world, m.
    pub world_reach: f64,
    /// A kind less probable than this is not reported as a joint.
    pub least_probability: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            gap: 0.015,
            hinge_gap: 0.06,
            origin_distance: 1.0,
            reach: 3.0,
            world_reach: 1.2,
            least_probability: 0.5,
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let lengths = [
            self.gap,
            self.hinge_gap,
            self.origin_distance,
            self.reach,
            self.world_reach,
        ];
        if lengths.iter().all(|x| *x > 0.0) && (0.0..1.0).contains(&self.least_probability) {
            return Ok(());
        }
        Err(Error::Usage(
            "articulation: distances must be positive and the least probability in [0, 1)".into(),
        ))
    }
}
