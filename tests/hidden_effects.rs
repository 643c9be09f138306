//! Effects that the lab hides in pushes and sensors are named, and what they would spoil stays right.
#![allow(clippy::expect_used, reason = "a test stops at what it did not expect")]

use std::path::Path;

use nalgebra::Vector3;
use palpate::base::{Notices, Progress, Seed, rng_for};
use palpate::capture::Capture;
use palpate::lab::{ActionSpec, Scene, hide_by_word, scene_named, synthesise};
use palpate::pipeline::{Options, Pass, Run, build, judge};
use palpate::twin::{CAUSES, Verdict};
use rand::Rng;

fn probed(scene: &str, hidden: &str, seed: u64) -> Run {
    probed_with(scene, hidden, seed, &Options::default())
}

fn probed_with(scene: &str, hidden: &str, seed: u64, options: &Options) -> Run {
    build(&captured(scene, hidden, seed), options, &Progress::silent()).expect("a twin")
}

/// The capture of [`probed`].
fn captured(scene: &str, hidden: &str, seed: u64) -> Capture {
    let mut scene = scene_named(scene).expect("a built-in scene");
    scene.hide = hide_by_word(&scene, hidden, Seed(seed)).expect("a cause that it can hide");
    let made = synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent());
    made.expect("a capture").capture
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

/// The tool's path is read ten times as badly as usual, then force and path a fifth as often as usual.
#[test]
fn paths_that_are_read_badly_and_readings_that_are_few_make_no_cause() {
    let read = |hidden: &str, change: &dyn Fn(&mut Scene)| {
        let mut scene = scene_named("probe-presses").expect("a built-in scene");
        scene.hide = hide_by_word(&scene, hidden, Seed(4)).expect("a cause that it can hide");
        change(&mut scene);
        let mut made = synthesise(&scene, Path::new("."), Seed(4), &Progress::silent()).expect("a capture");
        let mut dice = rng_for(Seed(4), "badly read");
        for path in made
            .capture
            .interactions
            .iter_mut()
            .filter_map(|i| i.tool_path.as_mut())
        {
            for place in &mut path.position {
                place.z += (0..12).map(|_| dice.random_range(-0.5..0.5)).sum::<f64>() * 2e-4;
            }
        }
        build(&made.capture, &Options::default(), &Progress::silent()).expect("a twin")
    };
    let seldom = |scene: &mut Scene| scene.noise.force_rate = 100.0;
    for run in [read("none", &|_| ()), read("none", &seldom)] {
        assert_eq!(named(&run), [""; 0]);
        assert_eq!(run.diagnosis.verdict, Verdict::Adequate);
    }
    assert_eq!(named(&read("preload:2", &|_| ())), ["preload"]);
}

/// Paths in steps of a tenth of a millimetre, as a file of four decimals has them, and one row in ten missing, with a gap in every track.
#[test]
fn few_decimals_and_missing_rows_make_no_cause_and_hide_none() {
    let worse = |capture: &Capture| {
        let mut out = capture.clone();
        let missing = Vector3::repeat(f64::NAN);
        for touch in &mut out.interactions {
            if let Some(path) = &mut touch.tool_path {
                for i in 0..path.len() {
                    path.position[i] = path.position[i].map(|x| (x * 1e4).round() * 1e-4);
                    if i % 11 == 5 {
                        path.position[i] = missing.into();
                        path.rotation[i] = None;
                    }
                }
            }
            for (i, force) in touch.force.iter_mut().flat_map(|f| &mut f.force).enumerate() {
                if i % 10 == 3 {
                    *force = missing;
                }
            }
            for track in touch.tracks.values_mut() {
                let middle = track.len() / 2;
                for i in 0..track.len() {
                    if i % 10 == 7 || (middle..middle + 15).contains(&i) {
                        track.position[i] = missing.into();
                        track.rotation[i] = None;
                    }
                }
            }
        }
        out
    };
    for (scene, hidden, verdict) in [
        ("probe-presses", "none", Verdict::Adequate),
        ("probe-hinge", "none", Verdict::Adequate),
        ("probe-presses", "guide-friction:2", Verdict::Explained),
        ("probe-hinge", "detent:2", Verdict::Explained),
    ] {
        let run = build(
            &worse(&captured(scene, hidden, 6)),
            &Options::default(),
            &Progress::silent(),
        )
        .expect("a twin");
        let cause = hidden.split(':').next().filter(|c| *c != "none");
        assert_eq!(named(&run), Vec::from_iter(cause), "{scene}");
        assert_eq!(run.diagnosis.verdict, verdict, "{scene}");
    }
}

