//! The command line as a user meets it: exit codes, messages, determinism, odd captures.
#![allow(
    clippy::expect_used,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn palpate(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .output()
        .expect("palpate runs")
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// Every file below a folder by its path, with its bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in fs::read_dir(&next).expect("listed") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                found.insert(
                    text(path.strip_prefix(folder).expect("below")),
                    fs::read(&path).expect("read"),
                );
            }
        }
    }
    found
}

#[test]
fn same_seed_same_bytes_whatever_the_threads() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| dir.path().join(name);
    for (name, threads) in [("c1", "1"), ("c2", "2")] {
        let made = palpate(&[
            "synth",
            "lab:tiny",
            "--out",
            &text(&at(name)),
            "--threads",
            threads,
            "-q",
            "--seed",
            "7",
        ]);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
    assert!(
        files(&at("c1")) == files(&at("c2")),
        "captures differ between one and two threads"
    );
    for (name, threads) in [("t1", "1"), ("t2", "2"), ("t3", "2")] {
        let made = palpate(&[
            "reconstruct",
            &text(&at("c1")),
            "--out",
            &text(&at(name)),
            "--threads",
            threads,
            "-q",
        ]);
        assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    }
    let first = files(&at("t1"));
    assert!(first.contains_key("twin.json") && first.contains_key("report.html") && first.contains_key("scene.glb"));
    for other in ["t2", "t3"] {
        for (name, bytes) in files(&at(other)) {
            assert!(first.get(&name) == Some(&bytes), "{name} differs in {other}");
        }
    }
}

#[test]
fn wrong_usage_exits_with_two_and_one_message() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let foreign = dir.path().join("mine");
    fs::create_dir(&foreign).expect("made");
    fs::write(foreign.join("thesis.txt"), "years of work").expect("written");
    let capture = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/tiny/capture");
    let cases: [(&[&str], &str); 6] = [
        (&["reconstrct"], "reconstruct"),
        (
            &["reconstruct", capture, "--out", "x", "--pass", "shap"],
            "did you mean shape",
        ),
        (&["reconstruct", "/nowhere", "--out", "x"], "/nowhere"),
        (
            &["reconstruct", capture, "--out", &text(&foreign)],
            "will not be replaced",
        ),
        (&["schema", "twn"], "did you mean twin"),
        (&["synth", "lab:tinny", "--out", "x"], "tiny"),
    ];
    for (words, expected) in cases {
        let out = palpate(words);
        let message = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{words:?}: {message}");
        assert!(message.contains(expected), "{words:?}: {message}");
    }
    assert_eq!(
        fs::read_to_string(foreign.join("thesis.txt")).expect("kept"),
        "years of work"
    );
}

#[test]
fn every_command_shows_an_example() {
    for command in [
        "demo",
        "synth",
        "reconstruct",
        "inspect",
        "schema",
        "score",
        "check",
        "view",
        "calibrate",
        "explore",
    ] {
        let out = palpate(&[command, "--help"]);
        assert!(out.status.success());
        assert!(
            String::from_utf8_lossy(&out.stdout).contains("Example"),
            "{command} --help has no example"
        );
    }
}

#[test]
fn schemas_and_json_results_are_json() {
    for format in ["capture", "twin", "diagnosis", "truth"] {
        let out = palpate(&["schema", format]);
        let schema: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
        assert!(schema.get("properties").is_some(), "{format}");
    }
    let capture = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/tiny/capture");
    let out = palpate(&["inspect", capture, "--json"]);
    serde_json::from_slice::<serde_json::Value>(&out.stdout).expect("JSON");
}

/// The golden capture with one list of its document emptied.
fn without(key: &str, to: &Path) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/tiny/capture");
    for (name, bytes) in files(&from) {
        let path = to.join(&name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("made");
        fs::write(path, bytes).expect("written");
    }
    let document = to.join("capture.json");
    let mut json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&document).expect("read")).expect("JSON");
    json.as_object_mut().expect("an object").remove(key);
    fs::write(document, json.to_string()).expect("written");
}

#[test]
fn captures_without_views_or_without_touches_are_reconstructed() {
    for key in ["views", "interactions", "support"] {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let capture = dir.path().join("capture");
        without(key, &capture);
        let twin = dir.path().join("twin");
        let out = palpate(&["reconstruct", &text(&capture), "--out", &text(&twin), "-q"]);
        assert!(
            out.status.success(),
            "without {key}: {}",
            String::from_utf8_lossy(&out.stderr)
        );
        let checked = palpate(&["check", &text(&twin)]);
        assert!(
            checked.status.success(),
            "without {key}: {}",
            String::from_utf8_lossy(&checked.stdout)
        );
    }
}

