//! A range image made ready for fusion: which pixels can be trusted, and how slanted their surface is.

use nalgebra::{Isometry3, Point3};

use super::lens::{project, unproject};
use crate::capture::{Camera, ColorImage, View};

/// Depth noise at 1 m that is assumed where the camera does not state it, m.
const ASSUMED_DEPTH_SD: f64 = 0.0015;
/// Steps of the stored slant factor per unit.
const SLANT_STEPS: f64 = 160.0;
/// Slant factor below which a surface is too grazing to be measured.
const LEAST_SLANT: f64 = 0.15;
/// Pixels to each side over which a slope is taken.
const SLOPE_REACH: i64 = 3;

/// A view with its pose relative to the field that it is fused into.
pub struct Range<'a> {
    pub camera: &'a Camera,
    pub color: Option<&'a ColorImage>,
    pub camera_from_field: Isometry3<f64>,
    counts: &'a [u16],
    /// 0: no trusted depth; 1: depth without a slope; else the slant factor in steps.
    slant: Vec<u8>,
    width: i64,
    height: i64,
}

/// What a view says about a place on its image.
pub enum Reading {
    /// Nothing.
    None,
    /// A depth edge, of which the nearer side is at this depth, m.
    Edge(f64),
    /// A surface at `depth`, m; a step along z times `slant` is the step towards the surface.
    Surface { depth: f64, slant: f64 },
}

impl<'a> Range<'a> {
    /// Sorts out the pixels of a view; its field's frame is the world.
    pub fn new(camera: &'a Camera, view: &'a View) -> Self {
        let mut range = Self {
            camera,
            color: view.color.as_ref(),
            camera_from_field: view.world_from_camera.0.inverse(),
            counts: &view.depth.counts,
            slant: Vec::new(),
            width: i64::from(view.depth.width),
            height: i64::from(view.depth.height),
        };
        range.slant = (0..range.width * range.height)
            .map(|i| range.judge(i % range.width, i / range.width))
            .collect();
        range
    }

    /// Standard deviation of one depth reading, m; grows with the range squared.
    pub fn depth_sd(&self, depth: f64) -> f64 {
        self.camera.depth_sd.unwrap_or(ASSUMED_DEPTH_SD) * depth * depth
    }

    fn raw(&self, x: i64, y: i64) -> Option<f64> {
        if x < 0 || y < 0 || x >= self.width || y >= self.height {
            return None;
        }
        let depth = f64::from(self.counts[(y * self.width + x) as usize]) * self.camera.depth_unit;
        (depth > 0.0 && depth >= self.camera.depth_min && depth <= self.camera.depth_max).then_some(depth)
    }

    /// Largest depth step to a neighbour that a surface is taken to make, m.
    fn step_limit(&self, depth: f64) -> f64 {
        (4.0 * self.depth_sd(depth)).max(5.0 * depth / self.camera.fx)
    }

