//! The scene to turn: what the viewer is given, and the frame that it draws in.

use serde_json::{Value, json};

use super::markup::section as framed;
use super::pack::{short, surface};
use super::replay;
use crate::base::Status;
use crate::capture::Capture;
use crate::export::playable;
use crate::pipeline::Run;
use crate::twin::{Joint, JointKind, Link, Model};

/// The scene as JSON that can stand inside a script element.
pub fn data(capture: &Capture, run: &Run) -> serde_json::Result<String> {
    let twin = &run.model.twin;
    let g = twin.gravity;
    let size = g.iter().map(|x| x * x).sum::<f64>().sqrt();
    let against = if size > 0.0 {
        g.map(|x| -x / size)
    } else {
        [0.0, 0.0, 1.0]
    };
    let links: Vec<Value> = twin.links().map(|(_, l)| link(&run.model, l)).collect();
    let joints: Vec<Value> = twin.joints().map(joint).collect();
    // Where the joints make no tree the page shows the twin and says why nothing moves.
    let (physics, why_not) = match playable(&run.model) {
        Ok(found) => (rounded(serde_json::to_value(found)?), None),
        Err(error) => (Value::Null, Some(error.to_string())),
    };
    let scene = json!({
        "name": twin.name,
        "up": twin.support.as_ref().map_or(against, |s| s.normal).map(short),
        "support": twin.support.as_ref().map(|s| s.point.map(short)),
        "links": links,
        "joints": joints,
        "physics": physics,
        "why_not": why_not,
        "replays": replay::data(capture, run),
    });
    // `<` would let a name close the script element.
    Ok(serde_json::to_string(&scene)?.replace('<', "\\u003c"))
}

/// Numbers to seven digits, which is what the page's engine holds.
fn rounded(value: Value) -> Value {
    match value {
        Value::Number(n) => match n.as_f64().filter(|_| !n.is_i64() && !n.is_u64()) {
            Some(x) => format!("{x:.6e}").parse::<f64>().map_or(Value::Null, |x| json!(x)),
            None => Value::Number(n),
        },
        Value::Array(list) => list.into_iter().map(rounded).collect(),
        Value::Object(map) => map.into_iter().map(|(k, v)| (k, rounded(v))).collect(),
        other => other,
    }
}

fn link(model: &Model, link: &Link) -> Value {
    let packed = |path: &String| {
        let mesh = model.meshes.get(path)?;
        let mut packed = surface(
            &mesh.vertices,
            &mesh.triangles,
            &mesh.colors,
            [&mesh.seen, &mesh.mirrored],
        )?;
        packed["file"] = json!(path);
        Some(packed)
    };
    let parts: Vec<Value> = link.collision.iter().filter_map(packed).collect();
    let com = link.com.as_ref();
    let planes: Vec<Value> = link
        .symmetry
        .iter()
        .map(|p| json!({"normal": p.normal.map(short), "offset": short(p.offset)}))
        .collect();
    json!({
        "name": link.name,
        "pose": link.pose.to_seven().map(short),
        "mesh": link.mesh.as_ref().and_then(packed),
        "parts": parts,
        "com": com.map(|c| c.value.map(short)),
        "com_sd": com.and_then(|c| c.sd).map(|sd| sd.map(short)),
        "com_status": com.map(|c| c.status == Status::Assumed).map(|a| if a { "assumed" } else { "measured" }),
        "symmetry": planes,
    })
}

fn joint(joint: &Joint) -> Value {
    json!({
        "name": joint.name,
        "kind": joint.kind,
        "parent": joint.parent,
        "child": joint.child,
        "axis": joint.axis.value.map(short),
        "origin": joint.origin.value.map(short),
        "pitch": joint.pitch.as_ref().map(|p| short(p.value)),
        "limits": joint.limits.as_ref().map(|l| l.value.map(short)),
        "travelled": joint.travelled.map(|t| t.map(short)),
    })
}

/// The frame of the scene.
pub fn section(run: &Run) -> String {
    let movable = run.model.twin.joints().any(|j| j.kind != JointKind::Fixed);
    let sliders = if movable {
        " Its joints also move with the sliders, over the range that was seen."
    } else {
        ""
    };
    let lead = format!(
        "Take a thing and move it: it weighs, rubs, slides, swings and holds together as was measured, and what comes along is \
         said below. Drag beside the things to turn the view, pinch or scroll to come nearer.{sliders}"
    );
    let content = "<div id=\"scene\">\n<div class=\"scene-view\"><p class=\"scene-none\" role=\"note\">This browser shows no \
         three-dimensional graphics (WebGL 2), so the scene cannot be drawn here. Everything else on this page is complete; \
         <code>scene.glb</code> beside it holds the same shapes.</p></div>\n\
         <div class=\"scene-side\">\n<div class=\"scene-switches\" role=\"group\" aria-label=\"What the scene shows\"></div>\n\
         <div class=\"scene-sliders\" role=\"group\" aria-label=\"Joints\"></div>\n</div>\n\
         <div class=\"scene-play\"></div>\n</div>\n";
    framed("view", "The scene", &lead, content)
}
