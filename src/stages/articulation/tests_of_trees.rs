//! Recover the truth: linkages of more than two links, whatever the links are called.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::tests::{LEVELS, capture, interaction, joints_of, shares, stream};
use crate::base::{Seed, rng_for};
use crate::capture::{Capture, Kind, Tool, ToolShape, TrackNoise};
use crate::twin::JointKind::{self, Prismatic, Revolute};

/// A link that hangs on another: where its joint is and where its track has its origin, all in the world at first.
struct Part {
    name: &'static str,
    on: &'static str,
    kind: JointKind,
    axis: Vector3<f64>,
    point: Vector3<f64>,
    home: Vector3<f64>,
    /// How far it is moved when it is moved; 0 where it never is.
    way: f64,
}

fn part(
    (name, on): (&'static str, &'static str),
    (kind, axis): (JointKind, Vector3<f64>),
    [point, home]: [[f64; 3]; 2],
    way: f64,
) -> Part {
    Part {
        name,
        on,
        kind,
        axis: axis.normalize(),
        point: point.into(),
        home: home.into(),
        way,
    }
}

/// World-now from world-at-first of every part, those they hang on first.
fn moved(parts: &[Part], positions: &[f64]) -> Vec<Isometry3<f64>> {
    let mut out: Vec<Isometry3<f64>> = Vec::new();
    for (part, q) in parts.iter().zip(positions) {
        let own = if part.kind == Prismatic {
            Isometry3::from_parts((part.axis * *q).into(), UnitQuaternion::identity())
        } else {
            let turn = UnitQuaternion::from_scaled_axis(part.axis * *q);
            Isometry3::from_parts((part.point - turn * part.point).into(), turn)
        };
        let carrier = parts.iter().position(|p| p.name == part.on);
        out.push(carrier.map_or(own, |k| out[k] * own));
    }
    out
}

/// Every part that moves is pulled twice by a free pivot while the others stand on what carries them.
fn pulls(base: &str, parts: &[Part], prefix: &str, noise: TrackNoise, seed: u64) -> Capture {
    let mut rng = rng_for(Seed(seed), "linkage");
    let called = |name: &str| format!("{prefix}{name}");
    let mut runs = Vec::new();
    for (k, pulled) in parts.iter().enumerate().filter(|(_, p)| p.way != 0.0) {
        for sign in [1.0, -0.8] {
            let (there, back) = (shares(150), shares(150).into_iter().rev());
            let poses: Vec<Vec<Isometry3<f64>>> = there
                .into_iter()
                .chain(back)
                .map(|s| {
                    let at = |i: usize| if i == k { s * sign * pulled.way } else { 0.0 };
                    moved(parts, &(0..parts.len()).map(at).collect::<Vec<f64>>())
                })
                .collect();
            let still = vec![Isometry3::translation(0.0, 0.0, 0.4); poses.len()];
            let mut tracks = vec![(called(base), stream(&still, noise, &mut rng))];
            for (i, part) in parts.iter().enumerate() {
                let home = Isometry3::from_parts(part.home.into(), UnitQuaternion::from_scaled_axis(part.home));
                let way: Vec<Isometry3<f64>> = poses.iter().map(|p| p[i] * home).collect();
                tracks.push((called(part.name), stream(&way, noise, &mut rng)));
            }
            let named = tracks.iter().map(|(n, s)| (n.as_str(), s.clone())).collect();
            let target = called(pulled.name);
            let mut run = interaction(&format!("pull-{}", runs.len()), &target, Vector3::x(), named);
            run.kind = Kind::Pull;
            run.tool = Some(Tool {
                shape: ToolShape::Sphere { radius: 0.01 },
                grip: false,
                pin: true,
            });
            let held = Point3::from(pulled.home + Vector3::new(0.03, 0.04, 0.02));
            if let Some(path) = run.tool_path.as_mut() {
                path.position = poses.iter().map(|p| p[k] * held).collect();
            }
            runs.push(run);
        }
    }
    capture(runs, false)
}

fn check(what: &str, base: &str, parts: &[Part]) {
    let truth: BTreeSet<(String, String, &str)> = parts
        .iter()
        .filter(|p| p.way != 0.0)
        .map(|p| (p.on.into(), p.name.into(), p.kind.name()))
        .collect();
    for (prefix, level) in [("", 0), ("", 2), ("thing/", 1)] {
        let capture = pulls(base, parts, prefix, LEVELS[level], level as u64);
        let bare = |name: &str| name.strip_prefix(prefix).unwrap_or(name).to_owned();
        let found: BTreeSet<(String, String, &str)> = joints_of(&capture)
            .iter()
            .filter(|j| j.kind != JointKind::Fixed)
            .map(|j| (bare(&j.parent), bare(&j.child), j.kind.name()))
            .collect();
        assert_eq!(found, truth, "{what}, prefix `{prefix}`, noise {level}");
    }
}

