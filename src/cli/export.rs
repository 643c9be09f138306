//! `palpate export`: a twin in other formats.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::Common;
use super::output;
use crate::base::Result;
use crate::export::{Format, export_into};

/// Writes the twin in the named formats beside its `twin.json`.
pub fn export(common: &Common, twin: &Path, to: &[String]) -> Result<ExitCode> {
    let formats = to.iter().map(|w| w.parse()).collect::<Result<Vec<Format>>>()?;
    let files = export_into(twin, &formats)?;
    output::result(common, &files.join("\n"), &json!({ "files": files }))?;
    Ok(ExitCode::SUCCESS)
}
