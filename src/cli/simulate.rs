//! `palpate simulate`: a hand at work on the twin in the embedded engine.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::output;
use crate::base::{Result, write_atomically};
use crate::export::{Deed, film_folder, manipulate_folder};

/// Does one thing to the twin and says what came along.
pub fn simulate(common: &Common, twin: &Path, deed: &str, film: Option<&Path>) -> Result<ExitCode> {
    let deed: Deed = deed.parse()?;
    let outcome = match film {
        None => manipulate_folder(twin, &deed)?,
        Some(file) => {
            let (outcome, bytes) = film_folder(twin, &deed)?;
            write_atomically(file, &bytes)?;
            outcome
        }
    };
    output::result(common, &outcome.to_string(), &outcome)?;
    Ok(ExitCode::SUCCESS)
}
