//! Stacks that rest, stacks that are glued, stacks that nobody tried: boxes with surfaces on a table.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{Config, relate};
use crate::base::{Notices, Pose, Seed, rng_for};
use crate::capture::{Capture, Interaction, Kind, Noise, PoseStream, Support, WrenchStream};
use crate::geometry::solids::cuboid;
use crate::twin::{Body, Link, Model, Provenance, Relation, RelationKind, Twin};

const LOW: Vector3<f64> = Vector3::new(0.0, 0.0, 0.02);
const TOP: Vector3<f64> = Vector3::new(0.005, 0.0, 0.056);

fn track(start: Vector3<f64>, shift: Vector3<f64>, rng: &mut impl Rng) -> PoseStream {
    let mut draw = |sd: f64| Vector3::from_fn(|_, _| -> f64 { StandardNormal.sample(rng) }) * sd;
    let mut out = PoseStream::default();
    for i in 0..200 {
        let share = ((i as f64 - 50.0) / 100.0).clamp(0.0, 1.0);
        out.time.push(i as f64 * 0.01);
        out.position.push(Point3::from(start + shift * share + draw(4e-4)));
        out.rotation.push(Some(UnitQuaternion::from_scaled_axis(draw(4e-3))));
    }
    out
}

/// One interaction: its kind, what it touches, how far the lower and the upper box go.
type Trial<'a> = (Kind, &'a str, [f64; 3], [f64; 3]);

fn scene(trials: &[Trial]) -> Capture {
    let mut rng = rng_for(Seed(5), "stack");
    let interactions = trials
        .iter()
        .enumerate()
        .map(|(k, (kind, target, low, top))| Interaction {
            name: format!("trial-{k}"),
            kind: *kind,
            action: None,
            tool_name: None,
            tool: None,
            target: Some((*target).into()),
            force: None,
            tool_path: None,
            support_path: None,
            tracks: BTreeMap::from([
                ("low".to_owned(), track(LOW, Vector3::from(*low), &mut rng)),
                ("top".to_owned(), track(TOP, Vector3::from(*top), &mut rng)),
            ]),
            frames: None,
            held_out: false,
        });
    Capture {
        root: Default::default(),
        name: "stack".into(),
        gravity: Vector3::new(0.0, 0.0, -9.8),
        support: Some(Support {
            point: Point3::origin(),
            normal: UnitVector3::new_normalize(Vector3::z()),
            material: None,
            friction: None,
        }),
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions: interactions.collect(),
        truth: None,
        digest: String::new(),
    }
}

