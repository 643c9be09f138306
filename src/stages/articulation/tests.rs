//! Recover the truth: made-up relative motion of every kind at three noise levels, and things that only look
//! joined.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, UnitVector3, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::manifold::Manifold;
use super::{Config, infer};
use crate::base::{Notices, Seed, rng_for};
use crate::capture::{Capture, Interaction, Kind, Noise, PoseStream, Support, TrackNoise};
use crate::twin::{Joint, JointKind, Model, Provenance, Twin};

/// Noise of the tracks: a motion capture rig, a good camera, a poor one.
pub(super) const LEVELS: [TrackNoise; 3] = [
    TrackNoise {
        position: 1e-4,
        rotation: 1e-3,
    },
    TrackNoise {
        position: 4e-4,
        rotation: 4e-3,
    },
    TrackNoise {
        position: 1e-3,
        rotation: 8e-3,
    },
];

pub(super) fn turn(axis: Vector3<f64>, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), angle)
}

pub(super) fn stream(poses: &[Isometry3<f64>], noise: TrackNoise, rng: &mut impl Rng) -> PoseStream {
    let mut draw = |sd: f64| Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(rng) }) * sd;
    let mut out = PoseStream::default();
    for (i, pose) in poses.iter().enumerate() {
        out.time.push(i as f64 * 0.01);
        out.position
            .push(Point3::from(pose.translation.vector + draw(noise.position)));
        let wobble = UnitQuaternion::from_scaled_axis(draw(noise.rotation));
        out.rotation.push(Some(wobble * pose.rotation));
    }
    out
}

/// A path with a rest before and after a smooth motion of share 0 to 1.
pub(super) fn shares(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let s = (i as f64 / count as f64 * 1.5 - 0.25).clamp(0.0, 1.0);
            s * s * (3.0 - 2.0 * s)
        })
        .collect()
}

pub(super) fn interaction(name: &str, target: &str, way: Vector3<f64>, tracks: Vec<(&str, PoseStream)>) -> Interaction {
    let time: Vec<f64> = tracks[0].1.time.clone();
    let path = shares(time.len()).iter().map(|s| Point3::from(way * *s)).collect();
    let rotation = vec![Some(UnitQuaternion::identity()); time.len()];
    Interaction {
        name: name.into(),
        kind: Kind::Push,
        action: None,
        tool_name: None,
        tool: None,
        target: Some(target.into()),
        force: None,
        tool_path: Some(PoseStream {
            time,
            position: path,
            rotation,
        }),
        support_path: None,
        tracks: tracks.into_iter().map(|(n, s)| (n.to_owned(), s)).collect(),
        frames: None,
        held_out: false,
    }
}

pub(super) fn capture(interactions: Vec<Interaction>, table: bool) -> Capture {
    Capture {
        root: Default::default(),
        name: "made-up".into(),
        gravity: Vector3::new(0.0, 0.0, -9.8),
        support: table.then(|| Support {
            point: Point3::origin(),
            normal: UnitVector3::new_normalize(Vector3::z()),
            material: None,
            friction: None,
        }),
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions,
        truth: None,
        digest: String::new(),
    }
}

