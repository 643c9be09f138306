//! Sparse blocks of signed distance samples, laid out for speed: one array per quantity and block.

use rayon::prelude::*;

use super::block_keys::BlockKeys;

/// Samples along one edge of a block.
pub const BLOCK: i32 = 8;
/// Samples of one block.
pub const BLOCK_SAMPLES: usize = (BLOCK * BLOCK * BLOCK) as usize;
/// How much more must have gone through a surface than stopped at it before it is none: views disagree.
const SEEN_THROUGH: f32 = 2.5;
/// Samples of a unit.
pub const UNIT_SAMPLES: usize = 16;

/// What has been gathered in 4 x 2 x 2 samples, x fastest: they lie side by side in memory, for they see the same.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub struct Unit {
    /// Sum of weight times signed distance, m, positive outside.
    pub sum: [f32; UNIT_SAMPLES],
    /// Sum of the weights in `sum`.
    pub weight: [f32; UNIT_SAMPLES],
    /// Sum of the weights of the observations that saw through a sample, but not through the whole unit.
    pub free: [f32; UNIT_SAMPLES],
}

/// Number of the unit of a sample and of the sample in it; samples are numbered x fastest, then y.
#[inline]
pub fn unit_of(at: usize) -> (usize, usize) {
    let (x, y, z) = (at & 7, at >> 3 & 7, at >> 6);
    (x >> 2 | y & 6 | (z & 6) << 2, x & 3 | (y & 1) << 2 | (z & 1) << 3)
}

/// What has been gathered in 8 x 8 x 8 samples of space.
#[derive(Clone, Debug)]
pub struct Block {
    /// Two units along x, four along y, four along z.
    pub units: [Unit; BLOCK_SAMPLES / UNIT_SAMPLES],
    /// Sum of the weights of the observations that saw through a whole unit.
    pub free: [f32; BLOCK_SAMPLES / UNIT_SAMPLES],
    /// Sum of the weights of the observations that saw through the whole block.
    pub free_all: f32,
    /// Weighted sums of red, green and blue, and the weight; only where a colour was seen.
    pub color: Option<Box<[[f32; 4]; BLOCK_SAMPLES]>>,
}

impl Default for Block {
    fn default() -> Self {
        Self {
            units: [Unit::default(); BLOCK_SAMPLES / UNIT_SAMPLES],
            free: [0.0; BLOCK_SAMPLES / UNIT_SAMPLES],
            free_all: 0.0,
            color: None,
        }
    }
}

impl Block {
    /// The signed distance of a sample where it was observed, else NaN; a surface that more light went through
    /// than stopped at it is not one.
    pub fn distance(&self, at: usize, least_weight: f32) -> f32 {
        let (unit, lane) = unit_of(at);
        let free = self.free(at);
        let unit = &self.units[unit];
        let (sum, weight) = (unit.sum[lane], unit.weight[lane]);
        let ghost = sum < 0.0 && free > SEEN_THROUGH * weight;
        if weight <= least_weight || ghost {
            return f32::NAN;
        }
        sum / weight
    }

    /// Whether a sample was seen to be empty, away from any surface.
    pub fn is_free(&self, at: usize) -> bool {
        self.free(at) > 0.0 && self.distance(at, 0.0).is_nan()
    }

    /// Sum of the weights of the observations that saw through a sample.
    pub fn free(&self, at: usize) -> f32 {
        let (unit, lane) = unit_of(at);
        self.units[unit].free[lane] + self.free[unit] + self.free_all
    }

    /// Sets the signed distance of a sample, with a weight of 1.
    pub fn set(&mut self, at: usize, distance: f32) {
        let (unit, lane) = unit_of(at);
        self.units[unit].sum[lane] = distance;
        self.units[unit].weight[lane] = 1.0;
    }

    /// Mean sRGB colour of a sample and its weight, if any was seen.
    pub fn rgb(&self, at: usize) -> Option<([f32; 3], f32)> {
        let [r, g, b, weight] = self.color.as_ref()?[at];
        (weight > 0.0).then(|| ([r / weight, g / weight, b / weight], weight))
    }
}

/// Blocks by key, found in constant time; the order of the blocks is that in which they were asked for.
#[derive(Clone, Debug)]
pub struct BlockGrid {
    /// Edge of a voxel, m. Voxel `i` is sampled at `(i + 0.5) * voxel`.
    pub voxel: f64,
    keys: BlockKeys,
    blocks: Vec<Box<Block>>,
}

impl BlockGrid {
    /// An empty grid.
    pub fn new(voxel: f64) -> Self {
        Self {
            voxel,
            keys: BlockKeys::default(),
            blocks: Vec::new(),
        }
    }

