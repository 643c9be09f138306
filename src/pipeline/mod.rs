//! The whole way on one screen: order, cache, record.

mod build;

pub use build::{Options, Run, build};
