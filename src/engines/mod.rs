//! A capture's own touches played in physics engines, each judged by what was measured.

mod astray;
mod compare;
mod outside;
mod pivot;
mod probe;
mod reason;
mod recorded;
mod table;

pub use compare::compare;
pub use outside::EngineName;
pub use reason::{Cause, Judged, Reason, Source};
pub use table::{EngineReport, EnginesReport, Outcome, RestRow, Skipped, TouchRow};
