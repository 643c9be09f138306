//! The whole program on recordings: worlds of another simulator with their answers, real pushes, a real range camera.
//!
//! Needs the recordings named by `PALPATE_DATA`; without them every test says that it is skipped.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

fn recording(name: &str) -> Option<PathBuf> {
    let Some(root) = std::env::var_os("PALPATE_DATA") else {
        println!("skipped: PALPATE_DATA is not set");
        return None;
    };
    let folder = PathBuf::from(root).join(name);
    if folder.join("capture.json").is_file() {
        return Some(folder);
    }
    println!("skipped: {} is no capture", folder.display());
    None
}

fn palpate(words: &[&Path]) -> Output {
    let out = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .output()
        .expect("palpate runs");
    assert!(
        out.status.success(),
        "{words:?}: {}{}",
        String::from_utf8_lossy(&out.stdout),
        String::from_utf8_lossy(&out.stderr)
    );
    out
}

/// Reconstructs, has every export loaded again, and gives the twin's folder (kept while the first lives).
fn twin_of(capture: &Path) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let twin = dir.path().join("twin");
    palpate(&["reconstruct".as_ref(), capture, "--out".as_ref(), &twin, "-q".as_ref()]);
    palpate(&["check".as_ref(), &twin]);
    (dir, twin)
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).expect("read")).expect("JSON")
}

/// Scores against the recording's own answers: every row of `wanted` is there and measured, within `share` of the
/// truth where it is a number with an interval that holds it, and right where it is a word.
fn scored(name: &str, wanted: &[(&str, &str)], share: f64) {
    let Some(capture) = recording(name) else { return };
    let (_dir, twin) = twin_of(&capture);
    let truth = capture.join("truth.json");
    let out = palpate(&["score".as_ref(), &twin, "--truth".as_ref(), &truth, "--json".as_ref()]);
    let score: Value = serde_json::from_slice(&out.stdout).expect("JSON");
    for (about, quantity) in wanted {
        let row = score["rows"]
            .as_array()
            .expect("rows")
            .iter()
            .find(|r| r["about"] == *about && r["quantity"] == *quantity)
            .unwrap_or_else(|| panic!("{name}: no row of {about} {quantity}"));
        println!("{name}: {row}");
        assert_eq!(row["status"], "measured", "{name}: {row}");
        assert_ne!(row["holds"], false, "{name}: the interval misses: {row}");
        assert_ne!(row["right"], false, "{name}: {row}");
        assert!(row["relative"].as_f64().is_none_or(|r| r <= share), "{name}: {row}");
    }
}

#[test]
fn a_tin_of_another_simulator() {
    scored("mujoco-tin", &[("tin", "mass"), ("tin", "friction_kinetic")], 0.04);
}

#[test]
fn a_pad_of_another_simulator() {
    scored("mujoco-pad", &[("pad", "stiffness")], 0.04);
}

#[test]
fn a_stack_of_another_simulator() {
    scored("mujoco-stack", &[("top", "mass"), ("low|top", "relation")], 0.04);
}

#[test]
fn a_hinge_of_another_simulator() {
    scored(
        "mujoco-hinge",
        &[("base|arm", "type"), ("base|arm", "axis"), ("base|arm", "relation")],
        0.04,
    );
    let Some(capture) = recording("mujoco-hinge") else {
        return;
    };
    // Its bars rock on their corners: what that leaves in doubt is told, and nothing is wrong beyond it.
    let (_dir, twin) = twin_of(&capture);
    assert_eq!(json(&twin.join("diagnosis.json"))["verdict"], "adequate");
}

#[test]
fn a_slope_that_is_not_mentioned_leaves_the_verdict_open() {
    scored("mujoco-hidden", &[("tin", "mass"), ("tin", "friction_kinetic")], 0.04);
    let Some(capture) = recording("mujoco-hidden") else {
        return;
    };
    let (_dir, twin) = twin_of(&capture);
    assert_ne!(json(&twin.join("diagnosis.json"))["verdict"], "adequate");
}

/// Friction force of real pushes near the nominal mu·m·g of the data's authors; mass alone is not to be known.
#[test]
fn real_pushes_tell_the_friction_force_and_not_the_mass() {
    for (name, nominal) in [
        ("cmu-push-hardboard-patch", 4.2),
        ("cmu-push-plywood-3pt-10-90-10-10-30-130", 5.0),
    ] {
        let Some(capture) = recording(name) else { return };
        let (_dir, folder) = twin_of(&capture);
        let twin = json(&folder.join("twin.json"));
        let link = &twin["bodies"][0]["links"][0];
        let force = &link["friction_force"]["kinetic"];
        println!("{name}: {} N {}, nominal {nominal} N", force["value"], force["ci95"]);
        assert_eq!(force["status"], "measured", "{name}");
        let (low, high) = (
            force["ci95"][0].as_f64().expect("low"),
            force["ci95"][1].as_f64().expect("high"),
        );
        assert!(low <= nominal && nominal <= high, "{name}: {nominal} N is outside");
        assert!(high - low < 0.25 * nominal, "{name}: an interval that says little");
        assert_eq!(link["mass"]["status"], "assumed", "{name}");
        assert_eq!(link["mass"]["confounded"]["known"], "friction_force.kinetic", "{name}");
    }
}

