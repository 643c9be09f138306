//! Recover the truth where it takes more than one look: whole turns of a screw, paths beside a support, and what proves
//! that two plainly named things are held.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::infer::Unproven;
use super::tests::{LEVELS, capture, handle, interaction, joints_of, nothing_seen, stream};
use super::{Articulation, Config, infer};
use crate::base::{Notices, Pose, Seed, rng_for};
use crate::capture::{Capture, Interaction, Kind, Tool, ToolShape, WrenchStream};
use crate::geometry::solids::cuboid;
use crate::twin::{Body, JointKind, Link};

/// Rises, stays and comes back, 0 to 1 to 0.
fn to_and_fro(count: usize) -> Vec<f64> {
    let share = |i: usize| (i as f64 / count as f64 * 2.6 - 0.2).clamp(0.0, 1.0);
    let smooth = |s: f64| s * s * (3.0 - 2.0 * s);
    (0..count)
        .map(|i| smooth(share(i)) - smooth(share(i.saturating_sub(count / 2))))
        .collect()
}

/// A pull that grips `child` beside `parent`, which stands: the child's pose, the tool's place by share of the way.
fn pull(
    k: usize,
    (parent, child): (&str, &str),
    shares: &[f64],
    pose: &dyn Fn(f64) -> Isometry3<f64>,
    tool: &dyn Fn(f64) -> Vector3<f64>,
) -> Interaction {
    let mut rng = rng_for(Seed(k as u64), "pull");
    let poses: Vec<Isometry3<f64>> = shares.iter().map(|s| pose(*s)).collect();
    let still = vec![Isometry3::identity(); poses.len()];
    let tracks = vec![
        (parent, stream(&still, LEVELS[0], &mut rng)),
        (child, stream(&poses, LEVELS[0], &mut rng)),
    ];
    let mut run = interaction(&format!("pull-{k}"), child, Vector3::x(), tracks);
    run.kind = Kind::Pull;
    run.tool = Some(Tool {
        shape: ToolShape::Sphere { radius: 0.01 },
        grip: true,
        pin: false,
    });
    if let Some(path) = run.tool_path.as_mut() {
        path.position = shares.iter().map(|s| Point3::from(tool(*s))).collect();
    }
    run
}

fn all_of(capture: &Capture) -> (Articulation, Notices) {
    let mut notices = Notices::default();
    let found = infer(capture, &[], &nothing_seen(), &Config::default(), &mut notices);
    (found.expect("inferred"), notices)
}

#[test]
fn a_screw_turned_more_than_once_is_a_screw() {
    let pitch = 0.0035;
    let home = Vector3::new(0.004, 0.002, 0.05);
    let turned = |angle: f64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * angle);
        Isometry3::from_parts((turn * home + Vector3::z() * (pitch * angle)).into(), turn)
    };
    // The second begins where the first one ended, almost two turns on.
    let there = to_and_fro(1200);
    let runs = vec![
        pull(0, ("pot/jar", "pot/lid"), &there[..600], &|s| turned(12.0 * s), &|_| {
            Vector3::z() * 0.1
        }),
        pull(
            1,
            ("pot/jar", "pot/lid"),
            &there[..600],
            &|s| turned(12.0 - 9.0 * s),
            &|_| Vector3::z() * 0.1,
        ),
    ];
    let joints = joints_of(&capture(runs, true));
    assert_eq!(joints[0].kind, JointKind::Screw, "{:?}", joints[0]);
    assert!(joints[0].probability > 0.95);
    let found = joints[0].pitch.clone().expect("a pitch");
    assert!((found.value.abs() / pitch - 1.0).abs() < 0.01, "{found:?}");
    let [low, high] = joints[0].travelled.expect("a range");
    assert!((high - low - 12.0).abs() < 0.1, "{low} {high}");
}

