//! A view with colours, and what it shows of a spot.

use nalgebra::{Isometry3, Point3, Vector3};

use super::verb::Spot;
use crate::capture::{Camera, ColorImage, View};
use crate::geometry::{Mesh, cover_triangle};
use crate::stages::shape::lens::{project, unproject};
use crate::stages::shape::{Config, Shapes};

/// Least cosine of incidence from which a view tells a colour.
const LEAST_FACING: f64 = 0.2;
/// How far a reading may be from a spot that it shows, in voxels and in standard deviations of the camera.
const NEAR: [f64; 2] = [1.5, 3.0];
/// Depth noise of a camera that does not state its own, at 1 m, m.
const DEPTH_SD: f64 = 0.002;
/// Pixels to each side over which a clear view shows one surface.
const REACH: i64 = 2;
/// Nothing is in front there.
const NOTHING: u16 = u16::MAX;

/// A view with colours.
pub struct Eye<'a> {
    camera: &'a Camera,
    view: &'a View,
    color: &'a ColorImage,
    /// Which thing is front-most at each pixel.
    front: Vec<u16>,
}

/// A view's look at a spot.
pub struct Look {
    pub color: [f64; 3],
    /// How much it counts.
    pub weight: f64,
    /// All around shows the same surface.
    pub clear: bool,
}

impl<'a> Eye<'a> {
    /// Nothing where the view has no colours.
    pub fn new(camera: &'a Camera, view: &'a View, shapes: &Shapes) -> Option<Self> {
        let color = view.color.as_ref()?;
        let mut eye = Self {
            camera,
            view,
            color,
            front: vec![NOTHING; camera.width as usize * camera.height as usize],
        };
        let mut depths = vec![f64::INFINITY; eye.front.len()];
        for (which, object) in shapes.objects.iter().enumerate() {
            let camera_from_link = view.world_from_camera.0.inverse() * object.world_from_link.0;
            eye.draw(&object.mesh, &camera_from_link, which as u16, &mut depths);
        }
        Some(eye)
    }

    /// Draws a thing over what is behind it; depths between corners are linear in their inverses.
    fn draw(&mut self, mesh: &Mesh, camera_from_link: &Isometry3<f64>, which: u16, depths: &mut [f64]) {
        let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|p| camera_from_link * p).collect();
        let size = [self.camera.width, self.camera.height].map(i64::from);
        for triangle in &mesh.triangles {
            let corners = triangle.map(|v| points[v as usize]);
            if corners.iter().any(|p| p.z < 1e-3) {
                continue;
            }
            // The centre of the first pixel is 0 for a camera, and half a pixel for an image.
            let places = corners.map(|p| {
                let (u, v) = project(self.camera, p.x / p.z, p.y / p.z);
                [u + 0.5, v + 0.5]
            });
            cover_triangle(&places, size, |x, y, w| {
                let inverse: f64 = corners.iter().zip(w).map(|(p, w)| w / p.z).sum();
                let at = (y * size[0] + x) as usize;
                if 1.0 / inverse < depths[at] {
                    (depths[at], self.front[at]) = (1.0 / inverse, which);
                }
            });
        }
    }

    /// What a pixel covers at a point, m; nothing behind the camera.
    pub fn pixel_at(&self, p: &Point3<f64>) -> Option<f64> {
        let z = self.view.world_from_camera.0.inverse_transform_point(p).z;
        (z > 0.0).then(|| z / self.camera.fx.max(self.camera.fy))
    }

    /// The look at a spot of that thing; nothing where it is hidden, faces away, or is not in the image.
    pub fn look(&self, spot: &Spot, which: usize, config: &Config) -> Option<Look> {
        let p = self.view.world_from_camera.0.inverse_transform_point(&spot.at);
        if p.z <= 0.0 {
            return None;
        }
        let normal = self.view.world_from_camera.0.rotation.inverse() * spot.normal;
        let facing = -normal.dot(&p.coords) / p.coords.norm();
        if facing < LEAST_FACING {
            return None;
        }
        let (u, v) = project(self.camera, p.x / p.z, p.y / p.z);
        let (x, y) = ((u + 0.5).floor() as i64, (v + 0.5).floor() as i64);
        let noise = self.camera.depth_sd.unwrap_or(DEPTH_SD) * p.z * p.z;
        let near = (NEAR[0] * config.voxel + NEAR[1] * noise) / facing;
        let shows = |x: i64, y: i64, expected: f64| {
            let own = self.at(x, y).is_some_and(|at| self.front[at] == which as u16);
            own && self.depth(x, y).is_some_and(|d| (d - expected).abs() < near)
        };
        if !shows(x, y, p.z) {
            return None;
        }
        let plane = p.coords.dot(&normal);
        let on_plane = |x: i64, y: i64| {
            let (rx, ry) = unproject(self.camera, x as f64, y as f64);
            let along = Vector3::new(rx, ry, 1.0).dot(&normal);
            shows(x, y, if along < -1e-6 { plane / along } else { p.z })
        };
        let around = [-REACH, 0, REACH];
        Some(Look {
            color: self.color_at(u, v, |x, y| shows(x, y, p.z))?,
            weight: (facing / p.z).powi(3),
            clear: around.iter().all(|dy| around.iter().all(|dx| on_plane(x + dx, y + dy))),
        })
    }

    /// The colour between pixels, of those alone that show the spot's surface.
    fn color_at(&self, u: f64, v: f64, shows: impl Fn(i64, i64) -> bool) -> Option<[f64; 3]> {
        let (x, y) = (u.floor(), v.floor());
        let (mut sum, mut all) = ([0.0; 3], 0.0);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let share = (1.0 - (u - x - dx).abs()) * (1.0 - (v - y - dy).abs());
            let (px, py) = ((x + dx) as i64, (y + dy) as i64);
            if share <= 0.0 || !shows(px, py) {
                continue;
            }
            let Some(rgb) = self.at(px, py).and_then(|at| self.color.rgb.get(at)) else {
                continue;
            };
            all += share;
            for k in 0..3 {
                sum[k] += share * f64::from(rgb[k]);
            }
        }
        (all > 0.0).then(|| sum.map(|s| s / all))
    }

    fn at(&self, x: i64, y: i64) -> Option<usize> {
        let inside = x >= 0 && y >= 0 && x < i64::from(self.camera.width) && y < i64::from(self.camera.height);
        inside.then(|| x as usize + y as usize * self.camera.width as usize)
    }

    /// The reading of a pixel of the camera's own image, m.
    fn depth(&self, x: i64, y: i64) -> Option<f64> {
        let count = *self.view.depth.counts.get(self.at(x, y)?)?;
        (count > 0).then(|| f64::from(count) * self.camera.depth_unit)
    }
}
