//! What is hidden is nowhere without strength, shows with it, and is told in the truth file alone.

use std::collections::BTreeSet;
use std::path::Path;

use super::*;
use crate::base::{Progress, Seed};
use crate::lab::{HideSpec, Scene, Synthetic, scene_named, synthesise};

const SCENES: [&str; 7] = [
    "probe-pushes",
    "probe-drags",
    "probe-rolls",
    "probe-loads",
    "probe-presses",
    "probe-hinge",
    "probe-pair",
];

/// The scene with these of its actions only.
fn short(name: &str, actions: &[usize]) -> Scene {
    let mut scene = scene_named(name).expect("a scene");
    scene.action = actions.iter().map(|i| scene.action[*i].clone()).collect();
    scene.pause.clear();
    scene
}

fn made(scene: &Scene, hide: &[(&str, f64)]) -> Synthetic {
    let mut scene = scene.clone();
    let spec = |(cause, strength): &(&str, f64)| HideSpec {
        cause: (*cause).to_owned(),
        strength: *strength,
        seed: 5,
    };
    scene.hide = hide.iter().map(spec).collect();
    synthesise(&scene, Path::new("."), Seed(3), &Progress::silent()).expect("a capture")
}

/// The middle of the forces along x of a push, while it pushes, N.
fn pushing(made: &Synthetic) -> f64 {
    let force = &made.capture.interactions[0].force.as_ref().expect("a force").force;
    let mut felt: Vec<f64> = force.iter().map(|f| f.x).filter(|x| *x > 0.5).collect();
    felt.sort_by(f64::total_cmp);
    felt[felt.len() / 2]
}

#[test]
fn without_strength_the_bytes_are_those_of_the_clean_capture() {
    for (name, action) in [
        ("probe-pushes", 4),
        ("probe-rolls", 2),
        ("probe-loads", 3),
        ("probe-presses", 3),
        ("probe-hinge", 1),
    ] {
        let scene = short(name, &[action]);
        let all: Vec<(&str, f64)> = hidden_causes(&scene).into_iter().map(|cause| (cause, 0.0)).collect();
        let clean = format!("{:?}", made(&scene, &[]));
        assert!(clean == format!("{:?}", made(&scene, &all)), "{name}");
    }
}

#[test]
fn every_law_shows_at_twice_its_plain_strength() {
    for (name, action) in [
        ("probe-presses", 1),
        ("probe-hinge", 2),
        ("probe-rolls", 2),
        ("probe-loads", 3),
    ] {
        let scene = short(name, &[action]);
        let clean = made(&scene, &[]);
        // A first press is not softened by others, and nothing drifts yet.
        let mut quiet = vec!["softening-by-use", "stiffness-drift"];
        // A ball is struck, and no arm has its reflex while it is touched.
        quiet.extend((name == "probe-rolls").then_some("outside-reflex"));
        for cause in hidden_causes(&scene).into_iter().filter(|c| !quiet.contains(c)) {
            let hidden = made(&scene, &[(cause, 2.0)]);
            assert!(hidden.truth.causes.iter().any(|c| c == cause), "{cause} is not told");
            assert!(
                format!("{:?}", hidden.capture) != format!("{:?}", clean.capture),
                "{cause} does not show"
            );
        }
    }
}

#[test]
fn a_viscous_push_is_harder_by_damping_times_speed() {
    let scene = short("probe-pushes", &[2]);
    let more = pushing(&made(&scene, &[("viscous-friction", 2.0)])) - pushing(&made(&scene, &[]));
    assert!((more - 10.0 * 0.03).abs() < 0.02, "{more} N");
}

#[test]
fn a_cause_that_cannot_show_is_refused_with_the_nearest_one() {
    let scene = short("probe-pushes", &[2]);
    let error = hide_by_word(&scene, "vicous-friction", Seed(1))
        .expect_err("no such cause")
        .to_string();
    assert!(error.contains("did you mean viscous-friction"), "{error}");
    assert!(hide_by_word(&scene, "detent", Seed(1)).is_err());
    assert!(hide_by_word(&scene, "bump:-1", Seed(1)).is_err());
    assert!(hide_by_word(&scene, "none", Seed(1)).expect("nothing").is_empty());
    for wrong in [
        "bump,bump",
        "bump,bump:2",
        "bump:0",
        "bump:NaN",
        "bump:",
        "friction-patch:1e300",
        "support-tilt:1e9",
        "com-offset:50",
        "time-delay:100",
        "none,support-tilt",
        "support-tilt,random",
        "none:2",
        "random:-1",
        "",
    ] {
        let error = hide_by_word(&scene, wrong, Seed(1)).expect_err(wrong);
        assert_eq!(error.exit_code(), 2, "{wrong}: {error}");
    }
    let error = hide_by_word(&scene, "com-offset:50", Seed(1))
        .expect_err("far off")
        .to_string();
    assert!(
        error.contains("found \"50\", expected a strength above 0 and up to 4"),
        "{error}"
    );
    let one = hide_by_word(&scene, "random:2", Seed(1)).expect("one");
    assert!(one.len() == 1 && one[0].strength == 2.0);
    assert_eq!(hide_by_word(&scene, "bump:2,magnet", Seed(1)).expect("two").len(), 2);
}

#[test]
fn a_quarter_of_random_draws_is_clean_and_all_causes_come_up() {
    for name in SCENES {
        let scene = scene_named(name).expect("a scene");
        let draws: Vec<_> = (0..1000).map(|seed| hide_at_random(&scene, Seed(seed))).collect();
        let clean = draws.iter().filter(|d| d.is_empty()).count();
        assert!((190..310).contains(&clean), "{clean} of 1000 are clean");
        let pairs: Vec<_> = draws.iter().filter(|d| d.len() == 2).collect();
        assert!((120..215).contains(&pairs.len()), "{} of 1000 are pairs", pairs.len());
        assert!(pairs.iter().all(|d| d[0].cause != d[1].cause));
        let seen: BTreeSet<&str> = draws.iter().flatten().map(|d| d.cause.as_str()).collect();
        assert_eq!(seen.len(), hidden_causes(&scene).len());
        assert!(draws.iter().flatten().all(|d| (0.25..=4.0).contains(&d.strength)));
    }
}

/// Both are of the arm and its cable: what is pushed goes as it went.
#[test]
fn reflexes_and_snags_are_in_the_force_alone_and_only_for_a_while() {
    let scene = short("probe-pushes", &[3]);
    let clean = made(&scene, &[]);
    for (cause, while_touched) in [("outside-reflex", true), ("outside-snagging-cable", false)] {
        let hidden = made(&scene, &[(cause, 2.0)]);
        let [a, b] = [&clean, &hidden].map(|m| &m.capture.interactions[0]);
        assert_eq!(format!("{:?}", a.tracks), format!("{:?}", b.tracks), "{cause}");
        let [a, b] = [a, b].map(|i| i.force.as_ref().expect("a force"));
        let off: Vec<bool> = a
            .force
            .iter()
            .zip(&b.force)
            .map(|(x, y)| (x - y).norm() > 0.1)
            .collect();
        let share = off.iter().filter(|o| **o).count() as f64 / off.len() as f64;
        assert!((0.01..0.7).contains(&share), "{cause}: {share}");
        let touched = a.force.iter().position(|f| f.norm() > 0.3);
        let free = off.iter().position(|o| *o) < touched;
        assert!(!(while_touched && free), "{cause}");
    }
}
