//! `palpate diagnose`: what a model gets wrong of a capture, why, and what would decide; writes nothing.

use std::path::Path;
use std::process::ExitCode;

use serde::Serialize;

use super::arguments::Common;
use super::{output, reconstruct};
use crate::base::{Estimate, Notices, Result, Seed};
use crate::capture::{Capture, read_capture};
use crate::pipeline::{self, Judged, Options, Pass};
use crate::twin::{Compared, Diagnosis, Experiment, Finding, Gain, Miss, Verdict, read_twin};

/// What came out, as one JSON object.
#[derive(Serialize)]
struct Said<'a> {
    #[serde(flatten)]
    diagnosis: &'a Diagnosis,
    /// Numbers of the given model beside measured ones; absent, as what follows, where no model was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    numbers: Option<&'a [Compared]>,
    /// What it holds together, or lets move, otherwise than was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    structure: Option<&'a [String]>,
    /// What it does not carry and was taken from the capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    lent: Option<&'a [String]>,
    /// What the diagnosis named that it has a number for: cause and place.
    #[serde(skip_serializing_if = "Option::is_none")]
    carried: Option<&'a [[String; 2]]>,
}

/// Diagnoses a fresh fit, or the model of an existing folder, and says what came out.
pub fn diagnose(common: &Common, capture: &Path, model: Option<&Path>, causes: &[String]) -> Result<ExitCode> {
    let mut options = Options {
        seed: Seed(common.seed),
        ..Options::default()
    };
    options.diagnosis.causes = (!causes.is_empty()).then(|| causes.to_vec());
    options.diagnosis.check()?;
    let capture = read_capture(capture)?;
    let mut judged = None;
    let diagnosis = match model {
        Some(folder) => {
            let (model, _) = read_twin(folder)?;
            let mut fit = options.clone();
            fit.passes
                .retain(|p| !matches!(p, Pass::Diagnosis | Pass::Export | Pass::Report));
            let fresh = reconstruct::run_passes(common, &capture, &fit)?;
            let mut notices = Notices::default();
            let found = pipeline::judge(&capture, &model, &fresh.model, &options, &mut notices)?;
            output::notices(common, &notices.0);
            let diagnosis = found.diagnosed.diagnosis.clone();
            judged = Some(found);
            diagnosis
        }
        None => {
            options.passes.retain(|p| !matches!(p, Pass::Export | Pass::Report));
            let run = reconstruct::run_passes(common, &capture, &options)?;
            output::notices(common, &run.model.twin.notices);
            run.diagnosis
        }
    };
    let words = match &judged {
        Some(judged) => {
            of_model(&diagnosis, judged) + &beside_the_plainest(judged) + &in_words(&diagnosis, &capture, causes)
        }
        None => in_words(&diagnosis, &capture, causes),
    };
    let said = Said {
        diagnosis: &diagnosis,
        numbers: judged.as_ref().map(|j| j.numbers.as_slice()),
        structure: judged.as_ref().map(|j| j.structure.as_slice()),
        lent: judged.as_ref().map(|j| j.lent.as_slice()),
        carried: judged.as_ref().map(|j| j.carried.as_slice()),
    };
    output::result(common, &words, &said)?;
    Ok(ExitCode::SUCCESS)
}

fn in_words(diagnosis: &Diagnosis, capture: &Capture, causes: &[String]) -> String {
    let mut text = format!("{}\n", verdict(diagnosis, capture));
    text += &left(diagnosis);
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
            let bits = experiment
                .bits
                .map_or_else(String::new, |b| format!("; up to {b:.1} bits"));
            text += &format!(
                "- {} ({word}: {}{bits})\n",
                experiment.words,
                experiment.parts.join(", ")
            );
        }
    }
    let asked = |c: &&str| causes.is_empty() || causes.iter().any(|own| own == c);
    let tried: Vec<&str> = diagnosis.tried().filter(asked).collect();
    if !tried.is_empty() {
        text += &format!("\ntried, and not found: {}\n", tried.join(", "));
    }
    text
}

