//! The verb of the relations pass.

use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::{Model, Relation};

/// Settings of the relations pass.
#[derive(Clone, Debug, Default)]
pub struct Config {}

/// The arcs of the constraint graph. `model` already holds the joints, so that jointed pairs come out
/// with the freedom of their joint.
pub fn relate(
    _capture: &Capture,
    _segmented: &[Segmented],
    _model: &Model,
    _config: &Config,
    _notices: &mut Notices,
) -> Result<Vec<Relation>> {
    Ok(Vec::new())
}
