//! A capture's own push played in engines with the twin that was made of the capture.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

#[allow(dead_code, reason = "not every test uses all of it")]
#[path = "common/python.rs"]
mod python;

fn palpate(words: &[&str], interpreter: Option<&str>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    if let Some(interpreter) = interpreter {
        command.env("PALPATE_PYTHON", interpreter);
    }
    command.args(words).output().expect("palpate runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path of text")
}

/// The twin of the lab's smallest scene, with the capture beside it.
fn twin(folder: &Path) -> PathBuf {
    let (capture, twin) = (folder.join("capture"), folder.join("twin"));
    let made = palpate(&["synth", "lab:tiny", "--out", text(&capture), "-q"], None);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let made = palpate(&["reconstruct", text(&capture), "--out", text(&twin), "-q"], None);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    twin
}

fn played(twin: &Path, engines: &str, interpreter: Option<&str>) -> Value {
    let done = palpate(&["check", text(twin), "--engines", engines, "--json"], interpreter);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).expect("one JSON object")
}

/// The lab's own dynamics made the push, so that the engines have a truth that is not theirs.
fn assert_near(engine: &Value) {
    let touches = engine["touches"].as_array().expect("a list");
    assert_eq!(touches.len(), 1, "the push alone can be played: {engine}");
    let row = &touches[0]["outcome"]["played"];
    let relative = row["relative_error"].as_f64().expect("a number");
    let turn = row["turn_error"].as_f64().expect("a number").to_degrees();
    assert!(relative < 0.10 && turn < 5.0, "{engine}");
    let force = row["force_rms"].as_f64().expect("a force") / row["force_measured"].as_f64().expect("a force");
    assert!(force < 0.6, "{engine}");
    for part in engine["rest"].as_array().expect("a list") {
        let (drift, turn) = (part["drift"].as_f64(), part["turn"].as_f64());
        assert!(drift < Some(1e-3) && turn < Some(0.5_f64.to_radians()), "{engine}");
    }
}

#[test]
fn a_push_is_played_again_in_engines() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let twin = twin(folder.path());
    let report = played(&twin, "rapier", None);
    assert_eq!(report["played"]["skipped"].as_array().map(Vec::len), Some(1));
    assert_near(&report["played"]["engines"][0]);
    for engine in ["mujoco", "pybullet", "pydrake"] {
        if let Some(interpreter) = python::python_with(engine) {
            let name = if engine == "pydrake" { "drake" } else { engine };
            let report = played(&twin, name, Some(&interpreter));
            let there = &report["played"]["engines"][0];
            assert!(there["silent"].is_null(), "{there}");
            if name == "mujoco" {
                assert_near(there);
            }
        }
    }
}

#[test]
fn an_engine_that_is_not_there_is_told_and_a_capture_that_is_gone_is_asked_for() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let twin = twin(folder.path());
    let report = played(&twin, "rapier,mujoco", Some("/no/such/python"));
    let engines = report["played"]["engines"].as_array().expect("a list");
    assert!(engines[0]["silent"].is_null());
    let why = engines[1]["silent"].as_str().expect("a reason");
    assert!(why.contains("pip install mujoco"), "{why}");

    std::fs::remove_dir_all(folder.path().join("capture")).expect("removed");
    let lost = palpate(&["check", text(&twin), "--engines", "rapier"], None);
    assert_eq!(lost.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&lost.stderr).contains("--capture"));
    let wrong = palpate(&["check", text(&twin), "--engines", "havok"], None);
    assert_eq!(wrong.status.code(), Some(2));
}

/// Changes a JSON file.
fn alter(file: &Path, change: impl FnOnce(&mut Value)) {
    let mut value: Value = serde_json::from_slice(&std::fs::read(file).expect("a file")).expect("JSON");
    change(&mut value);
    std::fs::write(file, serde_json::to_vec(&value).expect("JSON")).expect("written");
}

/// A twin whose centre of mass is moved by as much as its interval is then said to allow misses the push, and that is found.
#[test]
fn a_wrong_number_is_found_to_be_the_reason_and_the_report_shows_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let twin = twin(folder.path());
    let capture = folder.path().join("capture");
    alter(&twin.join("twin.json"), |t| {
        let com = &mut t["bodies"][0]["links"][0]["com"];
        for k in 0..2 {
            let moved = com["value"][k].as_f64().expect("a number") + 0.012;
            com["value"][k] = moved.into();
            com["sd"][k] = 0.01.into();
            com["ci95"][k] = vec![moved - 0.02, moved + 0.02].into();
        }
    });
    alter(&capture.join("capture.json"), |c| {
        let all = c["interactions"].as_array_mut().expect("a list");
        all.iter_mut()
            .filter(|i| i["kind"] == "push")
            .for_each(|i| i["held_out"] = true.into());
    });
    let words = ["export", text(&twin), "--to", "mjcf,urdf,glb", "-q"];
    assert!(palpate(&words, None).status.success());
    let words = [
        "check",
        text(&twin),
        "--engines",
        "rapier",
        "--capture",
        text(&capture),
        "--json",
    ];
    let done = palpate(&words, None);
    let report: Value = serde_json::from_slice(&done.stdout).expect("one JSON object");
    let reason = &report["played"]["reasons"][0];
    let judged = &reason["judged"][0];
    assert_eq!(judged["cause"], "doubt", "{reason}");
    let first = judged["likely"][0][0].as_u64().expect("an index") as usize;
    let what = reason["sources"][first]["what"].as_str().expect("words");
    assert!(what.starts_with("centre of mass"), "{reason}");

    // Kept beside the twin, and in the report once however often it is asked for.
    assert!(twin.join("engines.json").is_file());
    palpate(&words, None);
    let page = std::fs::read_to_string(twin.join("report.html")).expect("a report");
    assert_eq!(page.matches("<section id=\"engines\"").count(), 1);
    assert_eq!(page.matches("href=\"#engines\"").count(), 1);
    assert!(page.contains("Why they were missed") && page.contains("centre of mass of"));
}
