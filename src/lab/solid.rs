//! A body of the scene with its geometry and its matter, made from the shapes and densities of the scene file.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Point3, Vector3};

use super::Scene;
use crate::base::{Error, Pose, Result};
use crate::geometry::Mesh;

/// A body of the scene with its geometry and matter, in the body frame. SI units.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The name of the body in the scene.
    pub name: String,
    /// Its closed surface, counter-clockwise seen from outside.
    pub mesh: Mesh,
    /// kg, hidden weights included.
    pub mass: f64,
    /// Centre of mass, hidden weights included.
    pub com: Point3<f64>,
    /// Inertia about the centre of mass, body axes, kg·m².
    pub inertia: Matrix3<f64>,
    /// Where the body frame is at the first view.
    pub world_from_body: Pose,
    /// Convex pieces that cover it, for contact.
    pub parts: Vec<ConvexPart>,
}

/// The shape of a convex piece, in its own frame, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartShape {
    /// A box with its centre at the origin.
    Box {
        /// Half extents.
        half: Vector3<f64>,
    },
    /// A cylinder along z with its centre at the origin.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Half height.
        half_height: f64,
    },
    /// A ball with its centre at the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
}

/// A convex piece of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConvexPart {
    /// Its shape.
    pub shape: PartShape,
    /// Where its frame is in the body.
    pub body_from_part: Pose,
}

/// The solids of a scene by name; mesh files are looked for beside the scene file, in `base`.
///
/// # Errors
/// A mesh file that is missing, damaged or not closed.
pub fn build_solids(_scene: &Scene, base: &Path) -> Result<BTreeMap<String, Solid>> {
    Err(Error::Failed(format!("{}: solids are not built yet", base.display())))
}
