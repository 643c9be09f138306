//! The whole way on one screen: order, cache, record.

mod assemble;
mod build;
mod calibrate;
mod options;
mod pass;
mod symmetries;

pub use build::{Run, build};
pub use calibrate::calibrate_friction;
pub use options::Options;
pub use pass::Pass;
