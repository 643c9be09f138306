//! `palpate explore`: the example rig in Python, rigs that answer badly, rigs that die.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "tests may stop and print"
)]

#[path = "common/python.rs"]
mod python;

use std::path::Path;
use std::process::{Command, Output};

use python::{python, python_with};
use serde_json::Value;

fn explore(rig: &str, out: &Path, budget: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["explore", "--json", "--budget", budget, "--rig", rig, "--out"])
        .arg(out)
        .output()
        .expect("palpate runs")
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("read")).expect("JSON")
}

#[test]
fn the_python_rig_is_explored_and_its_bodies_are_weighed() {
    let Some(python) = python() else { return };
    let dir = tempfile::tempdir().expect("a temporary folder");
    let out = dir.path().join("explored");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/rig.py");
    let made = explore(&format!("exec:{python} '{script}'"), &out, "14");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let record = json(&out.join("explore.json"));
    let steps = record["steps"].as_array().expect("steps");
    assert!(steps.iter().any(|s| s["action"] == "look") && steps.iter().any(|s| s["action"] == "lift"));
    assert!(steps.iter().all(|s| s["why"].as_str().is_some_and(|w| w.len() > 10)));
    let twin = json(&out.join("twin/twin.json"));
    for (name, mass) in [("box", 0.25), ("can", 0.4)] {
        let body = twin["bodies"]
            .as_array()
            .expect("bodies")
            .iter()
            .find(|b| b["name"] == name);
        let link = &body.unwrap_or_else(|| panic!("no {name}"))["links"][0];
        let [low, high] = [0, 1].map(|k| link["mass"]["ci95"][k].as_f64().expect("a number"));
        assert!(low <= mass && mass <= high, "{name}: {low} to {high}");
        let surface = &link["surface"];
        let [seen, mirrored, closed] = ["seen", "mirrored", "closed"].map(|k| surface[k].as_f64().expect("a share"));
        assert!(
            (seen + mirrored + closed - 1.0).abs() < 1e-9 && seen > 0.6,
            "{name}: {surface}"
        );
    }
    assert!(out.join("capture/capture.json").is_file() && out.join("twin/report.html").is_file());
}

#[test]
fn a_rig_with_another_world_is_touched_until_all_is_known_as_wanted() {
    let Some(python) = python_with("mujoco") else { return };
    let dir = tempfile::tempdir().expect("a temporary folder");
    let out = dir.path().join("explored");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/mujoco_rig.py");
    let made = explore(&format!("exec:{python} '{script}'"), &out, "20");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let record = json(&out.join("explore.json"));
    let enough = record["touched_enough"].as_str().expect("a reason");
    assert!(enough.starts_with("of every thing, mass is known to 5 %"), "{enough}");
    let twin = json(&out.join("twin/twin.json"));
    for (name, mass, friction, centre) in [("box", 0.35, 0.3, [0.0043, -0.0023]), ("can", 0.4, 0.25, [0.0, 0.0])] {
        let bodies = twin["bodies"].as_array().expect("bodies");
        let link = &bodies.iter().find(|b| b["name"] == name).expect("the body")["links"][0];
        let held = |estimate: &Value, truth: f64| {
            let [low, high] = [0, 1].map(|k| estimate[k].as_f64().expect("a number"));
            assert!(low <= truth && truth <= high, "{name}: {low} to {high} for {truth}");
        };
        held(&link["mass"]["ci95"], mass);
        held(&link["friction"]["kinetic"]["ci95"], friction);
        for k in 0..2 {
            held(&link["com"]["ci95"][k], centre[k]);
        }
    }
}

/// A rig that answers with the lines given, then ends.
fn rig_of(folder: &Path, lines: &[&str]) -> String {
    let file = folder.join("answers.txt");
    let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
    std::fs::write(&file, text).expect("written");
    // It reads a question before each answer, so that nothing is sent to a rig that has gone.
    format!(
        "exec:sh -c 'while read -r answer <&3; do read -r question; echo \"$answer\"; done 3<{}'",
        file.display()
    )
}

const SOUND: &str = r#"{"protocol": "palpate-rig/1", "name": "r", "cameras": [{"name": "c", "width": 8, "height": 6, "fx": 8, "fy": 8, "cx": 4, "cy": 3}], "reach": {"dome": {"target": [0, 0, 0], "radius": [0.4, 0.5], "elevation": [20, 80]}}, "workspace": {"low": [-0.1, -0.1, 0], "high": [0.1, 0.1, 0.1]}}"#;

#[test]
fn a_bad_answer_is_named_by_line_and_key_and_leaves_nothing() {
    let swapped = SOUND.replace("[0.4, 0.5]", "[0.5, 0.4]");
    let unknown = SOUND.replace("\"reach\"", "\"raech\"");
    let other = SOUND.replace("rig/1", "rig/9");
    let long = r#"{"time": 0, "pose": [0, 0, 1, 0, 0, 0, 2], "depth_png": "AAAA"}"#;
    let image = r#"{"time": 0, "pose": [0, 0, 1, 1, 0, 0, 0], "depth_png": "AAAA"}"#;
    let cases: [(&[&str], i32, &str); 8] = [
        (&["not json"], 2, "line 1"),
        (&[&unknown], 2, "raech"),
        (&[&other], 2, "line 1: protocol"),
        (&[&swapped], 2, "line 1: reach.dome"),
        (&[SOUND, long], 2, "line 2: pose"),
        (&[SOUND, image], 2, "line 2: depth_png"),
        (&[SOUND], 1, "the rig ended"),
        (&[], 1, "the rig ended"),
    ];
    for (lines, code, place) in cases {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let answers = tempfile::tempdir().expect("a temporary folder");
        let made = explore(&rig_of(answers.path(), lines), &dir.path().join("out"), "5");
        let said = String::from_utf8_lossy(&made.stderr);
        assert_eq!(made.status.code(), Some(code), "{lines:?}: {said}");
        assert!(
            said.contains(place) && said.trim().lines().count() == 1,
            "{lines:?}: {said}"
        );
        assert_eq!(std::fs::read_dir(dir.path()).expect("listed").count(), 0, "{lines:?}");
    }
}

#[test]
fn the_lab_is_explored_and_the_same_seed_chooses_the_same() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (first, second) = (dir.path().join("a"), dir.path().join("b"));
    for out in [&first, &second] {
        let made = explore("lab:tiny", out, "12");
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
    assert_eq!(json(&first.join("explore.json")), json(&second.join("explore.json")));
    assert_eq!(
        json(&first.join("twin/twin.json")),
        json(&second.join("twin/twin.json"))
    );
    let (twin, truth) = (
        json(&first.join("twin/twin.json")),
        json(&first.join("capture/truth.json")),
    );
    let mass = &twin["bodies"][0]["links"][0]["mass"]["ci95"];
    let right = truth["bodies"]["box"]["mass"].as_f64().expect("a mass");
    assert!(
        mass[0].as_f64() <= Some(right) && Some(right) <= mass[1].as_f64(),
        "{mass} for {right}"
    );
}

#[test]
fn a_rig_of_no_known_kind_is_refused() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    for (rig, place) in [
        ("robot", "--rig robot"),
        ("lab:tinny", "tiny"),
        ("exec: ", "exec:COMMAND"),
    ] {
        let made = explore(rig, &dir.path().join("out"), "5");
        assert_eq!(made.status.code(), Some(2), "{rig}");
        assert!(String::from_utf8_lossy(&made.stderr).contains(place), "{rig}");
    }
}
