//! `palpate score`: the errors of a twin against the truth.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::output;
use crate::base::Result;
use crate::twin::{read_truth, read_twin, score as compare};

/// Scores the twin.
pub fn score(common: &Common, twin: &Path, truth: &Path) -> Result<ExitCode> {
    let (model, diagnosis) = read_twin(twin)?;
    let (truth, meshes) = read_truth(truth)?;
    let score = compare(&model, &diagnosis, &truth, Some(&meshes))?;
    output::result(common, &score.to_string(), &score)?;
    Ok(ExitCode::SUCCESS)
}
