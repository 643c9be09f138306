//! Bodies followed through images, and parts told apart by how they move.

mod align;
mod contour;
mod cut;
mod divide;
mod follow;
mod foreign;
mod parting;
mod parts;
mod picture;
mod skin;
mod surfels;
mod verb;

pub use verb::{Following, VisualTrack, follow};