    /// A grid that keeps the given blocks, in which nothing was observed.
    pub fn with_keys(voxel: f64, keys: &[[i32; 3]]) -> Self {
        let mut grid = Self::new(voxel);
        grid.touch_all(keys.iter().copied());
        grid
    }

    /// The key of the block that holds a point.
    pub fn block_of(voxel: f64, point: [f64; 3]) -> [i32; 3] {
        point.map(|x| (x / (voxel * f64::from(BLOCK))).floor() as i32)
    }

    /// The keys of the blocks, in the order of the blocks.
    pub fn keys(&self) -> &[[i32; 3]] {
        self.keys.all()
    }

    /// The blocks.
    pub fn blocks(&self) -> &[Box<Block>] {
        &self.blocks
    }

    /// Keys and blocks together, to be filled in parallel.
    pub fn parts_mut(&mut self) -> (&[[i32; 3]], &mut [Box<Block>]) {
        (self.keys.all(), &mut self.blocks)
    }

    /// The position of a block, if it is kept.
    pub fn find(&self, key: [i32; 3]) -> Option<usize> {
        self.keys.find(key)
    }

    /// Keeps a block from now on; one that lies too far out to be addressed is left out.
    pub fn touch(&mut self, key: [i32; 3]) {
        if self.keys.insert(key) {
            self.blocks.push(Box::default());
        }
    }

    /// Keeps blocks from now on, in this order; their memory is asked for on all threads.
    pub fn touch_all(&mut self, keys: impl IntoIterator<Item = [i32; 3]>) {
        for key in keys {
            self.keys.insert(key);
        }
        let new = self.blocks.len()..self.keys.all().len();
        self.blocks.par_extend(new.into_par_iter().map(|_| Box::default()));
    }

    /// Drops the blocks in which nothing was observed or stopped light.
    pub fn drop_empty(&mut self) {
        let mut kept = Self::new(self.voxel);
        for (key, block) in self.keys.all().iter().zip(self.blocks.drain(..)) {
            if block.units.iter().flat_map(|u| u.weight).any(|w| w > 0.0) {
                kept.touch(*key);
                if let Some(last) = kept.blocks.last_mut() {
                    *last = block;
                }
            }
        }
        *self = kept;
    }

    /// The block and the position in it of a global voxel index, if its block is kept.
    pub fn sample(&self, index: [i32; 3]) -> Option<(&Block, usize)> {
        let at = self.find(index.map(|i| i.div_euclid(BLOCK)))?;
        Some((&self.blocks[at], offset_in_block(index)))
    }

    /// The signed distance at a global voxel index, m, where it was observed.
    pub fn observed(&self, index: [i32; 3]) -> Option<f32> {
        let (block, at) = self.sample(index)?;
        Some(block.distance(at, 0.0)).filter(|d| !d.is_nan())
    }

    /// Whether the sample at a global voxel index was seen to be empty, away from any surface.
    pub fn is_free(&self, index: [i32; 3]) -> bool {
        self.sample(index).is_some_and(|(block, at)| block.is_free(at))
    }
}

/// Position of a global voxel index inside its block, x fastest.
fn offset_in_block(index: [i32; 3]) -> usize {
    let [x, y, z] = index.map(|i| i.rem_euclid(BLOCK) as usize);
    let n = BLOCK as usize;
    x + n * (y + n * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_is_found_again() {
        let mut grid = BlockGrid::new(0.002);
        let keys: Vec<[i32; 3]> = (0..5000)
            .map(|i| [i % 17 - 8, (i / 17) % 19 - 9, i / 323 - 7])
            .collect();
        for key in keys.iter().chain(&keys) {
            grid.touch(*key);
        }
        assert_eq!(grid.keys(), keys);
        for (at, key) in keys.iter().enumerate() {
            assert_eq!(grid.find(*key), Some(at));
        }
        assert_eq!(grid.find([100, 0, 0]), None);
    }

    #[test]
    fn every_sample_has_a_place_in_one_unit() {
        let mut seen = vec![0; BLOCK_SAMPLES];
        for at in 0..BLOCK_SAMPLES {
            let (unit, lane) = unit_of(at);
            seen[unit * UNIT_SAMPLES + lane] += 1;
        }
        assert!(seen.iter().all(|n| *n == 1));
        assert_eq!(unit_of(5 + 8 * 3 + 64 * 5), (1 + 2 + 16, 1 + 4 + 8));
    }

    #[test]
    fn a_surface_that_is_seen_through_is_a_ghost() {
        let mut block = Block::default();
        block.set(3, -0.001);
        assert_eq!(block.distance(3, 0.0), -0.001);
        block.free_all = 3.0;
        assert!(block.distance(3, 0.0).is_nan() && block.is_free(3));
    }
}
