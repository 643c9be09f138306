//! One view into one block: what it can say about the block as a whole, and then about its samples.

use nalgebra::{Isometry3, Matrix3, Vector3};
use wide::f32x4;

use super::noise::Noise;
use super::planes::Planes;
use super::pyramid::Pyramid;
use super::units::{Steps, Units};
use crate::capture::{Camera, ColorImage};
use crate::geometry::{BLOCK, Block};

/// Samples of a row.
const N: usize = BLOCK as usize;
/// Pixels along a voxel from which a unit is too large for the plane of its middle.
const WIDEST: f32 = 3.0;
/// Gap in front of all readings, in truncations, from which a block is taken as seen through: readings may be slanted.
pub const CLEAR: f32 = 2.0;
/// Gap behind all readings, in reaches behind, from which nothing counts: surfaces may be slanted.
pub const STEEP: f32 = 3.0;

/// A view made ready to be fused.
pub struct Prepared<'a> {
    pub camera: &'a Camera,
    pub color: Option<&'a ColorImage>,
    pub planes: Planes,
    pub pyramid: Pyramid,
    /// Takes a point of the field to `(z u, z v, z)`: pixels times depth, and depth.
    pub rotation: Matrix3<f64>,
    pub offset: Vector3<f64>,
    /// Depth below which there is no reading, m, and the larger focal length, pixels.
    pub least_depth: f32,
    pub focal: f32,
}

impl Prepared<'_> {
    /// Puts the view into a field.
    pub fn place(&mut self, camera_from_field: &Isometry3<f64>) {
        let camera = self.camera;
        let project = Matrix3::new(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
        self.rotation = project * camera_from_field.rotation.to_rotation_matrix().into_inner();
        self.offset = project * camera_from_field.translation.vector;
    }
}

/// How far the distance reaches in front of and behind the surface, m, and the edge of a voxel, m.
#[derive(Clone, Copy)]
pub struct Reach {
    pub front: f32,
    pub behind: f32,
    pub voxel: f32,
}

impl Reach {
    /// Widened to what the noise of a view at this depth asks for.
    fn at(self, noise: Noise, depth: f32) -> Self {
        let depth = depth.max(0.05);
        let sd = noise.variance(1.0 / depth).sqrt() * depth * depth;
        Self {
            front: self.front.max(4.0 * sd),
            behind: self.behind.max(2.0 * sd),
            ..self
        }
    }
}

/// What a view can say about a whole block.
enum Verdict {
    Nothing,
    SeenThrough(f32),
    Mixed,
}

/// A view before a grid: how the samples of its blocks lie, scaled to pixels.
pub struct Placed<'a> {
    view: &'a Prepared<'a>,
    /// The columns lead from a sample to the next along each axis.
    along: Matrix3<f32>,
    steps: Steps,
    /// From the depth of the first sample of a block to that of the nearest, of the middle and of the farthest.
    depths: [f32; 3],
    reach: Reach,
}

impl<'a> Placed<'a> {
    pub fn new(view: &'a Prepared<'a>, reach: Reach) -> Self {
        let along = (view.rotation * f64::from(reach.voxel)).map(|x| x as f32);
        let far = (N - 1) as f32;
        let deep = [along[(2, 0)], along[(2, 1)], along[(2, 2)]];
        let sum = |part: fn(f32) -> f32| far * (part(deep[0]) + part(deep[1]) + part(deep[2]));
        Self {
            view,
            along,
            steps: Steps::new(&along),
            depths: [sum(|x| x.min(0.0)), sum(|x| 0.5 * x), sum(|x| x.max(0.0))],
            reach,
        }
    }

    /// Adds the view to a block.
    pub fn update(&self, key: [i32; 3], block: &mut Block) {
        let view = self.view;
        let voxel = f64::from(self.reach.voxel);
        let at = |k: i32| (f64::from(k * BLOCK) + 0.5) * voxel;
        let first = Vector3::new(at(key[0]), at(key[1]), at(key[2]));
        let base = view.rotation * first + view.offset;
        let base = Vector3::new(base.x as f32, base.y as f32, base.z as f32);
        let middle = base.z + self.depths[1];
        if base.z + self.depths[0] < view.least_depth {
            return;
        }
        let reach = self.reach.at(view.planes.noise, middle);
        match self.judge(&base, reach) {
            Verdict::Nothing => {}
            Verdict::SeenThrough(weight) => block.free_all += weight,
            Verdict::Mixed => {
                let pixels = reach.voxel * view.focal / middle;
                Units::new(view, &self.steps, block, reach, pixels > WIDEST).add(&base);
            }
        }
    }

    /// The least columns and rows of the samples of a block, and the largest, turned about.
    #[inline]
    fn bounds(&self, base: &Vector3<f32>) -> [f32; 4] {
        let far = (N - 1) as f32;
        let (x, y) = (f32x4::new([0.0, far, 0.0, far]), f32x4::new([0.0, 0.0, far, far]));
        let along = &self.along;
        let face = |axis: usize| x * along[(axis, 0)] + y * along[(axis, 1)] + base[axis];
        let (u, v, depth) = (face(0), face(1), face(2));
        let inverse = f32x4::ONE / depth;
        let (upper_u, upper_v) = (u * inverse, v * inverse);
        let inverse = f32x4::ONE / (depth + far * along[(2, 2)]);
        let (lower_u, lower_v) = ((u + far * along[(0, 2)]) * inverse, (v + far * along[(1, 2)]) * inverse);
        let [a, b, c, d] = f32x4::transpose([
            upper_u.fast_min(lower_u),
            upper_v.fast_min(lower_v),
            -upper_u.fast_max(lower_u),
            -upper_v.fast_max(lower_v),
        ]);
        a.fast_min(b).fast_min(c.fast_min(d)).to_array()
    }

    fn judge(&self, base: &Vector3<f32>, reach: Reach) -> Verdict {
        let view = self.view;
        let (near, far) = (base.z + self.depths[0], base.z + self.depths[2]);
        let [left, top, right, bottom] = self.bounds(base);
        let (right, bottom) = (-right, -bottom);
        let (w, h) = ((view.planes.width - 1) as f32, (view.planes.height - 1) as f32);
        if right < 0.0 || bottom < 0.0 || left > w || top > h {
            return Verdict::Nothing;
        }
        let within = left >= 0.0 && top >= 0.0 && right <= w && bottom <= h;
        let pixel = |x: f32, y: f32| [x.clamp(0.0, w) as usize, y.clamp(0.0, h) as usize];
        let (first, last) = (pixel(left, top), pixel(right + 0.5, bottom + 0.5));
        let span = view.pyramid.span(first, last);
        if span.most <= 0.0 || (near - STEEP * reach.behind) * span.least > 1.0 {
            return Verdict::Nothing;
        }
        if within && span.whole && (far + CLEAR * reach.front) * span.most < 1.0 {
            let q = span.least * span.least;
            return Verdict::SeenThrough(0.5 * q * q);
        }
        view.planes.fetch(first, last);
        Verdict::Mixed
    }
}
