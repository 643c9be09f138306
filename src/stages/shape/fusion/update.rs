//! One view into one block: rows of eight samples, written so that compilers make vector code of it.

use nalgebra::{Matrix3, Vector3};

use super::depths::bent_pixel;
use super::planes::{Noise, Planes};
use super::pyramid::{Pyramid, Span};
use crate::capture::{Camera, ColorImage};
use crate::geometry::{BLOCK, BLOCK_SAMPLES, Block};

/// Samples of a row.
const N: usize = BLOCK as usize;
/// Of a sample that lies half a voxel or more behind the surface, how much counts falls off towards the truncation.
const FLAT: f32 = 0.5;
/// Steps from the middle of a row to its ends.
const HALF: f32 = 0.5 * (N - 1) as f32;
/// How far a surface may curve away from its plane over a block, in voxels.
const MARGIN: f32 = 1.5;
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
    Mixed(Span),
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
        Verdict::Mixed(touched) => {
            let [right, down, deep] = [0, 1, 2].map(|a| steps.column(a).into_owned());
            let looks: &[f32] = if touched.torn { &[0.5, 3.5, 6.5] } else { &[3.5] };
            let spread = 3.5 / looks.len() as f32;
            for z in 0..N {
                let slab = base + deep * z as f32;
                let extents = [(right, HALF), (down, HALF)];
                if !touched.torn {
                    let middle = slab + (right + down) * HALF;
                    if skip(look(view, &middle, &extents, reach), block, N * N * z..N * N * (z + 1)) {
                        continue;
                    }
                }
                for y in 0..N {
                    let row = slab + down * y as f32;
                    let at = N * (y + N * z);
                    let seen = looks
                        .iter()
                        .map(|x| look(view, &(row + right * *x), &[(right, spread)], reach));
                    let side = seen.reduce(Look::and).unwrap_or(Look::Near);
                    if !skip(side, block, at..at + N) {
                        update_row(view, &row, &right, block, at, reach);
                    }
                }
            }
        }
    }
}

/// What one reading says about the samples around a place.
#[derive(Clone, Copy)]
enum Look {
    /// All seen through, with this weight.
    Through(f32),
    /// All farther behind the surface than a view counts.
    Behind,
    Near,
}

impl Look {
    /// What two readings agree on.
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Through(a), Self::Through(b)) => Self::Through(a.min(b)),
            (Self::Behind, Self::Behind) => Self::Behind,
            _ => Self::Near,
        }
    }
}

/// Looks at the samples around `middle` that lie up to so many `steps` away.
#[inline]
fn look(view: &Prepared, middle: &Vector3<f32>, steps: &[(Vector3<f32>, f32)], reach: Reach) -> Look {
    let inverse = 1.0 / middle.z;
    let place = view.planes.place(middle.x * inverse, middle.y * inverse);
    let [a, b, c, d] = view.planes.record(place);
    let distance = d - (a * middle.x + b * middle.y + c * middle.z);
    let along = |s: &Vector3<f32>| (a * s.x + b * s.y + c * s.z).abs();
    let extent: f32 = steps.iter().map(|(s, n)| n * along(s)).sum();
    let margin = extent + MARGIN * reach.voxel;
    if d > 0.0 && distance > reach.front + margin {
        let near = inverse * inverse;
        return Look::Through(d * inverse * d * inverse * near * near);
    }
    if d > 0.0 && distance < -reach.behind - margin {
        return Look::Behind;
    }
    Look::Near
}

/// Whether nothing is left to do for these samples; notes that they were seen through.
#[inline]
fn skip(side: Look, block: &mut Block, samples: std::ops::Range<usize>) -> bool {
    if let Look::Through(weight) = side {
        for free in &mut block.free[samples] {
            *free += weight;
        }
    }
    !matches!(side, Look::Near)
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
    Verdict::Mixed(span)
}

/// Weights are `slant² / z⁴`. Space that is seen through is counted apart and never enters the mean distance,
/// which would otherwise shrink every silhouette; what lies behind a surface counts the less the farther it is,
/// for it may be about the other side of a thin wall (Bylow et al. 2013, sec. III-C).
#[inline]
fn update_row(view: &Prepared, row: &Vector3<f32>, step: &Vector3<f32>, block: &mut Block, at: usize, reach: Reach) {
    let planes = &view.planes;
    let (mut pu, mut pv, mut pz, mut inverse) = ([0.0_f32; N], [0.0_f32; N], [0.0_f32; N], [0.0_f32; N]);
    let mut place = [0_u32; N];
    for l in 0..N {
        let n = l as f32;
        pu[l] = row.x + step.x * n;
        pv[l] = row.y + step.y * n;
        pz[l] = row.z + step.z * n;
        inverse[l] = 1.0 / pz[l];
        place[l] = planes.place(pu[l] * inverse[l], pv[l] * inverse[l]);
    }
    let (mut distance, mut slant) = ([0.0_f32; N], [0.0_f32; N]);
    for half in [0, N / 2] {
        let records: [[f32; 4]; N / 2] = std::array::from_fn(|l| planes.record(place[half + l]));
        for (l, [a, b, c, d]) in records.into_iter().enumerate() {
            let at = half + l;
            distance[at] = d - (a * pu[at] + b * pv[at] + c * pz[at]);
            slant[at] = if d > 0.0 { d } else { 0.0 };
        }
    }
    let fall = 1.0 / (reach.behind - FLAT * reach.voxel);
    let (mut trust, mut signed, mut through) = ([0.0_f32; N], [0.0_f32; N], [0.0_f32; N]);
    for l in 0..N {
        let d = distance[l];
        let slant = slant[l] * inverse[l];
        let near = inverse[l] * inverse[l];
        let full = slant * slant * near * near;
        let share = (d + reach.behind) * fall;
        let share = if share < 1.0 { share } else { 1.0 };
        let share = if share > 0.0 { share } else { 0.0 };
        let part = full * share * share;
        let beyond = d > reach.front;
        trust[l] = if beyond { 0.0 } else { part };
        through[l] = if beyond { full } else { 0.0 };
        signed[l] = if d > -reach.behind { trust[l] * d } else { 0.0 };
    }
    add(&mut block.sum, at, &signed);
    add(&mut block.weight, at, &trust);
    add(&mut block.free, at, &through);
    if let Some(color) = view.color {
        for l in 0..N {
            if trust[l] > 0.0 && distance[l].abs() < 2.0 * reach.voxel {
                add_color(view, color, block, at + l, place[l] as usize, trust[l]);
            }
        }
    }
}

#[inline]
fn add(samples: &mut [f32; BLOCK_SAMPLES], at: usize, row: &[f32; N]) {
    if let Some(into) = samples[at..].first_chunk_mut::<N>() {
        for l in 0..N {
            into[l] += row[l];
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
    let sums = block.color.get_or_insert_with(|| Box::new([[0.0; 4]; BLOCK_SAMPLES]));
    for (sum, new) in sums[at].iter_mut().zip(rgb) {
        *sum += f32::from(*new) * weight;
    }
    sums[at][3] += weight;
}
