//! Somebody's own URDF of several parts against a capture: all right, and with one number wrong.
//! `tests/worlds/judge_imports.py` does so for more numbers, more seeds and worlds of MuJoCo.
#![allow(clippy::expect_used, clippy::panic, reason = "a test says what it found and stops")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

fn palpate(words: &[&str]) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_palpate")).args(words).output();
    let out = out.expect("palpate runs");
    assert!(
        out.status.success(),
        "{words:?}: {}",
        String::from_utf8_lossy(&out.stderr)
    );
    String::from_utf8(out.stdout).expect("text")
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("imported-{name}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// What `diagnose --model` says of the URDF after `change`: quantities outside and within, and what it holds otherwise.
fn told(work: &Path, capture: &str, file: &str, change: [&str; 2]) -> (Vec<String>, Vec<String>, Vec<String>) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/imported").join(file);
    let text = std::fs::read_to_string(source).expect("a URDF");
    assert!(text.contains(change[0]), "{file} has {}", change[0]);
    let own = work.join(file);
    std::fs::write(&own, text.replacen(change[0], change[1], 1)).expect("a copy");
    let model = work.join("model");
    let _ = std::fs::remove_dir_all(&model);
    let (own, model) = (own.to_str().expect("a path"), model.to_str().expect("a path"));
    palpate(&["import", "twin", own, "--out", model, "-q"]);
    let said: Value = serde_json::from_str(&palpate(&["diagnose", capture, "--model", model, "--json"])).expect("JSON");
    let numbers = said["numbers"].as_array().expect("numbers");
    let of = |outside: bool| {
        let those = numbers.iter().filter(|n| n["outside"] == outside);
        those
            .map(|n| n["quantity"].as_str().expect("a name").to_owned())
            .collect()
    };
    let structure = said["structure"].as_array().expect("structure");
    let words = structure.iter().map(|w| w.as_str().expect("words").to_owned());
    (of(true), of(false), words.collect())
}

#[test]
fn what_fixed_joints_hold_is_judged_as_one_thing() {
    let work = folder("stack");
    let capture = work.join("capture");
    let capture = capture.to_str().expect("a path");
    palpate(&["synth", "lab:glued-stack", "--seed", "61", "--out", capture, "-q"]);
    let check = |change: [&str; 2], wrong: &[&str], held: usize| {
        let (outside, within, structure) = told(&work, capture, "stack.urdf", change);
        assert_eq!(outside, wrong, "{change:?}");
        assert_eq!(structure.len(), held, "{structure:?}");
        assert!(within.len() + outside.len() >= 2, "{within:?}");
    };
    check(["0.33", "0.33"], &[], 0);
    check(["value=\"0.0500\"", "value=\"0.1500\""], &["mass", "com x"], 0);
    check(["value=\"0.33\"", "value=\"0.45\""], &["friction.kinetic"], 0);
}

#[test]
fn a_drawer_is_judged_by_what_its_joint_took() {
    let work = folder("drawer");
    let capture = work.join("capture");
    let capture = capture.to_str().expect("a path");
    palpate(&["synth", "lab:drawer", "--seed", "61", "--out", capture, "-q"]);
    let check = |change: [&str; 2], wrong: &[&str]| {
        let (outside, within, structure) = told(&work, capture, "drawer.urdf", change);
        assert_eq!(outside, wrong, "{change:?}");
        assert!(structure.is_empty(), "{structure:?}");
        assert!(within.len() >= 2, "{within:?}");
    };
    check(["damping=\"1.0\"", "damping=\"1.0\""], &[]);
    check(["damping=\"1.0\"", "damping=\"9.0\""], &["damping"]);
    check(["upper=\"0.106\"", "upper=\"0.126\""], &["upper end"]);
}
