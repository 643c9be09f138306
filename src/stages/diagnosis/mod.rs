//! `diagnose`: how far the twin's predictions are from what was measured, against the noise floor.

mod diagnose;
mod trace;

pub use diagnose::{Config, Diagnosed, diagnose};
pub use trace::{Curve, Trace};
