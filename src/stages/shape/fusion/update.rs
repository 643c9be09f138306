//! One view into one block: rows of eight samples, written so that compilers make vector code of it.

use nalgebra::{Matrix3, Vector3};

use super::depths::bent_pixel;
use super::planes::Planes;
use super::pyramid::Pyramid;
use crate::capture::{Camera, ColorImage};
use crate::geometry::{BLOCK, Block};

/// Samples of a row.
const N: usize = BLOCK as usize;
/// Adding and taking away this rounds a float to the nearest whole number; its bits then hold the number.
const ROUND: f32 = 8_388_608.0;
/// Bits of [`ROUND`].
const ROUND_BITS: u32 = 0x4B00_0000;
/// Of a sample that lies half a voxel or more behind the surface, how much counts falls off towards the truncation.
const FLAT: f32 = 0.5;
/// Gap in front of all readings, in truncations, from which a block is taken as seen through: readings may be slanted.
const CLEAR: f32 = 2.0;

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

/// How far the distance reaches in front of and behind the surface, m, and the edge of a voxel, m.
#[derive(Clone, Copy)]
pub struct Reach {
    pub front: f32,
    pub behind: f32,
    pub voxel: f32,
}

impl Reach {
    /// Widened to what the noise of a view at this depth asks for.
    fn at(self, noise: f32, depth: f32) -> Self {
        let sd = noise * depth * depth;
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
    let reach = reach.at(view.planes.noise, middle.max(0.0));
    match judge(view, &base, &steps, reach) {
        Verdict::Nothing => {}
        Verdict::SeenThrough(weight) => block.free_all += weight,
        Verdict::Mixed => {
            for z in 0..N {
                for y in 0..N {
                    let row = base + steps.column(1) * y as f32 + steps.column(2) * z as f32;
                    update_row(view, &row, &steps.column(0).into(), block, N * (y + N * z), reach);
                }
            }
        }
    }
}

fn judge(view: &Prepared, base: &Vector3<f32>, steps: &Matrix3<f32>, reach: Reach) -> Verdict {
    let (mut low, mut high) = (Vector3::repeat(f32::MAX), Vector3::repeat(f32::MIN));
    for corner in 0..8 {
        let at = |axis: usize| if corner >> axis & 1 == 1 { (N - 1) as f32 } else { 0.0 };
        let p = base + steps * Vector3::new(at(0), at(1), at(2));
        let pixel = Vector3::new(p.x / p.z, p.y / p.z, p.z);
        (low, high) = (low.inf(&pixel), high.sup(&pixel));
    }
    let (w, h) = ((view.planes.width - 1) as f32, (view.planes.height - 1) as f32);
    if low.z < 0.5 * view.camera.depth_min.max(0.02) as f32 || high.x < 0.0 || high.y < 0.0 || low.x > w || low.y > h {
        return Verdict::Nothing;
    }
    let within = low.x >= 0.0 && low.y >= 0.0 && high.x <= w && high.y <= h;
    let pixel = |x: f32, y: f32| [x.clamp(0.0, w) as usize, y.clamp(0.0, h) as usize];
    let span = view
        .pyramid
        .span(pixel(low.x, low.y), pixel(high.x + 0.5, high.y + 0.5));
    if span.most <= 0.0 || low.z - 1.0 / span.least > 3.0 * reach.behind {
        return Verdict::Nothing;
    }
    if within && span.whole && 1.0 / span.most - high.z > CLEAR * reach.front {
        let q = span.least * span.least;
        return Verdict::SeenThrough(0.5 * q * q);
    }
    Verdict::Mixed
}

/// Weights are `slant² / z⁴`. Space that is seen through is counted apart and never enters the mean distance,
/// which would otherwise shrink every silhouette; what lies behind a surface counts the less the farther it is,
/// for it may be about the other side of a thin wall (Bylow et al. 2013, sec. III-C).
#[inline]
fn update_row(view: &Prepared, row: &Vector3<f32>, step: &Vector3<f32>, block: &mut Block, at: usize, reach: Reach) {
    let planes = &view.planes;
    let (w, h, stride) = (planes.width as f32, planes.height as f32, planes.stride as f32);
    let (mut pu, mut pv, mut pz, mut inverse) = ([0.0_f32; N], [0.0_f32; N], [0.0_f32; N], [0.0_f32; N]);
    let mut place = [0_u32; N];
    for l in 0..N {
        let n = l as f32;
        pu[l] = row.x + step.x * n;
        pv[l] = row.y + step.y * n;
        pz[l] = row.z + step.z * n;
        inverse[l] = 1.0 / pz[l];
        let (u, v) = (pu[l] * inverse[l] + 1.0, pv[l] * inverse[l] + 1.0);
        let u = if u > 0.0 { u } else { 0.0 };
        let v = if v > 0.0 { v } else { 0.0 };
        let u = if u < w + 1.0 { u } else { w + 1.0 };
        let v = if v < h + 1.0 { v } else { h + 1.0 };
        let (u, v) = ((u + ROUND) - ROUND, (v + ROUND) - ROUND);
        place[l] = (v * stride + u + ROUND).to_bits() - ROUND_BITS;
    }
    let (mut distance, mut slant) = ([0.0_f32; N], [0.0_f32; N]);
    for l in 0..N {
        let [a, b, c, d] = planes.records[place[l] as usize];
        distance[l] = d - (a * pu[l] + b * pv[l] + c * pz[l]);
        slant[l] = d;
    }
    let fall = 1.0 / (reach.behind - FLAT * reach.voxel);
    let (Some(sum), Some(weight), Some(free)) = (
        block.sum[at..].first_chunk_mut::<N>(),
        block.weight[at..].first_chunk_mut::<N>(),
        block.free[at..].first_chunk_mut::<N>(),
    ) else {
        return;
    };
    let mut trust = [0.0_f32; N];
    for l in 0..N {
        let d = distance[l];
        let slant = slant[l] * inverse[l];
        let near = inverse[l] * inverse[l];
        let full = slant * slant * near * near;
        let share = (d + reach.behind) * fall;
        let share = if share < 1.0 { share } else { 1.0 };
        let touched = d > -reach.behind && d <= reach.front;
        trust[l] = if touched { full * share * share } else { 0.0 };
        let signed = if touched { d } else { 0.0 };
        sum[l] += trust[l] * signed;
        weight[l] += trust[l];
        free[l] += if d > reach.front { full } else { 0.0 };
    }
    if let Some(color) = view.color {
        for l in 0..N {
            if trust[l] > 0.0 && distance[l].abs() < 2.0 * reach.voxel {
                add_color(view, color, block, at + l, place[l] as usize, trust[l]);
            }
        }
    }
}

fn add_color(view: &Prepared, color: &ColorImage, block: &mut Block, at: usize, place: usize, weight: f32) {
    let (x, y) = (place % view.planes.stride, place / view.planes.stride);
    let pixel = if view.camera.distortion == [0.0; 5] {
        Some(x - 1 + view.planes.width * (y - 1))
    } else {
        bent_pixel(view.camera, x - 1, y - 1)
    };
    let Some(rgb) = pixel.and_then(|p| color.rgb.get(p)) else {
        return;
    };
    let sums = block
        .color
        .get_or_insert_with(|| Box::new([[0.0; 4]; crate::geometry::BLOCK_SAMPLES]));
    for (sum, new) in sums[at].iter_mut().zip(rgb) {
        *sum += f32::from(*new) * weight;
    }
    sums[at][3] += weight;
}
