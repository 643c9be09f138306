//! Joints and relations from recordings whose physics is not ours. Set PALPATE_DATA to the folder of recordings;
//! unset, these tests say that they are skipped. PALPATE_WORLDS may hold folders of captures that
//! `tests/worlds/mujoco_world.py` made, separated by colons.
#![allow(clippy::expect_used, clippy::disallowed_macros, reason = "tests may panic and print")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use palpate::base::{Notices, Pose};
use palpate::capture::{Capture, read_capture};
use palpate::stages::articulation::{self, Articulation};
use palpate::stages::relations;
use palpate::twin::{
    Body, Joint, JointKind, Link, Model, Provenance, Relation, RelationKind, TrueRelation, Truth, Twin,
};

fn capture(root: &Path) -> Capture {
    read_capture(root).expect("a capture")
}

/// What the pipeline knows before articulation, without the shapes: a rigid body for every track.
fn model(capture: &Capture) -> Model {
    let mut first: BTreeMap<String, Pose> = BTreeMap::new();
    for (name, stream) in capture.interactions.iter().flat_map(|i| &i.tracks) {
        if let Some(pose) = stream.pose(0) {
            first.entry(name.clone()).or_insert(pose);
        }
    }
    let bodies = first.into_iter().map(|(name, pose)| Body::rigid(Link::new(name, pose)));
    Model {
        twin: Twin {
            format: "palpate-twin/1".into(),
            name: capture.name.clone(),
            gravity: capture.gravity.into(),
            support: None,
            bodies: bodies.collect(),
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes: BTreeMap::new(),
        textures: BTreeMap::new(),
    }
}

fn inferred(root: &Path) -> (Articulation, Notices) {
    let capture = capture(root);
    let mut notices = Notices::default();
    let config = articulation::Config::default();
    let out = articulation::infer(&capture, &[], &model(&capture), &config, &mut notices).expect("inferred");
    (out, notices)
}

fn related(root: &Path, joints: Vec<Joint>) -> Vec<Relation> {
    let capture = capture(root);
    let mut model = model(&capture);
    if let Some(body) = model.twin.bodies.first_mut() {
        body.joints = joints;
    }
    let config = relations::Config::default();
    relations::relate(&capture, &[], &model, &config, &mut Notices::default()).expect("related")
}

fn data() -> Option<PathBuf> {
    let found = std::env::var_os("PALPATE_DATA").map(PathBuf::from);
    if found.is_none() {
        println!("PALPATE_DATA is not set: skipped");
    }
    found
}

#[test]
fn the_hinge_of_two_bars_is_found_where_it_is() {
    let Some(data) = data() else { return };
    let (out, _) = inferred(&data.join("mujoco-hinge"));
    assert_eq!(out.joints.len(), 1);
    let joint = &out.joints[0];
    assert_eq!(
        (joint.kind, joint.parent.as_str(), joint.child.as_str()),
        (JointKind::Revolute, "base", "arm")
    );
    assert!(joint.axis.value[2].acos().to_degrees() < 0.5);
    let origin = joint.origin.value;
    assert!((origin[0] - 0.065).hypot(origin[1]) < 3e-4, "{origin:?}");
    let arcs = related(&data.join("mujoco-hinge"), out.joints.clone());
    assert!(
        arcs.iter()
            .any(|r| r.kind == RelationKind::Revolute && (r.rotation_dof, r.translation_dof) == (1, 0))
    );
}

#[test]
fn a_stack_that_merely_rests_is_no_joint_and_not_glued() {
    let Some(data) = data() else { return };
    let root = data.join("mujoco-stack");
    assert!(inferred(&root).0.joints.is_empty());
    let arcs = related(&root, Vec::new());
    let arc = arcs.iter().find(|r| r.a == "low" && r.b == "top").expect("an arc");
    assert_eq!(arc.kind, RelationKind::Resting);
}

#[test]
fn real_doors_turn_and_real_drawers_slide() {
    let Some(data) = data() else { return };
    let table = [
        ("mechanisms/cabinet-one", JointKind::Revolute),
        ("mechanisms/cabinet-two", JointKind::Revolute),
        ("mechanisms/dishwasher", JointKind::Revolute),
        ("mechanisms/left-door", JointKind::Revolute),
        ("mechanisms/right-door", JointKind::Revolute),
        ("mechanisms/microwave", JointKind::Revolute),
        ("mechanisms/drawer", JointKind::Prismatic),
        ("mechanisms/drawer-one", JointKind::Prismatic),
        ("mechanisms/sliding-cabinet", JointKind::Prismatic),
        ("emps-train", JointKind::Prismatic),
        ("elbow-tosses", JointKind::Revolute),
        ("pr2-ikea-cabinet-log", JointKind::Revolute),
        ("pr2-lab-cabinet-log", JointKind::Revolute),
    ];
    for (name, kind) in table {
        let (out, _) = inferred(&data.join(name));
        let kinds: Vec<JointKind> = out.joints.iter().map(|j| j.kind).collect();
        assert_eq!(kinds, [kind], "{name}");
    }
}

/// What a made-up world says is true: kinds of joints, and words or freedoms of relations.
fn truth(root: &Path) -> Truth {
    let text = std::fs::read_to_string(root.join("truth.json")).expect("the truth");
    serde_json::from_str(&text).expect("a truth file")
}

#[test]
fn worlds_of_another_simulator_are_read_right() {
    let list = std::env::var("PALPATE_WORLDS").unwrap_or_default();
    if list.is_empty() {
        println!("PALPATE_WORLDS is not set: skipped");
    }
    for root in list.split(':').filter(|x| !x.is_empty()).map(Path::new) {
        let (truth, (out, _)) = (truth(root), inferred(root));
        let found: Vec<JointKind> = out.joints.iter().map(|j| j.kind).collect();
        let made: Vec<JointKind> = truth.joints.iter().map(|j| j.kind).collect();
        assert_eq!(found, made, "{}", root.display());
        for (joint, made) in out.joints.iter().zip(&truth.joints) {
            let cosine: f64 = (0..3).map(|i| joint.axis.value[i] * made.axis[i]).sum();
            assert!(cosine.abs().min(1.0).acos().to_degrees() < 1.0, "{}", root.display());
        }
        let arcs = related(root, out.joints);
        for (pair, relation) in &truth.relations {
            let (a, b) = pair.split_once('|').expect("a pair");
            let arc = arcs.iter().find(|r| r.a == a && r.b == b).expect("an arc");
            match relation {
                TrueRelation::Freedom(dof) => assert_eq!([arc.rotation_dof, arc.translation_dof], *dof),
                TrueRelation::Word(word) => assert_eq!(format!("{:?}", arc.kind).to_lowercase(), *word),
            }
        }
    }
}
