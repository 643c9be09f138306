//! What the twin still gets wrong, and what to measure next.

use super::header::{capital, unit_of};
use super::markup::{count, escape, percent, section as framed, table};
use super::numbers::{fixed, quantity};
use super::profiles::{budgets, pictures};
use super::rows::{COLUMNS, scalar};
use crate::pipeline::Run;
use crate::twin::{BaseFit, CauseOdds, Evidence, Experiment, Finding, Profile};

/// Below this p-value a residual is called notable.
const NOTABLE: f64 = 0.01;
const MOST_NOTABLE: usize = 8;

/// Errors, findings with what gave them away, of what the errors are made, experiments, residual tests.
pub fn section(run: &Run) -> String {
    let d = &run.diagnosis;
    let mut content = errors(&d.base);
    content.push_str(&findings(&d.findings, &d.profiles));
    content.push_str(&budgets(&d.budgets));
    content.push_str(&experiments(&d.experiments));
    content.push_str(&tests(&d.base));
    framed("diagnosis", "Diagnosis", &lead(&d.base), &content)
}

fn lead(base: &BaseFit) -> String {
    if base.rmse.is_empty() {
        return "No prediction could be compared with a measurement.".to_owned();
    }
    let judged = if base.held_out.is_empty() {
        "no interaction was held out, so on the fitted ones".to_owned()
    } else {
        let names: Vec<String> = base.held_out.iter().map(|n| escape(n)).collect();
        format!("on {} held-out interactions ({})", names.len(), names.join(", "))
    };
    format!(
        "Root mean square error of what the twin predicts, {judged}, beside what the noise of the sensors alone would leave. \
         At most {} % of the variance of any quantity is left unexplained.",
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

fn findings(findings: &[Finding], profiles: &[Profile]) -> String {
    if findings.is_empty() {
        return "<p>No named effect was added to the plain model.</p>\n".to_owned();
    }
    let card = |f: &Finding| finding(f, profiles.iter().find(|p| p.cause == f.cause && p.place == f.place));
    let cards: String = findings.iter().map(card).collect();
    format!("<h3>Findings</h3>\n<div class=\"cards\">\n{cards}</div>\n")
}

fn finding(f: &Finding, profile: Option<&Profile>) -> String {
    let gain = &f.gain;
    let parameters: String = f.parameters.iter().map(|(name, e)| scalar(&escape(name), e)).collect();
    let parameters = if parameters.is_empty() {
        String::new()
    } else {
        table(
            &format!("Parameters of {}", f.cause),
            "estimates",
            &COLUMNS,
            &parameters,
        )
    };
    let evidence: String = f
        .evidence
        .iter()
        .map(|e| format!("<li>{}</li>", escape(&e.words)))
        .collect();
    let pictures = profile.map_or_else(String::new, pictures);
    let judges = if gain.held_out.is_empty() {
        "the interactions that were fitted, since none was held out"
    } else {
        "interactions that it was not fitted to"
    };
    format!(
        "<article class=\"card\"><h3>{} <small>{}</small></h3>\n<p>Probability {}{}. It lowers the error of {} from {} to {} on \
         {judges}: {} of the error above the noise goes away.</p>\n<ul>{evidence}</ul>\n{pictures}{parameters}</article>\n",
        escape(&f.cause),
        escape(&f.place),
        percent(f.probability),
        odds(&f.alternatives),
        escape(&gain.quantity),
        escape(&quantity(gain.rmse_before, &gain.unit, 2.0)),
        escape(&quantity(gain.rmse_after, &gain.unit, 2.0)),
        percent(gain.reduction)
    )
}

fn odds(alternatives: &[CauseOdds]) -> String {
    if alternatives.is_empty() {
        return String::new();
    }
    let each: Vec<String> = alternatives
        .iter()
        .map(|a| format!("{} ({})", escape(&a.cause), percent(a.probability)))
        .collect();
    format!("; not ruled out: {}", each.join(", "))
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
        "<h3>Residuals</h3>\n<p>{} of {} look like noise. A residual that does not is not yet an error that matters: the bars above \
         say how large it is.</p>\n<ul class=\"residuals\">\n{items}</ul>\n{more}\
         <details class=\"arcs\"><summary>All {} residual tests</summary>\n{}</details>\n",
        base.tests.len() - notable.len(),
        count(base.tests.len(), "residual", "residuals"),
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

fn experiments(experiments: &[Experiment]) -> String {
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
            let parts: Vec<String> = e.parts.iter().map(|p| escape(p)).collect();
            let parts = if parts.is_empty() {
                String::new()
            } else {
                let does = if e.bits.is_some() { "tells apart" } else { "would show" };
                format!(" <span class=\"muted\">{does} {}</span>", parts.join(", "))
            };
            format!("<li>{}{bits}{parts}</li>\n", escape(&e.words))
        })
        .collect();
    format!("<h3>What to measure next</h3>\n<ol>\n{items}</ol>\n")
}
