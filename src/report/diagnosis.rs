//! What the twin still gets wrong, and what to measure next: what is read in a minute first, all else folded below it.

use super::causes::{cards, left, profile_of, ranked};
use super::header::{capital, unit_of};
use super::markup::{count, escape, section as framed, table};
use super::numbers::{fixed, quantity};
use super::profiles::{budgets, pictures};
use crate::pipeline::Run;
use crate::twin::{BaseFit, Budget, Diagnosis, Evidence, Experiment, Profile};

/// Below this p-value a residual is called notable.
const NOTABLE: f64 = 0.01;
const MOST_NOTABLE: usize = 8;
/// Experiments and budgets that the first look has room for.
const NEXT: usize = 2;
const PARTS: usize = 3;
const BUDGETS: usize = 1;

/// Ranked causes with their gain, where something is left, what to do next and of what the error is made, beside the pictures
/// that gave the first cause away; then all of it in full.
pub fn section(run: &Run) -> String {
    let d = &run.diagnosis;
    let pictured = d.findings.iter().find_map(|f| profile_of(f, &d.profiles));
    // Several causes take the room of the second experiment.
    let most = if d.findings.len() > 1 { 1 } else { NEXT };
    let next = d.experiments.get(..most).unwrap_or(&d.experiments);
    let content = format!(
        "<div class=\"look\">\n<div>\n{}{}{}{}</div>\n<div>\n{}</div>\n</div>\n{}",
        ranked(d),
        left(&d.missed, &d.left),
        experiments("What to do next", next, PARTS),
        budgets(d.budgets.get(..BUDGETS).unwrap_or(&d.budgets)),
        pictured.map_or_else(|| errors(&d.base), pictures),
        in_full(d, pictured)
    );
    framed("diagnosis", "Diagnosis", "", &content)
}

/// What the first look has no room for.
fn in_full(d: &Diagnosis, pictured: Option<&Profile>) -> String {
    let folded = |summary: &str, content: &str| {
        format!("<details class=\"arcs\"><summary>{summary}</summary>\n{content}</details>\n")
    };
    let mut out = String::new();
    if !d.findings.is_empty() {
        let summary = format!("{} in full", capital(&count(d.findings.len(), "finding", "findings")));
        out += &folded(&summary, &cards(&d.findings, &d.profiles, pictured));
    }
    let more: &[Budget] = d.budgets.get(BUDGETS..).unwrap_or(&[]);
    if !more.is_empty() {
        out += &folded("Errors of the other kinds of touches, in parts", &budgets(more));
    }
    if d.experiments.len() > 1 {
        let summary = format!("All {} experiments", d.experiments.len());
        out += &folded(&summary, &experiments("", &d.experiments, usize::MAX));
    }
    if !d.base.rmse.is_empty() {
        let bars = if pictured.is_some() {
            errors(&d.base)
        } else {
            String::new()
        };
        out += &folded(
            "Errors of the plain twin by quantity",
            &format!("<p class=\"lead\">{}</p>\n{bars}", lead(&d.base)),
        );
    }
    out + &tests(&d.base)
}

fn lead(base: &BaseFit) -> String {
    let judged = if base.held_out.is_empty() {
        "no interaction was held out, so on the fitted ones".to_owned()
    } else {
        let names: Vec<String> = base.held_out.iter().map(|n| escape(n)).collect();
        format!("on {} held-out interactions ({})", names.len(), names.join(", "))
    };
    format!(
        "Root mean square error of single readings by the plain twin, {judged}, beside what the noise of a single reading alone \
         would leave. Of the square of what was read, what is above the noise is at most {} %.",
        fixed(100.0 * base.unexplained, 1)
    )
}

