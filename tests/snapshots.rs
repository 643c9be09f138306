//! Captures of snapshot pairs, made with MuJoCo as the world: what they tell, what they do not, and that odd ones break nothing.

#![allow(
    clippy::disallowed_macros,
    clippy::expect_used,
    clippy::panic,
    reason = "a test speaks and fails aloud"
)]

#[path = "common/python.rs"]
mod python;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// A capture in a folder of its own, or nothing where there is no MuJoCo.
fn made(folder: &Path, arguments: &[&str]) -> Option<PathBuf> {
    let python = python::python()?;
    let has_mujoco = Command::new(&python)
        .args(["-c", "import mujoco, scipy"])
        .output()
        .expect("starts");
    if !has_mujoco.status.success() {
        println!("skipped: that python has no mujoco or no scipy");
        return None;
    }
    let out = folder.join("capture");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/worlds/snapshot_world.py");
    let run = Command::new(python)
        .arg(script)
        .arg(&out)
        .args(arguments)
        .output()
        .expect("starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    Some(out)
}

fn reconstruct(capture: &Path, out: &Path, threads: &str) {
    let run = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["reconstruct", "--threads", threads])
        .arg(capture)
        .arg("--out")
        .arg(out)
        .output()
        .expect("starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("reads")).expect("parses")
}

fn link(twin: &Path) -> Value {
    json(&twin.join("twin.json"))["bodies"][0]["links"][0].clone()
}

fn interval(estimate: &Value) -> [f64; 2] {
    [0, 1].map(|k| estimate["ci95"][k].as_f64().expect("an interval"))
}

#[test]
fn snapshots_tell_friction_and_leave_the_mass_open() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--seed", "11", "--thing", "box", "--trials", "4", "--friction", "0.4"];
    let train = [
        "--train",
        "stick:push,stick:tap_from_left,rake:tap_from_right,rake:draw,hook:tap_from_left",
    ];
    let Some(capture) = made(folder.path(), &[arguments.as_slice(), train.as_slice()].concat()) else {
        return;
    };
    let (twin, again) = (folder.path().join("twin"), folder.path().join("again"));
    reconstruct(&capture, &twin, "1");
    reconstruct(&capture, &again, "2");
    assert_eq!(
        fs::read(twin.join("twin.json")).expect("reads"),
        fs::read(again.join("twin.json")).expect("reads"),
        "the threads change nothing"
    );
    let link = link(&twin);
    let kinetic = &link["friction"]["kinetic"];
    assert_eq!(kinetic["method"], "bayesian-optimisation");
    assert_eq!(kinetic["status"], "measured");
    let [low, high] = interval(kinetic);
    assert!(low <= 0.4 && 0.4 <= high, "0.4 is not in {low} to {high}");
    assert!(high / low < 2.0, "{low} to {high} says little");
    assert_eq!(link["friction"]["rolling"]["status"], "assumed");
    assert_eq!(link["mass"]["status"], "assumed");
    assert_eq!(link["mass"]["confounded"]["known"], "friction.kinetic");
    assert!(link["mass"]["from"].as_array().expect("a list").is_empty());
    let diagnosis = json(&twin.join("diagnosis.json"));
    let tests = diagnosis["base"]["tests"].as_array().expect("tests");
    let held = |t: &&Value| t["residual"].as_str().is_some_and(|r| r.ends_with("held out"));
    assert_eq!(tests.iter().filter(held).count(), 1);
    let names = diagnosis["base"]["held_out"].as_array().expect("names");
    assert!(
        names
            .iter()
            .all(|n| n.as_str().is_some_and(|n| n.starts_with("hook-tap_from_right")))
    );
    let page = fs::read_to_string(twin.join("report.html")).expect("reads");
    assert!(page.contains("Before and after") && page.contains("Course of the search"));
}

#[test]
fn a_recorded_force_weighs_the_thing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--seed", "3", "--thing", "can", "--trials", "3", "--force"];
    let train = ["--train", "stick:push,rake:draw,rake:tap_from_left"];
    let Some(capture) = made(folder.path(), &[arguments.as_slice(), train.as_slice()].concat()) else {
        return;
    };
    let twin = folder.path().join("twin");
    reconstruct(&capture, &twin, "0");
    let mass = &link(&twin)["mass"];
    let truth = json(&capture.join("truth.json"))["bodies"]["thing"]["mass"]
        .as_f64()
        .expect("a mass");
    assert_eq!(mass["status"], "measured");
    let [low, high] = interval(mass);
    assert!(low <= truth && truth <= high, "{truth} is not in {low} to {high}");
}

#[test]
fn a_search_goes_on_where_it_was_stopped() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let train = ["--train", "stick:push,rake:draw"];
    let arguments = ["--seed", "7", "--thing", "box", "--trials", "2"];
    let Some(capture) = made(folder.path(), &[arguments.as_slice(), train.as_slice()].concat()) else {
        return;
    };
    let run = |out: &str, search: &str, evaluations: &str, seed: &str| {
        let run = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["reconstruct", "--seed", seed, "--snapshot-evaluations", evaluations])
            .arg("--snapshot-search")
            .arg(folder.path().join(search))
            .arg(&capture)
            .arg("--out")
            .arg(folder.path().join(out))
            .output()
            .expect("starts");
        run.status.code()
    };
    let text = |path: &str| fs::read_to_string(folder.path().join(path)).expect("reads");
    assert_eq!(run("stopped", "a.json", "14", "0"), Some(0));
    let first = json(&folder.path().join("a.json"));
    let asked = first["things"]["thing"]["search"]["evaluations"].as_array();
    assert_eq!(asked.map(Vec::len), Some(14));
    assert_eq!(run("resumed", "a.json", "20", "0"), Some(0));
    assert_eq!(run("whole", "b.json", "20", "0"), Some(0));
    assert_eq!(text("a.json"), text("b.json"));
    assert_eq!(text("resumed/twin.json"), text("whole/twin.json"));
    // A search of another seed is refused, and nothing is written.
    assert_eq!(run("other", "a.json", "20", "1"), Some(2));
    assert!(!folder.path().join("other").exists());
}