/// A model that carries what was found, with numbers beside it, is right of the capture that it was made from.
#[test]
fn effects_that_a_model_carries_are_not_lacking_and_its_numbers_are_beside_them() {
    let passes = Pass::ALL.into_iter().filter(|p| *p != Pass::Diagnosis).collect();
    let bare = Options {
        passes,
        ..Options::default()
    };
    for (scene, hidden, seed) in [
        ("probe-pushes", "viscous-friction:1.7", 5),
        ("probe-hinge", "detent:2", 6),
        ("probe-hinge", "joint-quadratic-damping:2", 7),
    ] {
        let capture = captured(scene, hidden, seed);
        let build = |options: &Options| build(&capture, options, &Progress::silent()).expect("a twin").model;
        let (model, fresh) = (build(&Options::default()), build(&bare));
        let judged = judge(&capture, &model, &fresh, &Options::default(), &mut Notices::default()).expect("judged");
        let off: Vec<String> = judged
            .numbers
            .iter()
            .filter(|n| n.outside)
            .map(ToString::to_string)
            .collect();
        assert!(off.is_empty(), "{hidden}: {off:?}");
        let cause = hidden.split(':').next().unwrap_or_default();
        assert!(
            judged.carried.iter().any(|[c, _]| c == cause),
            "{hidden}: {:?}",
            judged.carried
        );
    }
}

#[test]
fn pushes_that_change_their_pace_do_not_hide_a_viscous_drag() {
    let run = probed("probe-pushes", "viscous-friction:1.7", 5);
    assert_eq!(named(&run), ["viscous-friction"]);
    assert_eq!(run.diagnosis.verdict, Verdict::Explained);
    let drag = &run.diagnosis.findings[0].parameters["b"];
    let [low, high] = drag.ci95.expect("an interval");
    let truth = 1.7 * 5.0;
    assert!((drag.value / truth - 1.0).abs() < 0.1, "{}", drag.value);
    assert!(low < 1.05 * truth && high > 0.95 * truth, "{low} to {high}");
}

#[test]
fn a_cause_that_only_mimics_the_true_one_is_not_told_as_the_whole() {
    let struck = |cause: &str| {
        let mut options = Options::default();
        let others = CAUSES.iter().filter(|c| **c != cause);
        options.diagnosis.causes = Some(others.map(|c| (*c).to_owned()).collect());
        probed_with("probe-presses", &format!("{cause}:2"), 5, &options).diagnosis
    };
    for cause in [
        "snap-through",
        "elastic-hysteresis",
        "power-law-stiffness",
        "second-stage",
    ] {
        let left = struck(cause);
        let whole = left.verdict == Verdict::Explained && !left.findings.is_empty();
        assert!(
            !whole,
            "{cause}: {:?}",
            left.findings.iter().map(|f| &f.cause).collect::<Vec<_>>()
        );
    }
}

/// A slope pulls across the way as well as along it; friction that is larger one way than back does not.
#[test]
fn friction_that_is_larger_one_way_is_no_slope() {
    let ratchet = probed("probe-pushes", "outside-ratchet", 144_003).diagnosis;
    assert_eq!(ratchet.verdict, Verdict::Unknown);
    assert!(
        ratchet.left.iter().any(|e| e.words.contains("one way")),
        "{:?}",
        ratchet.left
    );
    assert!(
        ratchet.findings.iter().all(|f| f.probability < 0.5),
        "{:?}",
        ratchet.findings
    );
    let slope = probed("probe-pushes", "support-tilt", 144_003).diagnosis;
    assert_ne!(slope.verdict, Verdict::Unknown);
    assert_eq!(slope.findings.first().map(|f| f.cause.as_str()), Some("support-tilt"));
}

