//! A finished run as a recording for the Rerun viewer (cargo feature `rerun`); computes no new result.
//!
//! Entities, timelines and units: `docs/exports.md`, "A recording for Rerun".

mod cameras;
mod clock;
mod curves;
mod scene;
mod stream;
mod touches;
mod words;
mod write;

pub use write::record;
