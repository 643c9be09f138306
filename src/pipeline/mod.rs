//! The whole way on one screen: order, cache, record.

mod assemble;
mod build;
mod calibrate;
mod carried;
mod diagnose;
mod doubt;
mod explore;
mod extend;
mod given;
mod lumps;
mod options;
mod pass;
mod symmetries;
mod touches;
mod welded;

pub use build::{Run, build};
pub use calibrate::{calibrate_camera, calibrate_force, calibrate_friction, learn_snapshots};
pub use diagnose::{Judged, diagnose, judge};
pub use explore::{Exploration, ExploreOptions, Step, explore};
pub use options::Options;
pub use pass::Pass;
