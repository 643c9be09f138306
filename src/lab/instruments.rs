//! The instruments of a scene: the camera rig, the force sensor, the tracker, and their noise. SI units.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Rings of camera poses that look at `target`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// Number of views, spread over the rings; 0 = no views.
    pub views: usize,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Focal length, pixels.
    pub focal: f64,
    /// Elevations of the rings, degrees.
    pub elevations: Vec<f64>,
    /// Distance from the target, m.
    pub distance: f64,
    /// What it looks at, world.
    pub target: [f64; 3],
    /// Depth noise at 1 m, m; grows with range squared.
    pub depth_sd: f64,
    /// Fraction of edge pixels that fly between near and far.
    pub flying: f64,
    /// Write images of instance ids (a body's place in the scene, from 1; 0 = table or nothing).
    pub labels: bool,
}

impl Default for CameraSpec {
    fn default() -> Self {
        Self {
            views: 24,
            width: 320,
            height: 240,
            focal: 300.0,
            elevations: vec![25.0, 45.0, 68.0],
            distance: 0.6,
            target: [0.0, 0.0, 0.04],
            depth_sd: 0.001,
            flying: 0.3,
            labels: false,
        }
    }
}

/// A camera that stands still and films every action but a tilt of the support.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilmSpec {
    /// Images a second.
    pub rate: f64,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Focal length, pixels.
    pub focal: f64,
    /// Where it stands as seen from the target, degrees from world x towards y.
    pub azimuth: f64,
    /// How high it stands as seen from the target, degrees.
    pub elevation: f64,
    /// Distance from the target, m.
    pub distance: f64,
    /// What it looks at, world.
    pub target: [f64; 3],
    /// Depth noise at 1 m, m; grows with range squared.
    pub depth_sd: f64,
    /// Fraction of edge pixels that fly between near and far.
    pub flying: f64,
    /// Write colour images beside the depth images.
    pub color: bool,
}

impl Default for FilmSpec {
    fn default() -> Self {
        Self {
            rate: 30.0,
            width: 320,
            height: 240,
            focal: 300.0,
            azimuth: 35.0,
            elevation: 40.0,
            distance: 0.45,
            target: [0.0, 0.0, 0.04],
            depth_sd: 0.001,
            flying: 0.3,
            color: false,
        }
    }
}

impl FilmSpec {
    /// The same camera as one of the rig.
    pub(super) fn lens(&self) -> CameraSpec {
        CameraSpec {
            views: 1,
            width: self.width,
            height: self.height,
            focal: self.focal,
            elevations: vec![self.elevation],
            distance: self.distance,
            target: self.target,
            depth_sd: self.depth_sd,
            flying: self.flying,
            labels: false,
        }
    }
}

/// The sensors' noise, one standard deviation per axis, and their rates.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseSpec {
    /// N.
    pub force: f64,
    /// N·m.
    pub torque: f64,
    /// m.
    pub position: f64,
    /// rad.
    pub rotation: f64,
    /// Force and tool path, Hz.
    pub force_rate: f64,
    /// Tracks, Hz.
    pub track_rate: f64,
    /// State the noise in the capture.
    pub stated: bool,
}

impl Default for NoiseSpec {
    fn default() -> Self {
        Self {
            force: 0.02,
            torque: 0.002,
            position: 0.0002,
            rotation: 0.002,
            force_rate: 500.0,
            track_rate: 120.0,
            stated: false,
        }
    }
}
