//! The recording for the Rerun viewer, read back: what is in it, at which times, and the same bytes each time.
#![cfg(feature = "rerun")]
#![allow(clippy::expect_used, clippy::panic, reason = "a test says what it found and stops")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use re_chunk::Chunk;
use re_log_types::LogMsg;

/// What an entity holds: its components, its rows, and the timelines that they are on.
#[derive(Debug, Default)]
struct Entity {
    components: BTreeSet<String>,
    rows: usize,
    timelines: BTreeSet<String>,
}

fn palpate(words: &[&str]) {
    let out = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .output()
        .expect("palpate runs");
    assert!(
        out.status.success(),
        "{words:?}: {}",
        String::from_utf8_lossy(&out.stderr)
    );
}

/// Every entity of a recording, read by the format's own decoder.
fn entities(file: &Path) -> BTreeMap<String, Entity> {
    let bytes = fs::read(file).expect("a recording");
    let mut found: BTreeMap<String, Entity> = BTreeMap::new();
    let messages = re_log_encoding::Decoder::<LogMsg>::decode_eager(bytes.as_slice()).expect("the head of a recording");
    for message in messages {
        let LogMsg::ArrowMsg(_, message) = message.expect("a whole message") else {
            continue;
        };
        let chunk = Chunk::from_arrow_msg(&message).expect("a chunk");
        let entity = found.entry(chunk.entity_path().to_string()).or_default();
        entity.rows += chunk.num_rows();
        entity
            .components
            .extend(chunk.components_identifiers().map(|c| c.to_string()));
        entity.timelines.extend(chunk.timelines().keys().map(|t| t.to_string()));
    }
    found
}

#[test]
fn a_recording_holds_the_run_and_is_the_same_each_time() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| dir.path().join(name).to_string_lossy().into_owned();
    let (capture, one, two) = (at("capture"), at("one"), at("two"));
    palpate(&["synth", "lab:hinge", "--out", &capture, "-q"]);
    palpate(&[
        "reconstruct",
        &capture,
        "--out",
        &one,
        "-q",
        "--rerun",
        "--threads",
        "1",
    ]);
    palpate(&[
        "reconstruct",
        &capture,
        "--out",
        &two,
        "-q",
        "--rerun",
        "--threads",
        "2",
    ]);
    let file = Path::new(&one).join("recording.rrd");
    let again = Path::new(&two).join("recording.rrd");
    assert!(
        fs::read(&file).expect("read") == fs::read(&again).expect("read"),
        "the same run, other bytes"
    );

    let found = entities(&file);
    let twin: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(Path::new(&one).join("twin.json")).expect("a twin")).expect("JSON");
    let holds = |path: &str, component: &str| {
        let entity = found
            .get(path)
            .unwrap_or_else(|| panic!("no {path} among {:?}", found.keys()));
        assert!(entity.components.contains(component), "{path}: {:?}", entity.components);
        entity
    };
    for body in twin["bodies"].as_array().expect("bodies") {
        for link in body["links"].as_array().expect("links") {
            let name = link["name"].as_str().expect("a name");
            holds(&format!("/world/measured/{name}"), "Mesh3D:vertex_positions");
            holds(&format!("/world/measured/{name}"), "Transform3D:translation");
            holds(&format!("/world/predicted/{name}"), "Mesh3D:vertex_positions");
        }
        for joint in body["joints"].as_array().expect("joints") {
            let name = joint["name"].as_str().expect("a name");
            holds(&format!("/world/joints/{name}"), "Arrows3D:vectors");
        }
    }
    let views = fs::read_to_string(Path::new(&capture).join("capture.json")).expect("a capture");
    let views: serde_json::Value = serde_json::from_str(&views).expect("JSON");
    let camera = views["cameras"][0]["name"].as_str().expect("a camera");
    holds(&format!("/world/cameras/{camera}"), "Pinhole:image_from_camera");
    let depth = holds(&format!("/world/cameras/{camera}/depth"), "DepthImage:buffer");
    assert_eq!(depth.rows, views["views"].as_array().expect("views").len());
    let timelines: Vec<&str> = depth.timelines.iter().map(String::as_str).collect();
    assert_eq!(timelines, ["capture_clock", "played"]);
    holds("/world/touch/force", "Arrows3D:vectors");
    holds("/world/touch/tool", "Transform3D:translation");
    holds("/tool/force", "Scalars:scalars");
    holds("/graph", "GraphNodes:node_ids");
    holds("/graph", "GraphEdges:edges");
    holds("/findings", "TextLog:text");
    holds("/log", "TextLog:text");
    holds("/estimates", "TextDocument:text");
    for part in ["measured", "predicted", "residual"] {
        let any = found.iter().any(|(path, e)| {
            path.starts_with("/curves/") && path.ends_with(part) && e.components.contains("Scalars:scalars")
        });
        assert!(any, "no {part} among {:?}", found.keys());
    }
}