/// A hand that pulls a box along eight ways, whose sensor reads a part of the force across it too, and one that does not.
#[test]
fn what_a_hand_reads_across_its_way_counts() {
    let mut scene = scene_named("probe-pushes").expect("a built-in scene");
    scene.action.retain(|a| matches!(a, ActionSpec::Lift { .. }));
    scene.action.extend((0..8_u8).map(|k| {
        // To and fro, so that it stays on the table.
        let angle = std::f64::consts::FRAC_PI_4 * f64::from(k) + std::f64::consts::PI * f64::from(k % 2);
        ActionSpec::Pull {
            name: format!("pull-{k}"),
            target: "box".into(),
            at: [0.0, 0.0, 0.03],
            direction: [angle.cos(), angle.sin(), 0.0],
            travel: 0.05,
            speed: if k % 4 < 2 { 0.03 } else { 0.06 },
            pin: false,
            down: 0.0,
            arc: false,
            back: false,
            held_out: false,
        }
    }));
    let made = synthesise(&scene, Path::new("."), Seed(3), &Progress::silent()).expect("a capture");
    for leak in [0.0, 0.06] {
        let mut capture = made.capture.clone();
        for f in capture
            .interactions
            .iter_mut()
            .flat_map(|i| i.force.iter_mut().flat_map(|s| &mut s.force))
        {
            (f.x, f.y) = (f.x - leak * f.y, f.y + leak * f.x);
        }
        let run = build(&capture, &Options::default(), &Progress::silent()).expect("a twin");
        let expected: &[&str] = if leak > 0.0 { &["force-crosstalk"] } else { &[] };
        assert_eq!(named(&run), expected);
    }
}

/// Readings of a sensor on the mains are none that are far off, and what is read is not as it should be.
#[test]
fn a_sensor_that_hums_has_no_strays_and_no_name() {
    let mut capture = captured("probe-pushes", "none", 21);
    for (stream, phase) in capture.interactions.iter_mut().zip(0..) {
        for (t, f) in stream.force.iter_mut().flat_map(|s| s.time.iter().zip(&mut s.force)) {
            f.x += 0.1 * (std::f64::consts::TAU * 50.0 * t + f64::from(phase)).sin();
        }
    }
    let told = build(&capture, &Options::default(), &Progress::silent())
        .expect("a twin")
        .diagnosis;
    assert_eq!(told.verdict, Verdict::Unknown);
    assert!(told.left.iter().any(|e| e.words.contains("50.0 Hz")), "{:?}", told.left);
    assert!(
        told.findings.iter().all(|f| f.cause != "outliers"),
        "{:?}",
        told.findings
    );
}

#[test]
fn what_softens_with_use_needs_no_second_name() {
    for (strength, seed) in [(2.5, 5), (2.0, 6)] {
        let run = probed("probe-presses", &format!("softening-by-use:{strength}"), seed);
        assert_eq!(named(&run), ["softening-by-use"]);
        let found = &run.diagnosis.findings[0];
        let share = found.parameters["a"].value;
        // Another form: `min(1, x / reach)` for the world's `tanh(x / 3 mm)`.
        assert!((share / (0.3 * strength) - 1.0).abs() < 0.25, "{share}");
        assert!(found.gain.reduction > 0.8, "{:?}", found.gain);
    }
}

#[test]
fn a_tool_that_touches_beside_where_its_path_says_is_no_offset_centre() {
    let run = probed("probe-pushes", "contact-point-offset", 5);
    assert_eq!(named(&run), ["contact-point-offset"]);
    let found = &run.diagnosis.findings[0].parameters;
    let [dx, dy] = ["dx", "dy"].map(|k| found[k].value);
    let (way, size): (f64, f64) = (dy.atan2(dx), dx.hypot(dy));
    assert!(
        (size / 0.003 - 1.0).abs() < 0.15 && (way + 1.999).abs() < 0.1,
        "{size} m along {way}"
    );
}

