//! Why engines missed held-out touches, as a part of the page: a table of reasons, and a card with a drawing for each touch.

use std::collections::BTreeMap;

use super::engines::there;
use super::markup::{count, escape, table};
use super::numbers::fixed;
use super::scale::Scale;
use crate::base::Status;
use crate::engines::{Cause, EnginesReport, Judged, Outcome, Reason};

/// Why held-out touches were missed: how many of each reason, then each touch with a drawing.
pub(super) fn reasons(report: &EnginesReport) -> String {
    if report.reasons.is_empty() {
        return String::new();
    }
    let cards = report.reasons.iter().enumerate();
    let cards: String = cards.map(|(k, r)| card(r, report, k)).collect();
    format!(
        "<h3>Why they were missed</h3>\n{}<p class=\"lead\">Each missed touch was played again with everything that is doubtful about it \
         at one standard deviation (sd) to either side: the place and the friction of the tool, and the twin's numbers within their \
         intervals. The drawing shows, from above, where engines end beside where the thing was measured to end (the cross), and \
         how far the doubts together scatter that end (rings of one and two sd). Below the words stands what would make up the miss; \
         shares of more than 100 % are partly undone by others.</p>\n<div class=\"reasons\">\n{cards}</div>\n",
        tally(report)
    )
}

/// A reason a row: how many misses it has, and what it means.
fn tally(report: &EnginesReport) -> String {
    let mut found: BTreeMap<Cause, usize> = BTreeMap::new();
    for judged in report.reasons.iter().flat_map(|r| &r.judged) {
        *found.entry(judged.cause).or_default() += 1;
    }
    let row = |(cause, n): (&Cause, &usize)| {
        let (name, means) = (cause.name(), cause.means());
        format!("<tr><th scope=\"row\">{name}</th><td class=\"num\">{n}</td><td>{means}</td></tr>\n")
    };
    let rows: String = found.iter().map(row).collect();
    table(
        "Reasons of misses",
        "engines causes",
        &["Reason", "Misses", "What that means"],
        &rows,
    )
}

fn card(reason: &Reason, report: &EnginesReport, number: usize) -> String {
    let judged: String = reason.judged.iter().map(|j| verdict(j, reason)).collect();
    let assumed: Vec<String> = reason
        .sources
        .iter()
        .filter(|s| s.status == Status::Assumed && s.position > 1e-4)
        .map(|s| escape(&s.what))
        .collect();
    let assumed = match assumed.is_empty() {
        true => String::new(),
        false => format!(
            "<p class=\"muted\">Never measured, and felt in it: {}.</p>\n",
            assumed.join(", ")
        ),
    };
    format!(
        "<article class=\"reason\"><h4>{}</h4>\n<div class=\"reason-body\">{}<div><div class=\"verdicts\">{judged}</div>\n{assumed}</div></div></article>\n",
        escape(&reason.interaction),
        drawing(reason, report, number)
    )
}

fn verdict(j: &Judged, reason: &Reason) -> String {
    let shares: String = j
        .shares(&reason.sources)
        .iter()
        .map(|s| format!("<li>{}</li>", escape(s)))
        .collect();
    let shares = match shares.is_empty() {
        true => String::new(),
        false => format!("<ul>{shares}</ul>\n"),
    };
    format!(
        "<div><p><b>{}</b> – <b>{}</b>: {}.</p>\n{shares}</div>\n",
        j.engine.name(),
        j.cause.name(),
        escape(&j.words)
    )
}

const SIZE: f64 = 220.0;
const EDGE: f64 = 34.0;

