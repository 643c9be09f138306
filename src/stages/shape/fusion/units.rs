//! The samples of a block in units of 4 x 2 x 2, each of which sees one plane, or many where the view is torn.

use nalgebra::{Matrix3, Vector3};
use wide::f32x4;

use super::depths::bent_pixel;
use super::planes::{NONE, columns};
use super::update::{CLEAR, Prepared, Reach, STEEP};
use crate::capture::ColorImage;
use crate::geometry::{BLOCK, BLOCK_SAMPLES, Block, UNIT_SAMPLES, Unit};

/// Units of a block, and of a layer of it two samples deep.
const UNITS: usize = BLOCK_SAMPLES / UNIT_SAMPLES;
const LAYER: usize = 8;
/// Samples along an edge of a block.
const N: usize = BLOCK as usize;
/// Offsets of the samples of a row of a unit, and of its rows, from the middle, in voxels.
const X: [f32; 4] = [-1.5, -0.5, 0.5, 1.5];
const YZ: [(f32, f32); ROWS] = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
/// Rows of a unit.
const ROWS: usize = 4;
/// Of a sample that lies half a voxel or more behind the surface, how much counts falls off towards the truncation, with
/// the fourth power: of a wall of two voxels each side then is seen by its own views alone.
const FLAT: f32 = 0.5;

/// How the samples of a block lie before a view, which is the same for every block.
pub struct Steps {
    /// From a sample to the next along each axis, scaled to pixels.
    right: Vector3<f32>,
    down: Vector3<f32>,
    deep: Vector3<f32>,
    /// From the first sample of a layer to the middles of its units, four by four.
    middles: [[f32x4; 3]; 2],
    /// From the middle of a row of a unit to its samples.
    row: [f32x4; 3],
}

impl Steps {
    /// The columns of `steps` are those along each axis.
    pub fn new(steps: &Matrix3<f32>) -> Self {
        let [right, down, deep] = [0, 1, 2].map(|axis| steps.column(axis).into_owned());
        let first = right * 1.5 + (down + deep) * 0.5;
        let unit = |k: usize| first + right * (4 * (k & 1)) as f32 + down * (k & 6) as f32;
        let four = |half: usize| [0, 1, 2].map(|axis| f32x4::new([0, 1, 2, 3].map(|k| unit(4 * half + k)[axis])));
        Self {
            right,
            down,
            deep,
            middles: [four(0), four(1)],
            row: [0, 1, 2].map(|axis| f32x4::new(X) * right[axis]),
        }
    }
}

/// A block that a view is added to, layer by layer.
pub struct Units<'a> {
    view: &'a Prepared<'a>,
    steps: &'a Steps,
    block: &'a mut Block,
    reach: Reach,
    /// Whether every sample must look for itself.
    each: bool,
    /// One over the distance over which what lies behind a surface falls off.
    fall: f32,
}

/// What the units of a block see.
struct Looks {
    /// Distance in front of the plane, and how it changes from sample to sample.
    distance: [f32; UNITS],
    along_x: [f32; UNITS],
    along_y: [f32; UNITS],
    along_z: [f32; UNITS],
    /// Distance of the sample that is farthest in front.
    most: [f32; UNITS],
    /// Weight of a look.
    full: [f32; UNITS],
    /// Middles, scaled to pixels.
    middle: [[f32; UNITS]; 3],
    /// Cells that are seen.
    place: [u32; UNITS],
    /// Bits of the units that see a smooth surface which is near, and something torn.
    smooth: u32,
    torn: u32,
}

impl<'a> Units<'a> {
    pub fn new(view: &'a Prepared<'a>, steps: &'a Steps, block: &'a mut Block, reach: Reach, each: bool) -> Self {
        Self {
            view,
            steps,
            block,
            reach,
            each,
            fall: 1.0 / (reach.behind - FLAT * reach.voxel),
        }
    }

