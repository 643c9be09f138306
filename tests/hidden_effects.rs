//! Effects that the lab hides in pushes and sensors are named, and what they would spoil stays right.
#![allow(clippy::expect_used, reason = "a test stops at what it did not expect")]

use std::path::Path;

use palpate::base::{Progress, Seed};
use palpate::lab::{hide_by_word, scene_named, synthesise};
use palpate::pipeline::{Options, Run, build};

fn probed(scene: &str, hidden: &str, seed: u64) -> Run {
    let mut scene = scene_named(scene).expect("a built-in scene");
    scene.hide = hide_by_word(&scene, hidden, Seed(seed)).expect("a cause that it can hide");
    let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("a capture");
    build(&made.capture, &Options::default(), &Progress::silent()).expect("a twin")
}

fn named(run: &Run) -> Vec<&str> {
    run.diagnosis.findings.iter().map(|f| f.cause.as_str()).collect()
}

#[test]
fn strays_in_force_and_tracks_are_told_and_do_no_harm() {
    let run = probed("probe-pushes", "outliers", 5);
    assert_eq!(named(&run), ["outliers"]);
    let link = run.model.twin.link("box").expect("the box");
    let mass = link.mass.as_ref().expect("a mass");
    let truth = 0.090 * 0.070 * 0.040 * 1600.0;
    assert!((mass.value / truth - 1.0).abs() < 0.01, "{}", mass.value);
    let friction = link.friction.kinetic.as_ref().expect("friction");
    assert!((friction.value / 0.32 - 1.0).abs() < 0.03, "{}", friction.value);
}

#[test]
fn a_sensor_that_rounds_is_told_by_its_step() {
    let run = probed("probe-presses", "quantisation", 5);
    let found = run
        .diagnosis
        .findings
        .iter()
        .find(|f| f.cause == "quantisation")
        .expect("rounding");
    let step = found.parameters["step"].value;
    assert!((step / 0.25 - 1.0).abs() < 0.01, "{step}");
}

#[test]
fn clocks_that_run_apart_are_told_from_a_late_camera() {
    let run = probed("probe-pushes", "clock-drift", 5);
    assert_eq!(named(&run), ["clock-drift"]);
}

#[test]
fn nothing_is_said_of_what_is_as_it_should_be() {
    for scene in ["probe-pushes", "probe-presses", "probe-hinge"] {
        assert!(named(&probed(scene, "none", 21)).is_empty(), "{scene}");
    }
}
