//! A tool on a prescribed path against a thing on the support: sliding, tipping, rolling, many trials at once.

mod batch;
mod extent;
mod floor;
mod lanes;
mod path;
mod solid;
mod solve;
mod touch;
mod trial;
mod turns;

pub use path::Path;
pub use solid::{Solid, Tool};
pub use trial::{Coefficients, Outcome, Stage, Trial, simulate};