/// Every row of a file of poses as `change` makes it, its columns in their order; those that it makes empty are left out.
fn rows(path: &Path, change: impl Fn(usize, Vec<String>) -> Vec<String>) {
    let text = fs::read_to_string(path).expect("reads");
    let mut lines = text.lines();
    let mut out = vec![lines.next().expect("a head").to_owned()];
    for (n, line) in lines.enumerate() {
        let row = change(n, line.split(',').map(str::to_owned).collect());
        if !row.is_empty() {
            out.push(row.join(","));
        }
    }
    fs::write(path, out.join("\n")).expect("writes");
}

#[test]
fn pairs_without_their_half_and_tools_that_pass_by_are_told_of() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = ["--seed", "5", "--thing", "puck", "--trials", "3"];
    let Some(capture) = made(
        folder.path(),
        &[arguments.as_slice(), &["--train", "stick:push"]].concat(),
    ) else {
        return;
    };
    let track = |k: usize| capture.join(format!("tracks/stick-push-0{k}.csv"));
    let said = |name: &str| {
        let twin = folder.path().join(name);
        reconstruct(&capture, &twin, "0");
        let notices = json(&twin.join("twin.json"))["notices"].to_string();
        (link(&twin)["friction"]["kinetic"].is_object(), notices, twin)
    };
    let before_only = |n: usize, row: Vec<String>| if n == 0 { row } else { Vec::new() };
    rows(&track(0), before_only);
    let (told, notices, _) = said("half");
    assert!(told && notices.contains("1 trial(s) left out"), "{notices}");
    // A tool a metre above moves nothing in simulation.
    for k in 1..3 {
        rows(
            &capture.join(format!("tracks/stick-push-0{k}.tool.csv")),
            |_, mut row| {
                row[3] = "1.0".into();
                row
            },
        );
    }
    // What was held out is said not to have moved: intervals that hold everything do not make that well foretold.
    for k in 0..3 {
        let path = capture.join(format!("tracks/hook-tap_from_right-0{k}.csv"));
        let text = fs::read_to_string(&path).expect("reads");
        let mut lines: Vec<&str> = text.lines().collect();
        let (place, time) = (lines[1].split_once(',').expect("columns").1, lines[2].split(',').next());
        let stayed = format!("{},{place}", time.expect("a time"));
        lines[2] = &stayed;
        fs::write(&path, lines.join("\n")).expect("writes");
    }
    let (_, notices, twin) = said("above");
    assert!(notices.contains("does not reach it"), "{notices}");
    assert_eq!(json(&twin.join("diagnosis.json"))["verdict"], "unknown");
    for k in 1..3 {
        rows(&track(k), before_only);
    }
    let (told, notices, _) = said("none");
    assert!(!told && notices.contains("trial(s) left out"), "{notices}");
}

/// A change of `capture.json`.
type Change = fn(&mut Value);

/// Changes `capture.json`.
fn altered(capture: &Path, change: impl Fn(&mut Value)) {
    let path = capture.join("capture.json");
    let mut document = json(&path);
    change(&mut document);
    fs::write(&path, document.to_string()).expect("writes");
}

#[test]
fn odd_captures_of_snapshots_break_nothing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = [
        "--seed",
        "5",
        "--thing",
        "puck",
        "--trials",
        "2",
        "--train",
        "stick:push",
    ];
    let Some(capture) = made(folder.path(), &arguments) else {
        return;
    };
    let whole = fs::read_to_string(capture.join("capture.json")).expect("reads");
    let changes: [(&str, Change); 6] = [
        ("one without its path", |d| {
            d["interactions"][0]
                .as_object_mut()
                .expect("an object")
                .remove("tool_path");
        }),
        ("all without tools", |d| {
            for i in d["interactions"].as_array_mut().expect("a list") {
                i.as_object_mut().expect("an object").remove("tool");
            }
        }),
        ("all held out", |d| {
            for i in d["interactions"].as_array_mut().expect("a list") {
                i["held_out"] = true.into();
            }
        }),
        ("no shape", |d| {
            d.as_object_mut().expect("an object").remove("bodies");
        }),
        ("no support", |d| {
            d.as_object_mut().expect("an object").remove("support");
        }),
        ("no labels", |d| {
            for i in d["interactions"].as_array_mut().expect("a list") {
                let i = i.as_object_mut().expect("an object");
                i.remove("action");
                i.remove("tool_name");
                i.remove("target");
            }
        }),
    ];
    for (what, change) in changes {
        fs::write(capture.join("capture.json"), &whole).expect("writes");
        altered(&capture, change);
        let twin = folder.path().join(what.replace(' ', "-"));
        reconstruct(&capture, &twin, "0");
        assert!(twin.join("report.html").exists(), "{what}");
        let friction = &link(&twin)["friction"]["kinetic"];
        let told = matches!(what, "one without its path" | "no support" | "no labels");
        assert_eq!(friction.is_object(), told, "{what}: {friction}");
    }
}