#[test]
fn a_support_or_no_target_does_not_silence_a_handle() {
    let arc = |z: f64| move |s: f64| Vector3::new(0.3 * (1.2 * s).cos(), 0.3 * (1.2 * s).sin(), z);
    let mut high = handle(arc(0.4), 200, 3e-4, 1);
    high.support.clone_from(&capture(Vec::new(), true).support);
    high.interactions[0].target = None;
    let (found, _) = all_of(&high);
    assert_eq!(found.joints[0].kind, JointKind::Revolute);
    assert!(found.joints[0].probability > 0.9);
    // Just above the support it may be dragged along: nothing is claimed, and why is told.
    let mut low = handle(arc(0.05), 200, 3e-4, 1);
    low.support.clone_from(&high.support);
    let (found, notices) = all_of(&low);
    assert!(found.joints.is_empty());
    assert!(notices.0.iter().any(|n| n.message.contains("level above the support")));
}

/// Pulls of a door of which nobody tracked the post, low over the table, about an axis that lies `apart` m farther on each time.
fn swung_alone(count: usize, apart: f64) -> bool {
    let shares = to_and_fro(300);
    let one = |k: usize| {
        let at = Vector3::new(apart * k as f64, 0.0, 0.0);
        let swung = move |s: f64| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (1.2 * s));
            Isometry3::from_parts((at + turn * Vector3::new(0.22, 0.0, 0.05)).into(), turn)
        };
        let led = move |s: f64| swung(s).translation.vector;
        let mut run = pull(k, ("post", "door"), &shares, &swung, &led);
        run.tracks.remove("post");
        run
    };
    let (found, _) = all_of(&capture((0..count).map(one).collect(), true));
    found.joints.iter().any(|j| j.kind == JointKind::Revolute)
}

#[test]
fn what_is_led_round_one_axis_three_times_is_a_door() {
    assert!(swung_alone(3, 0.0));
    // Twice, or about another place each time, a hand may draw what stands on the table.
    assert!(!swung_alone(2, 0.0) && !swung_alone(3, 0.04));
}

#[test]
fn what_hangs_in_the_air_far_from_the_one_thing_beside_it_runs_on_its_rail() {
    let shares = to_and_fro(300);
    let found = |height: f64| {
        let drawn = move |s: f64| Isometry3::translation(0.3 + 0.08 * s, 0.0, height);
        let run = |k| pull(k, ("case", "drawer"), &shares, &drawn, &|s| drawn(s).translation.vector);
        let capture = capture((0..3).map(run).collect(), true);
        let mut model = nothing_seen();
        for (name, x) in [("case", 0.0), ("drawer", 0.3)] {
            let mesh = format!("{name}.obj");
            let mut link = Link::new(name, Pose(Isometry3::translation(x, 0.0, height)));
            link.mesh = Some(mesh.clone());
            model.twin.bodies.push(Body::rigid(link));
            model.meshes.insert(mesh, cuboid([0.1, 0.1, 0.06]));
        }
        let mut notices = Notices::default();
        let found = infer(&capture, &[], &model, &Config::default(), &mut notices).expect("inferred");
        found.joints.iter().any(|j| j.kind == JointKind::Prismatic)
    };
    assert!(found(0.1) && !found(0.03));
}

