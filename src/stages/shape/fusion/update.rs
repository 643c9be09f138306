//! One view into one block: what it can say about the block as a whole, and then about its samples.

use nalgebra::{Isometry3, Matrix3, Vector3};
use wide::f32x4;

use super::noise::Noise;
use super::planes::Planes;
use super::pyramid::Pyramid;
use super::units::Units;
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

/// Adds a view to a block.
pub fn update(view: &Prepared, key: [i32; 3], block: &mut Block, reach: Reach) {
    let voxel = f64::from(reach.voxel);
    let first = Vector3::from(key.map(|k| f64::from(k * BLOCK) + 0.5)) * voxel;
    let base = (view.rotation * first + view.offset).map(|x| x as f32);
    let steps = (view.rotation * voxel).map(|x| x as f32);
    let middle = base.z + 3.5 * (steps[(2, 0)] + steps[(2, 1)] + steps[(2, 2)]);
    let reach = reach.at(view.planes.noise, middle);
    match judge(view, &base, &steps, reach) {
        Verdict::Nothing => {}
        Verdict::SeenThrough(weight) => block.free_all += weight,
        Verdict::Mixed => {
            let pixels = reach.voxel * view.camera.fx.max(view.camera.fy) as f32 / middle;
            let mut units = Units::new(view, block, &steps, reach, pixels > WIDEST);
            for z in 0..N / 2 {
                units.layer(&(base + steps.column(2) * (2 * z) as f32), z);
            }
        }
    }
}

/// The least and the largest column, row and depth of the samples of a block.
fn bounds(base: &Vector3<f32>, steps: &Matrix3<f32>) -> (Vector3<f32>, Vector3<f32>) {
    let far = (N - 1) as f32;
    let (x, y) = (f32x4::new([0.0, far, 0.0, far]), f32x4::new([0.0, 0.0, far, far]));
    let corners = [0.0, far].map(|z| {
        let [u, v, depth] = [0, 1, 2].map(|axis| {
            let start = base[axis] + z * steps[(axis, 2)];
            x * steps[(axis, 0)] + y * steps[(axis, 1)] + start
        });
        let inverse = f32x4::ONE / depth;
        [u * inverse, v * inverse, depth]
    });
    let [upper, lower] = corners;
    let least = |axis: usize| {
        upper[axis]
            .fast_min(lower[axis])
            .to_array()
            .into_iter()
            .fold(f32::MAX, f32::min)
    };
    let most = |axis: usize| {
        upper[axis]
            .fast_max(lower[axis])
            .to_array()
            .into_iter()
            .fold(f32::MIN, f32::max)
    };
    (
        Vector3::from_fn(|axis, _| least(axis)),
        Vector3::from_fn(|axis, _| most(axis)),
    )
}

fn judge(view: &Prepared, base: &Vector3<f32>, steps: &Matrix3<f32>, reach: Reach) -> Verdict {
    let (low, high) = bounds(base, steps);
    let (w, h) = ((view.planes.width - 1) as f32, (view.planes.height - 1) as f32);
    if low.z < 0.5 * view.camera.depth_min.max(0.02) as f32 || high.x < 0.0 || high.y < 0.0 || low.x > w || low.y > h {
        return Verdict::Nothing;
    }
    let within = low.x >= 0.0 && low.y >= 0.0 && high.x <= w && high.y <= h;
    let pixel = |x: f32, y: f32| [x.clamp(0.0, w) as usize, y.clamp(0.0, h) as usize];
    let span = view
        .pyramid
        .span(pixel(low.x, low.y), pixel(high.x + 0.5, high.y + 0.5));
    if span.most <= 0.0 || low.z - 1.0 / span.least > STEEP * reach.behind {
        return Verdict::Nothing;
    }
    if within && span.whole && 1.0 / span.most - high.z > CLEAR * reach.front {
        let q = span.least * span.least;
        return Verdict::SeenThrough(0.5 * q * q);
    }
    Verdict::Mixed
}