pub(super) fn nothing_seen() -> Model {
    Model {
        twin: Twin {
            format: "palpate-twin/1".into(),
            name: "made-up".into(),
            gravity: [0.0, 0.0, -9.8],
            support: None,
            bodies: Vec::new(),
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes: BTreeMap::new(),
        textures: BTreeMap::new(),
    }
}

pub(super) fn joints_of(capture: &Capture) -> Vec<Joint> {
    let mut notices = Notices::default();
    let found = infer(capture, &[], &nothing_seen(), &Config::default(), &mut notices);
    found.expect("inferred").joints
}

/// A joint in the parent's frame, and how far its positions go in each of three runs.
fn made(kind: JointKind) -> (Manifold, [[f64; 3]; 3]) {
    let manifold = Manifold {
        kind,
        home: Isometry3::from_parts(
            Vector3::new(0.08, 0.02, 0.03).into(),
            turn(Vector3::new(1.0, 2.0, 0.5), 0.4),
        ),
        axis: Unit::new_normalize(Vector3::new(0.2, -0.3, 1.0)),
        point: Vector3::new(0.04, -0.01, 0.02),
        pitch: 0.008,
    };
    let ends = match kind {
        JointKind::Prismatic => [[0.06, 0.0, 0.0], [0.03, 0.0, 0.0], [-0.02, 0.0, 0.0]],
        JointKind::Cylindrical => [[0.8, 0.0, 0.0], [0.0, 0.05, 0.0], [-0.5, 0.03, 0.0]],
        JointKind::Planar => [[0.6, 0.0, 0.0], [0.0, 0.05, 0.0], [0.2, 0.0, 0.05]],
        JointKind::Spherical => [[0.6, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.2, 0.6]],
        JointKind::Screw => [[3.0, 0.0, 0.0], [1.5, 0.0, 0.0], [-2.0, 0.0, 0.0]],
        _ => [[0.8, 0.0, 0.0], [0.5, 0.0, 0.0], [-0.6, 0.0, 0.0]],
    };
    (manifold, ends)
}

/// Three runs of a joint whose base glides along, in a world frame that is turned.
fn jointed(kind: JointKind, noise: TrackNoise, seed: u64) -> (Capture, Isometry3<f64>) {
    moved_to(&made(kind), noise, seed)
}

/// The same to other ends.
fn moved_to((manifold, ends): &(Manifold, [[f64; 3]; 3]), noise: TrackNoise, seed: u64) -> (Capture, Isometry3<f64>) {
    let mut rng = rng_for(Seed(seed), "joint");
    let base = Isometry3::from_parts(Vector3::new(0.3, -0.1, 0.2).into(), turn(Vector3::z(), 0.7));
    let mut runs = Vec::new();
    for (k, end) in ends.iter().enumerate() {
        let glide = Vector3::new(0.0, 0.01 * (k as f64 + 1.0), 0.004);
        let (mut parents, mut children) = (Vec::new(), Vec::new());
        for s in shares(150) {
            let parent = Isometry3::from_parts((base.translation.vector + glide * s).into(), base.rotation);
            children.push(parent * manifold.pose(&end.map(|z| z * s)));
            parents.push(parent);
        }
        let tracks = vec![
            ("thing/base", stream(&parents, noise, &mut rng)),
            ("thing/part", stream(&children, noise, &mut rng)),
        ];
        runs.push(interaction(
            &format!("push-{k}"),
            "thing/part",
            Vector3::new(0.1, 0.0, 0.0),
            tracks,
        ));
    }
    (capture(runs, false), base)
}

#[test]
fn every_kind_is_recovered_at_three_noise_levels() {
    use JointKind::{Cylindrical, Planar, Prismatic, Revolute, Screw, Spherical};
    for kind in [Revolute, Prismatic, Screw, Cylindrical, Planar, Spherical] {
        for (level, noise) in LEVELS.iter().enumerate() {
            let (capture, base) = jointed(kind, *noise, 7);
            let joints = joints_of(&capture);
            assert_eq!(joints.len(), 1, "{kind:?} at level {level}");
            assert_eq!(joints[0].kind, kind, "at level {level}: {:?}", joints[0]);
            assert!(joints[0].probability > 0.9, "{kind:?} at level {level}");
            let axis = base.rotation * made(kind).0.axis.into_inner();
            if kind != Spherical {
                let angle = axis.dot(&Vector3::from(joints[0].axis.value)).abs().min(1.0).acos();
                assert!(angle.to_degrees() < 2.0, "{kind:?} at level {level}: {angle}");
            }
        }
    }
}

#[test]
fn axis_and_origin_lie_in_their_intervals_at_the_stated_rate() {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..16 {
        let (capture, base) = jointed(JointKind::Revolute, LEVELS[1], seed);
        let joint = &joints_of(&capture)[0];
        let manifold = made(JointKind::Revolute).0;
        let axis = base.rotation * manifold.axis.into_inner();
        let point = (base * Point3::from(manifold.point)).coords;
        let sign = axis.dot(&Vector3::from(joint.axis.value)).signum();
        let found = Vector3::from(joint.origin.value);
        let nearest = point + axis * axis.dot(&(found - point));
        let intervals = joint.axis.ci95.iter().chain(&joint.origin.ci95).flatten();
        let truths = (sign * axis)
            .iter()
            .chain(nearest.iter())
            .copied()
            .collect::<Vec<f64>>();
        for ([low, high], truth) in intervals.zip(truths) {
            all += 1;
            inside += usize::from(*low <= truth && truth <= *high);
        }
    }
    assert!(inside * 100 >= all * 88, "{inside} of {all}");
}

#[test]
fn a_hinge_that_turns_by_more_than_half_a_turn_is_no_screw() {
    let (manifold, _) = made(JointKind::Revolute);
    let ends = [[3.2, 0.0, 0.0], [1.5, 0.0, 0.0], [-0.4, 0.0, 0.0]];
    let (capture, _) = moved_to(&(manifold, ends), LEVELS[1], 3);
    let joints = joints_of(&capture);
    assert_eq!(joints[0].kind, JointKind::Revolute, "{:?}", joints[0]);
}

#[test]
fn a_screw_gives_its_pitch() {
    let (capture, _) = jointed(JointKind::Screw, LEVELS[1], 3);
    let pitch = joints_of(&capture)[0].pitch.clone().expect("a pitch");
    let [low, high] = pitch.ci95.expect("an interval");
    assert!(low <= 0.008 && 0.008 <= high, "{low} {high}");
}

/// What was pushed, how the two went, and the way of the tool.
type Move<'a> = (&'a str, Isometry3<f64>, Isometry3<f64>, Vector3<f64>);

