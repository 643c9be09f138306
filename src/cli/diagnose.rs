//! `palpate diagnose`: what a model gets wrong of a capture, why, and what would decide; writes nothing.

use std::path::Path;
use std::process::ExitCode;

use super::arguments::Common;
use super::{output, reconstruct};
use crate::base::{Estimate, Notices, Result, Seed};
use crate::capture::read_capture;
use crate::pipeline::{self, Options, Pass};
use crate::twin::{Diagnosis, Experiment, Finding, Gain, Verdict, read_twin};

/// Diagnoses a fresh fit, or the model of an existing folder, and says what came out.
pub fn diagnose(common: &Common, capture: &Path, model: Option<&Path>, causes: &[String]) -> Result<ExitCode> {
    let mut options = Options {
        seed: Seed(common.seed),
        ..Options::default()
    };
    options.diagnosis.causes = (!causes.is_empty()).then(|| causes.to_vec());
    options.diagnosis.check()?;
    let capture = read_capture(capture)?;
    let diagnosis = match model {
        Some(folder) => {
            let (model, _) = read_twin(folder)?;
            let mut notices = Notices::default();
            let diagnosis = pipeline::diagnose(&capture, &model, &options, &mut notices)?.diagnosis;
            output::notices(common, &notices.0);
            diagnosis
        }
        None => {
            options.passes.retain(|p| !matches!(p, Pass::Export | Pass::Report));
            let run = reconstruct::run_passes(common, &capture, &options)?;
            output::notices(common, &run.model.twin.notices);
            run.diagnosis
        }
    };
    output::result(common, &in_words(&diagnosis), &diagnosis)?;
    Ok(ExitCode::SUCCESS)
}

fn in_words(diagnosis: &Diagnosis) -> String {
    let mut text = format!("{}\n", verdict(diagnosis.verdict));
    for finding in &diagnosis.findings {
        text += &of_finding(finding);
    }
    let (parting, showing): (Vec<&Experiment>, Vec<&Experiment>) =
        diagnosis.experiments.iter().partition(|e| e.bits.is_some());
    for (title, word, some) in [
        ("what would tell more", "parts", parting),
        (
            "what these data say nothing of, and what would show it",
            "shows",
            showing,
        ),
    ] {
        if !some.is_empty() {
            text += &format!("\n{title}:\n");
        }
        for experiment in some {
            text += &format!("- {} ({word}: {})\n", experiment.words, experiment.parts.join(", "));
        }
    }
    text
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "adequate: nothing is left above noise and the scatter of dry friction",
        Verdict::Explained => "explained: what the plain model gets wrong has a name",
        Verdict::Ambiguous => "ambiguous: these data cannot tell between the causes below",
        Verdict::Unknown => "unknown: something is left that no cause of the catalogue explains",
    }
}

fn of_finding(finding: &Finding) -> String {
    let others = finding.alternatives.iter();
    let others: Vec<String> = others.map(|a| format!("{} {:.2}", a.cause, a.probability)).collect();
    let mut text = format!(
        "\n{} ({}), probability {:.2}",
        finding.cause, finding.place, finding.probability
    );
    if !others.is_empty() {
        text += &format!("; or {}", others.join(", "));
    }
    text += "\n";
    for evidence in &finding.evidence {
        text += &format!("  {}\n", evidence.words);
    }
    for (name, value) in &finding.parameters {
        text += &format!("  {name} = {}\n", of_estimate(value));
    }
    text + &of_gain(&finding.gain)
}

fn of_estimate(value: &Estimate) -> String {
    let unit = if value.unit == "1" { "" } else { &value.unit };
    match value.ci95 {
        Some([low, high]) => format!("{} [{}, {}] {unit}", short(value.value), short(low), short(high)),
        None => format!("{} {unit}", short(value.value)),
    }
}

/// Four decimals, or three digits of what is small.
fn short(value: f64) -> String {
    if value == 0.0 || value.abs() >= 0.01 {
        format!("{value:.4}")
    } else {
        format!("{value:.2e}")
    }
}

fn of_gain(gain: &Gain) -> String {
    if gain.rmse_before <= 0.0 {
        return String::new();
    }
    let on = if gain.held_out.is_empty() {
        "the fitted interactions; none was held out".to_owned()
    } else {
        gain.held_out.join(", ")
    };
    format!(
        "  error of the {} from {} to {} {} ({:.0} % of what is above the noise is gone) on {on}\n",
        gain.quantity,
        short(gain.rmse_before),
        short(gain.rmse_after),
        gain.unit,
        100.0 * gain.reduction
    )
}
