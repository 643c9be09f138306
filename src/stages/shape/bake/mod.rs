//! Textures: the colour images, seen from the surface.

mod eye;
mod fill;
mod verb;

pub use verb::bake;
