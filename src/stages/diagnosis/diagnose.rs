//! The verb of the diagnosis pass.

use super::compare::{base_fit, verdict};
use super::predict::trace_of;
use super::white::whiteness;
use super::{Config, Trace};
use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented};
use crate::twin::{BaseFit, DIAGNOSIS_FORMAT, Diagnosis, Model, Verdict};

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
        Self {
            diagnosis: plain(BaseFit::default(), Verdict::Unknown),
            traces: Vec::new(),
        }
    }
}

fn plain(base: BaseFit, verdict: Verdict) -> Diagnosis {
    Diagnosis {
        format: DIAGNOSIS_FORMAT.into(),
        base,
        verdict,
        findings: Vec::new(),
        experiments: Vec::new(),
    }
}

/// Predicts every interaction with the twin and compares with what was measured.
///
/// The error that counts is that on interactions which were not used to fit. Names of causes are not given
/// here yet: what is left above the noise and the scatter of dry friction makes the verdict `unknown`.
pub fn diagnose(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    config: &Config,
    notices: &mut Notices,
) -> Result<Diagnosed> {
    config.check()?;
    let of = |name: &str| segmented.iter().find(|s| s.interaction == name);
    let traces: Vec<Trace> = capture
        .interactions
        .iter()
        .map(|i| trace_of(capture, i, of(&i.name), model))
        .collect();
    for trace in traces.iter().filter(|t| t.curves.is_empty()) {
        let why = trace.remark.as_deref().unwrap_or("nothing to compare");
        notices.note("diagnosis", &trace.interaction, format!("not predicted: {why}"));
    }
    if !traces.iter().any(|t| t.held_out) && !traces.is_empty() {
        notices.warn(
            "diagnosis",
            &capture.name,
            "no interaction was held out: the error is that on data the twin was fitted to",
        );
    }
    let mut base = base_fit(&traces);
    base.tests = whiteness(&traces);
    Ok(Diagnosed {
        diagnosis: plain(base, verdict(&traces, config)),
        traces,
    })
}
