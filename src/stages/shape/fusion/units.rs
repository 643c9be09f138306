//! The samples of a block in units of 4 x 2 x 2, each of which sees one plane, or many where the view is torn.

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

use super::depths::bent_pixel;
use super::planes::Cell;
use super::update::{CLEAR, Prepared, Reach, STEEP};
use crate::capture::ColorImage;
use crate::geometry::{BLOCK_SAMPLES, Block, UNIT_SAMPLES, Unit};

/// Units of a layer two samples deep.
const UNITS: usize = 8;
/// Offsets of the samples of a row of a unit, and of its rows, from the middle, in voxels.
const X: [f32; 4] = [-1.5, -0.5, 0.5, 1.5];
const YZ: [(f32, f32); ROWS] = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
/// Rows of a unit.
const ROWS: usize = 4;
/// Of a sample that lies half a voxel or more behind the surface, how much counts falls off towards the truncation, with
/// the fourth power: of a wall of two voxels each side then is seen by its own views alone.
const FLAT: f32 = 0.5;

/// A block that a view is added to, layer by layer.
pub struct Units<'a> {
    view: &'a Prepared<'a>,
    block: &'a mut Block,
    reach: Reach,
    /// Whether every sample must look for itself.
    each: bool,
    right: Vector3<f32>,
    down: Vector3<f32>,
    deep: Vector3<f32>,
    /// From the first sample of a layer to the middles of its units, four by four.
    middles: [[f32x4; 3]; 2],
    /// One over the distance over which what lies behind a surface falls off.
    fall: f32,
}

/// What units see.
struct Sight {
    records: [[f32; 4]; UNITS],
    /// Distance in front of the plane, and how it changes from sample to sample.
    distance: [f32; UNITS],
    along_x: [f32; UNITS],
    along_y: [f32; UNITS],
    along_z: [f32; UNITS],
    /// Most that the samples' distances differ from the middle's.
    extent: [f32; UNITS],
    /// Weight of a look.
    full: [f32; UNITS],
}

impl<'a> Units<'a> {
    pub fn new(view: &'a Prepared<'a>, block: &'a mut Block, steps: &Matrix3<f32>, reach: Reach, each: bool) -> Self {
        let [right, down, deep] = [0, 1, 2].map(|axis| steps.column(axis).into_owned());
        let first = right * 1.5 + (down + deep) * 0.5;
        let unit = |k: usize| first + right * (4 * (k & 1)) as f32 + down * (k & 6) as f32;
        let four = |half: usize| [0, 1, 2].map(|axis| f32x4::new([0, 1, 2, 3].map(|k| unit(4 * half + k)[axis])));
        Self {
            view,
            block,
            reach,
            each,
            right,
            down,
            deep,
            middles: [four(0), four(1)],
            fall: 1.0 / (reach.behind - FLAT * reach.voxel),
        }
    }

    /// Adds the view to layer `z` of units, whose first sample is `first`, scaled to pixels.
    #[inline]
    pub fn layer(&mut self, first: &Vector3<f32>, z: usize) {
        let sight = self.look(first);
        for k in 0..UNITS {
            let unit = UNITS * z + k;
            match Cell::of(&sight.records[k]) {
                Cell::Nothing => {}
                Cell::Smooth if !self.each => self.one_plane(&sight, k, first, unit),
                Cell::Smooth => self.many_planes(&self.middle(first, k), unit),
                Cell::Torn => self.torn(&sight.records[k], &self.middle(first, k), unit),
            }
        }
    }

    fn middle(&self, first: &Vector3<f32>, k: usize) -> Vector3<f32> {
        let middles = &self.middles[k >> 2];
        Vector3::from_fn(|axis, _| first[axis] + middles[axis].as_array()[k & 3])
    }

