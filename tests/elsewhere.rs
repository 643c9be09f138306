//! What is found does not depend on where in the room the table stands nor on when the clock began: the lab's tables
//! all stand at the origin, and its clocks begin at nought.
#![allow(clippy::expect_used, reason = "a test stops at what it did not expect")]

mod common;

use std::path::Path;

use common::elsewhere::{later, moved};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use palpate::base::{Progress, Seed};
use palpate::capture::Capture;
use palpate::lab::{hide_by_word, scene_named, synthesise};
use palpate::pipeline::{Options, Pass, build};
use palpate::twin::Verdict;

/// A scene, what is hidden in it, and the seed of both.
const CASES: [(&str, &str, u64); 7] = [
    ("probe-pushes", "none", 21),
    ("probe-pushes", "support-tilt", 5),
    ("probe-pushes", "magnet", 11),
    ("probe-pushes", "wear-or-heating", 4),
    ("probe-presses", "stress-relaxation", 6),
    ("probe-hinge", "detent", 6),
    ("probe-hinge", "none", 21),
];

fn captured((scene, hidden, seed): (&str, &str, u64)) -> Capture {
    let mut scene = scene_named(scene).expect("a built-in scene");
    scene.hide = hide_by_word(&scene, hidden, Seed(seed)).expect("a cause that it can hide");
    let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent());
    made.expect("a capture").capture
}

/// The verdict, and each finding with its odds.
type Told = (Verdict, Vec<(String, f64)>);

fn told(capture: &Capture) -> Told {
    let options = Options {
        passes: vec![
            Pass::Shape,
            Pass::Physics,
            Pass::Relations,
            Pass::Articulation,
            Pass::Diagnosis,
        ],
        ..Options::default()
    };
    let diagnosis = build(capture, &options, &Progress::silent()).expect("a twin").diagnosis;
    let each = diagnosis.findings.iter();
    (
        diagnosis.verdict,
        each.map(|f| (f.cause.clone(), f.probability)).collect(),
    )
}

fn alike(case: (&str, &str, u64), what: &str, here: &Told, there: &Capture) {
    let there = told(there);
    assert_eq!(here.0, there.0, "{case:?}, {what}: {here:?} became {there:?}");
    assert_eq!(
        here.1.len(),
        there.1.len(),
        "{case:?}, {what}: {here:?} became {there:?}"
    );
    for (one, other) in here.1.iter().zip(&there.1) {
        let same = one.0 == other.0 && (one.1 - other.1).abs() < 0.05;
        assert!(same, "{case:?}, {what}: {here:?} became {there:?}");
    }
}

/// Elsewhere in the room; in a world whose axes are those of graphics, y upwards; by a clock that counts from 1970, as
/// those of robots do; with what was done last written first.
#[test]
fn what_is_found_does_not_depend_on_the_room_the_clock_or_the_order_of_the_file() {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 2.3);
    let away = Isometry3::from_parts(Translation3::new(-3.7, 2.1, 0.83), turn);
    let lain = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let upright_y = Isometry3::from_parts(Translation3::new(0.6, 0.0, -1.2), lain);
    for case in CASES {
        let capture = captured(case);
        let here = told(&capture);
        assert_eq!(here.1.is_empty(), case.1 == "none", "{case:?}: {here:?}");
        alike(case, "elsewhere in the room", &here, &moved(&capture, &away));
        alike(case, "with y upwards", &here, &moved(&capture, &upright_y));
        alike(case, "on another clock", &here, &later(&capture, 1_764_470_000.0));
        let mut turned_round = capture.clone();
        turned_round.interactions.reverse();
        alike(case, "last first", &here, &turned_round);
    }
}
