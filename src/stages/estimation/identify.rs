//! The verb of the physics pass.

use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::Model;

/// Settings of the physics pass.
#[derive(Clone, Debug, Default)]
pub struct Config {}

/// Writes matter (mass, centre of mass, inertia, friction, stiffness) into the links of `model`, and
/// friction, damping and spring into its joints, from the interactions that are not held out.
pub fn identify(
    _capture: &Capture,
    _segmented: &[Segmented],
    _model: &mut Model,
    _config: &Config,
    _notices: &mut Notices,
) -> Result<()> {
    Ok(())
}
