//! `detect`: what leaves a shape as it is: planes of reflection, axes of rotation, the centre of a ball.

mod candidates;
mod config;
mod detect;
mod evidence;
mod family;
mod judge;
mod lookup;
mod motion;
mod refine;
mod state;
mod surface;
#[cfg(test)]
mod tests;

pub use config::Config;
pub use detect::detect;
pub use evidence::{Evidence, SeenEmpty};
