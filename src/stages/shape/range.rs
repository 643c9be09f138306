//! A view with its pose relative to the field that it is fused into, and what it says about places in that field.

use nalgebra::{Isometry3, Point3};

use super::fusion::{Prepared, Sight, prepare, raw_depth};
use crate::base::Result;
use crate::capture::{Camera, DepthImage, View};

/// A view made ready for fusion.
pub struct Range<'a> {
    camera: &'a Camera,
    depth: &'a DepthImage,
    camera_from_field: Isometry3<f64>,
    prepared: Prepared<'a>,
}

/// What a view says about a place.
pub enum Reading {
    /// Nothing.
    None,
    /// It is beside a torn surface, and this far before the nearest reading around, m along the optical axis.
    Edge(f64),
    /// It is this far in front of the surface that is seen there, m; negative behind.
    Surface(f64),
}

impl<'a> Range<'a> {
    /// Fits the planes of a view; its field's frame is the world.
    ///
    /// # Errors
    /// Images whose size is not the camera's.
    pub fn new(camera: &'a Camera, view: &'a View) -> Result<Self> {
        let world_from_camera = view.world_from_camera.0;
        Ok(Self {
            camera,
            depth: &view.depth,
            camera_from_field: world_from_camera.inverse(),
            prepared: prepare(camera, &world_from_camera, &view.depth, view.color.as_ref())?,
        })
    }

    /// The same view for a field with another frame.
    pub fn seen_from(&mut self, field_from_new: &Isometry3<f64>) {
        self.camera_from_field *= field_from_new;
        self.prepared.place(&self.camera_from_field);
    }

    /// Takes points of the field to the camera's optical frame.
    pub fn camera_from_field(&self) -> &Isometry3<f64> {
        &self.camera_from_field
    }

    /// The view as the fusion takes it.
    pub fn prepared(&self) -> &Prepared<'a> {
        &self.prepared
    }

    /// Every `step`-th pixel in rows and columns that shows a surface, as a point of the field's frame.
    pub fn points(&self, step: usize) -> impl Iterator<Item = Point3<f64>> + '_ {
        let field_from_camera = self.camera_from_field.inverse();
        let planes = &self.prepared.planes;
        (0..planes.height).step_by(step).flat_map(move |y| {
            (0..planes.width).step_by(step).filter_map(move |x| {
                let Sight::Surface(_) = planes.sight(x, y) else {
                    return None;
                };
                let depth = raw_depth(self.camera, self.depth, x, y)?;
                let u = (x as f64 - self.camera.cx) / self.camera.fx;
                let v = (y as f64 - self.camera.cy) / self.camera.fy;
                Some(field_from_camera * Point3::new(u * depth, v * depth, depth))
            })
        })
    }

    /// What the view says about a point of the field.
    pub fn read(&self, p: &Point3<f64>) -> Reading {
        let p = self.camera_from_field * p;
        if p.z < 0.5 * self.camera.depth_min.max(0.02) {
            return Reading::None;
        }
        let u = self.camera.fx * p.x / p.z + self.camera.cx;
        let v = self.camera.fy * p.y / p.z + self.camera.cy;
        let planes = &self.prepared.planes;
        let (w, h) = ((planes.width - 1) as f64, (planes.height - 1) as f64);
        if !(u >= 0.0 && v >= 0.0 && u <= w && v <= h) {
            return Reading::None;
        }
        match planes.sight(u.round() as usize, v.round() as usize) {
            Sight::Nothing => Reading::None,
            Sight::Torn(near) => Reading::Edge(f64::from(near) - p.z),
            Sight::Surface([a, b, c, d]) => {
                let [a, b, c, d] = [a, b, c, d].map(f64::from);
                Reading::Surface(d - p.z * (a * u + b * v + c))
            }
        }
    }
}
