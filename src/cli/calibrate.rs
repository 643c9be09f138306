//! `palpate calibrate`: entries of the calibration tables from measurements.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::{Calibration, Common};
use super::output;
use crate::base::{Notices, Result, write_atomically};
use crate::capture::read_capture;
use crate::pipeline::calibrate_friction;

/// Calibrates what was asked.
pub fn calibrate(common: &Common, what: &Calibration) -> Result<ExitCode> {
    match what {
        Calibration::Friction { capture, out } => friction(common, capture, out.as_deref()),
    }
}

fn friction(common: &Common, capture: &Path, out: Option<&Path>) -> Result<ExitCode> {
    let mut notices = Notices::default();
    let entry = calibrate_friction(&read_capture(capture)?, &mut notices)?;
    output::notices(common, &notices.0);
    match out {
        Some(path) => {
            write_atomically(path, entry.as_bytes())?;
            output::result(common, &format!("entry: {}", path.display()), &json!({ "out": path }))?;
        }
        None => output::result(common, &entry, &json!({ "entry": entry }))?,
    }
    Ok(ExitCode::SUCCESS)
}
