//! Readings of a depth image as points with normals.

use nalgebra::{Point3, Vector3};

use crate::capture::{Camera, View};
use crate::stages::shape::lens::unproject;

/// Step between neighbouring readings, over the depth, from which they are of two surfaces.
const EDGE: f64 = 0.012;
/// Bend of the readings along a row, over the depth, up to which they are of one surface however slanted.
const BEND: f64 = 0.01;
/// Slope of the depth a pixel, over the depth, beyond which nothing is read.
const STEEP: f64 = 0.05;

/// A depth image with its camera.
pub(super) struct Image<'a> {
    pub camera: &'a Camera,
    pub view: &'a View,
}

impl Image<'_> {
    pub fn width(&self) -> i64 {
        i64::from(self.view.depth.width)
    }

    pub fn height(&self) -> i64 {
        i64::from(self.view.depth.height)
    }

    pub fn depth(&self, x: i64, y: i64) -> Option<f64> {
        if x < 0 || y < 0 || x >= self.width() || y >= self.height() {
            return None;
        }
        let depth = f64::from(self.view.depth.counts[(y * self.width() + x) as usize]) * self.camera.depth_unit;
        (depth > 0.0 && depth >= self.camera.depth_min && depth <= self.camera.depth_max).then_some(depth)
    }

    pub fn point(&self, x: i64, y: i64, depth: f64) -> Point3<f64> {
        let (u, v) = unproject(self.camera, x as f64, y as f64);
        self.view.world_from_camera.0 * Point3::new(u * depth, v * depth, depth)
    }

    /// How the surface runs along one direction of the image, by the points around a pixel; nothing at an edge.
    pub fn along(&self, x: i64, y: i64, depth: f64, way: [i64; 2]) -> Option<Vector3<f64>> {
        let there = |k: i64| self.depth(x + k * way[0], y + k * way[1]);
        let point = |k: i64, d: f64| self.point(x + k * way[0], y + k * way[1], d);
        for reach in [2, 1] {
            if let (Some(a), Some(b)) = (there(-reach), there(reach))
                && (a + b - 2.0 * depth).abs() < BEND * depth
                && (b - a).abs() < STEEP * depth * reach as f64
            {
                return Some(point(reach, b) - point(-reach, a));
            }
        }
        let near = |k: i64| there(k).filter(|d| (d - depth).abs() < EDGE * depth).map(|d| (k, d));
        let (k, d) = [near(-2), near(2), near(-1), near(1)].into_iter().flatten().next()?;
        Some((point(k, d) - self.point(x, y, depth)) * k.signum() as f64)
    }

    /// The normal towards the camera from the points around a pixel; none at an edge.
    pub fn normal(&self, x: i64, y: i64, depth: f64) -> Option<Vector3<f64>> {
        let (across, down) = (self.along(x, y, depth, [1, 0])?, self.along(x, y, depth, [0, 1])?);
        let normal = down.cross(&across).try_normalize(1e-15)?;
        let to_eye = self.view.world_from_camera.translation.vector - self.point(x, y, depth).coords;
        Some(if normal.dot(&to_eye) < 0.0 { -normal } else { normal })
    }
}
