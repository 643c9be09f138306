//! `detect`: the planes through a mesh on which it mirrors onto itself.

mod config;
mod detect;
mod mirror;
mod revolution;
#[cfg(test)]
mod tests;

pub use config::Config;
pub use detect::detect;
