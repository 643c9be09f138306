//! `palpate calibrate`: entries of the calibration tables from measurements.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::arguments::{Calibration, Common};
use super::output;
use crate::base::{Notices, Result, Seed, write_atomically};
use crate::capture::read_capture;
use crate::pipeline::{calibrate_camera, calibrate_force, calibrate_friction, learn_snapshots};

/// Calibrates what was asked.
pub fn calibrate(common: &Common, what: &Calibration) -> Result<ExitCode> {
    match what {
        Calibration::Friction { capture, out } => friction(common, capture, out.as_deref()),
        Calibration::Force { capture, out } => force(common, capture, out.as_deref()),
        Calibration::Camera { capture, out } => camera(common, capture, out.as_deref()),
        Calibration::Snapshots { captures, out } => snapshots(common, captures, out.as_deref()),
    }
}

fn snapshots(common: &Common, folders: &[PathBuf], out: Option<&Path>) -> Result<ExitCode> {
    let captures = folders.iter().map(|f| read_capture(f)).collect::<Result<Vec<_>>>()?;
    let mut notices = Notices::default();
    let learnt = learn_snapshots(&captures, Seed(common.seed), &mut notices);
    output::notices(common, &notices.0);
    let learnt = learnt?;
    entry(common, &learnt.to_toml()?, out)
}

fn force(common: &Common, capture: &Path, out: Option<&Path>) -> Result<ExitCode> {
    let mut notices = Notices::default();
    let scale = calibrate_force(&read_capture(capture)?, &mut notices)?;
    output::notices(common, &notices.0);
    entry(common, &scale.to_toml()?, out)
}

fn friction(common: &Common, capture: &Path, out: Option<&Path>) -> Result<ExitCode> {
    let mut notices = Notices::default();
    let entry = calibrate_friction(&read_capture(capture)?, &mut notices)?;
    output::notices(common, &notices.0);
    self::entry(common, &entry, out)
}

fn camera(common: &Common, capture: &Path, out: Option<&Path>) -> Result<ExitCode> {
    let mut notices = Notices::default();
    let noise = calibrate_camera(&read_capture(capture)?, &mut notices)?;
    output::notices(common, &notices.0);
    entry(common, &noise, out)
}

/// Writes an entry to its file, or shows it.
fn entry(common: &Common, entry: &str, out: Option<&Path>) -> Result<ExitCode> {
    match out {
        Some(path) => {
            write_atomically(path, entry.as_bytes())?;
            output::result(common, &format!("entry: {}", path.display()), &json!({ "out": path }))?;
        }
        None => output::result(common, entry, &json!({ "entry": entry }))?,
    }
    Ok(ExitCode::SUCCESS)
}
