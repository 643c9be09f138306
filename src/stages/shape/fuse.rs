//! Fusion of range images into a truncated signed distance field (Curless and Levoy 1996).

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::range::{Range, Reading};
use crate::capture::Capture;
use crate::geometry::{BLOCK, Field, Voxel};

/// The views of a capture; their field's frame is the world.
pub fn ranges(capture: &Capture) -> Vec<Range<'_>> {
    capture
        .views
        .par_iter()
        .map(|view| Range::new(&capture.cameras[view.camera], view))
        .collect()
}

/// The blocks within two voxels of every second trusted pixel whose point `keep` accepts.
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
    let reach = 2.0 * voxel;
    let low = Field::block_of(voxel, [p.x - reach, p.y - reach, p.z - reach]);
    let high = Field::block_of(voxel, [p.x + reach, p.y + reach, p.z + reach]);
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            for z in low[2]..=high[2] {
                if keys.last() != Some(&[x, y, z]) {
                    keys.push([x, y, z]);
                }
            }
        }
    }
}

/// All blocks of the box between two corners.
pub fn blocks_of_box(voxel: f64, low: &Point3<f64>, high: &Point3<f64>) -> Vec<[i32; 3]> {
    let low = Field::block_of(voxel, [low.x, low.y, low.z]);
    let high = Field::block_of(voxel, [high.x, high.y, high.z]);
    let mut keys = Vec::new();
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            keys.extend((low[2]..=high[2]).map(|z| [x, y, z]));
        }
    }
    keys
}

/// Adds every view to every block; a block takes the views in their order, whichever thread it is on.
pub fn integrate(field: &mut Field, ranges: &[Range], truncation: f64) {
    let voxel = field.voxel;
    let (keys, blocks) = field.parts_mut();
    keys.par_iter().zip(blocks.par_iter_mut()).for_each(|(key, block)| {
        for range in ranges {
            integrate_block(range, *key, block, voxel, truncation);
        }
    });
}

fn integrate_block(range: &Range, key: [i32; 3], block: &mut [Voxel], voxel: f64, truncation: f64) {
    let pose = &range.camera_from_field;
    let size = voxel * f64::from(BLOCK);
    let corner = Point3::from(Vector3::from(key.map(f64::from)) * size);
    let middle = pose * (corner + Vector3::repeat(0.5 * size));
    if outside_view(range, &middle, size) {
        return;
    }
    let first = pose * (corner + Vector3::repeat(0.5 * voxel));
    let rotation = pose.rotation.to_rotation_matrix().into_inner() * voxel;
    let mut at = 0;
    for z in 0..BLOCK {
        for y in 0..BLOCK {
            for x in 0..BLOCK {
                let p = first + rotation * Vector3::new(f64::from(x), f64::from(y), f64::from(z));
                observe(range, &p, &mut block[at], voxel, truncation);
                at += 1;
            }
        }
    }
}

/// Whether a ball of radius `size` around a point of the camera frame is out of the image for sure.
fn outside_view(range: &Range, middle: &Point3<f64>, size: f64) -> bool {
    let camera = range.camera;
    let z = middle.z + size;
    if z < 0.5 * camera.depth_min {
        return true;
    }
    if middle.z < 2.0 * size {
        return false;
    }
    // Half a frame of slack on each side is for the lens distortion.
    let (u, v) = (
        camera.fx * middle.x / middle.z + camera.cx,
        camera.fy * middle.y / middle.z + camera.cy,
    );
    let slack = camera.fx * size / (middle.z - size);
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    u < -0.5 * w - slack || u > 1.5 * w + slack || v < -0.5 * h - slack || v > 1.5 * h + slack
}

/// One observation of one voxel. Weights are `slant^2 / z^4`, the inverse variance of the distance to the
/// surface. Space that is seen through is counted apart and never enters the mean distance, which would
/// otherwise shrink every silhouette.
fn observe(range: &Range, p: &Point3<f64>, sample: &mut Voxel, voxel: f64, truncation: f64) {
    let Some((u, v)) = range.pixel(p) else { return };
    let confidence = |z: f64| (1.0 / (z * z * z * z).max(1e-3)) as f32;
    match range.read(u, v) {
        Reading::None => {}
        Reading::Edge(near) => {
            if near - p.z > truncation {
                sample.free += confidence(near) * 0.25;
            }
        }
        Reading::Surface { depth, slant } => {
            let distance = (depth - p.z) * slant;
            let weight = confidence(depth) * (slant * slant) as f32;
            if distance > truncation {
                sample.free += weight;
            } else if distance > -truncation {
                sample.near += weight;
                let trust = weight * behind(distance, voxel.max(range.depth_sd(depth)));
                sample.add_distance(distance as f32, trust);
                if let Some(rgb) = range.rgb(u, v).filter(|_| distance.abs() < 2.0 * voxel) {
                    sample.add_color(rgb, trust);
                }
            }
        }
    }
}

/// How much an observation counts that lies behind the surface: the farther, the likelier it is about the
/// other side of a thin wall (Bylow et al. 2013, sec. III-C).
fn behind(distance: f64, scale: f64) -> f32 {
    let depth = -distance - scale;
    if depth <= 0.0 {
        return 1.0;
    }
    ((-1.5 * (depth / scale).powi(2)).exp() as f32).max(0.001)
}
