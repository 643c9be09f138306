//! `palpate check`: every export loaded again, and in the embedded engine; the capture's touches across engines.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::Serialize;

use super::arguments::Common;
use super::output;
use crate::base::{Error, Result, read_text, write_atomically};
use crate::capture::{Capture, read_capture};
use crate::engines::{EngineName, EnginesReport, compare};
use crate::export::{CheckReport, check as load_again};
use crate::report::with_engines;
use crate::twin::{Model, read_twin};

/// The result with engines, for `--json`.
#[derive(Serialize)]
struct Across<'a> {
    #[serde(flatten)]
    check: &'a CheckReport,
    played: &'a EnginesReport,
}

/// Checks the exports of the twin, and plays the capture in `engines` where some are named; exit code 1 where an export
/// differs from the twin. How far an engine is from what was measured is told, and is no failure.
pub fn check(common: &Common, twin: &Path, engines: &[String], capture: Option<&Path>) -> Result<ExitCode> {
    let engines = engines.iter().map(|w| w.parse()).collect::<Result<Vec<EngineName>>>()?;
    let report = load_again(twin)?;
    if engines.is_empty() {
        output::result(common, &report.to_string(), &report)?;
    } else {
        let (model, diagnosis) = read_twin(twin)?;
        let capture = match capture {
            Some(folder) => read_capture(folder)?,
            None => beside(twin, &model)?,
        };
        let played = compare(&capture, &model, twin, &diagnosis, &engines)?;
        let all = Across {
            check: &report,
            played: &played,
        };
        let kept = keep(twin, &played)?;
        output::result(common, &format!("{report}\n\n{played}{kept}"), &all)?;
    }
    Ok(if report.passed() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    })
}

/// The file in the twin's folder that holds what engines made of its capture.
const PLAYED: &str = "engines.json";
const REPORT: &str = "report.html";

/// Writes what engines made of the capture beside the twin and into its report, and says where. A folder that may not be
/// written to is told, and is no failure.
fn keep(twin: &Path, played: &EnginesReport) -> Result<String> {
    let mut text = serde_json::to_string_pretty(played).map_err(|e| Error::Failed(e.to_string()))?;
    text.push('\n');
    if let Err(why) = write_atomically(&twin.join(PLAYED), text.as_bytes()) {
        return Ok(format!("not kept beside the twin: {why}\n"));
    }
    let page = twin.join(REPORT);
    let shown = read_text(&page).ok().and_then(|p| with_engines(&p, played));
    let Some(shown) = shown else {
        return Ok(format!("kept in {}\n", twin.join(PLAYED).display()));
    };
    write_atomically(&page, shown.as_bytes())?;
    Ok(format!("report: {}#engines\n", page.display()))
}

/// The capture that the twin was made of, among the folders beside it and above it: known by its name and digest.
fn beside(twin: &Path, model: &Model) -> Result<Capture> {
    let digest = &model.twin.provenance.capture_digest;
    for folder in folders(twin) {
        if !names(&folder, &model.twin.name) {
            continue;
        }
        if let Ok(capture) = read_capture(&folder)
            && &capture.digest == digest
        {
            return Ok(capture);
        }
    }
    Err(Error::Usage(format!(
        "{}: the capture that it was made of is not beside it; name it with --capture",
        twin.display()
    )))
}

/// The folders beside the twin and beside the one that holds it, in the order of their names.
fn folders(twin: &Path) -> Vec<PathBuf> {
    let twin = twin.canonicalize().unwrap_or_else(|_| twin.to_path_buf());
    let mut found: Vec<PathBuf> = Vec::new();
    for above in twin.ancestors().skip(1).take(2) {
        let entries = std::fs::read_dir(above).into_iter().flatten().flatten();
        let mut here: Vec<PathBuf> = entries.map(|e| e.path()).filter(|p| p.is_dir()).collect();
        here.sort();
        found.extend(here);
    }
    found
}

/// Whether a folder holds a capture of that name.
fn names(folder: &Path, name: &str) -> bool {
    let text = read_text(&folder.join("capture.json")).unwrap_or_default();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    value["name"].as_str() == Some(name)
}