#[test]
fn what_has_to_be_sped_up_but_weighs_nothing_is_found() {
    let run = probed("probe-pushes", "added-inertia:2", 6);
    assert_eq!(named(&run), ["added-inertia"]);
    let share = &run.diagnosis.findings[0].parameters["e"];
    let [low, high] = share.ci95.expect("an interval");
    assert!(low < 0.6 && 0.6 < high, "{low} to {high}");
}

#[test]
fn a_part_of_the_mass_that_swings_is_found() {
    let run = probed("probe-pushes", "loose-mass:2", 5);
    assert_eq!(named(&run)[0], "loose-mass");
}

#[test]
fn a_play_and_a_swinging_part_of_a_joint_are_found() {
    let run = probed("probe-hinge", "backlash", 3);
    assert_eq!(named(&run), ["backlash"]);
    let half = &run.diagnosis.findings[0].parameters["b"];
    assert!((half.value / 0.03 - 1.0).abs() < 0.15, "{}", half.value);
    let run = probed("probe-hinge", "joint-loose-mass", 3);
    assert_eq!(named(&run), ["joint-loose-mass"]);
    let rate = &run.diagnosis.findings[0].parameters["rate"];
    assert!((rate.value / 21.834 - 1.0).abs() < 0.05, "{}", rate.value);
}

/// A lag of 50 ms that every start of a hinge shows, to and fro, is no matter of the hinge.
#[test]
fn a_sensor_that_lags_is_told_by_a_joint() {
    let run = probed("probe-hinge", "sensor-lag", 84_201);
    assert_eq!(named(&run), ["sensor-lag"]);
    let lag = &run.diagnosis.findings[0].parameters["Tf"];
    assert!(lag.ci95.is_some_and(|[low, high]| low < 0.05 && 0.05 < high), "{lag:?}");
}

#[test]
fn an_axis_that_wanders_and_a_joint_that_follows_are_found() {
    assert_eq!(named(&probed("probe-hinge", "moving-axis", 3)), ["moving-axis"]);
    let run = probed("probe-pair", "joint-coupling", 3);
    assert_eq!(named(&run), ["joint-coupling"]);
    let ratio = &run.diagnosis.findings[0].parameters["rho"];
    assert!((ratio.value / 0.873 - 1.0).abs() < 0.02, "{}", ratio.value);
    assert!(named(&probed("probe-pair", "none", 3)).is_empty());
}

#[test]
fn a_support_that_gives_is_found() {
    let run = probed("probe-presses", "support-compliance:4", 3);
    assert_eq!(named(&run), ["support-compliance"]);
    let found = &run.diagnosis.findings[0].parameters["compliance"];
    assert!((found.value / 2e-4 - 1.0).abs() < 0.1, "{} m/N", found.value);
}

#[test]
fn a_sensor_that_reads_a_stated_weight_wrongly_is_told() {
    let scene = scene_named("probe-pushes").expect("a built-in scene");
    let mut made = synthesise(&scene, Path::new("."), Seed(21), &Progress::silent()).expect("a capture");
    let weight = 0.090 * 0.070 * 0.040 * 1600.0;
    let mut told = |stated: f64| {
        let body = made
            .capture
            .bodies
            .iter_mut()
            .find(|b| b.name == "box")
            .expect("the box");
        (body.mass, body.mass_sd) = (Some(stated), Some(1e-3 * stated));
        build(&made.capture, &Options::default(), &Progress::silent()).expect("a twin")
    };
    assert!(named(&told(weight)).is_empty());
    let run = told(weight / 1.12);
    assert!(named(&run).contains(&"force-gain"), "{:?}", named(&run));
    let found = run
        .diagnosis
        .findings
        .iter()
        .find(|f| f.cause == "force-gain")
        .expect("a gain");
    let gain = &found.parameters["g"];
    let [low, high] = gain.ci95.expect("an interval");
    assert!(
        (gain.value - 0.12).abs() < 0.005 && low < 0.12 && 0.12 < high,
        "{}",
        gain.value
    );
}

