//! The verb of the articulation pass.

use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::{Joint, Model};

/// Settings of the articulation pass.
#[derive(Clone, Debug, Default)]
pub struct Config {}

/// What the relative motion shows.
#[derive(Clone, Debug, Default)]
pub struct Articulation {
    /// Joints between tracked links, axis and origin in the world at the first view.
    pub joints: Vec<Joint>,
    /// Links that were never seen or tracked but that a joint needs as its parent (the world).
    pub world_links: Vec<String>,
}

/// Finds the joints between things that were tracked one by one.
pub fn infer(
    _capture: &Capture,
    _segmented: &[Segmented],
    _model: &Model,
    _config: &Config,
    _notices: &mut Notices,
) -> Result<Articulation> {
    Ok(Articulation::default())
}
