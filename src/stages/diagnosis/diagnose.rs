//! The verb of the diagnosis pass.

use super::Trace;
use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::{BaseFit, DIAGNOSIS_FORMAT, Diagnosis, Model, Verdict};

/// Settings of the diagnosis pass.
#[derive(Clone, Debug, Default)]
pub struct Config {}

/// A diagnosis with the curves that it rests on.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// The content of `diagnosis.json`.
    pub diagnosis: Diagnosis,
    /// Measured against predicted, one per interaction, in the order of the capture.
    pub traces: Vec<Trace>,
}

impl Diagnosed {
    /// Nothing was asked, nothing is claimed.
    pub fn skipped() -> Self {
        let diagnosis = Diagnosis {
            format: DIAGNOSIS_FORMAT.into(),
            base: BaseFit::default(),
            verdict: Verdict::Unknown,
            findings: Vec::new(),
            experiments: Vec::new(),
        };
        Self {
            diagnosis,
            traces: Vec::new(),
        }
    }
}

/// Predicts every interaction with the twin and compares with what was measured.
pub fn diagnose(
    _capture: &Capture,
    _segmented: &[Segmented],
    _model: &Model,
    _config: &Config,
    _notices: &mut Notices,
) -> Result<Diagnosed> {
    Ok(Diagnosed::skipped())
}
