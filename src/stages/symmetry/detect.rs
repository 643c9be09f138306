//! The verb of the symmetry pass.

use crate::base::{Notices, Result};
use crate::geometry::Mesh;
use crate::twin::SymmetryPlane;

/// Settings of the symmetry pass.
#[derive(Clone, Debug, Default)]
pub struct Config {}

/// Planes of reflection of `mesh`, best first.
pub fn detect(_mesh: &Mesh, _config: &Config, _notices: &mut Notices) -> Result<Vec<SymmetryPlane>> {
    Ok(Vec::new())
}
