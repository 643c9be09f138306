//! The joints: kind with its rivals, axis, range and resistance.

use super::estimates::range;
use super::markup::{escape, percent, section as framed, table};
use super::rows::{COLUMNS, list, scalar};
use crate::pipeline::Run;
use crate::twin::{Joint, JointKind};

/// A card per joint.
pub fn section(run: &Run) -> String {
    let cards: String = run.model.twin.joints().map(joint).collect();
    if cards.is_empty() {
        return framed("joints", "Joints", "", "<p class=\"muted\">No joint was found.</p>\n");
    }
    let lead = "Axis and origin are in the world at the first view; positions count from there.";
    framed(
        "joints",
        "Joints",
        lead,
        &format!("<div class=\"cards\">\n{cards}</div>\n"),
    )
}

fn kind_words(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Fixed => "they move as one",
        JointKind::Revolute => "turns about an axis",
        JointKind::Prismatic => "slides along an axis",
        JointKind::Screw => "turns and slides, coupled by a pitch",
        JointKind::Cylindrical => "turns and slides along one axis",
        JointKind::Planar => "slides in a plane",
        JointKind::Spherical => "turns about a point",
    }
}

fn joint(joint: &Joint) -> String {
    let unit = if joint.kind == JointKind::Prismatic { "m" } else { "rad" };
    let travelled = joint
        .travelled
        .map(|t| format!(" It was seen to move over {}.", escape(&range(t, unit))))
        .unwrap_or_default();
    let ends = if joint.kind != JointKind::Fixed && joint.limits.is_none() {
        " No end of its range was reached."
    } else {
        ""
    };
    let rows = rows(joint);
    let rows = if joint.kind == JointKind::Fixed {
        String::new()
    } else {
        table(&joint.name, "estimates", &COLUMNS, &rows)
    };
    format!(
        "<article class=\"card\">\n<h3>{} <small>{} → {}</small></h3>\n\
         <p class=\"shape\"><strong>{}</strong>, probability {}: {}.{travelled}{ends}</p>\n{}{rows}{}</article>\n",
        escape(&joint.name),
        escape(&joint.parent),
        escape(&joint.child),
        joint.kind.name(),
        percent(joint.probability),
        kind_words(joint.kind),
        odds(joint),
        effort(joint),
    )
}

/// All kinds with their probabilities, as bars.
fn odds(joint: &Joint) -> String {
    if joint.alternatives.is_empty() {
        return String::new();
    }
    let own = std::iter::once((joint.kind, joint.probability));
    let others = joint.alternatives.iter().map(|a| (a.kind, a.probability));
    let bars: String = own
        .chain(others)
        .map(|(kind, p)| {
            format!(
                "<li><span>{}</span><span class=\"bar\"><i style=\"width:{:.1}%\"></i></span><span class=\"num\">{}</span></li>",
                kind.name(),
                (100.0 * p).clamp(0.0, 100.0),
                percent(p)
            )
        })
        .collect();
    format!("<details class=\"odds\"><summary>Other kinds that it could be</summary><ul>{bars}</ul></details>\n")
}

fn rows(joint: &Joint) -> String {
    let mut out = list("Axis", ["x", "y", "z"], &joint.axis);
    out.push_str(&list("Origin", ["x", "y", "z"], &joint.origin));
    if let Some(limits) = &joint.limits {
        out.push_str(&list("Limits", ["low", "high"], limits));
    }
    let scalars = [
        ("Position at the first view", &joint.position),
        ("Pitch", &joint.pitch),
        ("Coulomb friction", &joint.friction),
        ("Viscous damping", &joint.damping),
        ("Return spring", &joint.stiffness),
        ("Spring slack at", &joint.rest),
    ];
    for (name, estimate) in scalars {
        if let Some(e) = estimate {
            out.push_str(&scalar(name, e));
        }
    }
    let effects = &joint.effects;
    if let Some(excess) = &effects.static_excess {
        out.push_str(&scalar("Static friction over the dry", excess));
    }
    for detent in &effects.detents {
        let name = if detent.latch { "Latch" } else { "Notch" };
        out.push_str(&scalar(&format!("{name} at"), &detent.position));
        out.push_str(&scalar(&format!("{name} draws back with up to"), &detent.load));
        out.push_str(&scalar(&format!("{name} draws most at a distance of"), &detent.reach));
    }
    if let Some(play) = &effects.backlash {
        out.push_str(&scalar("Play, to either side", play));
    }
    if let Some(coupling) = &effects.coupling {
        out.push_str(&scalar(
            &format!("Follows {}, by", escape(&coupling.leader)),
            &coupling.ratio,
        ));
    }
    if let Some(latch) = joint.effort.as_ref().and_then(|e| e.latch.as_ref()) {
        out.push_str(&scalar("Latch, over the way after it", &latch.excess));
        out.push_str(&scalar("The same at the hand", &latch.force));
        out.push_str(&scalar("Level after the latch", &latch.level));
        out.push_str(&scalar("The latch has given way at", &latch.until));
    }
    out
}

/// What it took to move the joint, stretch by stretch.
fn effort(joint: &Joint) -> String {
    let Some(effort) = &joint.effort else {
        return String::new();
    };
    let unit = if joint.kind == JointKind::Prismatic { "m" } else { "rad" };
    let rows: String = effort
        .by_position
        .iter()
        .map(|e| scalar(&range(e.position, unit), &e.force))
        .collect();
    let rows = table(
        &format!("{}, force by position", joint.name),
        "estimates",
        &COLUMNS,
        &rows,
    );
    format!("<details><summary>Force at the hand by position</summary>\n{rows}</details>\n")
}