#[test]
fn what_happens_when_a_push_begins_is_found() {
    let of = |hidden: &str, cause: &str, parameter: &str| {
        let run = probed("probe-pushes", hidden, 4);
        assert_eq!(named(&run), [cause]);
        run.diagnosis.findings[0].parameters[parameter].value
    };
    let way = of("presliding:2", "presliding", "way");
    assert!((way / 6e-4 - 1.0).abs() < 0.15, "{way}");
    let glue = of("breakaway-bond", "breakaway-bond", "Fg");
    assert!((1.8..3.2).contains(&glue), "{glue}");
    of("static-ageing", "static-ageing", "beta");
}

#[test]
fn a_thing_in_the_way_is_no_patch_of_friction() {
    // It is never pushed past, so that a patch does nearly as well: neither is told for sure, and both are told.
    let run = probed("probe-pushes", "hidden-body:2.6", 137);
    let first = &run.diagnosis.findings[0];
    let rivals = first.alternatives.iter().map(|a| (a.cause.as_str(), a.probability));
    let told: Vec<(&str, f64)> = rivals.chain([(first.cause.as_str(), first.probability)]).collect();
    let of = |cause: &str| told.iter().find(|t| t.0 == cause).map_or(0.0, |t| t.1);
    assert!(of("hidden-body") > 0.2 && of("friction-patch") < 0.8, "{told:?}");
}

#[test]
fn what_a_finger_that_touches_beside_does_to_lifts_is_no_offset_centre_either() {
    assert_eq!(
        named(&probed("probe-pushes", "contact-point-offset:3", 122)),
        ["contact-point-offset"]
    );
}

#[test]
fn a_tether_that_is_slack_at_first_is_found() {
    let run = probed("probe-pushes", "tether", 4);
    assert_eq!(named(&run), ["tether"]);
    let stiffness = &run.diagnosis.findings[0].parameters["k"];
    assert!((stiffness.value / 20.0 - 1.0).abs() < 0.15, "{}", stiffness.value);
}

/// In three scenes without a hidden effect: causes that its touches show, and that they cannot.
#[test]
fn each_cause_is_tried_found_or_listed_with_what_would_show_it() {
    let friction = [
        "velocity-weakening-friction",
        "viscous-friction",
        "static-ageing",
        "anisotropic-friction",
        "friction-patch",
        "support-tilt",
        "com-offset",
        "presliding",
    ];
    let elastic = [
        "hardening-stiffness",
        "power-law-stiffness",
        "guide-friction",
        "preload",
        "stiffness-drift",
    ];
    let joint = [
        "joint-damping",
        "joint-quadratic-damping",
        "detent",
        "lever-arm",
        "backlash",
    ];
    let reads = ["outliers", "quantisation", "force-saturation", "force-drift"];
    for (scene, seed, shows, hides) in [
        ("probe-pushes", 20, &friction[..], [&elastic[..], &joint]),
        ("probe-presses", 21, &elastic, [&friction, &joint]),
        (
            "probe-hinge",
            22,
            &joint,
            [&elastic, &["anisotropic-friction", "friction-patch"]],
        ),
    ] {
        let diagnosis = probed(scene, "none", seed).diagnosis;
        let showing = diagnosis.experiments.iter().filter(|e| e.bits.is_none());
        let listed: Vec<&str> = showing.flat_map(|e| e.parts.iter().map(String::as_str)).collect();
        let named: Vec<&str> = diagnosis.findings.iter().map(|f| f.cause.as_str()).collect();
        let tried: Vec<&str> = diagnosis.tried().collect();
        assert!(named.is_empty(), "{scene}: {named:?}");
        for cause in CAUSES {
            let places = listed.iter().chain(&tried).filter(|c| **c == cause).count();
            assert_eq!(places, 1, "{scene}: {cause}");
        }
        for cause in shows.iter().chain(&reads) {
            assert!(tried.contains(cause), "{scene}: {cause} is not tried");
        }
        for cause in hides.into_iter().flatten() {
            assert!(listed.contains(cause), "{scene}: {cause} cannot show and is not listed");
        }
        let bits: Vec<f64> = diagnosis.experiments.iter().map(|e| e.bits.unwrap_or(-1.0)).collect();
        assert!(bits.is_sorted_by(|a, b| a >= b), "{scene}: {bits:?}");
    }
}

