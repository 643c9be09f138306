//! Many captures at once, and what a hand does as an animation.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn palpate(words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .output()
        .expect("palpate runs")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path of text")
}

fn made(words: &[&str]) {
    let output = palpate(words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn rows(output: &Output) -> Vec<(String, usize)> {
    let value: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    let rows = value["captures"].as_array().expect("a list");
    let row = |r: &Value| {
        let masses = r["masses"].as_u64().expect("a number");
        (r["status"].as_str().expect("a word").to_owned(), masses as usize)
    };
    rows.iter().map(row).collect()
}

#[test]
fn a_batch_makes_all_it_can_keeps_what_is_there_and_tells_what_failed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    for (name, seed) in [("one", "1"), ("two", "2")] {
        made(&["synth", "lab:tiny", "--out", text(&at(name)), "--seed", seed, "-q"]);
    }
    let (one, two, lost) = (at("one"), at("two"), at("lost"));
    let run = |out: &str, threads: &str, captures: &[&Path]| {
        let out = at(out);
        let mut words = vec!["batch"];
        words.extend(captures.iter().map(|c| text(c)));
        words.extend(["--out", text(&out), "--threads", threads, "--json"]);
        palpate(&words)
    };
    let first = run("a", "1", &[&one]);
    assert!(first.status.success());
    assert_eq!(rows(&first), [("made".to_owned(), 1)]);
    let second = run("a", "1", &[&one, &lost, &two]);
    assert_eq!(second.status.code(), Some(1));
    let words: Vec<String> = rows(&second).into_iter().map(|r| r.0).collect();
    assert_eq!(words, ["kept", "failed", "made"]);
    assert!(!at("a").join("lost").exists());

    assert!(run("b", "2", &[&two, &one]).status.success());
    for name in ["one/twin.json", "two/twin.json", "two/scene.xml", "two/report.html"] {
        let read = |out: &str| fs::read(at(out).join(name)).expect("read");
        assert!(read("a") == read("b"), "{name} depends on the threads");
    }
    assert_eq!(run("c", "1", &[&one, &one]).status.code(), Some(2));
}

#[test]
fn a_lift_is_filmed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    made(&["synth", "lab:tiny", "--out", text(&at("capture")), "-q"]);
    made(&["reconstruct", text(&at("capture")), "--out", text(&at("twin")), "-q"]);
    let film = at("film.glb");
    made(&[
        "simulate",
        text(&at("twin")),
        "--do",
        "pick:box",
        "--film",
        text(&film),
        "-q",
    ]);
    let (document, buffers, _) = gltf::import(&film).expect("a binary glTF");
    let animation = document.animations().next().expect("an animation");
    let channel = animation
        .channels()
        .find(|c| {
            let target = c.target();
            target.node().name() == Some("box") && target.property() == gltf::animation::Property::Translation
        })
        .expect("the box moves");
    let reader = channel.reader(|b| Some(&buffers[b.index()]));
    let times: Vec<f32> = reader.read_inputs().expect("times").collect();
    let Some(gltf::animation::util::ReadOutputs::Translations(places)) = reader.read_outputs() else {
        panic!("no translations");
    };
    let places: Vec<[f32; 3]> = places.collect();
    assert_eq!(times.len(), places.len());
    assert!(times.windows(2).all(|w| w[1] > w[0]) && *times.last().expect("an end") > 2.0);
    let rise = places.last().expect("an end")[2] - places[0][2];
    assert!((rise - 0.12).abs() < 5e-3, "rises by {rise} m");
}