#[test]
fn a_cabinet_is_its_box_with_two_doors_and_a_tray() {
    let (up, down, out) = (Vector3::z(), -Vector3::z(), Vector3::x());
    let parts = [
        part(
            ("right", "box"),
            (Revolute, down),
            [[0.3, -0.4, 0.4], [0.3, -0.2, 0.4]],
            1.2,
        ),
        part(("left", "box"), (Revolute, up), [[0.3, 0.4, 0.4], [0.3, 0.2, 0.4]], 1.3),
        part(("tray", "box"), (Prismatic, out), [[0.0; 3], [0.2, 0.0, 0.25]], 0.25),
    ];
    check("cabinet", "box", &parts);
}

#[test]
fn a_lamp_is_a_chain_of_three_hinges() {
    let (up, level) = (Vector3::z(), Vector3::y());
    let parts = [
        part(
            ("trunk", "foot"),
            (Revolute, up),
            [[0.0, 0.0, 0.5], [0.0, 0.0, 0.45]],
            0.8,
        ),
        part(
            ("arm", "trunk"),
            (Revolute, level),
            [[0.0, 0.0, 0.5], [0.1, 0.0, 0.6]],
            0.4,
        ),
        part(
            ("shade", "arm"),
            (Revolute, level),
            [[0.2, 0.0, 0.65], [0.3, 0.0, 0.6]],
            0.6,
        ),
    ];
    check("lamp", "foot", &parts);
}

#[test]
fn drawers_of_one_chest_hang_on_the_chest() {
    let out = Vector3::new(1.0, 0.2, 0.0);
    let drawer = |name: &'static str, z: f64| part((name, "chest"), (Prismatic, out), [[0.0; 3], [0.2, 0.0, z]], 0.2);
    let parts = [drawer("low", 0.25), drawer("middle", 0.4), drawer("high", 0.55)];
    check("chest", "chest", &parts);
}

#[test]
fn flaps_on_one_axis_hang_on_the_box() {
    let axis = Vector3::new(0.0, 1.0, 0.0);
    let at = [0.1, 0.0, 0.5];
    let parts = [
        part(("one", "box"), (Revolute, axis), [at, [0.25, 0.1, 0.5]], 1.0),
        part(("two", "box"), (Revolute, axis), [at, [0.25, -0.1, 0.5]], 0.7),
    ];
    check("flaps", "box", &parts);
}

#[test]
fn a_branch_hangs_on_what_carries_it() {
    let parts = [
        part(
            ("slide", "rail"),
            (Prismatic, Vector3::x()),
            [[0.0; 3], [0.1, 0.0, 0.5]],
            0.2,
        ),
        part(
            ("lid", "slide"),
            (Revolute, Vector3::y()),
            [[0.1, 0.0, 0.55], [0.2, 0.0, 0.55]],
            1.0,
        ),
        part(
            ("knob", "slide"),
            (Revolute, Vector3::z()),
            [[0.1, 0.1, 0.5], [0.13, 0.2, 0.5]],
            0.9,
        ),
    ];
    check("branch", "rail", &parts);
}

/// Two things joined, touched by themselves; a third that stood by once beside either end while nothing moved. It says
/// nothing of the two.
#[test]
fn what_stood_by_takes_no_joint_away() {
    let parts = [part(
        ("flap", "post"),
        (Revolute, Vector3::z()),
        [[0.0, 0.0, 0.5], [0.1, 0.0, 0.5]],
        1.0,
    )];
    let mut capture = pulls("post", &parts, "", LEVELS[1], 5);
    for (k, name) in ["post", "flap"].into_iter().enumerate() {
        let mut rest = capture.interactions[0].clone();
        rest.name = format!("rest-{k}");
        (rest.kind, rest.target, rest.tool, rest.tool_path) = (Kind::Hold, None, None, None);
        let mut own = rest.tracks[name].clone();
        let (position, rotation) = (own.position[0], own.rotation[0]);
        own.position.fill(position);
        own.rotation.fill(rotation);
        rest.tracks = [(name.to_owned(), own.clone()), ("mug".to_owned(), own)].into();
        capture.interactions.push(rest);
    }
    let joints = joints_of(&capture);
    assert_eq!(joints.len(), 1, "{joints:?}");
    assert_eq!(joints[0].kind, Revolute);
}