fn model(shift_of_top: [f64; 3]) -> Model {
    let mut meshes = BTreeMap::new();
    let things = [
        ("low", LOW, [0.08, 0.08, 0.04]),
        ("top", TOP + Vector3::from(shift_of_top), [0.05, 0.05, 0.03]),
    ];
    let bodies = things.map(|(name, at, size)| {
        let mut link = Link::new(name, Pose(Isometry3::translation(at.x, at.y, at.z)));
        let path = format!("meshes/{name}.obj");
        meshes.insert(path.clone(), cuboid(size));
        link.mesh = Some(path);
        Body::rigid(link)
    });
    Model {
        twin: Twin {
            format: "palpate-twin/1".into(),
            name: "stack".into(),
            gravity: [0.0, 0.0, -9.8],
            support: None,
            bodies: bodies.into(),
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes,
        textures: BTreeMap::new(),
    }
}

fn arcs(capture: &Capture) -> Vec<Relation> {
    relate(
        capture,
        &[],
        &model([0.0; 3]),
        &Config::default(),
        &mut Notices::default(),
    )
    .expect("related")
}

fn between(arcs: &[Relation]) -> &Relation {
    arcs.iter().find(|r| r.a == "low" && r.b == "top").expect("an arc")
}

#[test]
fn only_what_was_tried_is_called_fixed_or_resting() {
    const UP: [f64; 3] = [0.0, 0.0, 0.08];
    const AWAY: [f64; 3] = [0.0, 0.05, 0.0];
    const STILL: [f64; 3] = [0.0; 3];
    const SLIP: [f64; 3] = [0.0, 0.046, 0.0];
    let table: [(&str, &[Trial], RelationKind); 7] = [
        ("lifted off", &[(Kind::Lift, "top", STILL, UP)], RelationKind::Resting),
        (
            "came along in a lift",
            &[(Kind::Lift, "top", UP, UP)],
            RelationKind::Fixed,
        ),
        (
            "carried by friction",
            &[(Kind::Push, "low", AWAY, AWAY)],
            RelationKind::Unknown,
        ),
        (
            "slipped a little",
            &[(Kind::Push, "low", AWAY, SLIP)],
            RelationKind::Resting,
        ),
        ("pushed off", &[(Kind::Push, "top", STILL, AWAY)], RelationKind::Resting),
        ("pressed", &[(Kind::Press, "top", STILL, STILL)], RelationKind::Unknown),
        (
            "carried, then lifted off",
            &[(Kind::Push, "top", AWAY, AWAY), (Kind::Lift, "top", STILL, UP)],
            RelationKind::Resting,
        ),
    ];
    for (name, trials, kind) in table {
        let arcs = arcs(&scene(trials));
        let arc = between(&arcs);
        assert_eq!(arc.kind, kind, "{name}");
        let freedom = if kind == RelationKind::Fixed { 0 } else { 3 };
        assert_eq!((arc.rotation_dof, arc.translation_dof), (freedom, freedom), "{name}");
        assert_eq!(
            arc.probability > 0.95,
            kind != RelationKind::Unknown,
            "{name}: {}",
            arc.probability
        );
    }
}

#[test]
fn the_lower_of_a_stack_stands_on_the_table_and_the_upper_does_not() {
    let arcs = arcs(&scene(&[(Kind::Push, "low", [0.05, 0.0, 0.0], [0.05, 0.0, 0.0])]));
    let standing: Vec<&str> = arcs.iter().filter(|r| r.a == "support").map(|r| r.b.as_str()).collect();
    assert_eq!(standing, ["low"]);
}

#[test]
fn things_apart_have_no_arc() {
    let capture = scene(&[(Kind::Push, "low", [0.0; 3], [0.0; 3])]);
    let apart = model([0.2, 0.0, 0.0]);
    let arcs = relate(&capture, &[], &apart, &Config::default(), &mut Notices::default()).expect("related");
    assert!(arcs.iter().all(|r| r.a == "support"));
}

#[test]
fn glue_that_gave_way_says_at_which_pull() {
    let mut capture = scene(&[(Kind::Lift, "top", [0.0; 3], [0.0, 0.0, 0.08])]);
    let time: Vec<f64> = (0..1000).map(|i| i as f64 * 0.002).collect();
    let pull = |t: f64| match t {
        t if t < 0.3 => 0.0,
        t if t < 0.5 => 8.0 * (t - 0.3) / 0.2,
        _ => 1.5,
    };
    capture.interactions[0].force = Some(WrenchStream {
        force: time.iter().map(|t| Vector3::new(0.0, 0.0, pull(*t))).collect(),
        time,
        torque: None,
    });
    let arcs = arcs(&capture);
    assert_eq!(between(&arcs).kind, RelationKind::Fixed);
    let breakaway = between(&arcs).breakaway.clone().expect("a force");
    assert!((breakaway.value - 6.5).abs() < 0.3, "{}", breakaway.value);
}

/// A push of the upper one at 40 mm/s that comes to bear at 0.5 s; `force` by the time from then on.
fn pushed_at_top(force: impl Fn(f64) -> f64) -> Capture {
    let mut capture = scene(&[(Kind::Push, "top", [0.0; 3], [0.03, 0.0, 0.0])]);
    let time: Vec<f64> = (0..1000).map(|i| i as f64 * 0.002).collect();
    let run = &mut capture.interactions[0];
    run.force = Some(WrenchStream {
        force: time.iter().map(|t| Vector3::new(force(t - 0.5), 0.0, 0.01)).collect(),
        time: time.clone(),
        torque: None,
    });
    run.tool_path = Some(PoseStream {
        position: time.iter().map(|t| Point3::new(0.04 * t, 0.0, 0.056)).collect(),
        rotation: vec![None; time.len()],
        time,
    });
    capture
}

#[test]
fn glue_that_a_push_broke_is_told_from_rest_and_from_a_blow() {
    // Loaded over 60 ms, and gone between two readings.
    let glue = arcs(&pushed_at_top(|t| {
        if t < 0.0 {
            0.01
        } else if t < 0.06 {
            80.0 * t
        } else {
            0.2
        }
    }));
    let arc = between(&glue);
    assert_eq!(arc.kind, RelationKind::Fixed);
    let breakaway = arc.breakaway.clone().expect("a force");
    assert!((breakaway.value - 4.6).abs() < 0.3, "{}", breakaway.value);
    // Friction of what merely rests.
    let rest = arcs(&pushed_at_top(|t| if t < 0.0 { 0.01 } else { (80.0 * t).min(0.2) }));
    assert_eq!(between(&rest).kind, RelationKind::Resting);
    // A finger that overshoots, rubs on, and is drawn back in the end.
    let rubbed = arcs(&pushed_at_top(|t| match t {
        t if !(0.0..=0.8).contains(&t) => 0.01,
        t if t < 0.04 => 1.97,
        _ => 1.3,
    }));
    assert_eq!(between(&rubbed).kind, RelationKind::Resting);
    assert!(between(&rubbed).breakaway.is_none());
    // A short rise: a bond that gave way at once, or the blow of a heavy thing. Nobody can say.
    let open = arcs(&pushed_at_top(|t| {
        if t < 0.0 {
            0.01
        } else if t < 0.012 {
            300.0 * t
        } else {
            0.2
        }
    }));
    let arc = between(&open);
    assert_eq!(arc.kind, RelationKind::Unknown);
    assert!(arc.probability > 0.2 && arc.probability < 0.8, "{}", arc.probability);
    assert_eq!(arc.breakaway.as_ref().and_then(|b| b.ci95).map(|ci| ci[0]), Some(0.0));
}

#[test]
fn what_came_apart_by_a_push_is_not_proved_loose_by_lifting_it_later() {
    let mut capture = pushed_at_top(|t| {
        if t < 0.0 {
            0.01
        } else if t < 0.012 {
            300.0 * t
        } else {
            0.2
        }
    });
    let mut later = scene(&[(Kind::Lift, "top", [0.0; 3], [0.0, 0.0, 0.08])])
        .interactions
        .remove(0);
    later.name = "lift".into();
    let top = later.tracks.get_mut("top").expect("a track");
    top.position.iter_mut().for_each(|p| p.x += 0.03);
    capture.interactions.push(later);
    assert_eq!(between(&arcs(&capture)).kind, RelationKind::Unknown);
}

/// The arcs where the shapes of the stack run into each other by some millimetres, as coarse views leave them.
fn arcs_of_sunk(capture: &Capture) -> Vec<Relation> {
    let sunk = model([0.0, 0.0, -0.012]);
    relate(capture, &[], &sunk, &Config::default(), &mut Notices::default()).expect("related")
}

#[test]
fn lifts_tell_what_stands_on_what_where_the_shapes_do_not() {
    const UP: [f64; 3] = [0.0, 0.0, 0.08];
    const STILL: [f64; 3] = [0.0; 3];
    let both = scene(&[(Kind::Lift, "low", UP, UP), (Kind::Lift, "top", STILL, UP)]);
    let arcs = arcs_of_sunk(&both);
    assert_eq!(between(&arcs).kind, RelationKind::Resting);
    let standing: Vec<&str> = arcs.iter().filter(|r| r.a == "support").map(|r| r.b.as_str()).collect();
    assert_eq!(standing, ["low"]);
    // The lower one takes the upper one up, which shows no bond; the other way round does.
    let arcs = arcs_of_sunk(&scene(&[(Kind::Lift, "low", UP, UP)]));
    assert_eq!(between(&arcs).kind, RelationKind::Unknown);
    let arcs = arcs_of_sunk(&scene(&[(Kind::Lift, "top", UP, UP)]));
    assert_eq!(between(&arcs).kind, RelationKind::Fixed);
    // A tray takes both up.
    let mut third = scene(&[(Kind::Lift, "tray", UP, UP)]);
    let tray = track(Vector3::zeros(), Vector3::from(UP), &mut rng_for(Seed(6), "tray"));
    third.interactions[0].tracks.insert("tray".into(), tray);
    assert_eq!(between(&arcs_of_sunk(&third)).kind, RelationKind::Unknown);
}

#[test]
fn what_lies_on_what_stands_on_a_tray_does_not_lie_on_the_tray() {
    const UP: [f64; 3] = [0.0, 0.0, 0.08];
    const STILL: [f64; 3] = [0.0; 3];
    let rng = &mut rng_for(Seed(7), "tray");
    let mut capture = scene(&[
        (Kind::Lift, "low", UP, UP),
        (Kind::Lift, "top", STILL, UP),
        (Kind::Lift, "tray", UP, UP),
    ]);
    for (k, way) in [STILL, STILL, UP].into_iter().enumerate() {
        let tray = track(Vector3::zeros(), Vector3::from(way), rng);
        capture.interactions[k].tracks.insert("tray".into(), tray);
    }
    let carried = super::carried::Carried::of(&capture, &Vector3::z());
    assert!(carried.bears("tray", "low") && carried.bears("low", "top") && carried.bears("tray", "top"));
    assert!(carried.by_another("tray", "top") && !carried.by_another("low", "top"));
    assert!(carried.is_borne("top") && !carried.is_borne("tray"));
}
