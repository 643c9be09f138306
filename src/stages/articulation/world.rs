//! Joints against something that nobody tracked: a handle pulled along a path that its hinge or rail dictates.

use super::Config;
use super::infer::Articulation;
use crate::base::Notices;
use crate::capture::Capture;
use crate::twin::Model;

/// Adds the joints of things that were pulled while nothing else was tracked and nothing carries them.
pub fn infer_world(
    _capture: &Capture,
    _model: &Model,
    _config: &Config,
    _notices: &mut Notices,
    _out: &mut Articulation,
) {
}
