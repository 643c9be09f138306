//! What the symmetry pass is told beside a mesh: what the views saw to be empty, and what the thing stands on.

use nalgebra::Point3;

use super::{Options, Pass};
use crate::base::{Notices, Pose, Result};
use crate::capture::Capture;
use crate::stages::shape::{FreeSpace, Mesh};
use crate::stages::symmetry::{Evidence, detect};
use crate::twin::{Model, SupportPlane, Symmetry};

/// One standard deviation of a fused surface, and height in which the views blur a thing and what it stands on, voxels.
const NOISE: f64 = 0.1;
const BLUR: f64 = 1.5;

/// Answers for meshes of one capture.
pub struct Symmetries<'a> {
    free: FreeSpace<'a>,
    /// Bodies whose mesh the capture brings along: nothing of them is hidden or blurred, wherever they stand.
    given: Vec<&'a str>,
    options: &'a Options,
}

impl<'a> Symmetries<'a> {
    /// From the views of a capture.
    pub fn new(capture: &'a Capture, options: &'a Options) -> Self {
        Self {
            free: FreeSpace::new(capture, &options.shape),
            given: capture
                .bodies
                .iter()
                .filter(|b| b.mesh.is_some())
                .map(|b| b.name.as_str())
                .collect(),
            options,
        }
    }

    /// The symmetry of a mesh in its own frame.
    pub fn of(
        &self,
        about: &str,
        mesh: &Mesh,
        world_from_mesh: &Pose,
        support: Option<&SupportPlane>,
        notices: &mut Notices,
    ) -> Result<Symmetry> {
        if self.given.contains(&about) {
            return detect(about, mesh, &Evidence::default(), &self.options.symmetry, notices);
        }
        let is_free = |p: &Point3<f64>| self.free.is_free(&(world_from_mesh.0 * p));
        let known = Evidence {
            free: self.free.is_known().then_some(&is_free),
            blur: BLUR * self.options.shape.voxel,
            noise: NOISE * self.options.shape.voxel,
            ..Evidence::default()
        };
        let known = known.standing_on(support, world_from_mesh);
        detect(about, mesh, &known, &self.options.symmetry, notices)
    }

    /// What completes shapes: the sure symmetry of a mesh, none where the pass does not run.
    pub fn finder(&self) -> impl Fn(&Mesh, &Pose, Option<&SupportPlane>) -> Result<Symmetry> {
        |mesh, world_from_mesh, support| match self.options.runs(Pass::Symmetry) {
            true => self.of("views", mesh, world_from_mesh, support, &mut Notices::default()),
            false => Ok(Symmetry::default()),
        }
    }

    /// Writes what leaves the shape of every link as it is.
    pub fn write(&self, model: &mut Model, notices: &mut Notices) -> Result<()> {
        let support = model.twin.support.clone();
        let meshes = &model.meshes;
        for link in model.twin.bodies.iter_mut().flat_map(|b| &mut b.links) {
            let Some(mesh) = link.mesh.as_ref().and_then(|path| meshes.get(path)) else {
                continue;
            };
            let found = self.of(&link.name, mesh, &link.pose, support.as_ref(), notices)?;
            link.symmetry = found.planes;
            link.axes = found.axes;
            link.symmetry_center = found.center;
        }
        Ok(())
    }
}
