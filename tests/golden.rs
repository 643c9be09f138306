//! Golden files: a small synthetic capture in the repository, its outputs compared number by number.
//!
//! `PALPATE_BLESS=1 cargo test --release --test golden` writes the outputs anew; read the diff before you commit it.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

const OUTPUTS: [&str; 4] = ["twin.json", "diagnosis.json", "scene.urdf", "scene.xml"];

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/tiny")
}

/// Numbers may differ in the last digits between processors; everything else must be the same.
fn same(place: &str, a: &Value, b: &Value) {
    match (a, b) {
        (Value::Number(x), Value::Number(y)) => {
            let (x, y) = (x.as_f64().expect("a number"), y.as_f64().expect("a number"));
            let near = (x - y).abs() <= 1e-6 * x.abs().max(y.abs()) + 1e-9;
            assert!(near, "{place}: {x} is golden, {y} was made");
        }
        (Value::Array(x), Value::Array(y)) => {
            assert_eq!(x.len(), y.len(), "{place}: another length");
            x.iter()
                .zip(y)
                .enumerate()
                .for_each(|(i, (x, y))| same(&format!("{place}[{i}]"), x, y));
        }
        (Value::Object(x), Value::Object(y)) => {
            let keys = |o: &serde_json::Map<String, Value>| o.keys().cloned().collect::<Vec<_>>();
            assert_eq!(keys(x), keys(y), "{place}: other keys");
            x.iter().for_each(|(k, v)| same(&format!("{place}.{k}"), v, &y[k]));
        }
        _ => assert_eq!(a, b, "{place}"),
    }
}

/// A text as a list of its words, numbers apart from the rest.
fn words(text: &str) -> Value {
    let pieces = text
        .split(|c: char| c.is_whitespace() || "\"<>=".contains(c))
        .filter(|w| !w.is_empty());
    pieces
        .map(|w| w.parse::<f64>().map_or_else(|_| Value::from(w), Value::from))
        .collect()
}

#[test]
fn the_outputs_of_the_tiny_capture_are_golden() {
    let out = tempfile::tempdir().expect("a temporary folder");
    let made = out.path().join("twin");
    let status = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["reconstruct", "-q", "--out"])
        .arg(&made)
        .arg(golden().join("capture"))
        .status()
        .expect("palpate runs");
    assert!(status.success());
    for name in OUTPUTS {
        let (new, old) = (made.join(name), golden().join(name));
        if std::env::var_os("PALPATE_BLESS").is_some() {
            fs::copy(&new, &old).expect("blessed");
            println!("blessed {}", old.display());
            continue;
        }
        let read = |p: &Path| fs::read_to_string(p).unwrap_or_else(|e| panic!("{}: {e}", p.display()));
        let (new, old) = (read(&new), read(&old));
        if name.ends_with(".json") {
            let parse = |t: &str| serde_json::from_str::<Value>(t).expect("JSON");
            same(name, &parse(&old), &parse(&new));
        } else {
            same(name, &words(&old), &words(&new));
        }
    }
}
