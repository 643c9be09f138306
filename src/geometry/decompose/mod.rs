//! Convex parts that keep cavities open.

mod cut;
mod merge;
mod overlap;
mod parts;
mod split;
#[cfg(test)]
mod tests;

pub use overlap::decomposition_overlap;
pub use parts::{DecompositionConfig, convex_parts};
