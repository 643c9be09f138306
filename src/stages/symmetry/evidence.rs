//! What is known about a shape beyond its mesh.

use nalgebra::{Point3, UnitVector3, Vector3};

use crate::base::Pose;
use crate::geometry::Plane;
use crate::twin::SupportPlane;

/// Whether a point was seen to be empty.
pub type SeenEmpty<'a> = &'a (dyn Fn(&Point3<f64>) -> bool + Sync);

/// What is known about a shape beyond its mesh, in the mesh's frame; by default nothing.
#[derive(Clone, Copy, Default)]
pub struct Evidence<'a> {
    /// Whether a point was seen to be empty: surface may not be mirrored to there.
    pub free: Option<SeenEmpty<'a>>,
    /// The plane that it stands on, normal upward: nothing of it is below, and a foot that was closed there counts
    /// almost like surface that was seen.
    pub floor: Option<Plane>,
    /// Height above the floor, m, below which the views blur thing and floor: no surface there was really seen.
    pub blur: f64,
    /// One standard deviation of the surface, m.
    pub noise: f64,
}

impl Evidence<'_> {
    /// With the plane that it stands on, told in the world.
    #[must_use]
    pub fn standing_on(self, support: Option<&SupportPlane>, world_from_mesh: &Pose) -> Self {
        let floor = support.and_then(|s| {
            let normal = world_from_mesh.rotation.inverse() * Vector3::from(s.normal);
            let point = world_from_mesh.0.inverse() * Point3::from(s.point);
            Some(Plane::through(&point, UnitVector3::try_new(normal, 1e-9)?))
        });
        Self { floor, ..self }
    }
}
