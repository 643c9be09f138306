//! Every interaction: what was measured beside what the twin predicts.

use super::markup::{escape, section as framed};
use super::plots::{figure, phase_name, span};
use super::scale::Scale;
use crate::capture::{Capture, PhaseKind, Segmented};
use crate::pipeline::Run;
use crate::stages::diagnosis::Trace;

/// One foldable block per interaction, those that were held out unfolded.
pub fn section(capture: &Capture, run: &Run) -> String {
    if run.traces.is_empty() && run.snapshots.is_some() {
        return String::new();
    }
    if run.traces.is_empty() {
        let said =
            "<p class=\"muted\">Nothing was compared: the diagnosis was not run, or there was no interaction.</p>\n";
        return framed("interactions", "Interactions", "", said);
    }
    let blocks: String = run.traces.iter().map(|t| block(capture, run, t)).collect();
    let lead = "Measured (dots) and predicted (line, with a band of two standard deviations of the sensor). \
        <b>Held-out</b> touches were never used to fit: they are the test, and stand open.";
    framed("interactions", "Interactions", lead, &format!("{LEGEND}{blocks}"))
}

const LEGEND: &str = "<ul class=\"legend\" aria-label=\"Legend of the plots\">\
    <li><svg width=\"34\" height=\"12\" aria-hidden=\"true\"><path class=\"measured\" d=\"M4 7h0M12 4h0M20 7h0M28 5h0\"/></svg>measured</li>\
    <li><svg width=\"34\" height=\"12\" aria-hidden=\"true\"><path class=\"band\" d=\"M2 2h30v8h-30z\"/><path class=\"predicted\" d=\"M2 6h30\"/></svg>predicted ± 2 sd</li>\
    <li><svg width=\"18\" height=\"12\" aria-hidden=\"true\" class=\"key\"><g class=\"phase approach\"><rect width=\"18\" height=\"12\"/><rect class=\"edge\" width=\"18\" height=\"4\"/></g></svg>approach</li>\
    <li><svg width=\"18\" height=\"12\" aria-hidden=\"true\" class=\"key\"><g class=\"phase stick\"><rect width=\"18\" height=\"12\"/><rect class=\"edge\" width=\"18\" height=\"4\"/></g></svg>stick</li>\
    <li><svg width=\"18\" height=\"12\" aria-hidden=\"true\" class=\"key\"><g class=\"phase slide\"><rect width=\"18\" height=\"12\"/><rect class=\"edge\" width=\"18\" height=\"4\"/></g></svg>slide</li>\
    <li><svg width=\"18\" height=\"12\" aria-hidden=\"true\" class=\"key\"><g class=\"phase release\"><rect width=\"18\" height=\"12\"/><rect class=\"edge\" width=\"18\" height=\"4\"/></g></svg>release</li></ul>\n";

fn block(capture: &Capture, run: &Run, trace: &Trace) -> String {
    let interaction = capture.interactions.iter().find(|i| i.name == trace.interaction);
    let segmented = run.segmented.iter().find(|s| s.interaction == trace.interaction);
    let open = if trace.held_out { " open" } else { "" };
    let kind = interaction.map_or("", |i| i.kind.name());
    let target = interaction
        .and_then(|i| i.target.as_deref())
        .map(|t| format!(" <span class=\"muted\">of {}</span>", escape(t)))
        .unwrap_or_default();
    let held = if trace.held_out {
        "<span class=\"tag held\">held out</span>"
    } else {
        ""
    };
    let remark = trace
        .remark
        .as_ref()
        .map(|r| format!("<p class=\"remark\">{}</p>\n", escape(r)))
        .unwrap_or_default();
    let name = escape(&trace.interaction);
    let start = start(segmented, trace);
    let plots: String = trace.curves.iter().map(|c| figure(c, segmented, start)).collect();
    let plots = if plots.is_empty() {
        "<p class=\"muted\">No curve.</p>\n".to_owned()
    } else {
        format!("<div class=\"plots\">\n{plots}</div>\n")
    };
    format!(
        "<details class=\"interaction\"{open} data-touch=\"{name}\">\n<summary><span class=\"title\">{name}</span> <span class=\"tag kind\">{kind}</span>{target}{held}{}</summary>\n\
         {remark}{plots}</details>\n",
        strip(segmented)
    )
}

/// What the axis of time counts from.
fn start(segmented: Option<&Segmented>, trace: &Trace) -> f64 {
    let first = trace
        .curves
        .iter()
        .filter_map(span)
        .map(|(a, _)| a)
        .fold(f64::INFINITY, f64::min);
    let phase = segmented
        .and_then(|s| s.phases.first())
        .map_or(f64::INFINITY, |p| p.start);
    let start = first.min(phase);
    if start.is_finite() { start } else { 0.0 }
}

/// The phases as a strip.
fn strip(segmented: Option<&Segmented>) -> String {
    let Some((phases, first, last)) = segmented.and_then(|s| Some((&s.phases, s.phases.first()?, s.phases.last()?)))
    else {
        return String::new();
    };
    let x = Scale::new(first.start, last.end, 0.0, 120.0);
    let parts: String = phases
        .iter()
        .filter(|p| p.kind != PhaseKind::Rest && p.end > p.start)
        .map(|p| {
            let (from, to) = (x.clamped(p.start), x.clamped(p.end));
            let name = phase_name(p.kind);
            format!(
                "<g class=\"phase {name}\"><rect class=\"edge\" x=\"{from:.1}\" width=\"{:.1}\" height=\"8\"/></g>",
                (to - from).max(0.8)
            )
        })
        .collect();
    format!(
        "<svg class=\"strip\" viewBox=\"0 0 120 8\" aria-hidden=\"true\"><rect class=\"back\" width=\"120\" height=\"8\"/>{parts}</svg>"
    )
}
