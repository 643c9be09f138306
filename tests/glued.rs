//! What is glued together is foretold and diagnosed as the one thing that it is: a box of the lab, cut across into two halves
//! that go as one.
#![allow(clippy::expect_used, reason = "a test stops at what it did not expect")]

use std::path::Path;

use palpate::base::{Progress, Seed, rng_for};
use palpate::capture::{BodyPrior, Capture, Kind, MeshFile};
use palpate::lab::{hide_by_word, scene_named, synthesise};
use palpate::pipeline::{Options, Run, build};
use palpate::twin::{RelationKind, Verdict};
use rand::Rng;

/// The half of a mesh's height from `from` on, as shares of it; right for what is as wide everywhere.
fn slice(mesh: &MeshFile, name: &str, from: f64) -> MeshFile {
    let text = String::from_utf8(mesh.bytes.clone()).expect("text");
    let height = |line: &str| -> Option<f64> { line.strip_prefix("v ")?.split_whitespace().nth(2)?.parse().ok() };
    let heights: Vec<f64> = text.lines().filter_map(height).collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let whole = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low;
    let cut = |line: &str| match height(line) {
        Some(z) => {
            let plane: Vec<&str> = line.split_whitespace().take(3).collect();
            format!("{} {:.9}\n", plane.join(" "), low + from * whole + 0.5 * (z - low))
        }
        None => format!("{line}\n"),
    };
    MeshFile {
        path: mesh.path.with_file_name(format!("{name}.obj")),
        bytes: text.lines().map(cut).collect::<String>().into_bytes(),
    }
}

/// The capture with the only body of it as two, each tracked by itself.
fn halved(mut capture: Capture, seed: u64) -> Capture {
    let whole = capture.bodies[0].clone();
    let mesh = whole.mesh.as_ref().expect("a shape");
    let half = |name: &str, from: f64| BodyPrior {
        name: name.into(),
        mesh: Some(slice(mesh, name, from)),
        mass: None,
        mass_sd: None,
        ..whole.clone()
    };
    capture.bodies = vec![half("low", 0.0), half("top", 0.5)];
    let mut dice = rng_for(Seed(seed), "the other half");
    for interaction in &mut capture.interactions {
        let lifts = interaction.kind == Kind::Lift;
        let target = interaction.target.as_mut().filter(|t| **t == whole.name);
        target
            .into_iter()
            .for_each(|t| *t = if lifts { "top" } else { "low" }.into());
        let Some(track) = interaction.tracks.remove(&whole.name) else {
            continue;
        };
        let mut other = track.clone();
        for place in other.position.iter_mut().flat_map(|p| p.iter_mut()) {
            *place += dice.random_range(-2e-4..2e-4);
        }
        interaction
            .tracks
            .extend([("low".into(), track), ("top".into(), other)]);
    }
    capture
}

fn probed(hidden: &str, seed: u64) -> Run {
    let mut scene = scene_named("probe-pushes").expect("a built-in scene");
    scene.hide = hide_by_word(&scene, hidden, Seed(seed)).expect("a cause that it can hide");
    let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("a capture");
    build(&halved(made.capture, seed), &Options::default(), &Progress::silent()).expect("a twin")
}

#[test]
fn nothing_is_wrong_with_two_that_go_as_one() {
    let run = probed("none", 21);
    assert_eq!(run.diagnosis.verdict, Verdict::Adequate);
    assert!(run.diagnosis.findings.is_empty());
    let twin = &run.model.twin;
    let glued = twin
        .relations
        .iter()
        .any(|r| r.kind == RelationKind::Fixed && r.probability > 0.9);
    assert!(glued, "{:?}", twin.relations);
    // What the whole tells is told of what stands on the table.
    let low = &twin.link("low").expect("the lower half").friction;
    let friction = low.kinetic.as_ref().expect("friction");
    assert!((friction.value / 0.32 - 1.0).abs() < 0.03, "{}", friction.value);
    assert!(low.torsional_radius.is_some() && low.static_.is_some());
    // Both halves go where the whole goes.
    let pushes = run.traces.iter().filter(|t| t.interaction.starts_with("push"));
    assert!(pushes.clone().count() > 3);
    for trace in pushes {
        assert!(
            trace.paths.contains_key("low") && trace.paths.contains_key("top"),
            "{}",
            trace.interaction
        );
    }
}

#[test]
fn what_is_wrong_with_them_is_named() {
    for hidden in ["viscous-friction:1.7", "force-bias:1.5", "bump:2"] {
        let run = probed(hidden, 5);
        let names: Vec<&str> = run.diagnosis.findings.iter().map(|f| f.cause.as_str()).collect();
        let cause = hidden.split(':').next().expect("a cause");
        assert_eq!(names, [cause], "{:?}", run.diagnosis.verdict);
    }
}
