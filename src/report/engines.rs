//! What engines made of the capture's own touches, and why held-out ones were missed: put into a page that is there already.

use super::markup::{count, escape, section as framed, table};
use super::numbers::fixed;
use super::scale::Scale;
use crate::base::Status;
use crate::engines::{EngineReport, EnginesReport, Judged, Outcome, Reason, RestRow, TouchRow};

/// What stands on either side of the section in a page.
const BEGIN: &str = "<!-- engines -->";
const END: &str = "<!-- /engines -->";
/// The same of its link among the links to sections.
const LINK_BEGIN: &str = "<!-- engines-link -->";
const LINK_END: &str = "<!-- /engines-link -->";

/// Where the section goes, empty until engines were asked.
pub fn place() -> String {
    format!("{BEGIN}{END}\n")
}

/// Where its link goes.
pub fn link_place() -> String {
    format!("{LINK_BEGIN}{LINK_END}")
}

/// A page with what engines made of the capture in it, in the place of what it said of that before; nothing where the page has
/// no place for it.
pub fn with_engines(page: &str, report: &EnginesReport) -> Option<String> {
    let page = filled(page, LINK_BEGIN, LINK_END, "<a href=\"#engines\">Engines</a>")?;
    filled(&page, BEGIN, END, &section(report))
}

fn filled(page: &str, begin: &str, end: &str, content: &str) -> Option<String> {
    let from = page.find(begin)? + begin.len();
    let to = from + page[from..].find(end)?;
    Some(format!("{}{content}{}", &page[..from], &page[to..]))
}

fn section(report: &EnginesReport) -> String {
    let lead = "The capture's own touches, played in physics engines with the exported twin, beside what was measured. A touch is \
        <b>near</b> where the thing ends within 10 % of its travel (or 0.2 mm) and 5° of where it was measured to; a press where \
        the force is within 10 % of its peak. Only touches that were never fitted are judged.";
    let content = format!(
        "{}{}{}{}",
        summary(report),
        touches(report),
        reasons(report),
        skipped(report)
    );
    framed("engines", "Engines beside reality", lead, &content)
}

fn there(report: &EnginesReport) -> impl Iterator<Item = &EngineReport> {
    report.engines.iter().filter(|e| e.silent.is_none())
}

/// An engine a row: how many are near, and what rests.
fn summary(report: &EnginesReport) -> String {
    let row = |e: &EngineReport| {
        let name = format!("{} {}", e.engine.name(), escape(&e.version));
        if let Some(why) = &e.silent {
            return format!(
                "<tr><th scope=\"row\">{name}</th><td colspan=\"3\">{}</td></tr>\n",
                escape(why)
            );
        }
        let of = |(near, all): (usize, usize)| match all {
            0 => "–".to_owned(),
            _ => format!("{near} of {all}"),
        };
        format!(
            "<tr><th scope=\"row\">{name}</th><td class=\"num\">{}</td><td class=\"num\">{}</td><td>{}</td></tr>\n",
            of(e.count(|t| t.held_out)),
            of(e.count(|_| true)),
            rest(&e.rest)
        )
    };
    let rows: String = report.engines.iter().map(row).collect();
    let rested = format!("Drift in {} s of rest", fixed(report.rest_seconds, 0));
    table(
        "Engines",
        "engines",
        &["Engine", "Held-out touches near", "All touches near", &rested],
        &rows,
    )
}

fn rest(rows: &[RestRow]) -> String {
    let restless: Vec<&RestRow> = rows.iter().filter(|r| !r.is_calm()).collect();
    if restless.is_empty() {
        let most = rows.iter().map(|r| r.drift).fold(0.0, f64::max);
        let turn = rows.iter().map(|r| r.turn).fold(0.0, f64::max);
        return format!(
            "<span class=\"near\">all rest</span> (at most {} mm and {}°)",
            fixed(1e3 * most, 3),
            fixed(turn.to_degrees(), 2)
        );
    }
    let said = restless.iter().map(|r| {
        let (mm, turn) = (fixed(1e3 * r.drift, 1), fixed(r.turn.to_degrees(), 1));
        format!("{} {mm} mm, {turn}°", escape(&r.part))
    });
    format!(
        "<span class=\"far\">{} restless</span>: {}",
        restless.len(),
        said.collect::<Vec<_>>().join("; ")
    )
}

