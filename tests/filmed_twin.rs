//! What was filmed and never tracked becomes a twin with joints, which says that its tracks come from images.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    missing_docs,
    reason = "a test"
)]

use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn palpate(arguments: &[&str], folder: &Path) {
    let output = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("palpate runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The twin and the report of a scene of the lab that films, and tracks nothing.
fn twin_of(scene: &str) -> (Value, String) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    palpate(&["synth", &format!("lab:{scene}"), "--out", "capture"], folder.path());
    let capture = std::fs::read_to_string(folder.path().join("capture/capture.json")).expect("read");
    assert!(
        capture.contains("frames") && !capture.contains("\"tracks\": {\n"),
        "the lab tracked {scene}"
    );
    palpate(&["reconstruct", "capture", "--out", "twin"], folder.path());
    let read = |name: &str| std::fs::read_to_string(folder.path().join("twin").join(name)).expect("read");
    (
        serde_json::from_str(&read("twin.json")).expect("JSON"),
        read("report.html"),
    )
}

/// The only joint, with the links that it holds.
fn joint<'a>(twin: &'a Value, kind: &str) -> &'a Value {
    let bodies = twin["bodies"].as_array().expect("bodies");
    let joints: Vec<&Value> = bodies
        .iter()
        .flat_map(|b| b["joints"].as_array().expect("joints"))
        .collect();
    println!("{} bodies, joints {joints:#?}", bodies.len());
    assert_eq!(joints.len(), 1);
    assert_eq!(joints[0]["type"], kind);
    let links = bodies[0]["links"].as_array().expect("links");
    assert!(
        links.len() == 2 && links.iter().all(|l| l["mesh"].is_string()),
        "a mesh for either link"
    );
    joints[0]
}

fn degrees_to(joint: &Value, axis: [f64; 3]) -> f64 {
    let found: Vec<f64> = joint["axis"]["value"]
        .as_array()
        .expect("axis")
        .iter()
        .filter_map(Value::as_f64)
        .collect();
    let cosine: f64 = found.iter().zip(axis).map(|(a, b)| a * b).sum();
    cosine.abs().min(1.0).acos().to_degrees()
}

fn says_where_tracks_come_from(twin: &Value, report: &str) {
    let tracks = twin["provenance"]["tracks_from_images"].as_array().expect("tracks");
    assert_eq!(tracks.len(), 4, "two links in two films: {tracks:?}");
    for track in tracks {
        assert!(
            track["position_sd"].as_f64().is_some_and(|sd| sd > 0.0) && track["lost"] == 0,
            "{track}"
        );
    }
    assert!(
        report.contains("images, not measured") && report.contains("4 made from images"),
        "the report says so"
    );
}

#[test]
fn a_filmed_flap_hangs_on_a_hinge() {
    let (twin, report) = twin_of("filmed-hinge");
    let off = degrees_to(joint(&twin, "revolute"), [0.0, 0.0, 1.0]);
    println!("axis {off:.2} degrees off");
    assert!(off < 2.0);
    says_where_tracks_come_from(&twin, &report);
}

#[test]
fn a_filmed_drawer_slides() {
    let (twin, report) = twin_of("filmed-drawer");
    let off = degrees_to(joint(&twin, "prismatic"), [1.0, 0.0, 0.0]);
    println!("axis {off:.2} degrees off");
    assert!(off < 2.0);
    says_where_tracks_come_from(&twin, &report);
}
