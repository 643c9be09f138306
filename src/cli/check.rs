//! `palpate check`: every export loaded again, and in the embedded engine.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::output;
use crate::base::Result;
use crate::export::check as load_again;

/// Checks the exports of the twin; exit code 1 where something differs.
pub fn check(common: &Common, twin: &Path) -> Result<ExitCode> {
    let report = load_again(twin)?;
    output::result(common, &report.to_string(), &report)?;
    Ok(if report.passed() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    })
}
