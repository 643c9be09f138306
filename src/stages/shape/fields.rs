//! The fields of a capture: which blocks of space they keep, filled by the fusion.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::fusion::{FusionConfig, fill};
use super::range::Range;
use crate::base::Result;
use crate::capture::Capture;
use crate::geometry::BlockGrid;

/// The views of a capture; their field's frame is the world.
///
/// # Errors
/// Images whose size is not the camera's.
pub fn ranges(capture: &Capture) -> Result<Vec<Range<'_>>> {
    capture
        .views
        .par_iter()
        .map(|view| Range::new(&capture.cameras[view.camera], view))
        .collect()
}

/// Adds every view to every block that the grid keeps; `truncation` in front of the surface, m.
///
/// # Errors
/// Settings that cannot work.
pub fn integrate(grid: &mut BlockGrid, ranges: &[Range], truncation: f64) -> Result<()> {
    let config = FusionConfig {
        truncation,
        ..FusionConfig::with_voxel(grid.voxel)
    };
    let views: Vec<_> = ranges.iter().map(Range::prepared).collect();
    fill(grid, &views, &config)
}

/// The blocks within two voxels of every second trusted pixel whose point `keep` accepts, in order.
pub fn blocks_near_points(ranges: &[Range], voxel: f64, keep: impl Fn(&Point3<f64>) -> bool + Sync) -> Vec<[i32; 3]> {
    let per_view: Vec<Vec<[i32; 3]>> = ranges
        .par_iter()
        .map(|range| {
            let mut keys = Vec::new();
            for p in range.points(2).filter(|p| keep(p)) {
                push_blocks(&mut keys, voxel, &p);
            }
            keys.sort_unstable();
            keys.dedup();
            keys
        })
        .collect();
    let mut keys: Vec<[i32; 3]> = per_view.into_iter().flatten().collect();
    keys.sort_unstable();
    keys.dedup();
    keys
}

fn push_blocks(keys: &mut Vec<[i32; 3]>, voxel: f64, p: &Point3<f64>) {
    let reach = Vector3::repeat(2.0 * voxel);
    for key in blocks_of_box(voxel, &(p - reach), &(p + reach)) {
        if keys.last() != Some(&key) {
            keys.push(key);
        }
    }
}

/// All blocks of the box between two corners, in order.
pub fn blocks_of_box(voxel: f64, low: &Point3<f64>, high: &Point3<f64>) -> impl Iterator<Item = [i32; 3]> + use<> {
    let low = BlockGrid::block_of(voxel, [low.x, low.y, low.z]);
    let high = BlockGrid::block_of(voxel, [high.x, high.y, high.z]);
    (low[0]..=high[0])
        .flat_map(move |x| (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z])))
}
