//! `reconstruct`: depth views in, closed coloured meshes standing on the support out.

mod anchor;
mod complete;
mod config;
mod discover;
mod free;
mod furnish;
mod fuse;
mod fusion;
mod lens;
mod range;
mod reconstruct;
mod seat;
mod solid;
mod split;
mod support;
mod surface;
mod volume;
mod walls;

#[cfg(test)]
#[expect(
    clippy::disallowed_macros,
    reason = "tests say what they measured and what they skipped"
)]
mod tests;

pub use crate::geometry::{Mesh, Silhouette};
pub use complete::FindSymmetry;
pub use config::Config;
pub use free::FreeSpace;
pub use furnish::furnish;
pub use fusion::{Fusion, FusionConfig};
pub use reconstruct::{ShapedObject, Shapes, reconstruct, reconstruct_with, seen_surface};
