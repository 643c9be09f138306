//! `reconstruct`: depth views in, closed coloured meshes standing on the support out.

mod config;
mod reconstruct;

pub use crate::geometry::Mesh;
pub use config::Config;
pub use reconstruct::{ShapedObject, Shapes, reconstruct};
