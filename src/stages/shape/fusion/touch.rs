//! Which blocks a view asks for: those within reach of the surfaces that it shows.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::pyramid::COARSE;
use super::update::Prepared;
use crate::geometry::{BLOCK, BlockKeys};

/// Blocks from one look to the next, at most: what lies between is then within reach of one of them.
const SPACING: f32 = 0.45;

/// Ranges of blocks that are remembered, for what lies side by side asks for the same.
const RECENT: usize = 256;

/// The blocks, of voxels of this size, that are within `reach` of a surface that a view shows, m; in the order in which the
/// view comes upon them.
pub fn asked_blocks(view: &Prepared, field_from_camera: &Isometry3<f64>, voxel: f64, reach: f64) -> BlockKeys {
    let mut asked = BlockKeys::default();
    let block = voxel * f64::from(BLOCK);
    let camera = view.camera;
    let unproject = Matrix3::new(
        1.0 / camera.fx,
        0.0,
        -camera.cx / camera.fx,
        0.0,
        1.0 / camera.fy,
        -camera.cy / camera.fy,
        0.0,
        0.0,
        1.0,
    );
    let rotation = field_from_camera.rotation.to_rotation_matrix().into_inner();
    let ray = (rotation * unproject / block).map(|x| x as f32);
    let eye = (field_from_camera.translation.vector / block).map(|x| x as f32);
    let reach = (reach / block) as f32;
    let pixels = SPACING * (block * camera.fx.max(camera.fy)) as f32;
    let mut recent = [[[i32::MAX; 3]; 2]; RECENT];
    for (corner, least) in view.pyramid.coarse() {
        let count = (COARSE as f32 / (pixels * least)).ceil().clamp(1.0, COARSE as f32) as usize;
        for n in 0..count * count {
            let at = |k: usize, corner: usize| corner + (2 * k + 1) * COARSE / (2 * count);
            let (x, y) = (at(n % count, corner[0]), at(n / count, corner[1]));
            let [a, b, c, d] = view.planes.pixel(x as u32 + 2, y as u32 + 2);
            if d <= 0.0 || x >= view.planes.width || y >= view.planes.height {
                continue;
            }
            let (u, v) = (x as f32, y as f32);
            let p = eye + ray * Vector3::new(u, v, 1.0) * (d / (a * u + b * v + c));
            let low = [floor(p.x - reach), floor(p.y - reach), floor(p.z - reach)];
            let high = [floor(p.x + reach), floor(p.y + reach), floor(p.z + reach)];
            let last = &mut recent[(low[0] ^ low[1] << 2 ^ low[2] << 4) as usize % RECENT];
            if *last != [low, high] {
                *last = [low, high];
                ask_all(&mut asked, [low, high]);
            }
        }
    }
    asked
}

/// The next whole number below, which takes a call where it is asked of the standard library.
fn floor(x: f32) -> i32 {
    let whole = x as i32;
    whole - i32::from(x < whole as f32)
}

fn ask_all(asked: &mut BlockKeys, [low, high]: [[i32; 3]; 2]) {
    for x in low[0]..=high[0] {
        for y in low[1]..=high[1] {
            for z in low[2]..=high[2] {
                asked.insert([x, y, z]);
            }
        }
    }
}
