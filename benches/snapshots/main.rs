//! Parameters from snapshots beside what others do: prints tables for docs/BENCHMARKS.md.
//!
//! `PALPATE_PYTHON` names a Python with `mujoco`, `numpy` and `scipy` (and `pybullet`, `scikit-optimize` for the peer).
//! `PALPATE_PEERS` names the folder of the peer's scripts (`push_lib.py`, `bench_rippe_gp.py`); without it the comparison is
//! left out. Arguments choose parts: `speed`, `loop`, `mujoco`, `rapier` (the same tasks in both), `things`, `learnt`,
//! `peer-loop`. The things' captures are kept below `target/tmp` and made once.

#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::disallowed_macros,
    reason = "a bench that cannot run must stop"
)]

mod peer;
mod rapier;
mod tasks;
mod things;

use std::process::Command;

use nalgebra::Point3;
use palpate::geometry::Mesh;
use serde_json::Value;

fn main() {
    let chosen: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let runs = |part: &str| chosen.is_empty() || chosen.iter().any(|c| c == part);
    if runs("speed") || runs("loop") {
        peer::beside_the_peer(runs("loop"));
    }
    if runs("mujoco") || runs("rapier") {
        tasks::beside_engines(20);
    }
    if runs("things") || runs("learnt") {
        things::lab_things(20, runs("learnt"));
    }
    if runs("peer-loop") {
        peer::peer_loop();
    }
}

/// CPU seconds of this process and its threads.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").expect("a Linux");
    let fields: Vec<&str> = text
        .rsplit(')')
        .next()
        .expect("a stat line")
        .split_whitespace()
        .collect();
    let ticks: f64 = [11, 12]
        .iter()
        .map(|k| fields[*k].parse::<f64>().expect("a number"))
        .sum();
    ticks / 100.0
}

fn python(arguments: &[&str]) -> String {
    let python = std::env::var("PALPATE_PYTHON").unwrap_or_else(|_| "python3".into());
    let output = Command::new(python)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn json(text: &str) -> Value {
    let line = text.lines().rev().find(|l| l.starts_with('{')).expect("a line of JSON");
    serde_json::from_str(line).expect("parses")
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array()
        .expect("a list")
        .iter()
        .map(|x| x.as_f64().expect("a number"))
        .collect()
}

fn points(v: &Value) -> Mesh {
    let vertices = v
        .as_array()
        .expect("points")
        .iter()
        .map(numbers)
        .map(|p| Point3::new(p[0], p[1], p[2]))
        .collect();
    Mesh {
        vertices,
        ..Mesh::default()
    }
}
