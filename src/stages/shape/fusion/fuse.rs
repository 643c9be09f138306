//! The door to fusion: one view after the other in, a mesh out.

use nalgebra::{Isometry3, Matrix3, Vector3};
use rayon::prelude::*;

use super::depths::InverseDepths;
use super::planes::Planes;
use super::pyramid::Pyramid;
use super::touch::asked_blocks;
use super::update::{Placed, Prepared, Reach};
use crate::base::{Error, Result};
use crate::capture::{Camera, ColorImage, DepthImage};
use crate::geometry::{Block, BlockGrid, BlockKeys, KEY_REACH, Mesh, grid_surface};

/// Blocks that one task works on.
const TASK: usize = 32;
/// Views of a sequence that are added together.
const TOGETHER: usize = 8;
/// Most pixels of an image: their numbers are kept exact in single precision.
const MOST_PIXELS: usize = 8_000_000;

/// Settings of a fusion; the defaults need no change to run.
#[derive(Clone, Debug)]
pub struct FusionConfig {
    /// Edge of a voxel, m.
    pub voxel: f64,
    /// Truncation of the signed distance in front of a surface, m; wider where the views are noisier than that.
    pub truncation: f64,
    /// How far behind a surface its views still count, m; wider where the views are noisy.
    pub behind: f64,
    /// Evidence that a surface needs, in head-on looks from 1 m.
    pub least_weight: f64,
}

impl Default for FusionConfig {
    fn default() -> Self {
        Self::with_voxel(0.002)
    }
}

impl FusionConfig {
    /// The defaults for another size of voxel.
    pub fn with_voxel(voxel: f64) -> Self {
        Self {
            voxel,
            truncation: 4.0 * voxel,
            behind: 2.0 * voxel,
            least_weight: 0.0,
        }
    }

    /// Refuses settings that cannot work.
    ///
    /// # Errors
    /// A voxel that is not positive, or a truncation of less than two voxels.
    pub fn check(&self) -> Result<()> {
        let least = 1.8 * self.voxel;
        if self.voxel > 0.0 && self.truncation >= least && self.behind >= least && self.least_weight >= 0.0 {
            return Ok(());
        }
        Err(Error::Usage(
            "fusion: the voxel must be positive, and the truncation on either side at least 1.8 voxels".into(),
        ))
    }
}

/// One view of a sequence.
#[derive(Clone, Copy, Debug)]
pub struct Shot<'a> {
    /// Takes points of the camera's optical frame to the frame of the field, m.
    pub field_from_camera: Isometry3<f64>,
    /// The range image.
    pub depth: &'a DepthImage,
    /// The colour image, registered to the range image and of its size.
    pub color: Option<&'a ColorImage>,
}

/// A signed distance field that grows with the surface that it is shown (Curless and Levoy 1996; the blocks are
/// those of Nießner et al. 2013). The same views in the same order give the same field on any number of threads.
#[derive(Clone, Debug)]
pub struct Fusion {
    grid: BlockGrid,
    config: FusionConfig,
}

impl Fusion {
    /// A field in which nothing was observed.
    ///
    /// # Errors
    /// Settings that cannot work.
    pub fn new(config: FusionConfig) -> Result<Self> {
        config.check()?;
        Ok(Self {
            grid: BlockGrid::new(config.voxel),
            config,
        })
    }

    /// Adds a view. `field_from_camera` takes points of the camera's optical frame (x right, y down, z forward) to
    /// the frame of the field, m. The colour image is registered to the depth image and of its size.
    ///
    /// # Errors
    /// Images whose size is not the camera's, or of more than eight million pixels.
    pub fn integrate(
        &mut self,
        camera: &Camera,
        field_from_camera: &Isometry3<f64>,
        depth: &DepthImage,
        color: Option<&ColorImage>,
    ) -> Result<()> {
        let shot = Shot {
            field_from_camera: *field_from_camera,
            depth,
            color,
        };
        self.integrate_all(camera, &[shot])
    }

