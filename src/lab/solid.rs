//! The solids of the lab: closed surface, mass properties, convex pieces.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::base::Pose;
use crate::geometry::Mesh;

/// One rigid part of the lab.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Unique name.
    pub name: String,
    /// Closed surface, body frame.
    pub mesh: Mesh,
    /// kg.
    pub mass: f64,
    /// Centre of mass, body frame.
    pub com: Point3<f64>,
    /// kg·m² about the centre of mass, body axes.
    pub inertia: Matrix3<f64>,
    /// Where it is at first.
    pub world_from_body: Pose,
    /// Convex pieces that cover it.
    pub parts: Vec<ConvexPart>,
}

/// The shape of a convex piece, centred at the origin of its frame.
#[derive(Clone, Debug)]
pub enum PartShape {
    /// A box.
    Box {
        /// Half edge lengths, m.
        half: Vector3<f64>,
    },
    /// A cylinder along z.
    Cylinder {
        /// m.
        radius: f64,
        /// m.
        half_height: f64,
    },
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
    },
}

/// A convex piece of a solid.
#[derive(Clone, Debug)]
pub struct ConvexPart {
    /// Its shape.
    pub shape: PartShape,
    /// Where it sits.
    pub body_from_part: Pose,
}
