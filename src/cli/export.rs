//! `palpate export`: a twin in other formats.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::Common;
use super::output;
use crate::base::{Result, Seed};
use crate::export::{Format, export_into, export_variants};

/// Writes the twin in the named formats beside its `twin.json`, or models drawn from what it knows.
pub fn export(common: &Common, twin: &Path, to: &[String], variants: Option<u32>) -> Result<ExitCode> {
    let formats = to.iter().map(|w| w.parse()).collect::<Result<Vec<Format>>>()?;
    let files = match variants {
        Some(count) => export_variants(twin, &formats, count as usize, Seed(common.seed))?,
        None => export_into(twin, &formats)?,
    };
    output::result(common, &files.join("\n"), &json!({ "files": files }))?;
    Ok(ExitCode::SUCCESS)
}