/// Two boxes on a table, not held to each other: what each does in each run.
fn loose(moves: &[Move]) -> Capture {
    let mut rng = rng_for(Seed(11), "loose");
    let (a, b) = (
        Isometry3::translation(0.0, 0.0, 0.02),
        Isometry3::translation(0.09, 0.0, 0.02),
    );
    let runs = moves.iter().enumerate().map(|(k, (target, da, db, way))| {
        let at = |from: &Isometry3<f64>, to: &Isometry3<f64>, s: f64| {
            let moved = from.translation.vector + to.translation.vector * s;
            Isometry3::from_parts(
                moved.into(),
                UnitQuaternion::from_scaled_axis(to.rotation.scaled_axis() * s),
            )
        };
        let poses = |from: &Isometry3<f64>, to: &Isometry3<f64>| -> Vec<Isometry3<f64>> {
            shares(150).iter().map(|s| at(from, to, *s)).collect()
        };
        let tracks = vec![
            ("a", stream(&poses(&a, da), LEVELS[1], &mut rng)),
            ("b", stream(&poses(&b, db), LEVELS[1], &mut rng)),
        ];
        interaction(&format!("push-{k}"), target, *way, tracks)
    });
    capture(runs.collect(), true)
}

#[test]
fn things_that_only_stand_beside_each_other_have_no_joint() {
    let still = Isometry3::identity();
    let to = Isometry3::translation;
    let spun = |x: f64, y: f64, angle: f64| Isometry3::new(Vector3::new(x, y, 0.0), Vector3::z() * angle);
    let cases: [(&str, Capture); 5] = [
        (
            "one push along a line",
            loose(&[("b", still, to(0.05, 0.0, 0.0), Vector3::x())]),
        ),
        (
            "two pushes of one box",
            loose(&[
                ("b", still, to(0.05, 0.0, 0.0), Vector3::x()),
                ("b", still, to(0.0, 0.06, 0.0), Vector3::y()),
            ]),
        ),
        (
            "a push off the centre",
            loose(&[("b", still, spun(0.01, 0.04, 0.4), Vector3::y())]),
        ),
        (
            "one shoves the other",
            loose(&[
                ("a", to(0.05, 0.0, 0.0), to(0.04, 0.0, 0.0), Vector3::x()),
                ("b", still, to(0.05, 0.0, 0.0), Vector3::x()),
            ]),
        ),
        (
            "both are pushed about",
            loose(&[
                ("a", spun(0.0, 0.05, 0.3), still, Vector3::y()),
                ("b", still, spun(0.03, -0.05, -0.5), -Vector3::y()),
                ("b", still, spun(0.05, 0.02, 0.3), Vector3::x()),
            ]),
        ),
    ];
    for (name, capture) in &cases {
        let joints = joints_of(capture);
        assert!(joints.is_empty(), "{name}: {joints:?}");
    }
}

#[test]
fn what_never_moved_relative_to_each_other_has_no_joint() {
    let together = Isometry3::translation(0.05, 0.02, 0.0);
    let capture = loose(&[("a", together, together, Vector3::x())]);
    assert!(joints_of(&capture).is_empty());
}

/// A handle pulled along a path, positions only.
pub(super) fn handle(path: impl Fn(f64) -> Vector3<f64>, count: usize, noise: f64, seed: u64) -> Capture {
    let mut rng = rng_for(Seed(seed), "handle");
    let poses: Vec<Isometry3<f64>> = (0..count)
        .map(|i| Isometry3::from_parts(path(i as f64 / (count - 1) as f64).into(), UnitQuaternion::identity()))
        .collect();
    let mut track = stream(
        &poses,
        TrackNoise {
            position: noise,
            rotation: 0.0,
        },
        &mut rng,
    );
    track.rotation.iter_mut().for_each(|r| *r = None);
    let mut run = interaction("pull-0", "part", Vector3::x(), vec![("part", track)]);
    run.kind = Kind::Pull;
    run.tool_path = None;
    capture(vec![run], false)
}

#[test]
fn a_door_is_told_from_a_drawer_once_its_arc_shows() {
    let (radius, noise, count) = (0.4, 5e-4, 300usize);
    let clear = 10.0 * noise / (count as f64).sqrt();
    for (sagitta, seed) in [(1.3 * clear, 1), (2.0 * clear, 2), (8.0 * clear, 3)] {
        let swing = (8.0 * sagitta / radius).sqrt();
        let arc = |s: f64| Vector3::new(radius * (swing * s).cos(), radius * (swing * s).sin(), 0.5);
        let joints = joints_of(&handle(arc, count, noise, seed));
        assert_eq!(joints[0].kind, JointKind::Revolute, "sagitta {sagitta}");
        assert_eq!(joints[0].parent, "world");
    }
    let line = |s: f64| Vector3::new(0.35 * s, 0.1 * s, 0.5);
    let joints = joints_of(&handle(line, count, noise, 4));
    assert_eq!(joints[0].kind, JointKind::Prismatic);
    assert!(joints[0].probability > 0.9);
}

#[test]
fn a_very_short_pull_leaves_the_kind_open() {
    let arc = |s: f64| Vector3::new(0.4 * (0.06 * s).cos(), 0.4 * (0.06 * s).sin(), 0.5);
    let joints = joints_of(&handle(arc, 100, 1e-3, 5));
    for joint in &joints {
        assert!(joint.probability < 0.9, "{joint:?}");
    }
}
