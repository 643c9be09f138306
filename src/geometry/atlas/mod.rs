//! A surface laid out flat, for textures.

mod charts;
mod layout;
mod pack;
mod raster;

pub use layout::{Atlas, Texel};
pub use raster::cover_triangle;
