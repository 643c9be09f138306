//! A sparse signed distance field: blocks of 8 x 8 x 8 voxels, kept where a surface may be.

/// Voxels along one edge of a block.
pub const BLOCK: i32 = 8;
/// How much more must have gone through a surface than stopped at it before it is none: views disagree.
const SEEN_THROUGH: f32 = 2.5;
const BLOCK_VOXELS: usize = (BLOCK * BLOCK * BLOCK) as usize;

/// What has been gathered about one sample of space.
#[derive(Clone, Copy, Debug, Default)]
pub struct Voxel {
    /// Weighted mean of the signed distance, m, positive outside.
    pub distance: f32,
    /// Sum of the weights in `distance`.
    pub weight: f32,
    /// Sum of the weights of all observations that lay near a surface, before those behind it are discounted.
    pub near: f32,
    /// Sum of the weights of the observations that saw through this sample.
    pub free: f32,
    /// Sum of the weights in `color`.
    pub color_weight: f32,
    /// Mean sRGB colour in 1/256 of a step.
    pub color: [u16; 3],
}

impl Voxel {
    /// Adds a signed distance with its weight (Curless and Levoy 1996, eqs. 1 and 2).
    pub fn add_distance(&mut self, distance: f32, weight: f32) {
        self.weight += weight;
        self.distance += (distance - self.distance) * weight / self.weight;
    }

    /// Adds a colour with its weight.
    pub fn add_color(&mut self, rgb: [u8; 3], weight: f32) {
        self.color_weight += weight;
        let share = weight / self.color_weight;
        for (mean, new) in self.color.iter_mut().zip(rgb) {
            let moved = f32::from(*mean) + (f32::from(new) * 256.0 - f32::from(*mean)) * share;
            *mean = moved.clamp(0.0, 65280.0) as u16;
        }
    }

    /// The mean colour as 8-bit sRGB, if any was seen.
    pub fn rgb(&self) -> Option<[u8; 3]> {
        (self.color_weight > 0.0).then(|| self.color.map(|c| (c / 256) as u8))
    }

    /// The signed distance where it was observed; a surface that more light went through than stopped at
    /// is not one.
    pub fn observed(&self) -> Option<f64> {
        let ghost = self.distance < 0.0 && self.free > SEEN_THROUGH * self.near;
        (self.weight > 0.0 && !ghost).then_some(f64::from(self.distance))
    }

    /// Whether it was seen to be empty, away from any surface.
    pub fn is_free(&self) -> bool {
        self.free > 0.0 && (self.weight == 0.0 || (self.distance < 0.0 && self.free > SEEN_THROUGH * self.near))
    }
}

/// Blocks in the order of their keys, so that every walk over the field has one order.
#[derive(Clone, Debug)]
pub struct Field {
    /// Edge of a voxel, m. Voxel `i` is sampled at `(i + 0.5) * voxel`.
    pub voxel: f64,
    keys: Vec<[i32; 3]>,
    blocks: Vec<Vec<Voxel>>,
}

impl Field {
    /// An unobserved field with the given blocks.
    pub fn with_blocks(voxel: f64, mut keys: Vec<[i32; 3]>) -> Self {
        keys.sort_unstable();
        keys.dedup();
        let blocks = vec![vec![Voxel::default(); BLOCK_VOXELS]; keys.len()];
        Self { voxel, keys, blocks }
    }

    /// The key of the block that holds a point.
    pub fn block_of(voxel: f64, point: [f64; 3]) -> [i32; 3] {
        point.map(|x| (x / (voxel * f64::from(BLOCK))).floor() as i32)
    }

    /// The keys of the blocks, ascending.
    pub fn keys(&self) -> &[[i32; 3]] {
        &self.keys
    }

    /// Keys and voxels together, to be filled in parallel.
    pub fn parts_mut(&mut self) -> (&[[i32; 3]], &mut [Vec<Voxel>]) {
        (&self.keys, &mut self.blocks)
    }

    /// The voxel at global index, if its block is kept.
    pub fn get(&self, index: [i32; 3]) -> Option<&Voxel> {
        let at = self.keys.binary_search(&index.map(|i| i.div_euclid(BLOCK))).ok()?;
        Some(&self.blocks[at][offset_in_block(index)])
    }

    /// The samples of the block at position `at` and of the first layer of its upper neighbours: 9 x 9 x 9,
    /// x fastest, absent where no block is kept.
    pub fn gather(&self, at: usize) -> Vec<Option<Voxel>> {
        let key = self.keys[at];
        let neighbours: Vec<Option<&Vec<Voxel>>> = (0..8)
            .map(|n| {
                let k = [key[0] + (n & 1), key[1] + ((n >> 1) & 1), key[2] + ((n >> 2) & 1)];
                self.keys.binary_search(&k).ok().map(|i| &self.blocks[i])
            })
            .collect();
        let mut samples = Vec::with_capacity(729);
        for z in 0..=BLOCK {
            for y in 0..=BLOCK {
                for x in 0..=BLOCK {
                    let which = (x / BLOCK + 2 * (y / BLOCK) + 4 * (z / BLOCK)) as usize;
                    samples.push(neighbours[which].map(|b| b[offset_in_block([x, y, z])]));
                }
            }
        }
        samples
    }
}

/// Position of a global voxel index inside its block, x fastest.
pub fn offset_in_block(index: [i32; 3]) -> usize {
    let [x, y, z] = index.map(|i| i.rem_euclid(BLOCK) as usize);
    let n = BLOCK as usize;
    x + n * (y + n * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_sees_the_first_layer_of_its_neighbours() {
        let mut field = Field::with_blocks(0.002, vec![[0, 0, 0], [1, 0, 0]]);
        let at = offset_in_block([8, 3, 2]);
        field.parts_mut().1[1][at].add_distance(0.5, 2.0);
        let gathered = field.gather(0);
        assert_eq!(gathered[8 + 9 * (3 + 9 * 2)].and_then(|v| v.observed()), Some(0.5));
        assert!(gathered[9 * 8].is_none());
        assert_eq!(field.get([8, 3, 2]).and_then(Voxel::observed), Some(0.5));
    }

    #[test]
    fn a_surface_that_is_seen_through_is_a_ghost() {
        let mut voxel = Voxel::default();
        voxel.add_distance(-0.001, 1.0);
        voxel.near = 1.0;
        voxel.free = 5.0;
        assert!(voxel.observed().is_none() && voxel.is_free());
    }
}
