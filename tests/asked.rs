//! What a diagnosis asks for tells apart what it could not: narrow protocols, the touches that are asked for, and the name.
#![allow(clippy::expect_used, reason = "a test stops at what it did not expect")]

#[path = "../benches/blind/parted.rs"]
mod parted;
#[allow(dead_code, reason = "the bench prints the rest")]
#[path = "../benches/blind/scenes.rs"]
mod scenes;

use std::path::Path;

use palpate::base::{Progress, Seed};
use palpate::lab::{HideSpec, synthesise};
use palpate::pipeline::{Options, Run, build};
use parted::Parted;
use scenes::{Case, Sort, case};

/// A scene of the blind bench with a narrow protocol, or as it was drawn.
fn diagnosed(number: u64, only: Option<Sort>) -> (Case, Run) {
    let case = case(number, only, None);
    let made = synthesise(&case.scene, Path::new("."), Seed(number), &Progress::silent()).expect("a capture");
    let run = build(&made.capture, &Options::default(), &Progress::silent()).expect("a twin");
    (case, run)
}

/// What could not be told apart in such a scene, and what came of the touches.
fn asked(number: u64, only: Option<Sort>) -> Parted {
    let (case, run) = diagnosed(number, only);
    for asked in run.diagnosis.experiments.iter().filter(|e| !e.touches.is_empty()) {
        assert!(asked.bits.is_some_and(|b| b > 0.0), "{}", asked.words);
        assert!(asked.parts.len() > 1, "{}", asked.words);
    }
    parted::parted(
        &case.scene,
        number,
        &run.diagnosis,
        &case.causes[0],
        &Options::default(),
    )
    .expect("causes not told apart")
}

fn told(number: u64, only: Option<Sort>) {
    let parted = asked(number, only);
    assert!(parted.after.is_some() && parted.right, "{number}: {parted:?}");
}

#[test]
fn a_damping_that_grows_with_speed_is_told_by_the_speed_that_is_asked_for() {
    told(30111, Some(Sort::Narrow));
}

#[test]
fn a_reading_of_the_room_is_told_from_one_of_the_finger_by_turning_the_tool() {
    let parted = asked(30137, Some(Sort::Narrow));
    assert!(parted.right && parted.done[0].contains("turned"), "{parted:?}");
}

#[test]
fn a_drag_is_told_from_friction_of_rate_and_state_by_the_push_that_is_asked_for() {
    told(74034, Some(Sort::Narrow));
}

/// Presses at one speed tell the curve of a spring by themselves.
#[test]
fn where_a_cause_is_told_no_touch_is_asked_for_it() {
    let (case, run) = diagnosed(30185, Some(Sort::Narrow));
    let named: Vec<&str> = run.diagnosis.findings.iter().map(|f| f.cause.as_str()).collect();
    assert_eq!(named, [case.causes[0].as_str()]);
    assert!(run.diagnosis.experiments.iter().all(|e| e.touches.is_empty()));
}

/// What is told from the first push to meet it is not asked about; what may be a rough patch is.
#[test]
fn a_thing_in_the_way_is_told_by_going_on() {
    let (_, run) = diagnosed(30203, Some(Sort::Narrow));
    assert_eq!(run.diagnosis.findings[0].cause, "hidden-body");
    assert!(run.diagnosis.experiments.iter().all(|e| e.touches.is_empty()));
    told(80009, None);
}

/// One object on one table cannot tell a table that leans from gravity that does: no touch is asked for.
#[test]
fn where_no_touch_tells_none_is_asked_for() {
    let run = diagnosed(30217, Some(Sort::Narrow)).1;
    let open = run
        .diagnosis
        .experiments
        .iter()
        .find(|e| e.bits.is_some())
        .expect("an experiment");
    assert!(
        open.parts.iter().any(|p| p == "gravity-error") && open.touches.is_empty(),
        "{open:?}"
    );
}

/// A density that is not even, and a centre that is off alone: what hangs on the tool and is twisted resists by its yaw inertia.
#[test]
fn a_twist_aloft_tells_an_uneven_density_from_an_offset_centre() {
    let hidden = [
        ("nonuniform-density", 79014, 2.76),
        ("com-offset", 79004, 1.63),
        ("com-offset", 79005, 1.3),
    ];
    for (cause, number, strength) in hidden {
        let mut case = case(number, Some(Sort::Clean), None);
        case.scene.hide = vec![HideSpec {
            cause: cause.into(),
            strength,
            seed: number * 4,
        }];
        let made = synthesise(&case.scene, Path::new("."), Seed(number), &Progress::silent()).expect("a capture");
        let run = build(&made.capture, &Options::default(), &Progress::silent()).expect("a twin");
        let parted = parted::parted(&case.scene, number, &run.diagnosis, cause, &Options::default());
        let parted = parted.expect("two causes that are not told apart");
        assert!(parted.right && parted.after == Some(1), "{cause} {number}: {parted:?}");
        assert!(parted.done[0].contains("twisted"), "{parted:?}");
    }
}