/// A copy of the golden capture whose interactions all name a body that no view shows and no frame sees.
fn of_unseen_bodies(to: &Path) {
    without("support", to);
    let document = to.join("capture.json");
    let mut json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&document).expect("read")).expect("JSON");
    for interaction in json["interactions"].as_array_mut().expect("interactions") {
        let track = interaction["tracks"]["box"].clone();
        interaction["tracks"] = serde_json::json!({ "ghost": track });
        interaction["target"] = "ghost".into();
        let file = to.join(track.as_str().expect("a path"));
        let text = fs::read_to_string(&file).expect("read");
        fs::write(&file, far_away(&text)).expect("written");
    }
    fs::write(document, json.to_string()).expect("written");
}

/// The track moved by three metres along x, out of every view.
fn far_away(track: &str) -> String {
    let mut lines = track.lines();
    let head = lines.next().expect("a head");
    let x = head.split(',').position(|c| c.trim() == "x").expect("a column x");
    let moved = lines.map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(value) = cells[x].parse::<f64>() {
            cells[x] = (value + 3.0).to_string();
        }
        cells.join(",")
    });
    std::iter::once(head.to_owned())
        .chain(moved)
        .collect::<Vec<_>>()
        .join("\n")
        + "\n"
}

#[test]
fn touches_of_bodies_that_no_view_shows_are_reconstructed() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (capture, twin) = (dir.path().join("capture"), dir.path().join("twin"));
    of_unseen_bodies(&capture);
    let out = palpate(&["reconstruct", &text(&capture), "--out", &text(&twin), "-q"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(palpate(&["check", &text(&twin)]).status.success());
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(twin.join("twin.json")).expect("read")).expect("JSON");
    let bodies = json["bodies"].as_array().expect("bodies");
    let mut links = bodies.iter().flat_map(|b| b["links"].as_array().expect("links"));
    let ghost = links
        .find(|l| l["name"] == "ghost")
        .expect("what was touched is in the twin");
    assert!(
        ghost.get("mesh").is_none_or(serde_json::Value::is_null),
        "nobody saw it"
    );
    assert_eq!(ghost["mass"]["status"], "measured", "it was lifted: {}", ghost["mass"]);
}

#[test]
fn the_built_in_scenes_are_listed() {
    let out = palpate(&["synth", "--list"]);
    let listed = String::from_utf8_lossy(&out.stdout).into_owned();
    for name in ["demo", "tiny", "hinge", "drawer", "weighted-box"] {
        assert!(listed.lines().any(|l| l.trim() == name), "{listed}");
    }
    let out = palpate(&["synth", "--list", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(json["scenes"].as_array().expect("a list").len(), listed.lines().count());
}

#[test]
fn a_score_is_one_json_object_and_finds_the_truth() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let twin = dir.path().join("twin");
    let capture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/tiny/capture");
    let made = palpate(&["reconstruct", &text(&capture), "--out", &text(&twin), "-q"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let truth = text(&capture.join("truth.json"));
    let out = palpate(&["score", &text(&twin), "--truth", &truth, "--json"]);
    let score: serde_json::Value = serde_json::from_slice(&out.stdout).expect("one JSON object");
    let rows = score["rows"].as_array().expect("rows");
    let mass = rows
        .iter()
        .find(|r| r["quantity"] == "mass")
        .expect("a row of the mass");
    assert_eq!(mass["holds"], true, "{mass}");
    assert!(mass["relative"].as_f64().expect("a share") < 0.02, "{mass}");
}

#[test]
fn an_input_that_is_not_there_is_the_callers_mistake() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let nothing = text(&dir.path().join("nothing"));
    let out = text(&dir.path().join("out"));
    let folder = text(dir.path());
    let calls: [&[&str]; 8] = [
        &["score", &nothing, "--truth", &nothing],
        &["check", &nothing],
        &["synth", &nothing, "--out", &out],
        &["synth", &folder, "--out", &out],
        &["reconstruct", &nothing, "--out", &out],
        &["inspect", &nothing],
        &["view", &nothing, "--no-open"],
        &["calibrate", "friction", &nothing],
    ];
    for call in calls {
        let said = palpate(call);
        let message = String::from_utf8_lossy(&said.stderr);
        assert_eq!(said.status.code(), Some(2), "{call:?}: {message}");
        assert!(
            message.contains(dir.path().to_str().expect("a path")),
            "{call:?}: {message}"
        );
        assert!(!Path::new(&out).exists(), "{call:?} wrote something");
    }
}

#[cfg(not(feature = "rerun"))]
#[test]
fn a_recording_for_rerun_needs_its_feature_and_says_so() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let out = dir.path().join("twin");
    let done = palpate(&[
        "reconstruct",
        "tests/golden/tiny/capture",
        "--out",
        &text(&out),
        "--rerun",
    ]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(said.contains("--features rerun"), "{said}");
    assert!(!out.exists(), "something was written");
}
