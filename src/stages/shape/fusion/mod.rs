//! Fusion of a sequence of range images into a sparse block grid, as fast as the memory of a CPU allows.

mod depths;
mod fuse;
mod noise;
mod patches;
mod planes;
mod pyramid;
mod touch;
mod units;
mod update;
mod windows;

#[cfg(test)]
mod tests;

pub use depths::raw_depth;
pub use fuse::{Fusion, FusionConfig, Shot, fill, prepare};
pub use planes::Sight;
pub use update::Prepared;
