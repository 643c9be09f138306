//! `palpate inspect`: what is in a capture, and what is missing for which estimate.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::output;
use crate::base::Result;
use crate::capture::{inspect as look, read_capture};

/// Inspects the capture.
pub fn inspect(common: &Common, capture: &Path) -> Result<ExitCode> {
    let seen = look(&read_capture(capture)?);
    output::result(common, &seen.to_text(), &seen)?;
    Ok(ExitCode::SUCCESS)
}
