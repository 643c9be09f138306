//! The head of the page: name, verdict, key figures.

use super::markup::{count, escape, percent};
use super::numbers::quantity;
use crate::capture::Capture;
use crate::pipeline::Run;
use crate::stages::diagnosis::Trace;
use crate::twin::{JointKind, RelationKind, Verdict};

/// Key figures in a row, at most.
const WIDEST: usize = 9;

/// The SI unit of a quantity that errors are gathered by.
pub fn unit_of(quantity: &str) -> &'static str {
    match quantity {
        "force" => "N",
        "torque" => "N·m",
        "position" | "position-in-flight" | "position-after-bounce" => "m",
        "rotation" => "rad",
        _ => "",
    }
}

/// A verdict as a word, a sentence, and a class of colour.
fn verdict(run: &Run) -> (&'static str, &'static str, &'static str) {
    if run.diagnosis.compares_nothing() {
        return (
            "Not judged",
            "Nothing was compared: no prediction could be laid beside a measurement, so nothing is said of how well the twin \
             predicts.",
            "open",
        );
    }
    match run.diagnosis.verdict {
        Verdict::Adequate => (
            "Adequate",
            "What the twin predicts of held-out touches differs from what was measured by no more than noise, the usual \
             scatter of friction, and what the twin's own numbers leave in doubt.",
            "good",
        ),
        Verdict::Explained => (
            "Explained",
            "What the plain twin got wrong has named causes, and the extended twin accounts for them.",
            "good",
        ),
        Verdict::Ambiguous => (
            "Ambiguous",
            "The twin misses more than noise allows; these data cannot tell which named cause it is, the experiments below would.",
            "open",
        ),
        Verdict::Unknown => (
            "Something is left",
            "The twin misses more than noise allows, and no named cause explains what is left. The diagnosis says where.",
            "open",
        ),
    }
}

/// A name with a capital, escaped.
pub fn capital(name: &str) -> String {
    let mut letters = name.chars();
    let first: String = letters.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    escape(&format!("{first}{}", letters.as_str()))
}

fn figure(value: &str, name: &str) -> String {
    format!("<div><dt>{name}</dt><dd>{value}</dd></div>\n")
}

/// The first cause with its odds.
fn cause(run: &Run) -> String {
    let first = run.diagnosis.findings.first();
    first.map_or_else(String::new, |f| {
        let more = run.diagnosis.findings.len() - 1;
        let more = if more > 0 {
            format!(", and {more} more")
        } else {
            String::new()
        };
        let (class, word) = match f.doubtful() {
            true => ("first doubtful", "Cause in doubt"),
            false => ("first", "Cause"),
        };
        format!(
            "<div class=\"{class}\"><dt>{word}</dt><dd>{} <small>{} in {}{more}</small></dd></div>\n",
            escape(&f.cause),
            percent(f.probability),
            escape(&f.place)
        )
    })
}

/// Error against noise floor of each quantity, both of single readings.
fn errors(run: &Run) -> String {
    let base = &run.diagnosis.base;
    let of = if base.held_out.is_empty() {
        "all readings"
    } else {
        "held-out readings"
    };
    base.rmse
        .iter()
        .map(|(name, rmse)| {
            let unit = unit_of(name);
            let floor = base.noise_floor.get(name).copied().unwrap_or(0.0);
            let value = format!(
                "{} <small>{of}; noise {}</small>",
                escape(&quantity(*rmse, unit, 2.0)),
                escape(&quantity(floor, unit, 2.0))
            );
            figure(&value, &format!("{} error", capital(&name.replace('-', " "))))
        })
        .collect()
}

/// How many held-out interactions there are, and on how many of them the twin predicts anything.
pub fn held_out(run: &Run) -> (usize, usize) {
    let predicts = |t: &&Trace| t.curves.iter().any(|c| c.predicted.iter().any(|p| p.is_finite()));
    let held_out = || run.traces.iter().filter(|t| t.held_out);
    (held_out().count(), held_out().filter(predicts).count())
}

/// A verdict rests on what was predicted: says so where some held-out interactions were not.
fn reservation(run: &Run) -> String {
    let (all, predicted) = held_out(run);
    if predicted == all || run.diagnosis.base.rmse.is_empty() {
        return String::new();
    }
    if predicted == 0 {
        return " No held-out touch could be predicted: this rests on the touches that were fitted.".to_owned();
    }
    format!(
        " {} of the {all} held-out touches could not be predicted and {} for nothing in this.",
        all - predicted,
        if all - predicted == 1 { "counts" } else { "count" }
    )
}

/// The head of the page.
pub fn section(capture: &Capture, run: &Run) -> String {
    let twin = &run.model.twin;
    let (word, sentence, class) = verdict(run);
    let reservation = reservation(run);
    let links = twin.links().count();
    let joints = twin.joints().filter(|j| j.kind != JointKind::Fixed).count();
    let relations = twin
        .relations
        .iter()
        .filter(|r| r.kind != RelationKind::Separate)
        .count();
    let held_out = capture.held_out().count();
    let mut figures = cause(run);
    figures += &figure(
        &format!(
            "{} <small>of {}</small>",
            twin.bodies.len(),
            count(links, "rigid part", "rigid parts")
        ),
        "Bodies",
    );
    figures.push_str(&figure(&joints.to_string(), "Movable joints"));
    figures.push_str(&figure(&relations.to_string(), "Relations"));
    figures.push_str(&figure(
        &format!("{} <small>{held_out} held out</small>", capture.interactions.len()),
        "Interactions",
    ));
    figures.push_str(&errors(run));
    // As many in a row as make rows of nearly the same length.
    let wide = figures.matches("class=\"first").count();
    let tiles = (figures.matches("<dt>").count() + wide).max(1);
    let columns = tiles.div_ceil(tiles.div_ceil(WIDEST));
    format!(
        "<header>\n<p class=\"over\">palpate · digital twin of a tabletop</p>\n<h1>{}</h1>\n\
         <p class=\"verdict {class}\"><strong>{word}</strong><span>{sentence}{reservation}</span></p>\n\
         <dl class=\"figures\" style=\"--columns: {columns}\">\n{figures}</dl>\n\
         <nav aria-label=\"Sections\"><a href=\"#diagnosis\">Diagnosis</a><a href=\"#view\">Scene</a><a href=\"#estimates\">Estimates</a><a href=\"#joints\">Joints</a>\
         <a href=\"#relations\">Relations</a><a href=\"#interactions\">Interactions</a>{}\
         <a href=\"#notices\">Notices</a></nav>\n</header>\n",
        escape(&twin.name),
        super::engines::link_place()
    )
}
