//! What leaves the shape of a link as it is: planes of reflection, axes of rotation, a centre.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A plane of reflection `normal · x = offset`, link frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SymmetryPlane {
    /// Unit normal, link frame.
    pub normal: [f64; 3],
    /// Distance of the plane from the link's origin along the normal, m.
    pub offset: f64,
    /// Share of the seen surface that finds its image, of that which could find it, 0 to 1.
    pub score: f64,
    /// One standard deviation of the normal, per component.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal_sd: Option<[f64; 3]>,
    /// One standard deviation of the offset, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset_sd: Option<f64>,
}

/// An axis about which a turn by a full circle over `fold` leaves the shape as it is, link frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SymmetryAxis {
    /// Unit direction, link frame.
    pub direction: [f64; 3],
    /// The point of the axis nearest to the middle of the surface, m, link frame.
    pub point: [f64; 3],
    /// Number of positions per full circle; 0 = any turn, as of a thing turned on a lathe.
    pub fold: u32,
    /// As of a plane.
    pub score: f64,
    /// One standard deviation of the direction, per component.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction_sd: Option<[f64; 3]>,
    /// One standard deviation of the point, square to the axis, per component, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_sd: Option<[f64; 3]>,
}

/// The centre of a ball: every plane and every axis through it is one of symmetry.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SymmetryCenter {
    /// m, link frame.
    pub point: [f64; 3],
    /// As of a plane.
    pub score: f64,
    /// One standard deviation of the point, per component, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_sd: Option<[f64; 3]>,
}

/// Everything that leaves a shape as it is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Symmetry {
    /// Planes of reflection, best first; a thing from the lathe has a family of them, of which two stand for all,
    /// a ball has three that do.
    pub planes: Vec<SymmetryPlane>,
    /// Axes of rotation, best first.
    pub axes: Vec<SymmetryAxis>,
    /// Where the shape is a ball.
    pub center: Option<SymmetryCenter>,
}
