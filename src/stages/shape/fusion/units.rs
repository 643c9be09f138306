//! The samples of a block in units of 4 x 2, each of which sees one plane, or many where the view is torn.

use nalgebra::{Matrix3, Vector3};

use super::depths::bent_pixel;
use super::planes::Cell;
use super::update::{CLEAR, Prepared, Reach, STEEP};
use crate::capture::ColorImage;
use crate::geometry::{BLOCK, BLOCK_SAMPLES, Block};

/// Samples of a row.
const ROW: usize = BLOCK as usize;
/// Samples of a unit along x.
const LONG: usize = 4;
/// Samples of a unit, and units of a layer.
const N: usize = 8;
/// Offsets of the samples of a unit from its middle, in voxels.
const X: [f32; N] = [-1.5, -0.5, 0.5, 1.5, -1.5, -0.5, 0.5, 1.5];
const Y: [f32; N] = [-0.5, -0.5, -0.5, -0.5, 0.5, 0.5, 0.5, 0.5];
/// Of a sample that lies half a voxel or more behind the surface, how much counts falls off towards the truncation.
const FLAT: f32 = 0.5;

type Lanes = [f32; N];

/// A block that a view is added to, layer by layer.
pub struct Units<'a> {
    view: &'a Prepared<'a>,
    block: &'a mut Block,
    reach: Reach,
    /// Whether every sample must look for itself.
    each: bool,
    right: Vector3<f32>,
    down: Vector3<f32>,
    /// From the first sample of a layer to the middles of its units.
    middles: [Lanes; 3],
    /// One over the distance over which what lies behind a surface falls off.
    fall: f32,
}

/// Where the middles of the units of a layer are, and what they see.
struct Sight {
    records: [[f32; 4]; N],
    /// Distance in front of the plane, and how it changes from sample to sample.
    distance: Lanes,
    along_x: Lanes,
    along_y: Lanes,
    /// Most that the samples' distances differ from the middle's.
    extent: Lanes,
    /// Weight of a look.
    full: Lanes,
}

impl<'a> Units<'a> {
    pub fn new(view: &'a Prepared<'a>, block: &'a mut Block, steps: &Matrix3<f32>, reach: Reach, each: bool) -> Self {
        let (right, down) = (steps.column(0).into_owned(), steps.column(1).into_owned());
        let unit = |k: usize| right * (1.5 + 4.0 * (k & 1) as f32) + down * (0.5 + 2.0 * (k >> 1) as f32);
        Self {
            view,
            block,
            reach,
            each,
            right,
            down,
            middles: std::array::from_fn(|axis| std::array::from_fn(|k| unit(k)[axis])),
            fall: 1.0 / (reach.behind - FLAT * reach.voxel),
        }
    }

    /// Adds the view to the layer whose first sample is `first`, scaled to pixels, and number `start` of the block.
    #[inline]
    pub fn layer(&mut self, first: &Vector3<f32>, start: usize) {
        let sight = self.look(first);
        for k in 0..N {
            let at = start + LONG * (k & 1) + 2 * ROW * (k >> 1);
            match Cell::of(&sight.records[k]) {
                Cell::Nothing => {}
                Cell::Smooth if !self.each => self.one_plane(&sight, k, first, at),
                Cell::Smooth => self.many_planes(&self.middle(first, k), at),
                Cell::Torn => self.torn(&sight.records[k], &self.middle(first, k), at),
            }
        }
    }

    fn middle(&self, first: &Vector3<f32>, k: usize) -> Vector3<f32> {
        Vector3::from_fn(|axis, _| first[axis] + self.middles[axis][k])
    }

    #[inline]
    fn look(&self, first: &Vector3<f32>) -> Sight {
        let planes = &self.view.planes;
        let [mut px, mut py, mut pz, mut inverse] = [[0.0_f32; N]; 4];
        let mut place = [0_u32; N];
        for k in 0..N {
            px[k] = first.x + self.middles[0][k];
            py[k] = first.y + self.middles[1][k];
            pz[k] = first.z + self.middles[2][k];
            inverse[k] = 1.0 / pz[k];
            place[k] = planes.place(px[k] * inverse[k], py[k] * inverse[k]);
        }
        let records: [[f32; 4]; N] = std::array::from_fn(|k| planes.cell(place[k]));
        let mut sight = Sight {
            records,
            distance: [0.0; N],
            along_x: [0.0; N],
            along_y: [0.0; N],
            extent: [0.0; N],
            full: [0.0; N],
        };
        for k in 0..N {
            let [a, b, c, d] = records[k];
            sight.distance[k] = d - (a * px[k] + b * py[k] + c * pz[k]);
            sight.along_x[k] = -(a * self.right.x + b * self.right.y + c * self.right.z);
            sight.along_y[k] = -(a * self.down.x + b * self.down.y + c * self.down.z);
            sight.extent[k] = 1.5 * sight.along_x[k].abs() + 0.5 * sight.along_y[k].abs();
            sight.full[k] = weight(d, inverse[k]);
        }
        sight
    }