    /// Adds the view to the block, whose first sample is `first`, scaled to pixels. All units look before any is
    /// added to, so that none waits for the others.
    #[inline]
    pub fn add(&mut self, first: &Vector3<f32>) {
        let mut looks = Looks {
            distance: [0.0; UNITS],
            along_x: [0.0; UNITS],
            along_y: [0.0; UNITS],
            along_z: [0.0; UNITS],
            most: [0.0; UNITS],
            full: [0.0; UNITS],
            middle: [[0.0; UNITS]; 3],
            place: [0; UNITS],
            smooth: 0,
            torn: 0,
        };
        for z in 0..N / 2 {
            let first = first + self.steps.deep * (2 * z) as f32;
            for half in 0..2 {
                self.look(&mut looks, &first, half, LAYER * z + 4 * half);
            }
        }
        self.fetch(looks.smooth | looks.torn);
        let mut smooth = looks.smooth;
        while smooth != 0 {
            let unit = (smooth.trailing_zeros() & 31) as usize;
            smooth &= smooth - 1;
            if self.each {
                self.many_planes(&looks.middle(unit), unit);
            } else {
                self.one_plane(&looks, unit);
            }
        }
        let mut torn = looks.torn;
        while torn != 0 {
            let unit = (torn.trailing_zeros() & 31) as usize;
            torn &= torn - 1;
            self.torn(&self.view.planes.cell(looks.place[unit]), &looks.middle(unit), unit);
        }
    }

    /// Has units brought from memory all at once.
    #[inline]
    fn fetch(&self, mut units: u32) {
        let mut any = 0;
        while units != 0 {
            let unit = &self.block.units[(units.trailing_zeros() & 31) as usize];
            units &= units - 1;
            any |= unit.sum[0].to_bits() | unit.weight[0].to_bits();
        }
        std::hint::black_box(any);
    }

    /// What four units see, half a layer from that of number `at` on; the first sample of the layer is `first`.
    #[inline]
    fn look(&mut self, looks: &mut Looks, first: &Vector3<f32>, half: usize, at: usize) {
        let (steps, planes) = (self.steps, &self.view.planes);
        let [x, y, z] = &steps.middles[half];
        let (x, y, z) = (*x + first.x, *y + first.y, *z + first.z);
        let inverse = f32x4::ONE / z;
        let place = planes.places(x * inverse, y * inverse);
        let [a, b, c, d] = columns([
            planes.cell(place[0]),
            planes.cell(place[1]),
            planes.cell(place[2]),
            planes.cell(place[3]),
        ]);
        let distance = d - (a * x + b * y + c * z);
        let along_x = a * steps.right.x + b * steps.right.y + c * steps.right.z;
        let along_y = a * steps.down.x + b * steps.down.y + c * steps.down.z;
        let along_z = a * steps.deep.x + b * steps.deep.y + c * steps.deep.z;
        let extent = along_x.abs() * 1.5 + (along_y.abs() + along_z.abs()) * 0.5;
        let full = weight(d, inverse);
        let most = distance + extent;
        let smooth = d.simd_gt(f32x4::ZERO);
        let near = smooth & most.simd_gt(f32x4::splat(-self.reach.behind));
        let through = near & (distance - extent).simd_gt(f32x4::splat(self.reach.front));
        let torn = !smooth & d.simd_gt(f32x4::splat(NONE));
        put(&mut looks.distance, at, distance);
        put(&mut looks.along_x, at, -along_x);
        put(&mut looks.along_y, at, -along_y);
        put(&mut looks.along_z, at, -along_z);
        put(&mut looks.most, at, most);
        put(&mut looks.full, at, full);
        put(&mut looks.middle[0], at, x);
        put(&mut looks.middle[1], at, y);
        put(&mut looks.middle[2], at, z);
        looks.place[at..at + 4].copy_from_slice(&place);
        looks.torn |= torn.to_bitmask() << at;
        if self.each {
            looks.smooth |= smooth.to_bitmask() << at;
            return;
        }
        looks.smooth |= (!through & near).to_bitmask() << at;
        if through.any() {
            self.see_through(at, through & full);
        }
    }

    #[inline]
    fn see_through(&mut self, unit: usize, weights: f32x4) {
        if let Some(free) = self.block.free[unit..].first_chunk_mut::<4>() {
            *free = (f32x4::new(*free) + weights).to_array();
        }
    }

