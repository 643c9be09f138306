//! What is known about a shape beyond its mesh.

use nalgebra::Point3;

use crate::geometry::Plane;

/// What is known about a shape beyond its mesh, in the mesh's frame; by default nothing.
#[derive(Clone, Copy, Default)]
pub struct Evidence<'a> {
    /// Whether a point was seen to be empty: surface may not be mirrored to there.
    pub free: Option<&'a (dyn Fn(&Point3<f64>) -> bool + Sync)>,
    /// The plane that it stands on, normal upward: nothing of it is below, and a foot that was closed there counts
    /// almost like surface that was seen.
    pub floor: Option<Plane>,
    /// One standard deviation of the surface, m.
    pub noise: f64,
}
