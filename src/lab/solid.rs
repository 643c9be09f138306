//! A body of the scene with its geometry and its matter, made from the shapes and densities of the scene file.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

use super::matter::Matter;
use super::obj::read_obj;
use super::parts::parts;
use super::surface::{is_closed, surface};
use super::{BodySpec, Scene, ShapeSpec};
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
#[derive(Clone, Debug, PartialEq)]
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
#[derive(Clone, Debug, PartialEq)]
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
pub fn build_solids(scene: &Scene, base: &Path) -> Result<BTreeMap<String, Solid>> {
    scene
        .body
        .iter()
        .map(|body| Ok((body.name.clone(), build_solid(body, base)?)))
        .collect()
}

fn build_solid(body: &BodySpec, base: &Path) -> Result<Solid> {
    let mesh = match &body.shape {
        ShapeSpec::Mesh { file } => closed_mesh(&base.join(file))?,
        shape => surface(shape),
    };
    let filling = Matter::filling(&mesh, body.density);
    let matter = body.weight.iter().fold(filling, |sum, weight| {
        sum.with(Matter::ball(weight.mass, weight.position.into(), weight.radius))
    });
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), body.yaw);
    let world_from_body = Isometry3::from_parts(body.position.into(), heading);
    Ok(Solid {
        name: body.name.clone(),
        parts: parts(&body.shape, &mesh),
        mesh,
        mass: matter.mass,
        com: matter.com,
        inertia: matter.inertia,
        world_from_body: Pose(world_from_body),
    })
}

fn closed_mesh(path: &Path) -> Result<Mesh> {
    let mesh = read_obj(path)?;
    if !is_closed(&mesh) {
        return Err(Error::bad_input(
            path,
            "the surface",
            "edges without a neighbour",
            "a closed surface",
        ));
    }
    if mesh.volume() <= 0.0 {
        return Err(Error::bad_input(
            path,
            "the surface",
            "triangles that face inward",
            "triangles that face outward",
        ));
    }
    Ok(mesh)
}