#[test]
fn a_long_swing_led_about_one_axis_is_a_hinge_whatever_the_names() {
    let shares = to_and_fro(500);
    let swung = |s: f64| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * (1.2 * s));
        Isometry3::from_parts((turn * Vector3::new(0.12, 0.0, 0.1)).into(), turn)
    };
    let led = |s: f64| swung(s) * Point3::new(0.13, 0.0, 0.0);
    let runs = (0..2).map(|k| pull(k, ("box", "door"), &shares, &swung, &|s| led(s).coords));
    let joints = joints_of(&capture(runs.collect(), true));
    assert_eq!(joints[0].kind, JointKind::Revolute);
    // Nor does what somebody put elsewhere between two touches: no hinge lets it lie there.
    let apart = |_: f64| Isometry3::translation(0.17, 0.02, 0.1);
    let told = |k: usize| {
        let swings = (0..2).map(|k| pull(k, ("box", "door"), &shares, &swung, &|s| led(s).coords));
        let still = pull(k, ("box", "door"), &shares, &apart, &|s| led(s).coords);
        let (found, notices) = all_of(&capture(swings.chain([still]).collect(), true));
        assert!(found.joints.is_empty(), "{:?}", found.joints);
        notices.0.iter().any(|n| n.message.contains("between touches"))
    };
    // Where noise looks like a motion, none of the kinds of joints explains all.
    let count = (2..12).filter(|k| told(*k)).count();
    assert!(count >= 3, "{count}");
    // What a hand turns where it stands shows no hinge.
    let spun = |s: f64| Isometry3::new(Vector3::new(0.12, 0.0, 0.1), Vector3::z() * (1.2 * s));
    let runs = (0..2).map(|k| pull(k, ("box", "can"), &shares, &spun, &|_| Vector3::new(0.12, 0.0, 0.15)));
    let (found, _) = all_of(&capture(runs.collect(), true));
    assert!(found.joints.is_empty(), "{:?}", found.joints);
}

#[test]
fn a_slide_with_a_stop_at_either_end_is_one_and_without_them_perhaps() {
    // The hand pulls on past both ends, where the slide stands and the force rises.
    let shares: Vec<f64> = to_and_fro(700)
        .iter()
        .map(|s| (1.3 * s - 0.1).clamp(0.0, 1.0))
        .collect();
    let drawn = |s: f64| Isometry3::translation(0.2 * s, 0.0, 0.05);
    let told = |stops: bool| {
        let run = |k: usize| {
            let mut run = pull(k, ("cabinet", "drawer"), &shares, &drawn, &|s| {
                drawn(s).translation.vector
            });
            let time = run.tool_path.as_ref().map_or_else(Vec::new, |p| p.time.clone());
            let force = |i: &usize| {
                let pressed = if shares[*i] >= 1.0 { 12.0 } else { -12.0 };
                let ends = stops && *i > 100 && (shares[*i] >= 1.0 || shares[*i] <= 0.0);
                Vector3::x() * if ends { pressed } else { 2.0 }
            };
            run.force = Some(WrenchStream {
                force: (0..time.len()).map(|i| force(&i)).collect(),
                torque: None,
                time,
            });
            run
        };
        all_of(&capture((0..2).map(run).collect(), true)).0
    };
    let found = told(true);
    assert_eq!(found.joints[0].kind, JointKind::Prismatic);
    let found = told(false);
    let [Unproven { child, share, .. }] = found.unproven.first_chunk().expect("a pair");
    assert!(child == "drawer" && found.joints.is_empty() && (0.3..0.5).contains(share));
}

#[test]
fn a_slide_that_is_led_along_one_line_again_and_again_both_ways_is_one() {
    let shares = to_and_fro(500);
    let forth = |s: f64| Isometry3::translation(0.15 * s, 0.0, 0.05);
    let back = |s: f64| Isometry3::translation(0.15 * (1.0 - s), 0.0, 0.05);
    let of = |each: [bool; 6]| {
        let run = |(k, back_too): (usize, &bool)| {
            let pose: &dyn Fn(f64) -> Isometry3<f64> = if *back_too { &back } else { &forth };
            pull(k, ("cabinet", "drawer"), &shares, pose, &|s| pose(s).translation.vector)
        };
        all_of(&capture(each.iter().enumerate().map(run).collect(), true)).0
    };
    let [f, b] = [false, true];
    assert_eq!(of([f, b, f, f, b, f]).joints[0].kind, JointKind::Prismatic);
    // A hand that only ever draws it away may do so with what is free.
    let away = of([f; 6]);
    assert!(away.joints.is_empty() && away.unproven.len() == 1);
}