    #[inline]
    fn look(&self, first: &Vector3<f32>) -> Sight {
        let planes = &self.view.planes;
        let mut sight = Sight {
            records: [[0.0; 4]; UNITS],
            distance: [0.0; UNITS],
            along_x: [0.0; UNITS],
            along_y: [0.0; UNITS],
            along_z: [0.0; UNITS],
            extent: [0.0; UNITS],
            full: [0.0; UNITS],
        };
        for (half, [x, y, z]) in self.middles.iter().enumerate() {
            let p = [*x + first.x, *y + first.y, *z + first.z];
            let inverse = f32x4::ONE / p[2];
            let place = planes.places(p[0] * inverse, p[1] * inverse);
            let at = 4 * half;
            let records = place.map(|place| planes.cell(place));
            sight.records[at..at + 4].copy_from_slice(&records);
            let [a, b, c, d] = columns(records);
            let distance = d - (a * p[0] + b * p[1] + c * p[2]);
            let along_x = a * self.right.x + b * self.right.y + c * self.right.z;
            let along_y = a * self.down.x + b * self.down.y + c * self.down.z;
            let along_z = a * self.deep.x + b * self.deep.y + c * self.deep.z;
            let extent = along_x.abs() * 1.5 + (along_y.abs() + along_z.abs()) * 0.5;
            put(&mut sight.distance, at, distance);
            put(&mut sight.along_x, at, -along_x);
            put(&mut sight.along_y, at, -along_y);
            put(&mut sight.along_z, at, -along_z);
            put(&mut sight.extent, at, extent);
            put(&mut sight.full, at, weight(d, inverse));
        }
        sight
    }

    /// Adds the plane that unit `k` of a layer sees.
    #[inline]
    fn one_plane(&mut self, sight: &Sight, k: usize, first: &Vector3<f32>, unit: usize) {
        let (middle, extent) = (sight.distance[k], sight.extent[k]);
        if middle + extent <= -self.reach.behind {
            return;
        }
        if middle - extent > self.reach.front {
            self.see_through(unit, sight.full[k]);
            return;
        }
        let along = f32x4::new(X) * sight.along_x[k] + middle;
        let distance = YZ.map(|(y, z)| along + (y * sight.along_y[k] + z * sight.along_z[k]));
        let full = f32x4::splat(sight.full[k]);
        let trust = self.add_distances(&distance, &[full; ROWS], unit);
        if let Some(color) = self.view.color {
            self.add_colors(color, &self.middle(first, k), &distance, &trust, unit);
        }
    }

    #[inline]
    fn see_through(&mut self, unit: usize, weight: f32) {
        self.block.free[unit] += weight;
    }

    /// Adds what a unit sees where something tears the view, if it is not clear of all that is around.
    #[inline]
    fn torn(&mut self, cell: &[f32; 4], middle: &Vector3<f32>, unit: usize) {
        let [far, near, low, _] = cell;
        let extent = 1.5 * self.right.z.abs() + 0.5 * (self.down.z.abs() + self.deep.z.abs());
        if (middle.z - extent - STEEP * self.reach.behind) * far > 1.0 {
            return;
        }
        if (middle.z + extent + CLEAR * self.reach.front) * near < 1.0 {
            self.see_through(unit, 0.5 * low * low * low * low);
            return;
        }
        self.many_planes(middle, unit);
    }

    /// Adds what each sample of the unit around `middle` sees.
    fn many_planes(&mut self, middle: &Vector3<f32>, unit: usize) {
        let planes = &self.view.planes;
        let mut distance = [f32x4::ZERO; ROWS];
        let mut full = [f32x4::ZERO; ROWS];
        for row in 0..ROWS {
            let [x, y, z] = self.row(middle, YZ[row]);
            let inverse = f32x4::ONE / z;
            let (u, v) = planes.pixels(x * inverse, y * inverse);
            let records = [0, 1, 2, 3].map(|l| planes.pixel(u[l], v[l]));
            let [a, b, c, d] = columns(records);
            distance[row] = d - (a * x + b * y + c * z);
            full[row] = weight(d, inverse);
        }
        let trust = self.add_distances(&distance, &full, unit);
        if let Some(color) = self.view.color {
            self.add_colors(color, middle, &distance, &trust, unit);
        }
    }

