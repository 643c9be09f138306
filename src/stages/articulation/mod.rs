//! `infer`: which tracked things are links of one body, and the joints between them.

mod config;
mod coupling;
mod describe;
mod fit;
mod infer;
mod limits;
mod manifold;
mod pair;
mod rail;
mod select;
mod shoved;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_of_proof;
#[cfg(test)]
mod tests_of_trees;
mod tree;
mod world;

pub use config::Config;
pub use infer::{Articulation, Unproven, infer};
