//! Printing: results on standard output, everything else on standard error.
#![expect(clippy::disallowed_macros, reason = "the one place that prints")]

use std::io::Write;

use super::arguments::Common;
use crate::base::{Error, Notice, Progress, Result, Severity};

/// Prints a result as text, or as one JSON object.
pub fn result(common: &Common, text: &str, json: &impl serde::Serialize) -> Result<()> {
    if common.json {
        let object = serde_json::to_string(json).map_err(|e| Error::Failed(e.to_string()))?;
        return line(&object);
    }
    if common.quiet {
        return Ok(());
    }
    line(text.trim_end())
}

/// One line on standard output; a reader that went away is not an error.
pub fn line(text: &str) -> Result<()> {
    match writeln!(std::io::stdout().lock(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output", e)),
        _ => Ok(()),
    }
}

/// What is being done, on standard error; silent with `--quiet` and `--json`.
pub fn say(common: &Common, text: &str) {
    if !common.quiet && !common.json {
        eprintln!("{text}");
    }
}

/// The doubts of a run: warnings always, notes with `--verbose`.
pub fn notices(common: &Common, notices: &[Notice]) {
    for notice in notices {
        if common.verbose || notice.severity == Severity::Warning {
            say(
                common,
                &format!("  {}: {}: {}", notice.stage, notice.about, notice.message),
            );
        }
    }
}

/// The one message of a run that failed.
pub fn error(error: &Error) {
    eprintln!("palpate: {error}");
}

/// A progress bar, or a silent one with `--quiet` and `--json`.
pub fn progress(common: &Common, label: &str, total: u64) -> Progress {
    if common.quiet || common.json {
        Progress::silent()
    } else {
        Progress::new(label, total)
    }
}
