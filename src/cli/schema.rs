//! `palpate schema`: the JSON Schema of a file format, made from the types that read and write it.

use std::process::ExitCode;

use super::output;
use crate::base::{Error, Result, nearest_name};
use crate::capture::capture_schema;
use crate::twin::{Diagnosis, Truth, Twin};

const FORMATS: [&str; 4] = ["capture", "twin", "diagnosis", "truth"];

/// Prints the schema of `format`.
pub fn schema(format: &str) -> Result<ExitCode> {
    let schema = match format {
        "capture" => capture_schema(),
        "twin" => schemars::schema_for!(Twin).to_value(),
        "diagnosis" => schemars::schema_for!(Diagnosis).to_value(),
        "truth" => schemars::schema_for!(Truth).to_value(),
        other => {
            let nearest = nearest_name(other, FORMATS).unwrap_or(FORMATS[0]);
            let all = FORMATS.join(", ");
            return Err(Error::Usage(format!(
                "schema {other}: no such format; did you mean {nearest}? There are {all}"
            )));
        }
    };
    let text = serde_json::to_string_pretty(&schema).map_err(|e| Error::Failed(e.to_string()))?;
    output::line(&text)?;
    Ok(ExitCode::SUCCESS)
}
