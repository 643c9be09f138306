//! Named causes: ranked with their odds and what they gained, for the first look, and as cards with all that is known of them.

use super::markup::{count, escape, percent, table};
use super::numbers::{fixed, quantity};
use super::profiles::pictures;
use super::rows::{COLUMNS, scalar};
use crate::twin::{Diagnosis, Evidence, Finding, Gain, Miss, Profile};

/// Findings, and other causes of each, that the first look has room for.
const FIRST: usize = 3;
const OTHERS: usize = 3;
/// Sentences of evidence there.
const SENTENCES: usize = 2;

/// The profile of a finding.
pub fn profile_of<'a>(f: &Finding, profiles: &'a [Profile]) -> Option<&'a Profile> {
    profiles.iter().find(|p| p.cause == f.cause && p.place == f.place)
}

/// What is named, each with the causes that do as well, ranked by their odds.
pub fn ranked(d: &Diagnosis) -> String {
    if d.findings.is_empty() {
        let words = if d.compares_nothing() {
            "Nothing was compared, so no cause was looked for."
        } else {
            "No named effect was added to the plain model."
        };
        return format!("<p>{words}</p>\n");
    }
    let first: String = d.findings.iter().take(FIRST).map(cause).collect();
    let more = d.findings.len().saturating_sub(FIRST);
    let more = if more > 0 {
        format!("<p class=\"muted\">And {more} more below.</p>\n")
    } else {
        String::new()
    };
    format!("{first}{more}")
}

fn cause(f: &Finding) -> String {
    let own = std::iter::once((f.cause.as_str(), f.place.as_str(), f.probability));
    let others = f.alternatives.iter().map(|a| (a.cause.as_str(), "", a.probability));
    let mut all: Vec<(&str, &str, f64)> = own.chain(others).collect();
    all.sort_by(|a, b| b.2.total_cmp(&a.2));
    let row = |(name, place, odds): &(&str, &str, f64)| {
        format!(
            "<li><span>{} <small>{}</small></span><span class=\"bar\"><i style=\"width:{:.1}%\"></i></span><span class=\"num\">{}</span></li>\n",
            escape(name),
            escape(place),
            (100.0 * odds).clamp(0.0, 100.0),
            percent(*odds)
        )
    };
    let rows: String = all.iter().take(1 + OTHERS).map(row).collect();
    let evidence: String = f
        .evidence
        .iter()
        .take(SENTENCES)
        .map(|e| format!("<li>{}</li>", escape(&e.words)))
        .collect();
    format!(
        "<div class=\"cause\"><ul class=\"ranked\">\n{rows}</ul>\n{}<ul class=\"why\">{evidence}</ul></div>\n",
        gained(&f.gain)
    )
}

/// What naming a cause did to the error, on what; nothing where no error was measured.
fn gained(gain: &Gain) -> String {
    if gain.rmse_before <= 0.0 {
        return String::new();
    }
    let of = |x: f64| escape(&quantity(x, &gain.unit, 2.0));
    let on = match gain.held_out.len() {
        0 => "the fitted touches, since none was held out".to_owned(),
        n => format!("{} that it was not fitted to", count(n, "touch", "touches")),
    };
    format!(
        "<p class=\"gain\">Error of {} <b>{} → {}</b> on {on}{}: {} of what is above the noise goes away.</p>\n",
        escape(&gain.quantity.replace('-', " ")),
        of(gain.rmse_before),
        of(gain.rmse_after),
        aside(&gain.of, gain.noise.map(of)),
        percent(gain.reduction)
    )
}

/// What an error is of, and what the noise alone would leave of the same, in brackets.
pub fn aside(of: &str, noise: Option<String>) -> String {
    let of = (!of.is_empty()).then(|| escape(of));
    let noise = noise.map(|n| format!("noise of the same {n}"));
    let said: Vec<String> = of.into_iter().chain(noise).collect();
    if said.is_empty() {
        return String::new();
    }
    format!(" ({})", said.join("; "))
}

/// Where something is left without a name, and what that depends on.
pub fn left(missed: &[Miss], depends: &[Evidence]) -> String {
    if missed.is_empty() && depends.is_empty() {
        return String::new();
    }
    let miss = |m: &Miss| {
        let held = if m.held_out {
            " <span class=\"tag held\">held out</span>"
        } else {
            ""
        };
        let times = m.noise.filter(|n| *n > 0.0).map(|n| m.rmse / n);
        let times = times.map_or_else(String::new, |t| format!(", {} times the noise", fixed(t, 1)));
        format!(
            "<li>{}{held}: {} {} rms off{times}{}</li>\n",
            escape(&m.interaction),
            escape(&m.quantity.replace('-', " ")),
            escape(&quantity(m.rmse, &m.unit, 2.0)),
            aside(&m.of, None)
        )
    };
    let worst: String = missed.iter().map(miss).collect();
    let on: String = depends
        .iter()
        .map(|e| format!("<li>{}</li>\n", escape(&e.words)))
        .collect();
    format!("<h3>What has no name yet</h3>\n<ul class=\"why\">\n{worst}{on}</ul>\n")
}

/// All findings in full; the pictures of the first stand elsewhere.
pub fn cards(findings: &[Finding], profiles: &[Profile], pictured: Option<&Profile>) -> String {
    let card = |f: &Finding| {
        let own = profile_of(f, profiles);
        card(f, own.filter(|p| pictured.is_none_or(|seen| !std::ptr::eq(*p, seen))))
    };
    let cards: String = findings.iter().map(card).collect();
    format!("<div class=\"cards\">\n{cards}</div>\n")
}

fn card(f: &Finding, profile: Option<&Profile>) -> String {
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
    let others: Vec<String> = f
        .alternatives
        .iter()
        .map(|a| format!("{} ({})", escape(&a.cause), percent(a.probability)))
        .collect();
    let others = if others.is_empty() {
        String::new()
    } else {
        format!("; not ruled out: {}", others.join(", "))
    };
    format!(
        "<article class=\"card\"><h3>{} <small>{}</small></h3>\n<p>Probability {}{others}.</p>\n{}<ul>{evidence}</ul>\n{}{parameters}</article>\n",
        escape(&f.cause),
        escape(&f.place),
        percent(f.probability),
        gained(&f.gain),
        profile.map_or_else(String::new, pictures)
    )
}
