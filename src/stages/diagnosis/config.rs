//! What can be set for the diagnosis pass.

use crate::base::{Error, Result};
use crate::twin::known_cause;

/// Settings of the diagnosis pass.
#[derive(Clone, Debug)]
pub struct Config {
    /// Share of the signal that push-to-push scatter and the closed-form models may miss before a misfit
    /// counts as one: dry friction itself scatters by 1 to 2 %.
    pub tolerance: f64,
    /// Distance that the reconstructed surface and the same scatter may leave, m.
    pub position_tolerance: f64,
    /// Rotation that the same scatter may leave, rad.
    pub rotation_tolerance: f64,
    /// The only causes that may be named; all where there is no such list.
    pub causes: Option<Vec<String>>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            tolerance: 0.05,
            position_tolerance: 1.5e-3,
            rotation_tolerance: 0.035,
            causes: None,
        }
    }
}

impl Config {
    /// Whether this cause may be named.
    pub fn allows(&self, cause: &str) -> bool {
        self.causes.as_ref().is_none_or(|all| all.iter().any(|c| c == cause))
    }

    /// Refuses settings that cannot work.
    pub fn check(&self) -> Result<()> {
        for cause in self.causes.iter().flatten() {
            known_cause(cause)?;
        }
        if self.tolerance > 0.0 && self.position_tolerance > 0.0 && self.rotation_tolerance > 0.0 {
            return Ok(());
        }
        Err(Error::Usage("diagnosis: the tolerances must be positive".into()))
    }
}
