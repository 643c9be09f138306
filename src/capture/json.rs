//! `capture.json` as it stands on disk: keys, types and bounds, and the JSON Schema made from them.

use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, schema_for};
use serde::{Deserialize, Serialize};

use super::Kind;

/// What a robot measured of one tabletop scene. SI units, one clock, world frame right-handed.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "palpate-capture/1")]
pub(super) struct CaptureJson {
    /// `palpate-capture/1`.
    pub format: String,
    /// What outputs are called.
    pub name: String,
    /// Gravity, m/s², world frame.
    #[serde(default = "standard_gravity")]
    pub gravity: [f64; 3],
    /// The table that things stand on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub support: Option<SupportJson>,
    /// The cameras.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<CameraJson>,
    /// The still views of the shape pass.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<ViewJson>,
    /// What is known beforehand of bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyJson>,
    /// Known sensor noise; what is absent is estimated from the data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseJson>,
    /// What was done.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interactions: Vec<InteractionJson>,
    /// A file with the right answers, for captures that have them; read by the scoring alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<String>,
}

/// Standard gravity along -z, m/s².
pub(super) fn standard_gravity() -> [f64; 3] {
    [0.0, 0.0, -9.80665]
}

/// The table that things stand on.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct SupportJson {
    /// A point of the plane, m, world.
    pub point: [f64; 3],
    /// Unit normal away from the table, world.
    pub normal: [f64; 3],
    /// A name in the calibration tables.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub material: Option<String>,
    /// Friction against the support that is known beforehand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<FrictionJson>,
}

/// Friction coefficients known beforehand.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FrictionJson {
    /// Static coefficient.
    #[serde(rename = "static", default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub static_: Option<f64>,
    /// Its standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub static_sd: Option<f64>,
    /// Kinetic coefficient.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub kinetic: Option<f64>,
    /// Its standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub kinetic_sd: Option<f64>,
}

/// A pinhole camera with Brown-Conrady distortion; optical frame x right, y down, z forward.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraJson {
    /// Unique name by which views refer to it.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Image width, pixels.
    #[schemars(range(min = 1))]
    pub width: u32,
    /// Image height, pixels.
    #[schemars(range(min = 1))]
    pub height: u32,
    /// Focal length in x, pixels.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub fx: f64,
    /// Focal length in y, pixels.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub fy: f64,
    /// Principal point x, pixels; the centre of the first pixel is 0.
    pub cx: f64,
    /// Principal point y, pixels.
    pub cy: f64,
    /// k1, k2, p1, p2, k3.
    #[serde(default)]
    pub distortion: [f64; 5],
    /// Metres per count of a depth image.
    #[serde(default = "millimetre")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub depth_unit: f64,
    /// Nearest depth that is trusted, m; 0 where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub depth_min: Option<f64>,
    /// Farthest depth that is trusted, m; the largest count where absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub depth_max: Option<f64>,
    /// Depth noise at 1 m, one standard deviation, m; grows with range squared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub depth_sd: Option<f64>,
}

fn millimetre() -> f64 {
    0.001
}

/// One still view.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewJson {
    /// Name of the camera.
    pub camera: String,
    /// Seconds on the clock of the capture.
    pub time: f64,
    /// World-from-camera, x y z qx qy qz qw.
    pub pose: [f64; 7],
    /// 16-bit greyscale PNG of counts, 0 = no reading.
    pub depth: String,
    /// 8-bit RGB PNG.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// 16-bit greyscale PNG of instance ids, 0 = none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels: Option<String>,
}

/// What is known beforehand of one body or link.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyJson {
    /// Unique name, `body` or `body/link`.
    pub name: String,
    /// OBJ, STL, PLY or GLB in the body frame, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub mass: Option<f64>,
    /// One standard deviation of `mass`, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub mass_sd: Option<f64>,
    /// A name in the calibration tables.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub material: Option<String>,
    /// World-from-body at the time of the first view, x y z qx qy qz qw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<[f64; 7]>,
}

/// Known sensor noise, one standard deviation per axis each.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NoiseJson {
    /// N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub force: Option<f64>,
    /// N·m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub torque: Option<f64>,
    /// Tracked position, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub position: Option<f64>,
    /// Tracked rotation, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rotation: Option<f64>,
}

/// One recorded interaction.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct InteractionJson {
    /// Unique in the capture.
    #[schemars(length(min = 1))]
    pub name: String,
    /// What was done.
    pub kind: Kind,
    /// Free label by which trials are grouped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<String>,
    /// Free label of the tool by which trials are grouped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_name: Option<String>,
    /// The tool, where there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool: Option<ToolJson>,
    /// The body or link that the tool means to touch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(length(min = 1))]
    pub target: Option<String>,
    /// CSV `time,fx,fy,fz[,tx,ty,tz]`: what the tool exerts on the body, at the tool's origin, world axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force: Option<String>,
    /// CSV `time,x,y,z,qx,qy,qz,qw`: world-from-tool.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_path: Option<String>,
    /// CSV `time,nx,ny,nz`: the support's normal, for a tilt.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub support_path: Option<String>,
    /// Body (or `body/link`) name to CSV `time,x,y,z,qx,qy,qz,qw`: world-from-body.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub tracks: BTreeMap<String, String>,
    /// Images taken meanwhile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<FramesJson>,
    /// Never used to fit, only to check predictions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub held_out: bool,
}

/// The shape of a tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum ShapeJson {
    /// `size` [radius].
    Sphere,
    /// `size` [half x, half y, half z].
    Box,
    /// `size` [radius, half height], along z.
    Cylinder,
    /// `mesh` names the file.
    Mesh,
}

/// The tool of an interaction.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolJson {
    /// Its shape.
    pub shape: ShapeJson,
    /// Its size, m; which numbers depends on the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<Vec<f64>>,
    /// OBJ, STL, PLY or GLB in the tool frame, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// It holds the body rigidly.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub grip: bool,
    /// It holds the body by a free pivot.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub pin: bool,
}

/// Images taken during an interaction.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FramesJson {
    /// Name of the camera.
    pub camera: String,
    /// CSV `time,depth[,color][,x,y,z,qx,qy,qz,qw]`.
    pub index: String,
    /// World-from-camera where the camera stands still, x y z qx qy qz qw.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<[f64; 7]>,
}

/// The schema of `capture.json`, made from the types that read it.
pub(super) fn schema() -> Schema {
    schema_for!(CaptureJson)
}

/// The JSON Schema (2020-12) of `capture.json`, made from the types that read it.
pub fn capture_schema() -> serde_json::Value {
    schema().to_value()
}