    fn judge(&self, x: i64, y: i64) -> u8 {
        let Some(depth) = self.raw(x, y) else { return 0 };
        let limit = self.step_limit(depth);
        let (mut valid, mut friends) = (0, 0);
        for (dx, dy) in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (dx, dy))) {
            if let Some(there) = self.raw(x + dx, y + dy) {
                valid += 1;
                friends += i32::from((there - depth).abs() < limit);
            }
        }
        if friends < 4 || 3 * friends < 2 * valid {
            return 0;
        }
        match self.slant_at(x, y, depth) {
            Some(slant) if slant > LEAST_SLANT => (slant * SLANT_STEPS).clamp(2.0, 255.0) as u8,
            _ => 1,
        }
    }

    /// Inverse depth is linear in the image of a plane, `1/z = a u + b v + c`, and `(a, b, c)` is its normal:
    /// the slant factor is `1 / (z |(a, b, c)|)`.
    fn slant_at(&self, x: i64, y: i64, depth: f64) -> Option<f64> {
        let a = self.slope(x, y, depth, 1, 0)? * self.camera.fx;
        let b = self.slope(x, y, depth, 0, 1)? * self.camera.fy;
        let u = (x as f64 - self.camera.cx) / self.camera.fx;
        let v = (y as f64 - self.camera.cy) / self.camera.fy;
        let c = 1.0 / depth - a * u - b * v;
        Some(1.0 / (depth * (a * a + b * b + c * c).sqrt()))
    }

    fn slope(&self, x: i64, y: i64, depth: f64, dx: i64, dy: i64) -> Option<f64> {
        let reach = |sign: i64| {
            (1..=SLOPE_REACH)
                .map_while(|n| {
                    let limit = self.step_limit(depth) * n as f64;
                    let there = self.raw(x + sign * n * dx, y + sign * n * dy)?;
                    ((there - depth).abs() < limit).then_some((sign * n, 1.0 / there))
                })
                .last()
                .unwrap_or((0, 1.0 / depth))
        };
        let (low, high) = (reach(-1), reach(1));
        (high.0 > low.0).then(|| (high.1 - low.1) / (high.0 - low.0) as f64)
    }

    /// The trusted depth at a pixel.
    pub fn depth(&self, x: i64, y: i64) -> Option<f64> {
        let i = (y * self.width + x) as usize;
        (self.slant[i] > 0).then(|| f64::from(self.counts[i]) * self.camera.depth_unit)
    }

    /// Every `step`-th trusted pixel in rows and columns as a point of the field's frame.
    pub fn points(&self, step: usize) -> impl Iterator<Item = Point3<f64>> + '_ {
        let field_from_camera = self.camera_from_field.inverse();
        (0..self.height).step_by(step).flat_map(move |y| {
            (0..self.width).step_by(step).filter_map(move |x| {
                let depth = self.depth(x, y)?;
                let (u, v) = unproject(self.camera, x as f64, y as f64);
                Some(field_from_camera * Point3::new(u * depth, v * depth, depth))
            })
        })
    }

    /// Pixel coordinates of a point of the camera frame, where it lies in front and within the image.
    pub fn pixel(&self, p: &Point3<f64>) -> Option<(f64, f64)> {
        if p.z < 0.5 * self.camera.depth_min.max(0.02) {
            return None;
        }
        let (u, v) = project(self.camera, p.x / p.z, p.y / p.z);
        let fits = u >= 0.0 && v >= 0.0 && u < (self.width - 1) as f64 && v < (self.height - 1) as f64;
        fits.then_some((u, v))
    }

    /// What stands at a place between four pixels.
    pub fn read(&self, u: f64, v: f64) -> Reading {
        let (x, y) = (u as i64, v as i64);
        let (s, t) = (u - x as f64, v - y as f64);
        // Images registered to another camera have holes: up to two of four corners may be missing.
        let corners = [
            self.depth(x, y),
            self.depth(x + 1, y),
            self.depth(x, y + 1),
            self.depth(x + 1, y + 1),
        ];
        let known = corners.iter().flatten().count();
        let Some(stand_in) = corners
            .iter()
            .flatten()
            .copied()
            .reduce(f64::min)
            .filter(|_| known >= 2)
        else {
            return Reading::None;
        };
        let [a, b, c, d] = corners.map(|depth| depth.unwrap_or(stand_in));
        let near = a.min(b).min(c).min(d);
        let far = a.max(b).max(c).max(d);
        let steps = self.slant[((v + 0.5) as i64 * self.width + (u + 0.5) as i64) as usize];
        let slant = f64::from(steps) / SLANT_STEPS;
        let tangent = (1.0 / (slant * slant) - 1.0).max(0.0).sqrt().min(8.0);
        let allowed = near / self.camera.fx * (2.0 + 3.0 * tangent) + 5.0 * self.depth_sd(near);
        if steps < 2 || far - near > allowed {
            return Reading::Edge(near);
        }
        let inverse = ((1.0 - s) / a + s / b) * (1.0 - t) + ((1.0 - s) / c + s / d) * t;
        let depth = 1.0 / inverse;
        Reading::Surface { depth, slant }
    }

    /// The colour at the pixel nearest to a place.
    pub fn rgb(&self, u: f64, v: f64) -> Option<[u8; 3]> {
        let at = ((v + 0.5) as i64 * self.width + (u + 0.5) as i64) as usize;
        self.color.and_then(|c| c.rgb.get(at).copied())
    }
}
