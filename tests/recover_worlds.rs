//! Recover the truth: captures of an independent simulator with their answers, and real pushes.
//!
//! Needs the recordings named by `PALPATE_DATA`; without them every test says that it is skipped.

#![allow(
    clippy::disallowed_macros,
    clippy::expect_used,
    clippy::panic,
    reason = "a test speaks and fails aloud"
)]

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Isometry3, Point3};
use palpate::base::{Estimate, Notices, Pose, Status};
use palpate::capture::{Capture, read_capture};
use palpate::geometry::Mesh;
use palpate::stages::{estimation, interaction};
use palpate::twin::{Body, Joint, JointKind, Link, Model, Provenance, Twin};

fn data(name: &str) -> Option<PathBuf> {
    let root = std::env::var_os("PALPATE_DATA");
    if root.is_none() {
        println!("skipped: PALPATE_DATA is not set");
    }
    root.map(|root| PathBuf::from(root).join(name))
}

fn box_mesh(half: [f64; 3]) -> Mesh {
    let corner = |i: u32| {
        let s = |bit: u32, h: f64| if i & bit == 0 { -h } else { h };
        Point3::new(s(1, half[0]), s(2, half[1]), s(4, half[2]))
    };
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads
            .iter()
            .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
            .collect(),
        ..Mesh::default()
    }
}

/// A model of boxes at the first tracked pose of each name.
fn model_of(capture: &Capture, boxes: &[(&str, [f64; 3])], joints: Vec<Joint>) -> Model {
    let mut meshes = BTreeMap::new();
    let links: Vec<Link> = boxes
        .iter()
        .map(|(name, half)| {
            let track = capture
                .interactions
                .iter()
                .find_map(|i| i.tracks.get(*name))
                .expect("tracked");
            let pose = track.pose(0).unwrap_or(Pose(Isometry3::identity()));
            let mut link = Link::new(*name, pose);
            link.mesh = Some(format!("meshes/{name}.obj"));
            meshes.insert(format!("meshes/{name}.obj"), box_mesh(*half));
            link
        })
        .collect();
    let bodies = if joints.is_empty() {
        links.into_iter().map(Body::rigid).collect()
    } else {
        vec![Body {
            name: boxes[0].0.into(),
            links,
            joints,
        }]
    };
    Model {
        twin: Twin {
            format: palpate::twin::FORMAT.into(),
            name: capture.name.clone(),
            gravity: capture.gravity.into(),
            support: None,
            bodies,
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes,
        textures: BTreeMap::new(),
    }
}

fn run(capture: &Capture, model: &mut Model) -> Notices {
    let mut notices = Notices::default();
    let cut = interaction::segment(capture, model, &interaction::Config::default(), &mut notices).expect("segments");
    for s in &cut {
        let phases: Vec<String> = s
            .phases
            .iter()
            .map(|p| format!("{:?} {:.3}-{:.3} {:?}", p.kind, p.start, p.end, p.moving))
            .collect();
        println!(
            "{}: {} | force {:?} N position {:?} m",
            s.interaction,
            phases.join(", "),
            s.force_noise,
            s.position_noise
        );
    }
    estimation::identify(capture, &cut, model, &estimation::Config::default(), &mut notices).expect("identifies");
    for (_, link) in model.twin.links() {
        let mut bare = link.clone();
        bare.mesh = None;
        println!("{}", serde_json::to_string_pretty(&bare).expect("json"));
    }
    for joint in model.twin.joints() {
        println!("{:?} {:?} {:?}", joint.friction, joint.damping, joint.stiffness);
    }
    for n in &notices.0 {
        println!("{:?} {}: {}", n.severity, n.about, n.message);
    }
    notices
}

fn link<'a>(model: &'a Model, name: &str) -> &'a Link {
    model.twin.links().find(|(_, l)| l.name == name).expect("there").1
}

/// Within `share` of the truth, measured, and the interval holds it.
fn check(what: &str, found: Option<&Estimate>, truth: f64, share: f64) {
    let found = found.unwrap_or_else(|| panic!("{what}: nothing found"));
    let [low, high] = found.ci95.expect("an interval");
    println!("{what}: {:.5} [{low:.5}, {high:.5}], truth {truth}", found.value);
    assert_eq!(found.status, Status::Measured, "{what}");
    assert!(
        (found.value / truth - 1.0).abs() < share,
        "{what}: {} against {truth}",
        found.value
    );
    assert!(
        low <= truth && truth <= high,
        "{what}: {truth} is outside [{low}, {high}]"
    );
}