#[test]
fn a_slide_that_is_shoved_along_the_line_on_which_it_was_led_is_one() {
    let shares = to_and_fro(500);
    let drawn = |s: f64| Isometry3::translation(0.15 * s, 0.0, 0.05);
    let run = |k: usize| {
        pull(k, ("cabinet", "drawer"), &shares, &drawn, &|s| {
            drawn(s).translation.vector
        })
    };
    let shoved = |turns: f64| {
        let goes = |s: f64| drawn(s) * Isometry3::rotation(Vector3::z() * (turns * s));
        let mut push = pull(2, ("cabinet", "drawer"), &shares, &goes, &|s| {
            drawn(s).translation.vector
        });
        push.kind = Kind::Push;
        push.tool.as_mut().expect("a tool").grip = false;
        push
    };
    let joints = joints_of(&capture(vec![run(0), run(1), shoved(0.0)], true));
    assert_eq!(joints[0].kind, JointKind::Prismatic);
    // What a single point turns as it shoves it is free; what was only led may be.
    for runs in [vec![run(0), run(1), shoved(0.3)], vec![run(0), run(1)]] {
        let (found, _) = all_of(&capture(runs, true));
        assert!(found.joints.is_empty(), "{:?}", found.joints);
    }
}

#[test]
fn a_frame_that_lies_on_its_axis_is_led_as_far_as_where_it_is_held() {
    let shares = to_and_fro(400);
    let turned = |s: f64| Isometry3::new(Vector3::new(0.1, 0.0, 0.2), Vector3::z() * (1.1 * s));
    let runs = (0..2).map(|k| {
        let held = |s: f64| (turned(s) * Point3::new(0.15, 0.0, 0.0)).coords;
        let mut run = pull(k, ("post", "arm"), &shares, &turned, &held);
        run.tracks.remove("post");
        run
    });
    let joints = joints_of(&capture(runs.collect(), false));
    assert_eq!(
        (joints[0].kind, joints[0].parent.as_str()),
        (JointKind::Revolute, "world")
    );
}

#[test]
fn a_slide_that_a_pivot_drives_ahead_of_itself_again_and_again_is_one() {
    let shares: Vec<f64> = (0..400).map(|i| f64::from(i) / 399.0).collect();
    let drawn = |s: f64| Isometry3::translation(0.15 * s, 0.0, 0.05);
    // The pivot is held to the front of it, and draws it out or drives it back in.
    let run = |k: usize, out: bool| {
        let at = move |s: f64| drawn(if out { s } else { 1.0 - s });
        let mut run = pull(k, ("cabinet", "drawer"), &shares, &at, &|s| {
            (at(s) * Point3::new(0.1, 0.0, 0.0)).coords
        });
        let tool = run.tool.as_mut().expect("a tool");
        (tool.grip, tool.pin) = (false, true);
        run
    };
    let joints = joints_of(&capture(
        vec![run(0, true), run(1, false), run(2, true), run(3, false)],
        true,
    ));
    assert_eq!(joints[0].kind, JointKind::Prismatic);
    // What is only drawn trails behind its pivot, held or not; once may be luck.
    for runs in [vec![run(0, true), run(1, true)], vec![run(0, true), run(1, false)]] {
        let (found, _) = all_of(&capture(runs, true));
        assert!(found.joints.is_empty(), "{:?}", found.joints);
    }
}

#[test]
fn a_drawer_by_its_name_is_held_though_its_chest_was_not_tracked() {
    let shares = to_and_fro(500);
    let drawn = |s: f64| Isometry3::translation(0.15 * s, 0.0, 0.05);
    let joints = |name: &str| {
        let run = |k: usize| {
            let mut run = pull(k, ("chest", name), &shares, &drawn, &|s| drawn(s).translation.vector);
            run.tracks.remove("chest");
            run
        };
        joints_of(&capture(vec![run(0), run(1)], true))
    };
    let joint = &joints("chest/drawer")[0];
    assert_eq!((joint.kind, joint.parent.as_str()), (JointKind::Prismatic, "world"));
    // What is a thing of its own may stand on the table.
    assert!(joints("drawer").is_empty());
}