    /// Adds the plane that unit `k` sees.
    #[inline]
    fn one_plane(&mut self, sight: &Sight, k: usize, first: &Vector3<f32>, at: usize) {
        let (middle, extent) = (sight.distance[k], sight.extent[k]);
        if middle + extent <= -self.reach.behind {
            return;
        }
        let full = [sight.full[k]; N];
        if middle - extent > self.reach.front {
            add(&mut self.block.free, at, &full);
            return;
        }
        let mut distance = [0.0; N];
        for l in 0..N {
            distance[l] = middle + X[l] * sight.along_x[k] + Y[l] * sight.along_y[k];
        }
        let trust = self.add_distances(&distance, &full, at);
        if let Some(color) = self.view.color {
            self.add_colors(color, &self.middle(first, k), &distance, &trust, at);
        }
    }

    /// Adds what a unit sees where something tears the view, if it is not clear of all that is around.
    #[inline]
    fn torn(&mut self, cell: &[f32; 4], middle: &Vector3<f32>, at: usize) {
        let [far, near, low, _] = cell;
        let extent = 1.5 * self.right.z.abs() + 0.5 * self.down.z.abs();
        if (middle.z - extent - STEEP * self.reach.behind) * far > 1.0 {
            return;
        }
        if (middle.z + extent + CLEAR * self.reach.front) * near < 1.0 {
            add(&mut self.block.free, at, &[0.5 * low * low * low * low; N]);
            return;
        }
        self.many_planes(middle, at);
    }

    /// Adds what each sample of the unit around `middle` sees.
    fn many_planes(&mut self, middle: &Vector3<f32>, at: usize) {
        let planes = &self.view.planes;
        let [mut px, mut py, mut pz, mut inverse, mut u, mut v] = [[0.0_f32; N]; 6];
        for l in 0..N {
            px[l] = middle.x + self.right.x * X[l] + self.down.x * Y[l];
            py[l] = middle.y + self.right.y * X[l] + self.down.y * Y[l];
            pz[l] = middle.z + self.right.z * X[l] + self.down.z * Y[l];
            inverse[l] = 1.0 / pz[l];
            (u[l], v[l]) = (px[l] * inverse[l], py[l] * inverse[l]);
        }
        let (x, y) = planes.pixels(&u, &v);
        let records: [[f32; 4]; N] = std::array::from_fn(|l| planes.pixel(x[l], y[l]));
        let [mut distance, mut full] = [[0.0; N]; 2];
        for l in 0..N {
            let [a, b, c, d] = records[l];
            distance[l] = d - (a * px[l] + b * py[l] + c * pz[l]);
            full[l] = weight(d, inverse[l]);
        }
        let trust = self.add_distances(&distance, &full, at);
        if let Some(color) = self.view.color {
            self.add_colors(color, middle, &distance, &trust, at);
        }
    }

    /// Space that is seen through is counted apart and never enters the mean distance, which would otherwise shrink
    /// every silhouette; what lies behind a surface counts the less the farther it is, for it may be about the other
    /// side of a thin wall (Bylow et al. 2013, sec. III-C). Gives what each sample was trusted.
    #[inline]
    fn add_distances(&mut self, distance: &Lanes, full: &Lanes, at: usize) -> Lanes {
        let [mut trust, mut signed, mut through] = [[0.0_f32; N]; 3];
        for l in 0..N {
            let d = distance[l];
            let share = (d + self.reach.behind) * self.fall;
            let share = if share < 1.0 { share } else { 1.0 };
            let share = if share > 0.0 { share } else { 0.0 };
            let part = full[l] * share * share;
            let beyond = d > self.reach.front;
            trust[l] = if beyond { 0.0 } else { part };
            through[l] = if beyond { full[l] } else { 0.0 };
            signed[l] = if d > -self.reach.behind { trust[l] * d } else { 0.0 };
        }
        add(&mut self.block.sum, at, &signed);
        add(&mut self.block.weight, at, &trust);
        add(&mut self.block.free, at, &through);
        trust
    }

    fn add_colors(&mut self, color: &ColorImage, middle: &Vector3<f32>, distance: &Lanes, trust: &Lanes, at: usize) {
        for l in 0..N {
            if trust[l] > 0.0 && distance[l].abs() < 2.0 * self.reach.voxel {
                let p = middle + self.right * X[l] + self.down * Y[l];
                let sample = at + l % LONG + ROW * (l / LONG);
                add_color(self.view, color, self.block, sample, (p.x / p.z, p.y / p.z), trust[l]);
            }
        }
    }
}

/// Weight of a look at a plane at distance `d` from the camera, `slant² / z⁴`; none of nothing.
#[inline]
fn weight(d: f32, inverse: f32) -> f32 {
    let d = if d > 0.0 { d } else { 0.0 };
    let slant = d * inverse;
    let near = inverse * inverse;
    slant * slant * near * near
}

/// Adds to the two rows of a unit.
#[inline]
fn add(samples: &mut [f32; BLOCK_SAMPLES], at: usize, unit: &Lanes) {
    if let Some(into) = samples[at..].first_chunk_mut::<{ LONG + ROW }>() {
        for l in 0..LONG {
            into[l] += unit[l];
            into[l + ROW] += unit[l + LONG];
        }
    }
}

fn add_color(view: &Prepared, color: &ColorImage, block: &mut Block, at: usize, (u, v): (f32, f32), weight: f32) {
    let (width, height) = (view.planes.width, view.planes.height);
    let (x, y) = ((u + 0.5).max(0.0) as usize, (v + 0.5).max(0.0) as usize);
    let (x, y) = (x.min(width - 1), y.min(height - 1));
    let pixel = if view.camera.distortion == [0.0; 5] {
        Some(x + width * y)
    } else {
        bent_pixel(view.camera, x, y)
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