/// Views of a real range camera, no touch and no support given: things with surfaces, and a GLB that reads back whole.
#[test]
fn a_real_shelf_is_reconstructed_to_a_valid_file() {
    let Some(capture) = recording("shelf-views") else {
        return;
    };
    let (_dir, folder) = twin_of(&capture);
    let twin = json(&folder.join("twin.json"));
    let bodies = twin["bodies"].as_array().expect("bodies");
    println!("shelf-views: {} bodies", bodies.len());
    assert!(!bodies.is_empty(), "nothing was found");
    for link in bodies.iter().flat_map(|b| b["links"].as_array().expect("links")) {
        assert!(link.get("mass").is_none(), "nobody touched {}", link["name"]);
        let mesh = folder.join(link["mesh"].as_str().expect("a mesh"));
        assert!(
            fs::metadata(&mesh).expect("the mesh").len() > 1000,
            "{}",
            mesh.display()
        );
    }
    let (document, buffers, _) = gltf::import(folder.join("scene.glb")).expect("a valid GLB");
    let mut corners = 0;
    for primitive in document.meshes().flat_map(|m| m.primitives().collect::<Vec<_>>()) {
        let reader = primitive.reader(|b| Some(&buffers[b.index()]));
        for p in reader.read_positions().expect("positions") {
            assert!(p.iter().all(|x| x.is_finite()));
            corners += 1;
        }
    }
    assert!(corners > 1000, "{corners} corners");
}

/// A twin whose exports are not loaded again: what is thrown has its first pose in the air, and falls there.
fn thrown_twin_of(capture: &Path) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let twin = dir.path().join("twin");
    palpate(&["reconstruct".as_ref(), capture, "--out".as_ref(), &twin, "-q".as_ref()]);
    (dir, twin)
}

/// The causes of every finding, each with its rivals.
fn named(twin: &Path) -> Vec<Vec<String>> {
    let diagnosis = json(&twin.join("diagnosis.json"));
    let findings = diagnosis["findings"].as_array().expect("findings");
    let of = |f: &Value| {
        let rivals = f["alternatives"].as_array().expect("alternatives").iter();
        let all = std::iter::once(&f["cause"]).chain(rivals.map(|a| &a["cause"]));
        all.map(|c| c.as_str().expect("a word").to_owned()).collect()
    };
    findings.iter().map(of).collect()
}

#[test]
fn the_tossed_cube_falls_too_slowly_and_lies_too_low() {
    let Some(capture) = recording("cube-tosses") else {
        return;
    };
    let (_dir, twin) = thrown_twin_of(&capture);
    let link = &json(&twin.join("twin.json"))["bodies"][0]["links"][0];
    let value = |e: &Value| e["value"].as_f64().expect("a number");
    assert!(
        (0.1..0.35).contains(&value(&link["restitution"])),
        "{}",
        link["restitution"]
    );
    assert!((0.15..0.25).contains(&value(&link["friction"]["kinetic"])));
    let gravity = value(&link["tossed"]["gravity"]);
    assert!((9.58..9.70).contains(&gravity), "{gravity}");
    let low = value(&link["tossed"]["resting_height"]);
    assert!((-1.3e-3..-1.0e-3).contains(&low), "{low}");
    let both = ["length-scale", "gravity-error"];
    let found = named(&twin);
    assert!(
        found.iter().any(|f| both.iter().all(|c| f.iter().any(|n| n == c))),
        "{found:?}"
    );
    let base = &json(&twin.join("diagnosis.json"))["base"]["rmse"];
    assert!(base["position-in-flight"].as_f64().expect("flights") < 1e-3);
    assert!(base["position"].as_f64().expect("contacts") < 4e-3);
}

#[test]
fn the_tossed_elbow_tells_of_its_hinge() {
    let Some(capture) = recording("elbow-tosses") else {
        return;
    };
    let (_dir, twin) = thrown_twin_of(&capture);
    let joint = &json(&twin.join("twin.json"))["bodies"][0]["joints"][0];
    for what in ["friction", "damping"] {
        let [low, high] = [0, 1].map(|k| joint[what]["ci95"][k].as_f64().expect("an interval"));
        assert!(low >= 0.0 && high < 0.01 && high > low, "{what}: {low} to {high}");
        // Over the mass alone: nobody weighed it.
        assert_eq!(joint[what]["status"], "assumed");
        assert!(joint[what]["confounded"].is_object());
    }
}

/// A sensor that repeats its readings at rest has no strays, however far the others are from the repeated ones.
#[test]
fn a_real_sensor_that_repeats_its_readings_has_no_strays() {
    let Some(capture) = recording("cmu-push-plywood-3pt-10-90-10-10-30-130") else {
        return;
    };
    let out = palpate(&["diagnose".as_ref(), &capture, "--json".as_ref(), "-q".as_ref()]);
    let said: Value = serde_json::from_slice(&out.stdout).expect("JSON");
    let findings = said["findings"].as_array().expect("findings");
    assert!(findings.iter().all(|f| f["cause"] != "outliers"), "{findings:?}");
}
