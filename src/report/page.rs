//! The page as a whole.

use crate::base::Result;
use crate::capture::Capture;
use crate::pipeline::Run;

/// The page of a run.
pub fn render(_capture: &Capture, run: &Run) -> Result<String> {
    Ok(format!("<!doctype html><title>{}</title>", run.model.twin.name))
}
