//! The door to fusion: one view after the other in, a mesh out.

use nalgebra::{Isometry3, Matrix3, Vector3};
use rayon::prelude::*;

use super::depths::InverseDepths;
use super::planes::Planes;
use super::pyramid::Pyramid;
use super::touch::touch_blocks;
use super::update::{Prepared, Reach, update};
use crate::base::{Error, Result};
use crate::capture::{Camera, ColorImage, DepthImage};
use crate::geometry::{BlockGrid, Mesh, grid_surface};

/// Blocks that one task works on.
const TASK: usize = 32;
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
        let view = prepare(camera, field_from_camera, depth, color)?;
        let near = self.config.behind.max(2.0 * self.config.voxel);
        touch_blocks(&mut self.grid, &view, field_from_camera, near);
        fill(&mut self.grid, &[&view], &self.config)
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
    let (keys, blocks) = grid.parts_mut();
    keys.par_chunks(TASK)
        .zip(blocks.par_chunks_mut(TASK))
        .for_each(|(keys, blocks)| {
            for (key, block) in keys.iter().zip(blocks) {
                for view in views {
                    update(view, *key, block, reach);
                }
            }
        });
    Ok(())
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
    };
    view.place(&field_from_camera.inverse());
    Ok(view)
}
