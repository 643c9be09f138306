//! Convex parts that keep cavities open.

mod axis;
mod balance;
mod divide;
mod merge;
mod overlap;
mod parts;
mod piece;
mod planes;
#[cfg(test)]
mod tests;

pub use overlap::decomposition_overlap;
pub use parts::{DecompositionConfig, convex_parts};
