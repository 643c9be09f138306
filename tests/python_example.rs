//! The Python example writes a capture that is read without a complaint.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "tests may stop and print"
)]

#[path = "common/python.rs"]
mod python;

use std::path::Path;
use std::process::Command;

use palpate::capture::{inspect, read_capture};
use python::python;

#[test]
fn the_python_example_writes_a_sound_capture() {
    let Some(python) = python() else { return };
    let parent = tempfile::tempdir().expect("a temporary folder");
    let folder = parent.path().join("capture");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/write_capture.py");
    let output = Command::new(python)
        .arg(&script)
        .arg(&folder)
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let capture = read_capture(&folder).unwrap_or_else(|error| panic!("{error}"));
    let inspection = inspect(&capture);
    assert_eq!((capture.views.len(), capture.interactions.len()), (2, 2));
    assert!(inspection.doubts.is_empty(), "{:?}", inspection.doubts);
    let peak = inspection.interactions[1].peak_force.expect("a force");
    assert!((peak - 0.5 * 9.80665).abs() < 0.2, "{peak}");
    assert!(inspection.interactions[0].moved[0].net > 0.04);
}
