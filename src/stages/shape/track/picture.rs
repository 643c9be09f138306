//! One depth image as oriented points: what a pixel saw, which way that faces, and how sure it is.

use nalgebra::{Isometry3, Point3, Vector3};

use super::super::lens::{project, unproject};
use crate::capture::{Camera, DepthImage};

/// Depth noise at 1 m where the capture states none, m.
const ASSUMED_DEPTH_SD: f64 = 0.0015;
/// Neighbours from which a slope is taken, pixels.
const REACH: i64 = 2;

/// A depth image with where its camera stood.
pub struct Picture<'a> {
    camera: &'a Camera,
    counts: &'a [u16],
    /// World-from-camera.
    pub world_from_camera: Isometry3<f64>,
    camera_from_world: Isometry3<f64>,
}

/// A pixel on a smooth surface, in the world.
#[derive(Clone, Copy, Debug)]
pub struct Pixel {
    /// m, world.
    pub point: Point3<f64>,
    /// Unit, towards the camera, world.
    pub normal: Vector3<f64>,
    /// Standard deviation of the point along the normal, m.
    pub sd: f64,
}

/// What the image says about a point of a surface that is thought to be there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The surface is there.
    There,
    /// The camera saw through it.
    Through,
    /// Something nearer hides it.
    Hidden,
    /// Outside the image, or no reading.
    Unknown,
}

impl<'a> Picture<'a> {
    /// An image of `camera` that stood at `world_from_camera`.
    pub fn new(camera: &'a Camera, image: &'a DepthImage, world_from_camera: Isometry3<f64>) -> Self {
        Self {
            camera,
            counts: &image.counts,
            world_from_camera,
            camera_from_world: world_from_camera.inverse(),
        }
    }

    /// Where the camera stood, m, world.
    pub fn eye(&self) -> Point3<f64> {
        Point3::from(self.world_from_camera.translation.vector)
    }

    fn sd(&self, depth: f64) -> f64 {
        let step = 0.29 * self.camera.depth_unit;
        (self.camera.depth_sd.unwrap_or(ASSUMED_DEPTH_SD) * depth * depth).hypot(step)
    }

    /// The reading of a pixel, m along the optical axis; nothing where there is none.
    pub fn depth(&self, x: i64, y: i64) -> Option<f64> {
        let (w, h) = (i64::from(self.camera.width), i64::from(self.camera.height));
        if x < 0 || y < 0 || x >= w || y >= h {
            return None;
        }
        let depth = f64::from(self.counts[(y * w + x) as usize]) * self.camera.depth_unit;
        (depth > 0.0 && depth >= self.camera.depth_min && depth <= self.camera.depth_max).then_some(depth)
    }

    /// The change of `1/z` per pixel along a direction, where both neighbours lie on one smooth surface with it.
    fn slope(&self, (x, y): (i64, i64), z: f64, (dx, dy): (i64, i64)) -> Option<f64> {
        let before = self.depth(x - REACH * dx, y - REACH * dy)?;
        let after = self.depth(x + REACH * dx, y + REACH * dy)?;
        let step = 6.0 * REACH as f64 * z / self.camera.fx + 4.0 * self.sd(z);
        let bend = (1.0 / before + 1.0 / after - 2.0 / z).abs() * z * z;
        let fits = (after - z).abs() < step && (before - z).abs() < step && bend < 6.0 * self.sd(z) + 3e-4;
        fits.then(|| (1.0 / after - 1.0 / before) / (2 * REACH) as f64)
    }

    /// The surface at a pixel; nothing at edges, where readings fly, and where there is none. Inverse depth is
    /// linear in the image of a plane, `1/z = a u + b v + c`, and `(a, b, c)` is its normal.
    pub fn pixel(&self, x: i64, y: i64) -> Option<Pixel> {
        let z = self.depth(x, y)?;
        let a = self.slope((x, y), z, (1, 0))? * self.camera.fx;
        let b = self.slope((x, y), z, (0, 1))? * self.camera.fy;
        let (u, v) = unproject(self.camera, x as f64, y as f64);
        let ray = Vector3::new(u, v, 1.0);
        let away = Vector3::new(a, b, 1.0 / z - a * u - b * v).try_normalize(1e-12)?;
        let slant = away.dot(&ray);
        if slant < 0.15 * ray.norm() {
            return None;
        }
        Some(Pixel {
            point: self.world_from_camera * Point3::from(ray * z),
            normal: self.world_from_camera.rotation * -away,
            sd: (self.sd(z) * slant).hypot(5e-5),
        })
    }

