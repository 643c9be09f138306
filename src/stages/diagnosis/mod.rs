//! `diagnose`: how far the twin's predictions are from what was measured, against the noise floor.

mod compare;
mod config;
mod diagnose;
mod predict;
mod slide;
mod slope;
mod trace;
mod white;

pub use config::Config;
pub use diagnose::{Diagnosed, diagnose};
pub use trace::{Curve, Quantity, Trace};