#[test]
fn what_slows_a_rolling_ball_is_found_and_is_no_sliding_friction() {
    let run = probed("probe-rolls", "rolling-resistance", 1);
    assert_eq!(named(&run), ["rolling-resistance"]);
    let finding = &run.diagnosis.findings[0];
    let length = &finding.parameters["k_r"];
    assert!((length.value / 2e-4 - 1.0).abs() < 0.05, "{} m", length.value);
    assert!(finding.gain.reduction > 0.8, "{}", finding.gain.reduction);
    let ball = run.model.twin.link("ball").expect("the ball");
    let rolling = ball.friction.rolling.as_ref().expect("its rolling resistance");
    let [low, high] = rolling.ci95.expect("an interval");
    assert!(low < 2e-4 && 2e-4 < high, "{low} to {high}");
    // The force of a finger that rolls a ball along says nothing of how it would slide.
    assert!(ball.friction.kinetic.as_ref().is_none_or(|f| !f.is_measured()));

    let free = probed("probe-rolls", "none", 1);
    assert!(named(&free).is_empty());
    assert_eq!(free.diagnosis.verdict, Verdict::Adequate);
    assert!(
        free.model
            .twin
            .link("ball")
            .expect("the ball")
            .friction
            .rolling
            .is_none()
    );
}

#[test]
fn friction_that_is_not_in_proportion_to_the_load_is_found() {
    let run = probed("probe-loads", "load-dependent-friction", 1);
    assert_eq!(named(&run), ["load-dependent-friction"]);
    assert_eq!(run.diagnosis.verdict, Verdict::Explained);
    assert!(run.diagnosis.findings[0].gain.reduction > 0.5);

    let plain = probed("probe-loads", "none", 1);
    assert!(named(&plain).is_empty());
    assert_eq!(plain.diagnosis.verdict, Verdict::Adequate);
    // What a hand presses down is part of the load.
    let friction = plain
        .model
        .twin
        .link("block")
        .expect("the block")
        .friction
        .kinetic
        .clone();
    let friction = friction.expect("its friction");
    assert!((friction.value / 0.32 - 1.0).abs() < 0.01, "{}", friction.value);
}

#[test]
fn a_force_sensor_that_lags_is_told_from_a_late_camera() {
    for (hidden, seconds) in [("sensor-lag", 0.05), ("sensor-lag:2", 0.1)] {
        let run = probed("probe-pushes", hidden, 3);
        assert_eq!(named(&run), ["sensor-lag"]);
        let [low, high] = run.diagnosis.findings[0].parameters["Tf"].ci95.expect("an interval");
        assert!((low..=high).contains(&seconds), "{low} {high}");
    }
}

#[test]
fn a_soft_finger_and_a_wrong_arm_of_its_force_are_found() {
    for (seed, exponent) in [(2, Some(0.4)), (4, None)] {
        let run = probed("probe-pushes", "contact-law", seed);
        assert_eq!(named(&run), ["contact-law"], "{seed}");
        let [low, high] = run.diagnosis.findings[0].parameters["h"].ci95.expect("an interval");
        assert!(exponent.is_none_or(|h| (low..=high).contains(&h)), "{low} {high}");
    }
    for seed in [1, 2] {
        assert_eq!(
            named(&probed("probe-hinge", "lever-arm", seed)),
            ["lever-arm"],
            "{seed}"
        );
    }
}

#[test]
fn what_the_twin_carries_is_the_model_with_what_was_named() {
    let run = probed("probe-pushes", "wear-or-heating:3", 3);
    assert_eq!(named(&run), ["wear-or-heating"]);
    let link = run.model.twin.link("box").expect("the box");
    let friction = link.friction.kinetic.as_ref().expect("friction");
    let [low, high] = friction.ci95.expect("an interval");
    // What it was before it wore.
    assert!((low..=high).contains(&0.32), "{low} {high}");
}
