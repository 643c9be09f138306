//! `reconstruct`: depth views in, closed coloured meshes standing on the support out.

mod anchor;
mod config;
mod discover;
mod furnish;
mod fuse;
mod lens;
mod range;
mod reconstruct;
mod seat;
mod solid;
mod split;
mod support;
mod surface;
mod track;
mod volume;
mod walls;

#[cfg(test)]
#[expect(
    clippy::disallowed_macros,
    reason = "tests say what they measured and what they skipped"
)]
mod tests;

pub use crate::geometry::{Mesh, Silhouette};
pub use config::Config;
pub use furnish::furnish;
pub use reconstruct::{ShapedObject, Shapes, reconstruct, seen_surface};
pub use track::{Following, VisualTrack, follow};
