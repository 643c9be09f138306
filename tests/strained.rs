//! Hands and fingers as they are: one holds with a load when the recording begins, the other rubs along the side that it pushes; and
//! what hangs in the air on a hinge that nobody tracked.
#![allow(clippy::expect_used, reason = "a test stops at what it did not expect")]

use std::path::Path;

use nalgebra::Vector3;
use palpate::base::{Progress, Seed};
use palpate::capture::{Capture, Interaction, Kind};
use palpate::lab::{scene_named, synthesise};
use palpate::pipeline::{Options, Run, build};
use palpate::twin::Verdict;

fn made(scene: &str, seed: u64) -> (Capture, f64) {
    let scene = scene_named(scene).expect("a built-in scene");
    let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("a capture");
    let mass = made.truth.bodies.values().find_map(|b| b.mass);
    (made.capture, mass.unwrap_or(f64::NAN))
}

fn built(capture: &Capture) -> Run {
    build(capture, &Options::default(), &Progress::silent()).expect("a twin")
}

/// When a force first leaves what it is at the beginning by so much, s.
fn rises(interaction: &Interaction, by: f64) -> f64 {
    let stream = interaction.force.as_ref().expect("a force");
    let row = stream.force.iter().position(|f| f.z > by).expect("a lift");
    stream.time[row]
}

#[test]
fn a_hand_that_holds_already_weighs_the_whole_weight() {
    let (mut capture, mass) = made("probe-pushes", 31);
    let weight = 9.80665 * mass;
    for lift in capture.interactions.iter_mut().filter(|i| i.kind == Kind::Lift) {
        let from = rises(lift, 0.5 * weight);
        let stream = lift.force.as_mut().expect("a force");
        for (time, force) in stream.time.iter().zip(&mut stream.force) {
            if *time < from && force.z < 0.2 * weight {
                *force += Vector3::z() * (0.2 * weight);
            }
        }
    }
    let run = built(&capture);
    let told = run
        .model
        .twin
        .links()
        .find_map(|(_, l)| l.mass.clone())
        .expect("a mass");
    assert!((told.value / mass - 1.0).abs() < 0.02, "{} of {mass}", told.value);
    assert_eq!(run.diagnosis.verdict, Verdict::Adequate, "{:?}", run.diagnosis.findings);
}

#[test]
fn what_a_finger_rubs_down_on_the_table_bears() {
    let (mut capture, mass) = made("probe-pushes", 32);
    let weight = 9.80665 * mass;
    // Every other push is by a finger that rubs down the side by 0.4 of its force.
    let pushes = capture.interactions.iter_mut().filter(|i| i.kind == Kind::Push);
    for push in pushes.step_by(2) {
        let stream = push.force.as_mut().expect("a force");
        for force in &mut stream.force {
            let size = force.xy().norm();
            let more = weight / (weight - 0.4 * size).max(0.5 * weight);
            *force = Vector3::new(force.x * more, force.y * more, force.z - 0.4 * size * more);
        }
    }
    let run = built(&capture);
    assert!(run.diagnosis.findings.is_empty(), "{:?}", run.diagnosis.findings);
    assert_eq!(run.diagnosis.verdict, Verdict::Adequate);
}

#[test]
fn what_hangs_over_the_table_and_keeps_to_an_arc_is_hinged() {
    let (mut capture, _) = made("probe-hinge", 33);
    capture.bodies.retain(|b| b.name == "flap");
    for interaction in &mut capture.interactions {
        interaction.tracks.retain(|name, _| name == "flap");
    }
    // On a table that it touches, and on one 0.1 m lower.
    capture.support.as_mut().expect("a table").point.z += 0.01;
    let standing = built(&capture);
    assert_eq!(standing.model.twin.joints().count(), 0);
    capture.support.as_mut().expect("a table").point.z -= 0.1;
    let hanging = built(&capture);
    let joint = hanging.model.twin.joints().next().expect("a joint");
    assert_eq!((joint.parent.as_str(), joint.child.as_str()), ("world", "flap"));
    let axis = Vector3::from(joint.axis.value);
    assert!(axis.z.abs() > 0.999, "{axis}");
}
