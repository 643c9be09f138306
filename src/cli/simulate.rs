//! `palpate simulate`: a hand at work on the twin in the embedded engine.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::output;
use crate::base::Result;
use crate::export::{Deed, manipulate_folder};

/// Does one thing to the twin and says what came along.
pub fn simulate(common: &Common, twin: &Path, deed: &str) -> Result<ExitCode> {
    let deed: Deed = deed.parse()?;
    let outcome = manipulate_folder(twin, &deed)?;
    output::result(common, &outcome.to_string(), &outcome)?;
    Ok(ExitCode::SUCCESS)
}