/// Error and floor as two bars per quantity.
fn errors(base: &BaseFit) -> String {
    let rows: String = base
        .rmse
        .iter()
        .map(|(name, rmse)| {
            let unit = unit_of(name);
            let floor = base.noise_floor.get(name).copied().unwrap_or(0.0);
            let most = rmse.max(floor).max(f64::MIN_POSITIVE);
            let bar = |class: &str, word: &str, value: f64| {
                format!(
                    "<div class=\"pair\"><span>{word}</span><span class=\"bar {class}\"><i style=\"width:{:.1}%\"></i></span>\
                     <span class=\"num\">{}</span></div>",
                    (100.0 * value / most).clamp(0.0, 100.0),
                    escape(&quantity(value, unit, 2.0))
                )
            };
            format!(
                "<div class=\"error\"><h3>{}</h3>{}{}</div>\n",
                capital(&name.replace('-', " ")),
                bar("rmse", "error", *rmse),
                bar("floor", "noise", floor)
            )
        })
        .collect();
    format!("<div class=\"errors\">\n{rows}</div>\n")
}

/// The residual tests: the notable ones in words, all of them folded.
fn tests(base: &BaseFit) -> String {
    if base.tests.is_empty() {
        return String::new();
    }
    let held_out = |e: &Evidence| base.held_out.iter().any(|n| e.residual.ends_with(n.as_str()));
    let mut notable: Vec<&Evidence> = base.tests.iter().filter(|e| e.p_value < NOTABLE).collect();
    // Held-out ones first, then the strongest; the order of the file settles ties.
    notable.sort_by(|a, b| held_out(b).cmp(&held_out(a)).then(b.statistic.total_cmp(&a.statistic)));
    let rest = notable.len().saturating_sub(MOST_NOTABLE);
    let items: String = notable
        .iter()
        .take(MOST_NOTABLE)
        .map(|e| {
            let tag = if held_out(e) {
                "<span class=\"tag held\">held out</span> "
            } else {
                ""
            };
            format!("<li>{tag}{}</li>\n", escape(&e.words))
        })
        .collect();
    let more = if rest > 0 {
        format!("<p class=\"muted\">And {rest} more in the table below.</p>\n")
    } else {
        String::new()
    };
    let rows: String = base.tests.iter().map(test_row).collect();
    let head = ["Residual", "Test", "Statistic", "p-value", "In words"];
    format!(
        "<details class=\"arcs\"><summary>Residuals: {} of {} look like noise</summary>\n<p>One that does not is not yet an error \
         that matters: the errors say how large it is.</p>\n<ul class=\"residuals\">\n{items}</ul>\n{more}{}</details>\n",
        base.tests.len() - notable.len(),
        base.tests.len(),
        table("Residual tests", "tests", &head, &rows)
    )
}

fn test_row(e: &Evidence) -> String {
    let p = if e.p_value < 1e-4 {
        "&lt; 0.0001".to_owned()
    } else {
        fixed(e.p_value, 4)
    };
    format!(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{p}</td><td>{}</td></tr>\n",
        escape(&e.residual),
        escape(&e.test),
        fixed(e.statistic, 1),
        escape(&e.words)
    )
}

/// Experiments with what each would part, `most` of it.
fn experiments(heading: &str, experiments: &[Experiment], most: usize) -> String {
    if experiments.is_empty() {
        return String::new();
    }
    let items: String = experiments
        .iter()
        .map(|e| {
            let bits = e
                .bits
                .map(|b| format!(" <span class=\"tag\">{} bits</span>", fixed(b, 2)))
                .unwrap_or_default();
            let shown = e.parts.len().min(most);
            let mut parts: Vec<String> = e.parts[..shown].iter().map(|p| escape(p)).collect();
            if shown < e.parts.len() {
                parts.push(format!("{} more", e.parts.len() - shown));
            }
            let parts = if parts.is_empty() {
                String::new()
            } else {
                let does = if e.bits.is_some() { "tells apart" } else { "would show" };
                format!(" <span class=\"muted\">{does} {}</span>", parts.join(", "))
            };
            format!("<li>{}{bits}{parts}</li>\n", escape(&e.words))
        })
        .collect();
    let heading = if heading.is_empty() {
        String::new()
    } else {
        format!("<h3>{heading}</h3>\n")
    };
    format!("{heading}<ol>\n{items}</ol>\n")
}