    /// Adds the plane that a unit sees.
    #[inline]
    fn one_plane(&mut self, looks: &Looks, unit: usize) {
        let along = f32x4::new(X) * looks.along_x[unit] + looks.distance[unit];
        let (along_y, along_z) = (looks.along_y[unit], looks.along_z[unit]);
        let distance = [
            along + (YZ[0].0 * along_y + YZ[0].1 * along_z),
            along + (YZ[1].0 * along_y + YZ[1].1 * along_z),
            along + (YZ[2].0 * along_y + YZ[2].1 * along_z),
            along + (YZ[3].0 * along_y + YZ[3].1 * along_z),
        ];
        let full = f32x4::splat(looks.full[unit]);
        let beyond = looks.most[unit] > self.reach.front;
        let trust = self.add_distances(&distance, &[full; ROWS], unit, beyond);
        if let Some(color) = self.view.color {
            self.add_colors(color, &looks.middle(unit), &distance, &trust, unit);
        }
    }

    /// Adds what a unit sees where something tears the view, if it is not clear of all that is around.
    #[inline]
    fn torn(&mut self, cell: &[f32; 4], middle: &Vector3<f32>, unit: usize) {
        let [far, near, low, _] = cell;
        let Steps { right, down, deep, .. } = self.steps;
        let extent = 1.5 * right.z.abs() + 0.5 * (down.z.abs() + deep.z.abs());
        if (middle.z - extent - STEEP * self.reach.behind) * far > 1.0 {
            return;
        }
        if (middle.z + extent + CLEAR * self.reach.front) * near < 1.0 {
            self.block.free[unit] += 0.5 * low * low * low * low;
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
            let [a, b, c, d] = planes.pixels(x * inverse, y * inverse);
            distance[row] = d - (a * x + b * y + c * z);
            full[row] = weight(d, inverse);
        }
        let front = f32x4::splat(self.reach.front);
        let most = (distance[0].fast_max(distance[1])).fast_max(distance[2].fast_max(distance[3]));
        let beyond = most.simd_gt(front).any();
        let trust = self.add_distances(&distance, &full, unit, beyond);
        if let Some(color) = self.view.color {
            self.add_colors(color, middle, &distance, &trust, unit);
        }
    }

    /// The samples of the row `y` and `z` voxels from the middle of a unit.
    #[inline]
    fn row(&self, middle: &Vector3<f32>, (y, z): (f32, f32)) -> [f32x4; 3] {
        let start = middle + self.steps.down * y + self.steps.deep * z;
        let [along_x, along_y, along_z] = self.steps.row;
        [along_x + start.x, along_y + start.y, along_z + start.z]
    }

    /// Space that is seen through is counted apart and never enters the mean distance, which would otherwise shrink
    /// every silhouette; what lies behind a surface counts the less the farther it is, for it may be about the other
    /// side of a thin wall (Bylow et al. 2013, sec. III-C). Gives what each sample was trusted.
    ///
    /// `beyond` says whether there may be samples that are seen through.
    #[inline]
    fn add_distances(
        &mut self,
        distance: &[f32x4; ROWS],
        full: &[f32x4; ROWS],
        unit: usize,
        beyond: bool,
    ) -> [f32x4; ROWS] {
        let unit: &mut Unit = &mut self.block.units[unit];
        let (behind, front) = (f32x4::splat(self.reach.behind), f32x4::splat(self.reach.front));
        let fall = f32x4::splat(self.fall);
        let mut trust = [f32x4::ZERO; ROWS];
        for row in 0..ROWS {
            let d = distance[row];
            let share = ((d + behind) * fall).fast_min(f32x4::ONE).fast_max(f32x4::ZERO);
            let share = share * share;
            trust[row] = !d.simd_gt(front) & (full[row] * share * share);
            // What lies far behind is trusted with 0 and, where there is nothing, infinitely far: it is left out.
            let kept = d.simd_gt(-behind) & d;
            add(&mut unit.sum, row, trust[row] * kept);
            add(&mut unit.weight, row, trust[row]);
        }
        if beyond {
            for row in 0..ROWS {
                add(&mut unit.free, row, distance[row].simd_gt(front) & full[row]);
            }
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

impl Looks {
    #[inline]
    fn middle(&self, unit: usize) -> Vector3<f32> {
        let [x, y, z] = &self.middle;
        Vector3::new(x[unit], y[unit], z[unit])
    }
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