#[test]
fn a_tin_is_weighed_and_its_friction_found() {
    let Some(folder) = data("mujoco-tin") else { return };
    let capture = read_capture(&folder).expect("reads");
    let mut model = model_of(&capture, &[("tin", [0.035, 0.025, 0.02])], Vec::new());
    run(&capture, &mut model);
    let tin = link(&model, "tin");
    check("mass", tin.mass.as_ref(), 0.31, 0.04);
    check("kinetic friction", tin.friction.kinetic.as_ref(), 0.27, 0.04);
    check(
        "friction force",
        tin.friction_force.kinetic.as_ref(),
        0.31 * 0.27 * 9.80665,
        0.04,
    );
    let com = tin.com.as_ref().expect("weighed");
    assert!(com.value.iter().all(|c| c.abs() < 2e-3), "{:?}", com.value);
}

#[test]
fn a_pad_is_as_stiff_as_it_is() {
    let Some(folder) = data("mujoco-pad") else { return };
    let capture = read_capture(&folder).expect("reads");
    let mut model = model_of(&capture, &[("pad", [0.04, 0.04, 0.03])], Vec::new());
    run(&capture, &mut model);
    check("stiffness", link(&model, "pad").stiffness.as_ref(), 2200.0, 0.04);
    assert!(link(&model, "pad").mass.is_none(), "a pressed pad shows no mass");
}

#[test]
fn the_upper_of_a_stack_is_weighed_alone() {
    let Some(folder) = data("mujoco-stack") else { return };
    let capture = read_capture(&folder).expect("reads");
    let mut model = model_of(
        &capture,
        &[("low", [0.03, 0.03, 0.025]), ("top", [0.02, 0.02, 0.02])],
        Vec::new(),
    );
    run(&capture, &mut model);
    check("mass of the upper", link(&model, "top").mass.as_ref(), 0.15, 0.04);
    let low = link(&model, "low").mass.as_ref().expect("pushed");
    assert_eq!(low.status, Status::Assumed, "the lower was never weighed");
    assert!(low.confounded.is_some());
}

#[test]
fn a_slope_that_nobody_mentioned_does_not_spoil_mass_and_friction() {
    let Some(folder) = data("mujoco-hidden") else { return };
    let capture = read_capture(&folder).expect("reads");
    let mut model = model_of(&capture, &[("tin", [0.03, 0.03, 0.02])], Vec::new());
    let notices = run(&capture, &mut model);
    check("mass", link(&model, "tin").mass.as_ref(), 0.36, 0.04);
    check(
        "kinetic friction",
        link(&model, "tin").friction.kinetic.as_ref(),
        0.31,
        0.04,
    );
    assert!(notices.0.iter().any(|n| n.message.contains("slope")));
}

#[test]
fn a_hinge_on_the_table_is_confounded_with_the_table() {
    let Some(folder) = data("mujoco-hinge") else { return };
    let capture = read_capture(&folder).expect("reads");
    let joint = Joint {
        name: "base-arm".into(),
        kind: JointKind::Revolute,
        parent: "base".into(),
        child: "arm".into(),
        probability: 1.0,
        alternatives: Vec::new(),
        axis: Estimate::measured([0.0, 0.0, 1.0], [0.01; 3], "1", Vec::new(), "test"),
        origin: Estimate::measured([0.065, 0.0, 0.02], [0.001; 3], "m", Vec::new(), "test"),
        pitch: None,
        limits: None,
        travelled: None,
        position: None,
        friction: None,
        damping: None,
        stiffness: None,
        rest: None,
        effort: None,
        effects: palpate::twin::JointEffects::default(),
        lateral: None,
    };
    let mut model = model_of(
        &capture,
        &[("base", [0.05, 0.03, 0.02]), ("arm", [0.05, 0.015, 0.015])],
        vec![joint],
    );
    run(&capture, &mut model);
    for name in ["base", "arm"] {
        assert_eq!(
            link(&model, name).mass.as_ref().expect("pushed").status,
            Status::Assumed
        );
    }
}

#[test]
fn real_pushes_give_the_friction_force_and_no_mass() {
    for (name, nominal) in [
        ("cmu-push-hardboard-patch", 4.2),
        ("cmu-push-hardboard-3pt-10-130-10-10-10-130", 4.2),
        ("cmu-push-hardboard-3pt-10-90-10-10-30-130", 4.2),
        ("cmu-push-hardboard-3pt-30-90-30-30-30-90", 4.2),
        ("cmu-push-plywood-3pt-10-130-10-10-10-130", 5.0),
        ("cmu-push-plywood-3pt-10-90-10-10-30-130", 5.0),
        ("cmu-push-plywood-3pt-30-90-30-30-30-90", 5.0),
    ] {
        let Some(folder) = data(name) else { return };
        let mut capture = read_capture(&folder).expect("reads");
        capture.bodies.clear();
        let mut model = model_of(&capture, &[("triangle", [0.06, 0.06, 0.013])], Vec::new());
        run(&capture, &mut model);
        let triangle = link(&model, "triangle");
        println!("{name}");
        check("friction force", triangle.friction_force.kinetic.as_ref(), nominal, 0.1);
        assert_eq!(triangle.mass.as_ref().expect("pushed").status, Status::Assumed);
        assert!(triangle.mass.as_ref().expect("pushed").confounded.is_some());
    }
}