/// What the diagnosis named and the given model has a number for.
fn carried(judged: &Judged) -> Option<String> {
    let words: Vec<String> = judged.carried.iter().map(|[c, p]| format!("{c} ({p})")).collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// Leads over to the diagnosis.
fn beside_the_plainest(judged: &Judged) -> String {
    match carried(judged) {
        Some(words) => {
            format!("\nthe model has a number for {words}, tried above; what its predictions lack without that: ")
        }
        None => "\nwhat its predictions lack: ".into(),
    }
}

/// How far a given model's predictions are off, and which of its numbers the capture excludes.
fn of_model(diagnosis: &Diagnosis, judged: &Judged) -> String {
    let base = &diagnosis.base;
    let unit = |name: &str| match name {
        "force" => "N",
        "torque" => "N·m",
        "rotation" | "heading" => "rad",
        _ => "m",
    };
    let of = |(name, rmse): (&String, &f64)| {
        let floor = base.noise_floor.get(name);
        let floor = floor.map_or(String::new(), |f| format!(" (noise {})", short(*f)));
        format!("{name} {} {}{floor}", short(*rmse), unit(name))
    };
    let off: Vec<String> = base.rmse.iter().map(of).collect();
    let without = match carried(judged) {
        Some(words) => format!(", without {words},"),
        None => String::new(),
    };
    let mut text = match off.is_empty() {
        true => "what the model predicts could not be laid beside what was measured\n".to_owned(),
        false => format!(
            "the model's predictions{without} are off by (rms): {}\n",
            off.join(", ")
        ),
    };
    for trace in judged.diagnosed.traces.iter().filter(|t| t.curves.is_empty()) {
        let why = trace.remark.as_deref().unwrap_or("nothing to compare");
        text += &format!("not foretold: {}: {why}\n", trace.interaction);
    }
    for lent in &judged.lent {
        text += &format!("not in the model, taken from the capture for this: {lent}\n");
    }
    for words in &judged.structure {
        text += &format!("- {words}\n");
    }
    let (outside, within): (Vec<&Compared>, Vec<&Compared>) = judged.numbers.iter().partition(|n| n.outside);
    if judged.numbers.is_empty() {
        return text + "this capture measures none of the model's numbers\n";
    }
    if outside.is_empty() && judged.structure.is_empty() {
        let count = within.len();
        text += &format!(
            "the model is right as far as this capture tells: all {count} of its numbers that were measured fit\n"
        );
    } else {
        text += &format!(
            "of its numbers that this capture measures, {} lie outside of the 95 % and {} within\n",
            outside.len(),
            within.len()
        );
    }
    for number in outside {
        text += &format!("- {number}\n");
    }
    if !within.is_empty() {
        text += "within:\n";
    }
    for number in within {
        text += &format!("  {number}\n");
    }
    text
}

fn verdict(diagnosis: &Diagnosis, capture: &Capture) -> String {
    let words = match diagnosis.verdict {
        Verdict::Adequate => "adequate: nothing is left above noise and the scatter of dry friction",
        Verdict::Explained => "explained: what the plain model gets wrong has a name",
        Verdict::Ambiguous => "ambiguous: these data cannot tell between the causes below",
        Verdict::Unknown if diagnosis.compares_nothing() => {
            return format!("unknown: nothing was compared: {}", why_not(capture));
        }
        Verdict::Unknown => "unknown: something is left that no cause of the catalogue explains",
    };
    words.to_owned()
}

/// Why no prediction could be laid beside a measurement.
fn why_not(capture: &Capture) -> String {
    let (all, held_out) = (capture.interactions.len(), capture.held_out().count());
    match all {
        0 => "the capture has no interaction".to_owned(),
        _ if held_out == all => format!("all {all} interactions are held out, so none was there to fit"),
        _ => format!("none of the {all} interactions was both predicted and measured"),
    }
}

/// How words on what has no name begin.
const LEFT: &str = "what is left";

/// Where something is left, by what it is seen, and what it depends on.
fn left(diagnosis: &Diagnosis) -> String {
    let missed = diagnosis.missed.iter().map(|m| format!("  {}\n", of_miss(m)));
    let depends = diagnosis.left.iter().map(|e| match e.words.starts_with(LEFT) {
        true => format!("  {}\n", e.words),
        false => format!("  {LEFT}: {}\n", e.words),
    });
    missed.chain(depends).collect()
}

fn of_miss(miss: &Miss) -> String {
    let held = if miss.held_out { " (held out)" } else { "" };
    let noise = miss.noise.filter(|n| *n > 0.0);
    let times = noise.map_or_else(String::new, |n| format!(", {:.1} times the noise", miss.rmse / n));
    let of = if miss.of.is_empty() {
        String::new()
    } else {
        format!(" ({})", miss.of)
    };
    format!(
        "{}{held}: {} {} {} rms off{times}{of}",
        miss.interaction,
        miss.quantity.replace('-', " "),
        short(miss.rmse),
        miss.unit
    )
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
    let noise = gain.noise.map_or_else(String::new, |n| format!(", noise {}", short(n)));
    let of = if gain.of.is_empty() {
        String::new()
    } else {
        format!("; {}", gain.of)
    };
    format!(
        "  error of the {} from {} to {} {}{noise} ({:.0} % of what is above the noise is gone{of}) on {on}\n",
        gain.quantity,
        short(gain.rmse_before),
        short(gain.rmse_after),
        gain.unit,
        100.0 * gain.reduction
    )
}
