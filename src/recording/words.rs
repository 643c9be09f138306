//! What is said: the estimates, the graph, the findings, the doubts, and what happened when.

use re_sdk_types::archetypes::{GraphEdges, GraphNodes, TextDocument, TextLog};
use re_sdk_types::components::TextLogLevel;
use serde_json::Value;

use super::clock::{Span, view_moment};
use super::stream::{Stream, failed};
use crate::base::{Result, Severity};
use crate::capture::{Capture, Segmented};
use crate::pipeline::Run;
use crate::stages::diagnosis::Trace;
use crate::twin::{Finding, Relation, RelationKind, SUPPORT, Twin};

const HOW_TO_READ: &str = "\n\nTimelines: `played` shows the views and then the touches one after another; `capture_clock` is the \
capture's own, on which touches may overlap. `world/measured` and `world/predicted` (orange, while a touch lasts): what was tracked, and \
what the twin has happen. `world/touch/force`: what the tool exerts, without its tare. `curves`: what the report plots. World frame, m, N, s.\n";

/// Everything in words.
pub(super) fn log(stream: &mut Stream, capture: &Capture, run: &Run, spans: &[Option<Span>]) -> Result<()> {
    let twin = &run.model.twin;
    let estimates = TextDocument::from_markdown(estimates(twin)?);
    stream.still(&["estimates"], &estimates)?;
    let (nodes, edges) = graph(twin);
    stream.still(&["graph"], &nodes)?;
    stream.still(&["graph"], &edges)?;
    findings(stream, run)?;
    for (interaction, span) in capture.interactions.iter().zip(spans) {
        let Some(span) = span else { continue };
        let trace = run.traces.iter().find(|t| t.interaction == interaction.name);
        let said = begin(
            interaction.kind.name(),
            &interaction.name,
            interaction.target.as_deref(),
            trace,
        );
        stream.at(&["log"], span.at(span.start), &line(said, TextLogLevel::INFO))?;
        let segmented = run.segmented.iter().find(|s| s.interaction == interaction.name);
        phases(stream, span, segmented)?;
    }
    Ok(())
}

fn line(text: String, level: &str) -> TextLog {
    TextLog::new(text).with_level(level)
}

fn begin(kind: &str, name: &str, target: Option<&str>, trace: Option<&Trace>) -> String {
    let target = target.map_or_else(String::new, |t| format!(" of {t}"));
    let held = trace.filter(|t| t.held_out).map_or("", |_| ", held out");
    let remark = trace.and_then(|t| t.remark.as_ref());
    let remark = remark.map_or_else(String::new, |r| format!(": {r}"));
    format!("{name}: {kind}{target}{held}{remark}")
}

fn phases(stream: &mut Stream, span: &Span, segmented: Option<&Segmented>) -> Result<()> {
    for phase in segmented.iter().flat_map(|s| &s.phases).filter(|p| span.holds(p.start)) {
        let kind = format!("{:?}", phase.kind).to_lowercase();
        let moving = if phase.moving.is_empty() {
            String::new()
        } else {
            format!("; moving: {}", phase.moving.join(", "))
        };
        let text = line(format!("{kind}{moving}"), TextLogLevel::DEBUG);
        stream.at(&["log"], span.at(phase.start), &text)?;
    }
    Ok(())
}

/// The verdict, each finding, what to measure next, and the doubts.
fn findings(stream: &mut Stream, run: &Run) -> Result<()> {
    let start = view_moment(0, 0.0);
    let diagnosis = &run.diagnosis;
    let verdict = format!("{:?}", diagnosis.verdict).to_lowercase();
    let mut said = vec![(format!("verdict: {verdict}"), TextLogLevel::INFO)];
    said.extend(diagnosis.findings.iter().map(|f| (finding(f), TextLogLevel::WARN)));
    let next = diagnosis.experiments.iter();
    said.extend(next.map(|e| (format!("to measure next: {}", e.words), TextLogLevel::INFO)));
    let doubts = run.model.twin.notices.iter();
    said.extend(doubts.map(|n| {
        let level = match n.severity {
            Severity::Warning => TextLogLevel::WARN,
            Severity::Note => TextLogLevel::DEBUG,
        };
        (format!("{}: {}: {}", n.stage, n.about, n.message), level)
    }));
    for (text, level) in said {
        stream.at(&["findings"], start, &line(text, level))?;
    }
    Ok(())
}