    /// Adds a sequence of views, eight together: a block is then fetched from memory once for all of them. It is kept
    /// for all eight as soon as one of them asks for it, so that the field may know a little more than after as many
    /// calls of [`Fusion::integrate`].
    ///
    /// # Errors
    /// Images whose size is not the camera's, or of more than eight million pixels.
    pub fn integrate_all(&mut self, camera: &Camera, shots: &[Shot]) -> Result<()> {
        let near = self.config.behind.max(2.0 * self.config.voxel);
        for shots in shots.chunks(TOGETHER) {
            let views: Vec<(Prepared, BlockKeys)> = shots
                .par_iter()
                .map(|shot| {
                    let view = prepare(camera, &shot.field_from_camera, shot.depth, shot.color)?;
                    let asked = asked_blocks(&view, &shot.field_from_camera, self.config.voxel, near);
                    Ok((view, asked))
                })
                .collect::<Result<_>>()?;
            self.grid
                .touch_all(views.iter().flat_map(|(_, asked)| asked.all()).copied());
            let views: Vec<&Prepared> = views.iter().map(|(view, _)| view).collect();
            fill(&mut self.grid, &views, &self.config)?;
        }
        Ok(())
    }

    /// The observed surface, coloured where colours were given, in the frame of the field. Open where nothing was
    /// observed.
    pub fn extract(&self) -> Mesh {
        grid_surface(&self.grid, self.config.least_weight as f32)
    }

    /// The blocks.
    pub fn grid(&self) -> &BlockGrid {
        &self.grid
    }
}

/// Adds every view to every block that the grid keeps; a block takes the views in their order, whichever thread it is
/// on.
///
/// # Errors
/// Settings that cannot work.
pub fn fill(grid: &mut BlockGrid, views: &[&Prepared], config: &FusionConfig) -> Result<()> {
    config.check()?;
    let reach = Reach {
        front: config.truncation as f32,
        behind: config.behind as f32,
        voxel: config.voxel as f32,
    };
    let views: Vec<Placed> = views.iter().map(|view| Placed::new(view, reach)).collect();
    let (keys, blocks) = grid.parts_mut();
    let mut order: Vec<(u64, [i32; 3], &mut Box<Block>)> = keys
        .iter()
        .zip(blocks)
        .map(|(key, block)| (along_curve(*key), *key, block))
        .collect();
    if views.len() > 1 {
        order.par_sort_unstable_by_key(|o| o.0);
    }
    order.par_chunks_mut(TASK).for_each(|task| {
        for (_, key, block) in task {
            for view in &views {
                view.update(*key, block);
            }
        }
    });
    Ok(())
}

/// The place of a block along the curve of Morton (1966): blocks that follow each other see the same part of an image.
fn along_curve(key: [i32; 3]) -> u64 {
    let spread = |k: i32| {
        let mut x = u64::from((k + KEY_REACH) as u32) & 0x1f_ffff;
        x = (x | x << 32) & 0x1f_0000_0000_ffff;
        x = (x | x << 16) & 0x1f_0000_ff00_00ff;
        x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
        x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
        (x | x << 2) & 0x1249_2492_4924_9249
    };
    spread(key[0]) | spread(key[1]) << 1 | spread(key[2]) << 2
}

fn check_size(camera: &Camera, depth: &DepthImage) -> Result<()> {
    let pixels = depth.width as usize * depth.height as usize;
    let fits = (depth.width, depth.height) == (camera.width, camera.height) && depth.counts.len() == pixels;
    if fits && pixels > 0 && pixels <= MOST_PIXELS {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "fusion: a depth image of {} x {} pixels does not fit the camera {:?} of {} x {}",
        depth.width, depth.height, camera.name, camera.width, camera.height
    )))
}

/// Makes a view ready to be added to a field; the arguments are those of [`Fusion::integrate`].
///
/// # Errors
/// Images whose size is not the camera's, or of more than eight million pixels.
pub fn prepare<'a>(
    camera: &'a Camera,
    field_from_camera: &Isometry3<f64>,
    depth: &DepthImage,
    color: Option<&'a ColorImage>,
) -> Result<Prepared<'a>> {
    check_size(camera, depth)?;
    let depths = InverseDepths::new(camera, depth);
    let planes = Planes::new(camera, &depths, camera.depth_sd);
    let pyramid = Pyramid::new(&depths);
    let mut view = Prepared {
        camera,
        color,
        planes,
        pyramid,
        rotation: Matrix3::identity(),
        offset: Vector3::zeros(),
        least_depth: 0.5 * camera.depth_min.max(0.02) as f32,
        focal: camera.fx.max(camera.fy) as f32,
    };
    view.place(&field_from_camera.inverse());
    Ok(view)
}
