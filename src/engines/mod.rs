//! A capture's own touches played in physics engines, each judged by what was measured.

mod compare;
mod outside;
mod recorded;
mod table;

pub use compare::compare;
pub use outside::EngineName;
pub use table::{Doubt, EngineReport, EnginesReport, Outcome, RestRow, Skipped, TouchRow};
