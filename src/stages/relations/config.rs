//! What can be set for the relations pass.

use crate::base::{Error, Result};

/// Settings of the relations pass; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct Config {
    /// Surfaces nearer than this bear on each other, m.
    pub gap: f64,
    /// A thing whose lowest point is nearer to the table than this stands on it, m.
    pub standing: f64,
    /// Two things have come apart when their relative position changed by more than this, m.
    pub parted: f64,
    /// Probability that a thing found on top of another is held to it, before any touch.
    pub prior_fixed: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            gap: 0.006,
            standing: 0.005,
            parted: 0.001,
            prior_fixed: 0.3,
        }
    }
}

impl Config {
    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        let lengths = [self.gap, self.standing, self.parted];
        if lengths.iter().all(|x| *x > 0.0) && self.prior_fixed > 0.0 && self.prior_fixed < 1.0 {
            return Ok(());
        }
        Err(Error::Usage(
            "relations: distances must be positive and the prior between 0 and 1".into(),
        ))
    }
}
