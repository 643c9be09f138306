//! What engines made of the capture's own touches, and why held-out ones were missed: put into a page that is there already.

use super::markup::{count, escape, section as framed, table};
use super::numbers::fixed;
use super::reasons::reasons;
use crate::engines::{EngineReport, EnginesReport, Outcome, RestRow, TouchRow};

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

pub(super) fn there(report: &EnginesReport) -> impl Iterator<Item = &EngineReport> {
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
    let one = held.iter().all(|t| t.link == first_link(&held));
    let row = |t: &&TouchRow| {
        let part = match one {
            true => String::new(),
            false => format!("<td>{}</td>", escape(&t.link)),
        };
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
            "<tr><th scope=\"row\">{}</th>{part}<td class=\"num\">{} mm{turned}</td>{cells}</tr>\n",
            escape(&t.interaction),
            fixed(1e3 * t.travel, 1)
        )
    };
    let rows: String = held.iter().map(row).collect();
    let part = if one { None } else { Some("Part") };
    let mut head: Vec<&str> = ["Held-out touch"]
        .into_iter()
        .chain(part)
        .chain(["Measured to go"])
        .collect();
    head.extend(engines.iter().map(|e| e.engine.name()));
    format!(
        "<h3>Off by</h3>\n{}",
        table("Held-out touches in engines", "engines", &head, &rows)
    )
}

fn first_link<'a>(rows: &[&'a TouchRow]) -> &'a str {
    rows.first().map_or("", |t| &t.link)
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
