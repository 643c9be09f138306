//! What a rig writes, `palpate-rig/1`: the JSON of its answers as it stands on a line.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Kind;
use super::json::{CameraJson, NoiseJson, SupportJson, ToolJson, standard_gravity};

/// Rows of numbers, one a sample; a missing reading is null.
pub(super) type Rows = Vec<Vec<Option<f64>>>;

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DescriptionJson {
    pub protocol: String,
    pub name: String,
    #[serde(default = "standard_gravity")]
    pub gravity: [f64; 3],
    #[serde(default)]
    pub support: Option<SupportJson>,
    #[schemars(length(min = 1))]
    pub cameras: Vec<CameraJson>,
    pub reach: ReachJson,
    pub workspace: BoxJson,
    #[serde(default)]
    pub touches: Vec<Kind>,
    #[serde(default)]
    pub bodies: Vec<BodyJson>,
    #[serde(default)]
    pub noise: Option<NoiseJson>,
    /// Whether everything is put back to where it was at first after each touch.
    #[serde(default)]
    pub restores: bool,
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReachJson {
    #[serde(default)]
    pub poses: Option<Vec<[f64; 7]>>,
    #[serde(default)]
    pub dome: Option<DomeJson>,
    #[serde(default, rename = "box")]
    pub room: Option<RoomJson>,
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DomeJson {
    pub target: [f64; 3],
    pub radius: [f64; 2],
    pub elevation: [f64; 2],
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RoomJson {
    pub low: [f64; 3],
    pub high: [f64; 3],
    pub target: [f64; 3],
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BoxJson {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyJson {
    #[schemars(length(min = 1))]
    pub name: String,
    #[serde(default)]
    pub pose: Option<[f64; 7]>,
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ViewJson {
    #[serde(default)]
    pub camera: Option<String>,
    pub time: f64,
    pub pose: [f64; 7],
    #[serde(default)]
    pub depth: Option<String>,
    #[serde(default)]
    pub depth_png: Option<String>,
    #[serde(default)]
    pub color: Option<String>,
    #[serde(default)]
    pub color_png: Option<String>,
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TouchedJson {
    #[serde(default)]
    pub tool: Option<ToolJson>,
    #[serde(default)]
    pub target: Option<String>,
    #[serde(default)]
    pub force: Option<Rows>,
    #[serde(default)]
    pub tool_path: Option<Rows>,
    #[serde(default)]
    pub support_path: Option<Rows>,
    #[serde(default)]
    pub tracks: BTreeMap<String, Rows>,
}

#[derive(Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct DoneJson {
    pub done: bool,
}