fn finding(f: &Finding) -> String {
    let rivals: Vec<String> = f
        .alternatives
        .iter()
        .map(|a| format!("{} {:.2}", a.cause, a.probability))
        .collect();
    let rivals = if rivals.is_empty() {
        String::new()
    } else {
        format!("; not ruled out: {}", rivals.join(", "))
    };
    let gain = &f.gain;
    format!(
        "{} at {}, p = {:.2}{rivals}; {} error on held-out touches {:.3e} -> {:.3e} {}",
        f.cause, f.place, f.probability, gain.quantity, gain.rmse_before, gain.rmse_after, gain.unit
    )
}

/// Links and the support as nodes; each relation is a node between its two, since edges carry no words.
fn graph(twin: &Twin) -> (GraphNodes, GraphEdges) {
    let mut nodes: Vec<(String, String)> = twin.links().map(|(_, l)| (l.name.clone(), l.name.clone())).collect();
    nodes.push((SUPPORT.to_owned(), SUPPORT.to_owned()));
    let mut edges: Vec<(String, String)> = Vec::new();
    for (i, relation) in twin.relations.iter().enumerate() {
        if relation.kind == RelationKind::Separate {
            continue;
        }
        let id = format!("relation-{i}");
        nodes.push((id.clone(), label(relation)));
        edges.push((relation.a.clone(), id.clone()));
        edges.push((id, relation.b.clone()));
    }
    let (ids, labels): (Vec<String>, Vec<String>) = nodes.into_iter().unzip();
    (
        GraphNodes::new(ids).with_labels(labels),
        GraphEdges::new(edges).with_undirected_edges(),
    )
}

fn label(relation: &Relation) -> String {
    let kind = format!("{:?}", relation.kind).to_lowercase();
    format!("{kind}, p = {:.2}", relation.probability)
}

/// Every estimate of the twin as a table: value, standard deviation, interval, unit, status, method.
fn estimates(twin: &Twin) -> Result<String> {
    let mut rows = String::new();
    for (_, link) in twin.links() {
        walk(&mut rows, &link.name, "", &serde_json::to_value(link).map_err(failed)?);
    }
    for joint in twin.joints() {
        walk(
            &mut rows,
            &joint.name,
            "",
            &serde_json::to_value(joint).map_err(failed)?,
        );
    }
    for relation in &twin.relations {
        let of = format!("{}, {}", relation.a, relation.b);
        walk(&mut rows, &of, "", &serde_json::to_value(relation).map_err(failed)?);
    }
    if let Some(support) = &twin.support {
        walk(&mut rows, SUPPORT, "", &serde_json::to_value(support).map_err(failed)?);
    }
    let head = "| of | quantity | value | sd | 95 % | unit | status | method |\n|---|---|---|---|---|---|---|---|\n";
    Ok(format!("# {}\n\n{head}{rows}{HOW_TO_READ}", twin.name))
}

/// A row for every estimate below `value`, by its path in `twin.json`.
fn walk(rows: &mut String, of: &str, path: &str, value: &Value) {
    if let (Some(number), Some(unit), Some(status)) =
        (value.get("value"), value["unit"].as_str(), value["status"].as_str())
    {
        let [number, sd, interval] = [number, &value["sd"], &value["ci95"]].map(short);
        let method = value["method"].as_str().unwrap_or("");
        *rows += &format!("| {of} | {path} | {number} | {sd} | {interval} | {unit} | {status} | {method} |\n");
        return;
    }
    let below = |key: &str| {
        if path.is_empty() {
            key.to_owned()
        } else {
            format!("{path}.{key}")
        }
    };
    match value {
        Value::Object(all) => all.iter().for_each(|(k, v)| walk(rows, of, &below(k), v)),
        Value::Array(all) => all
            .iter()
            .enumerate()
            .for_each(|(i, v)| walk(rows, of, &below(&i.to_string()), v)),
        _ => {}
    }
}

/// Numbers with five figures; nothing where there is none.
fn short(value: &Value) -> String {
    match value {
        Value::Number(n) => n.as_f64().map_or_else(String::new, |x| {
            let short: f64 = format!("{x:.4e}").parse().unwrap_or(x);
            short.to_string()
        }),
        Value::Array(all) => all.iter().map(short).collect::<Vec<_>>().join(" … "),
        _ => String::new(),
    }
}
