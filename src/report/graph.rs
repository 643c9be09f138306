//! The relational-constraint graph as a drawing and as a table.

use super::layout::{BOX, Layout, Node, drawn, layout, resolve};
use super::markup::{count, escape, names, percent, section as framed, table};
use super::rows::scalar;
use crate::pipeline::Run;
use crate::twin::{Relation, RelationKind, SUPPORT, Twin};

const HIGH: f64 = 36.0;
const STEP: f64 = 104.0;
const TOP: f64 = 14.0;
const BAR: f64 = 30.0;

/// The graph with its legend, and the arcs as a table.
pub fn section(run: &Run) -> String {
    let twin = &run.model.twin;
    let separate = twin.relations.iter().filter(|r| !drawn(r)).count();
    let mut content = svg(twin);
    content.push_str(LEGEND);
    if separate > 0 {
        let pairs = count(separate, "pair does", "pairs do");
        content.push_str(&format!(
            "<p class=\"muted\">{pairs} not bear on each other and are not drawn.</p>\n"
        ));
    }
    let rows: String = twin.relations.iter().map(row).collect();
    let head = ["Between", "Kind", "Freedom", "Probability", "Proven by"];
    content.push_str(&format!(
        "<details class=\"arcs\"><summary>The arcs as a table</summary>\n{}</details>\n",
        table("Relations", "relations", &head, &rows)
    ));
    let breaks: String = twin
        .relations
        .iter()
        .filter_map(|r| {
            Some(scalar(
                &format!("{} – {}", escape(&r.a), escape(&r.b)),
                r.breakaway.as_ref()?,
            ))
        })
        .collect();
    if !breaks.is_empty() {
        content.push_str("<h3>Bonds that gave way</h3>\n");
        content.push_str(&table(
            "Bonds that gave way",
            "estimates",
            &super::rows::COLUMNS,
            &breaks,
        ));
    }
    let lead = "What is held to what, and how. <b>r</b> and <b>t</b> count the freedoms to turn and to shift that are left between the two.";
    framed("relations", "Relations", lead, &content)
}

const LEGEND: &str = "<ul class=\"legend\" aria-label=\"Kinds of relation\">\
    <li><svg width=\"34\" height=\"10\" aria-hidden=\"true\"><path class=\"arc fixed\" d=\"M2 5h30\"/></svg>fixed</li>\
    <li><svg width=\"34\" height=\"10\" aria-hidden=\"true\"><path class=\"arc joint\" d=\"M2 5h30\"/></svg>joint</li>\
    <li><svg width=\"34\" height=\"10\" aria-hidden=\"true\"><path class=\"arc resting\" d=\"M2 5h30\"/></svg>resting: can be taken off</li>\
    <li><svg width=\"34\" height=\"10\" aria-hidden=\"true\"><path class=\"arc unknown\" d=\"M2 5h30\"/></svg>unknown: never tried</li></ul>\n";

fn kind_name(kind: RelationKind) -> &'static str {
    match kind {
        RelationKind::Separate => "separate",
        RelationKind::Resting => "resting",
        RelationKind::Fixed => "fixed",
        RelationKind::Revolute => "revolute",
        RelationKind::Prismatic => "prismatic",
        RelationKind::Screw => "screw",
        RelationKind::Cylindrical => "cylindrical",
        RelationKind::Planar => "planar",
        RelationKind::Spherical => "spherical",
        RelationKind::Unknown => "unknown",
    }
}

fn class(kind: RelationKind) -> &'static str {
    match kind {
        RelationKind::Fixed => "fixed",
        RelationKind::Resting => "resting",
        RelationKind::Unknown | RelationKind::Separate => "unknown",
        _ => "joint",
    }
}

fn row(r: &Relation) -> String {
    format!(
        "<tr><th scope=\"row\">{} – {}</th><td>{}</td><td class=\"num\">{}</td><td class=\"num\">{}</td><td class=\"from\">{}</td></tr>\n",
        escape(&r.a),
        escape(&r.b),
        kind_name(r.kind),
        freedom(r),
        percent(r.probability),
        names(&r.from)
    )
}

fn freedom(r: &Relation) -> String {
    format!("r {} · t {}", r.rotation_dof, r.translation_dof)
}

/// Centre height of a level.
fn height(plan: &Layout, level: usize) -> f64 {
    TOP + (plan.levels.saturating_sub(level)) as f64 * STEP + 0.5 * HIGH
}

fn svg(twin: &Twin) -> String {
    let plan = layout(twin);
    let bar = TOP + plan.levels as f64 * STEP;
    let (width, high) = (plan.width, bar + BAR + 4.0);
    let mut out = format!(
        "<div class=\"scroll graph\" tabindex=\"0\" role=\"region\" aria-label=\"Constraint graph\">\n\
         <svg viewBox=\"0 0 {width:.0} {high:.0}\" style=\"min-width:{:.0}px;max-width:{:.0}px\" role=\"img\" aria-label=\"{}\">\n",
        0.86 * width,
        1.25 * width,
        escape(&spoken(twin))
    );
    out.push_str(&format!(
        "<rect class=\"support\" x=\"2\" y=\"{bar:.1}\" width=\"{:.1}\" height=\"{BAR}\" rx=\"6\"/>\
         <text class=\"name\" x=\"{:.1}\" y=\"{:.1}\">support</text>\n",
        width - 4.0,
        0.5 * width,
        bar + 0.5 * BAR + 4.5
    ));
    for relation in twin.relations.iter().filter(|r| drawn(r)) {
        out.push_str(&arc(twin, &plan, relation, bar));
    }
    for node in &plan.nodes {
        out.push_str(&node_box(node, height(&plan, node.level)));
    }
    out.push_str("</svg>\n</div>\n");
    out
}

