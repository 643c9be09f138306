//! Fusion of a sequence of range images into a sparse block grid, as fast as the memory of a CPU allows.

mod depths;
mod fuse;
mod patches;
mod planes;
mod pyramid;
mod update;

pub use fuse::{Fusion, FusionConfig};