/// The ends from above, world axes, mm from the measured end.
fn drawing(reason: &Reason, report: &EnginesReport, number: usize) -> String {
    let ends: Vec<(usize, [f64; 3])> = there(report)
        .enumerate()
        .filter_map(|(k, e)| {
            let row = e.touches.iter().find(|t| t.interaction == reason.interaction)?;
            match &row.outcome {
                Outcome::Played { missed_by, .. } => Some((k, missed_by.map(|v| 1e3 * v))),
                _ => None,
            }
        })
        .collect();
    let [xx, xy, yy] = reason.spread.map(|v| 1e6 * v);
    let far = ends.iter().flat_map(|(_, e)| [e[0].abs(), e[1].abs()]);
    let reach = far.fold(1.15 * xx.max(yy).sqrt(), f64::max).max(0.2) * 1.15;
    let x = Scale::new(-reach, reach, EDGE, SIZE - 8.0);
    let y = Scale::new(-reach, reach, SIZE - EDGE, 8.0);
    let mut svg = frame(&x, &y);
    for ring in [2.0, 1.0] {
        svg.push_str(&format!(
            "<path class=\"ring\" clip-path=\"url(#ends-{number})\" d=\"{}\"/>",
            ellipse([xx, xy, yy], ring, &x, &y)
        ));
    }
    svg.push_str(&format!(
        "<path class=\"cross\" d=\"M{:.1} {:.1}h12m-6 -6v12\"/>",
        x.at(0.0) - 6.0,
        y.at(0.0)
    ));
    let names: Vec<&str> = there(report).map(|e| e.engine.name()).collect();
    for (k, end) in &ends {
        svg.push_str(&marker(*k, x.at(end[0]), y.at(end[1]), names[*k]));
    }
    let legend: String = ends
        .iter()
        .map(|(k, _)| {
            format!(
                "<li><svg width=\"16\" height=\"14\" aria-hidden=\"true\">{}</svg>{}</li>",
                marker(*k, 8.0, 7.0, names[*k]),
                names[*k]
            )
        })
        .collect();
    let label = format!(
        "Ends of {} in {} beside the measured end, millimetres",
        escape(&reason.interaction),
        count(ends.len(), "engine", "engines")
    );
    format!(
        "<figure class=\"ends\"><svg viewBox=\"0 0 {SIZE} {SIZE}\" role=\"img\" aria-label=\"{label}\"><defs><clipPath id=\"ends-{number}\">\
         <rect x=\"{EDGE}\" y=\"8\" width=\"{wide:.0}\" height=\"{wide:.0}\"/></clipPath></defs>{svg}</svg>\
         <ul class=\"legend\"><li><svg width=\"16\" height=\"14\" aria-hidden=\"true\"><path class=\"cross\" d=\"M2 7h12m-6 -6v12\"/></svg>measured</li>{legend}</ul></figure>",
        wide = SIZE - EDGE - 8.0
    )
}

fn frame(x: &Scale, y: &Scale) -> String {
    let mut out = String::new();
    let (values, decimals) = x.ticks(6.0);
    let (bottom, right) = (SIZE - EDGE, SIZE - 8.0);
    for v in values {
        let (at, level, said) = (x.at(v), y.at(v), fixed(v, decimals));
        out.push_str(&format!(
            "<path class=\"grid\" d=\"M{at:.1} 8V{bottom:.0}M{EDGE} {level:.1}H{right:.0}\"/>\
             <text class=\"x\" x=\"{at:.1}\" y=\"{:.0}\">{said}</text>\
             <text class=\"y\" x=\"{:.0}\" y=\"{:.1}\">{said}</text>",
            bottom + 13.0,
            EDGE - 5.0,
            level + 3.5
        ));
    }
    out.push_str(&format!(
        "<text class=\"x\" x=\"{:.0}\" y=\"{:.0}\">x, mm</text><text class=\"x\" transform=\"translate(10 {:.0}) rotate(-90)\">y, mm</text>",
        0.5 * (EDGE + SIZE),
        SIZE - 4.0,
        0.5 * (SIZE - EDGE)
    ));
    out
}

/// The ring at `size` standard deviations of a covariance xx, xy, yy, mm².
fn ellipse([xx, xy, yy]: [f64; 3], size: f64, x: &Scale, y: &Scale) -> String {
    // The columns of its Cholesky factor turn a circle into the ring.
    let a = xx.max(1e-9).sqrt();
    let b = xy / a;
    let c = (yy - b * b).max(0.0).sqrt();
    let corner = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / 48.0).sin_cos();
        format!("{:.1} {:.1}", x.at(size * a * cos), y.at(size * (b * cos + c * sin)))
    };
    let ring: Vec<String> = (0..48).map(corner).collect();
    format!("M{}Z", ring.join("L"))
}

/// An engine's mark: another shape for each.
fn marker(k: usize, x: f64, y: f64, name: &str) -> String {
    let shape = match k % 4 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\"/>"),
        1 => format!("<path d=\"M{:.1} {:.1}h9v9h-9z\"/>", x - 4.5, y - 4.5),
        2 => format!("<path d=\"M{x:.1} {:.1}l6 6l-6 6l-6 -6z\"/>", y - 6.0),
        _ => format!("<path d=\"M{x:.1} {:.1}l6 10h-12z\"/>", y - 6.0),
    };
    format!("<g class=\"end e{}\"><title>{name}</title>{shape}</g>", k % 4)
}
