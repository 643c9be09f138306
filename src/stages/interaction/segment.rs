//! The verb of the interaction pass.

use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::Model;

/// Settings of the interaction pass.
#[derive(Clone, Debug, Default)]
pub struct Config {}

/// Cuts every interaction (held-out ones too) into phases, in the order of the capture.
pub fn segment(_capture: &Capture, _model: &Model, _config: &Config, _notices: &mut Notices) -> Result<Vec<Segmented>> {
    Ok(Vec::new())
}
