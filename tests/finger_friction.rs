//! The friction between finger and body: a number only where the finger slid, else a bound from below.

#![allow(clippy::expect_used, reason = "a test fails aloud")]

use std::path::Path;

use palpate::base::{Estimate, Progress, Seed};
use palpate::lab::{Scene, hide_by_word, scene_named, synthesise};
use palpate::pipeline::{Options, Pass, build};

/// A box that is pushed from two sides: `direction` is the angle between the push and the face's normal, rad.
fn finger(friction: f64, direction: f64, seed: u64) -> Estimate {
    let mut text = String::from(
        r#"
name = "finger"
[camera]
views = 0
[[body]]
name = "box"
shape = { kind = "box", size = [0.10, 0.08, 0.05] }
density = 900.0
position = [0.0, 0.0, 0.025]
friction = { static = 0.34, kinetic = 0.3 }
known_mesh = true
[[action]]
kind = "lift"
name = "lift"
target = "box"
at = [0.0, 0.0, 0.05]
height = 0.03
"#,
    );
    for (k, offset) in [-0.01, 0.008].iter().enumerate() {
        let (s, c) = direction.sin_cos();
        text += &format!(
            "[[action]]\nkind = \"push\"\nname = \"push-{k}\"\ntarget = \"box\"\nat = [-0.05, {offset}, 0.02]\n\
             direction = [{c}, {s}, 0.0]\ntravel = 0.04\nspeed = 0.03\ntool_friction = {friction}\n"
        );
    }
    let scene: Scene = toml::from_str(&text).expect("a scene");
    let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("made");
    let options = Options {
        passes: vec![Pass::Shape, Pass::Physics],
        ..Options::default()
    };
    let run = build(&made.capture, &options, &Progress::silent()).expect("a run");
    let link = run.model.twin.link("box").expect("the box");
    link.friction.tool.clone().expect("something is said of the finger")
}

fn holds(e: &Estimate, truth: f64) -> bool {
    e.ci95.is_some_and(|[low, high]| low <= truth && truth <= high)
}

#[test]
fn a_finger_that_sticks_bounds_its_friction_from_below() {
    for (seed, friction) in [(1, 0.3), (2, 1.8)] {
        let said = finger(friction, 0.0, seed);
        assert!(!said.is_measured(), "{friction}: {said:?}");
        assert!(holds(&said, friction), "{friction}: {said:?}");
    }
}

#[test]
fn a_finger_that_slides_tells_its_friction() {
    for (seed, friction) in [(3, 0.1), (4, 0.2)] {
        let said = finger(friction, 0.6, seed);
        assert!(said.is_measured(), "{friction}: {said:?}");
        assert!(holds(&said, friction), "{friction}: {said:?}");
        assert!((said.value / friction - 1.0).abs() < 0.15, "{friction}: {said:?}");
    }
}

/// Fingers that slide too slowly for it to be seen: the lab's pushes off the middle turn the box away from under them, or do not.
#[test]
fn where_only_the_paths_tell_that_a_finger_slid_its_steepest_force_is_its_friction() {
    let probed = |seed: u64| {
        let mut scene = scene_named("probe-pushes").expect("a built-in scene");
        scene.hide = hide_by_word(&scene, "tool-friction:0.8", Seed(seed)).expect("a cause that it can hide");
        let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent()).expect("made");
        let factor = made.truth.cause_parameters["tool-friction"]["factor"];
        let run = build(&made.capture, &Options::default(), &Progress::silent()).expect("a run");
        let said = run.model.twin.link("box").and_then(|l| l.friction.tool.clone());
        (said.expect("something is said of the finger"), 0.4 * factor)
    };
    let (slides, truth) = probed(4);
    assert!(
        truth < 0.3 && slides.is_measured() && holds(&slides, truth),
        "{truth}: {slides:?}"
    );
    assert!((slides.value / truth - 1.0).abs() < 0.1, "{truth}: {slides:?}");
    let (sticks, truth) = probed(1);
    assert!(
        truth > 0.6 && !sticks.is_measured() && holds(&sticks, truth),
        "{truth}: {sticks:?}"
    );
}