    /// The samples of the row `y` and `z` voxels from the middle of a unit.
    #[inline]
    fn row(&self, middle: &Vector3<f32>, (y, z): (f32, f32)) -> [f32x4; 3] {
        let start = middle + self.down * y + self.deep * z;
        [0, 1, 2].map(|axis| f32x4::new(X) * self.right[axis] + start[axis])
    }

    /// Space that is seen through is counted apart and never enters the mean distance, which would otherwise shrink
    /// every silhouette; what lies behind a surface counts the less the farther it is, for it may be about the other
    /// side of a thin wall (Bylow et al. 2013, sec. III-C). Gives what each sample was trusted.
    #[inline]
    fn add_distances(&mut self, distance: &[f32x4; ROWS], full: &[f32x4; ROWS], unit: usize) -> [f32x4; ROWS] {
        let unit: &mut Unit = &mut self.block.units[unit];
        let mut trust = [f32x4::ZERO; ROWS];
        for row in 0..ROWS {
            let d = distance[row];
            let share = (d + self.reach.behind) * self.fall;
            let share = share.fast_min(f32x4::ONE).fast_max(f32x4::ZERO);
            let share = share * share;
            let beyond = d.simd_gt(f32x4::splat(self.reach.front));
            trust[row] = !beyond & (full[row] * share * share);
            // What lies far behind is trusted with 0 and, where there is nothing, infinitely far: it is left out.
            let kept = d.simd_gt(f32x4::splat(-self.reach.behind)) & d;
            add(&mut unit.sum, row, trust[row] * kept);
            add(&mut unit.weight, row, trust[row]);
            add(&mut unit.free, row, beyond & full[row]);
        }
        trust
    }

    fn add_colors(
        &mut self,
        color: &ColorImage,
        middle: &Vector3<f32>,
        distance: &[f32x4; ROWS],
        trust: &[f32x4; ROWS],
        unit: usize,
    ) {
        for row in 0..ROWS {
            let near = distance[row].abs().simd_le(f32x4::splat(2.0 * self.reach.voxel));
            let weight = (near & trust[row]).to_array();
            let [x, y, z] = self.row(middle, YZ[row]);
            let (u, v) = ((x / z).to_array(), (y / z).to_array());
            for l in (0..4).filter(|l| weight[*l] > 0.0) {
                add_color(
                    self.view,
                    color,
                    self.block,
                    sample(unit, 4 * row + l),
                    (u[l], v[l]),
                    weight[l],
                );
            }
        }
    }
}

/// Number in its block of a sample of a unit.
fn sample(unit: usize, lane: usize) -> usize {
    let x = (unit & 1) << 2 | lane & 3;
    let y = unit & 6 | lane >> 2 & 1;
    let z = unit >> 2 & 6 | lane >> 3;
    x | y << 3 | z << 6
}

/// Four records as their four components.
#[inline]
fn columns(records: [[f32; 4]; 4]) -> [f32x4; 4] {
    f32x4::transpose(records.map(f32x4::new))
}

#[inline]
fn put(into: &mut [f32; UNITS], at: usize, four: f32x4) {
    into[at..at + 4].copy_from_slice(&four.to_array());
}

/// Weight of a look at a plane at distance `d` from the camera, `slant² / z⁴`; none of nothing.
#[inline]
fn weight(d: f32x4, inverse: f32x4) -> f32x4 {
    let slant = d.fast_max(f32x4::ZERO) * inverse;
    let near = inverse * inverse;
    slant * slant * (near * near)
}

/// Adds to a row of a unit.
#[inline]
fn add(samples: &mut [f32; UNIT_SAMPLES], row: usize, four: f32x4) {
    if let Some(into) = samples[4 * row..].first_chunk_mut::<4>() {
        *into = (f32x4::new(*into) + four).to_array();
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
