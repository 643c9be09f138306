//! A tilt as the support sees it: slope angle and displacement down the slope.

use nalgebra::{Point3, Vector3};

use super::predict::Scene;
use crate::capture::PoseStream;
use crate::math::turned_displacement;

/// Slope and displacement at the times of a track.
pub struct Slope {
    /// rad.
    pub angle: Vec<f64>,
    /// Down the slope, m; NaN where missing.
    pub slid: Vec<f64>,
}

/// The slope under a track; nothing where the support's path is missing.
pub fn slope(scene: &Scene, track: &PoseStream) -> Option<Slope> {
    let path = scene.interaction.support_path.as_ref()?;
    let normals: Vec<Vector3<f64>> = path.vector.iter().map(|n| n.into_inner()).collect();
    let noise = scene.position_noise().unwrap_or(3e-4);
    let guess = scene
        .model
        .twin
        .support
        .as_ref()
        .map_or(Point3::origin(), |s| Point3::from(s.point));
    let turned = turned_displacement(&path.time, &normals, &track.time, &track.position, noise, &guess)?;
    let gravity = scene.capture.gravity.try_normalize(1e-9)?;
    let start = *normals.first()?;
    let angle = turned
        .turn
        .iter()
        .map(|q| (q * start).dot(&-gravity).clamp(-1.0, 1.0).acos())
        .collect();
    let down = turned.downhill(&start, &gravity)?;
    let slid = turned.displacement.iter().map(|d| d.dot(&down)).collect();
    Some(Slope { angle, slid })
}