    /// The point of the world that the pixel nearest to `(u, v)` reads.
    pub fn read(&self, u: f64, v: f64) -> Option<Point3<f64>> {
        let z = self.depth(u.round() as i64, v.round() as i64)?;
        let (x, y) = unproject(self.camera, u, v);
        Some(self.world_from_camera * Point3::new(x * z, y * z, z))
    }

    /// Width of a pixel at a depth, m.
    pub fn pixel_size(&self, z: f64) -> f64 {
        z / self.camera.fx
    }

    /// The point of the world at depth `z` behind image coordinates, and the derivative, pixels per metre, of its image
    /// along the direction `(mx, my)` of the image by its place in the world.
    pub fn moves_by(&self, (u, v): (f64, f64), z: f64, (mx, my): (f64, f64)) -> (Point3<f64>, Vector3<f64>) {
        let (x, y) = unproject(self.camera, u, v);
        let (gx, gy) = (mx * self.camera.fx / z, my * self.camera.fy / z);
        let gradient = Vector3::new(gx, gy, -(gx * x + gy * y));
        let place = self.world_from_camera * Point3::new(x * z, y * z, z);
        (place, self.world_from_camera.rotation * gradient)
    }

    /// Pixel coordinates of a point of the world in front of the camera, and its depth.
    pub fn place(&self, p: &Point3<f64>) -> Option<(f64, f64, f64)> {
        let c = self.camera_from_world * p;
        if c.z < 0.02 {
            return None;
        }
        let (u, v) = project(self.camera, c.x / c.z, c.y / c.z);
        Some((u, v, c.z))
    }

    /// The box of pixels, low and high corner, around points of the world; nothing where none is in view.
    pub fn window(&self, points: impl Iterator<Item = Point3<f64>>) -> Option<[i64; 4]> {
        let mut box_ = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
        for (u, v, _) in points.filter_map(|p| self.place(&p)) {
            box_ = [box_[0].min(u), box_[1].min(v), box_[2].max(u), box_[3].max(v)];
        }
        let (w, h) = (i64::from(self.camera.width), i64::from(self.camera.height));
        let low = [box_[0].max(0.0) as i64, box_[1].max(0.0) as i64];
        let high = [(box_[2] as i64).min(w - 1), (box_[3] as i64).min(h - 1)];
        (low[0] < high[0] && low[1] < high[1] && box_[2] > 0.0).then_some([low[0], low[1], high[0], high[1]])
    }

    /// The point of the world that the image reads in the direction of `p`.
    pub fn reading(&self, p: &Point3<f64>) -> Option<Point3<f64>> {
        let (u, v, z) = self.place(p)?;
        let seen = self.depth(u.round() as i64, v.round() as i64)?;
        Some(self.eye() + (p - self.eye()) * (seen / z))
    }

    /// Whether the camera saw past a point: the pixel that shows it, and its eight neighbours, read well behind.
    pub fn clear_behind(&self, p: &Point3<f64>) -> bool {
        let Some((u, v, z)) = self.place(p) else { return false };
        let (x, y) = (u.round() as i64, v.round() as i64);
        let limit = z + 0.003 + 3.0 * self.sd(z);
        (-1..=1).all(|dy| (-1..=1).all(|dx| self.depth(x + dx, y + dy).is_some_and(|seen| seen > limit)))
    }

    /// Whether the surface point `p` that faces `normal` (unit, world) is there; `tolerance` along the normal, m.
    pub fn judge(&self, p: &Point3<f64>, normal: &Vector3<f64>, tolerance: f64) -> Verdict {
        let Some((u, v, z)) = self.place(p) else {
            return Verdict::Unknown;
        };
        let Some(seen) = self.depth(u.round() as i64, v.round() as i64) else {
            return Verdict::Unknown;
        };
        let ray = (p - self.eye()) / z;
        let slant = -normal.dot(&ray);
        if slant <= 0.0 {
            return Verdict::Unknown;
        }
        let behind = (seen - z) * slant;
        if behind.abs() < tolerance + 3.0 * self.sd(z) {
            Verdict::There
        } else if behind > 0.0 {
            Verdict::Through
        } else {
            Verdict::Hidden
        }
    }
}