/// The graph in words, for who cannot see it.
fn spoken(twin: &Twin) -> String {
    let arcs: Vec<String> = twin
        .relations
        .iter()
        .filter(|r| drawn(r))
        .map(|r| format!("{} and {}: {}", r.a, r.b, kind_name(r.kind)))
        .collect();
    arcs.join("; ")
}

fn node_box(node: &Node, y: f64) -> String {
    let length = node.name.chars().count();
    let squeeze = if length > 15 {
        format!(" textLength=\"{:.0}\" lengthAdjust=\"spacingAndGlyphs\"", BOX - 8.0)
    } else {
        String::new()
    };
    format!(
        "<g><rect class=\"node\" x=\"{:.1}\" y=\"{:.1}\" width=\"{BOX}\" height=\"{HIGH}\" rx=\"7\"/>\
         <text class=\"name\" x=\"{:.1}\" y=\"{:.1}\"{squeeze}>{}</text></g>\n",
        node.x - 0.5 * BOX,
        y - 0.5 * HIGH,
        node.x,
        y + 4.5,
        escape(&node.name)
    )
}

/// An arc with its kind, freedom and probability.
fn arc(twin: &Twin, plan: &Layout, r: &Relation, bar: f64) -> String {
    let find = |name: &str| {
        let name = resolve(twin, name);
        plan.nodes.iter().find(|n| n.name == name)
    };
    let (a, b) = match (r.a.as_str(), r.b.as_str()) {
        (SUPPORT, other) | (other, SUPPORT) => (find(other), None),
        (a, b) => (find(a), find(b)),
    };
    let Some(first) = a else { return String::new() };
    let from = (first.x, height(plan, first.level));
    let (path, x, y, centred) = match b {
        None => {
            let top = from.1 + 0.5 * HIGH;
            let path = format!("M{:.1} {top:.1}V{bar:.1}", from.0);
            (path, from.0 + 7.0, 0.5 * (top + bar) - 9.0, false)
        }
        Some(second) => between(from, (second.x, height(plan, second.level))),
    };
    let kind = kind_name(r.kind);
    let anchor = if centred { " mid" } else { "" };
    // Beside a level arc the kind stands above the line and the rest below it.
    let below = if centred && b.is_some_and(|n| (n.x - first.x).abs() < 2.0 * BOX) {
        8.0
    } else {
        0.0
    };
    let line = |i: usize, text: &str| {
        let drop = 13.0 * i as f64 + if i > 0 { below } else { 0.0 };
        format!("<tspan x=\"{x:.1}\" y=\"{:.1}\">{text}</tspan>", y + drop)
    };
    format!(
        "<g><path class=\"arc {}\" d=\"{path}\"/><text class=\"tag{anchor}\"><title>{}</title>{}{}{}</text></g>\n",
        class(r.kind),
        escape(&format!(
            "proven by {}",
            if r.from.is_empty() {
                "nothing".to_owned()
            } else {
                r.from.join(", ")
            }
        )),
        line(0, &format!("<tspan class=\"kind\">{kind}</tspan>")),
        line(1, &freedom(r)),
        line(2, &percent(r.probability)),
    )
}

/// Path, place of the label, and whether it is centred there.
fn between(from: (f64, f64), to: (f64, f64)) -> (String, f64, f64, bool) {
    if (from.1 - to.1).abs() > 1.0 {
        let (low, high) = if from.1 > to.1 { (from, to) } else { (to, from) };
        let (start, end) = (low.1 - 0.5 * HIGH, high.1 + 0.5 * HIGH);
        let path = format!("M{:.1} {start:.1}L{:.1} {end:.1}", low.0, high.0);
        return (path, 0.5 * (low.0 + high.0) + 7.0, 0.5 * (start + end) - 9.0, false);
    }
    let (left, right) = if from.0 < to.0 { (from, to) } else { (to, from) };
    let (start, end) = (left.0 + 0.5 * BOX, right.0 - 0.5 * BOX);
    let x = 0.5 * (start + end);
    if end - start < BOX {
        return (format!("M{start:.1} {0:.1}H{end:.1}", left.1), x, left.1 - 6.0, true);
    }
    // Something stands between: over it.
    let top = left.1 - 0.5 * HIGH;
    let path = format!(
        "M{:.1} {top:.1}Q{x:.1} {:.1} {:.1} {top:.1}",
        left.0,
        top - 40.0,
        right.0
    );
    (path, x, top - 42.0, true)
}
