//! `detect`: the planes through a mesh on which it mirrors onto itself.

mod detect;

pub use detect::{Config, detect};