/// A held-out touch a row, an engine a column.
fn touches(report: &EnginesReport) -> String {
    let engines: Vec<&EngineReport> = there(report).collect();
    let Some(first) = engines.first() else {
        return String::new();
    };
    let held: Vec<&TouchRow> = first.touches.iter().filter(|t| t.held_out).collect();
    if held.is_empty() {
        return "<p class=\"muted\">No touch was held out: nothing judges.</p>\n".to_owned();
    }
    let row = |t: &&TouchRow| {
        let cells: String = engines
            .iter()
            .map(|e| {
                let mine = e.touches.iter().find(|o| o.interaction == t.interaction);
                format!("<td>{}</td>", mine.map_or("–".to_owned(), cell))
            })
            .collect();
        let turned = t
            .turned
            .map_or(String::new(), |a| format!(", {}°", fixed(a.to_degrees(), 1)));
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"num\">{} mm{turned}</td>{cells}</tr>\n",
            escape(&t.interaction),
            escape(&t.link),
            fixed(1e3 * t.travel, 1)
        )
    };
    let rows: String = held.iter().map(row).collect();
    let mut head = vec!["Held-out touch", "Part", "Measured to go"];
    head.extend(engines.iter().map(|e| e.engine.name()));
    format!(
        "<h3>Off by</h3>\n{}",
        table("Held-out touches in engines", "engines", &head, &rows)
    )
}

fn cell(t: &TouchRow) -> String {
    let mark = match t.within() {
        true => "<span class=\"near\">near</span>",
        false => "<span class=\"far\">far</span>",
    };
    match &t.outcome {
        Outcome::NotPlayed(why) => format!("<span class=\"muted\">{}</span>", escape(why)),
        Outcome::Pressed {
            force_rms, force_peak, ..
        } => format!(
            "{mark} {} N of {} N ({} %)",
            fixed(*force_rms, 2),
            fixed(*force_peak, 1),
            fixed(100.0 * force_rms / force_peak, 0)
        ),
        Outcome::Played {
            position_error,
            relative_error,
            turn_error,
            ..
        } => {
            let turn = turn_error.map_or(String::new(), |a| format!(", {}°", fixed(a.to_degrees(), 1)));
            format!(
                "{mark} {} mm ({} %){turn}",
                fixed(1e3 * position_error, 2),
                fixed(100.0 * relative_error, 0)
            )
        }
    }
}

/// Why held-out touches were missed.
fn reasons(report: &EnginesReport) -> String {
    if report.reasons.is_empty() {
        return String::new();
    }
    let cards = report.reasons.iter().enumerate();
    let cards: String = cards.map(|(k, r)| card(r, report, k)).collect();
    format!(
        "<h3>Why they were missed</h3>\n<p class=\"lead\">Each missed touch was played again with everything that is doubtful about it \
         at one standard deviation to either side: the place and the friction of the tool, and the twin's numbers within their \
         intervals. The drawing shows, from above, where engines end beside where the thing was measured to end (the cross), and \
         how far the doubts together scatter that end (rings of one and two standard deviations).</p>\n<div class=\"reasons\">\n{cards}</div>\n"
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
        "<article class=\"reason\"><h4>{}</h4>\n<div class=\"reason-body\">{}<div>{judged}{assumed}</div></div></article>\n",
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
        "<p><b>{}</b> – {}: {}.</p>\n{shares}",
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
    let (values, decimals) = x.ticks(4.0);
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

fn skipped(report: &EnginesReport) -> String {
    if report.skipped.is_empty() {
        return String::new();
    }
    let rows: String = report
        .skipped
        .iter()
        .map(|s| format!("<li>{}: {}</li>", escape(&s.interaction), escape(&s.why)))
        .collect();
    format!(
        "<details class=\"more\"><summary>{} not played</summary><ul>{rows}</ul></details>\n",
        count(report.skipped.len(), "interaction", "interactions")
    )
}
