//! `reconstruct`: depth views in, closed coloured meshes standing on the support out.

mod anchor;
mod bake;
mod borders;
mod camera_noise;
mod colours;
mod complete;
mod config;
mod discover;
mod fields;
mod flat;
mod free;
mod furnish;
mod fusion;
mod given;
mod instances;
mod lens;
mod look;
mod principal;
mod range;
mod reconstruct;
mod seams;
mod seat;
mod solid;
mod split;
mod support;
mod track;
mod vessel;
mod volume;
mod walls;

#[cfg(test)]
#[expect(
    clippy::disallowed_macros,
    reason = "tests say what they measured and what they skipped"
)]
mod tests;

pub use crate::geometry::{Mesh, Silhouette};
pub use bake::bake;
pub use camera_noise::{CameraNoise, Term, camera_noise, camera_noise_to_toml};
pub use complete::FindSymmetry;
pub use config::Config;
pub use free::FreeSpace;
pub use furnish::furnish;
pub use fusion::{Fusion, FusionConfig, Shot};
pub use look::{Decision, Gain, NextView, NextViewConfig, ViewChoice};
pub use principal::principal_views;
pub use reconstruct::{ShapedObject, Shapes, reconstruct, reconstruct_with, seen_surface};
pub use track::{Following, VisualTrack, follow};
