//! Joints and relations from recordings whose physics is not ours. Set PALPATE_DATA to the folder of recordings;
//! unset, these tests say that they are skipped. PALPATE_WORLDS may name captures made by
//! `tests/worlds/mujoco_world.py`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, UnitQuaternion, UnitVector3, Vector3};
use palpate::base::{Notices, Pose};
use palpate::capture::{Capture, Interaction, Kind, Noise, PoseStream, Support, Tool, ToolShape, WrenchStream};
use palpate::stages::articulation::{self, Articulation};
use palpate::stages::relations;
use palpate::twin::{Body, Joint, JointKind, Link, Model, Provenance, Relation, RelationKind, Twin};

fn rows(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).expect("a stream");
    text.lines()
        .skip(1)
        .map(|l| l.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect())
        .collect()
}

fn poses(path: &Path) -> PoseStream {
    let mut out = PoseStream::default();
    for r in rows(path) {
        out.time.push(r[0]);
        out.position.push(Point3::new(r[1], r[2], r[3]));
        let whole = r[4..8].iter().all(|x| x.is_finite());
        let seven = std::array::from_fn(|i| r[i + 1]);
        let turn: Option<UnitQuaternion<f64>> = whole.then(|| Pose::from_seven(seven).rotation);
        out.rotation.push(turn);
    }
    out
}

fn wrenches(path: &Path) -> WrenchStream {
    let mut out = WrenchStream::default();
    for r in rows(path) {
        out.time.push(r[0]);
        out.force.push(Vector3::new(r[1], r[2], r[3]));
    }
    out
}

fn interaction(root: &Path, value: &serde_json::Value) -> Interaction {
    let text = |key: &str| value[key].as_str().map(str::to_owned);
    let tool = value["tool"].is_object().then(|| Tool {
        shape: ToolShape::Sphere { radius: 0.008 },
        grip: value["tool"]["grip"].as_bool().unwrap_or(false),
        pin: value["tool"]["pin"].as_bool().unwrap_or(false),
    });
    let mut tracks = BTreeMap::new();
    for (name, path) in value["tracks"].as_object().into_iter().flatten() {
        tracks.insert(name.clone(), poses(&root.join(path.as_str().expect("a path"))));
    }
    Interaction {
        name: text("name").expect("a name"),
        kind: match text("kind").as_deref() {
            Some("push") => Kind::Push,
            Some("pull") => Kind::Pull,
            Some("press") => Kind::Press,
            Some("lift") => Kind::Lift,
            Some("tilt") => Kind::Tilt,
            Some("toss") => Kind::Toss,
            _ => Kind::Hold,
        },
        action: None,
        tool_name: None,
        tool,
        target: text("target"),
        force: text("force").map(|f| wrenches(&root.join(f))),
        tool_path: text("tool_path").map(|f| poses(&root.join(f))),
        support_path: None,
        tracks,
        frames: None,
        held_out: value["held_out"].as_bool().unwrap_or(false),
    }
}

fn capture(root: &Path) -> Capture {
    let text = std::fs::read_to_string(root.join("capture.json")).expect("a capture");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let list = json["interactions"].as_array().expect("interactions");
    Capture {
        root: root.into(),
        name: json["name"].as_str().unwrap_or("").into(),
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        support: json["support"].is_object().then(|| Support {
            point: Point3::origin(),
            normal: UnitVector3::new_normalize(Vector3::z()),
            material: None,
            friction: None,
        }),
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions: list.iter().map(|i| interaction(root, i)).collect(),
        truth: None,
        digest: String::new(),
    }
}

fn link(name: &str, pose: Pose) -> Link {
    serde_json::from_value(serde_json::json!({"name": name, "pose": pose.to_seven()})).expect("a link")
}

fn model(capture: &Capture) -> Model {
    let mut first: BTreeMap<String, Pose> = BTreeMap::new();
    for interaction in &capture.interactions {
        for (name, stream) in &interaction.tracks {
            if let Some(pose) = stream.pose(0) {
                first.entry(name.clone()).or_insert(pose);
            }
        }
    }
    let bodies = first.into_iter().map(|(name, pose)| Body {
        links: vec![link(&name, pose)],
        name,
        joints: Vec::new(),
    });
    Model {
        twin: Twin {
            format: "palpate-twin/1".into(),
            name: capture.name.clone(),
            gravity: capture.gravity.into(),
            support: None,
            bodies: bodies.collect(),
            relations: Vec::new(),
            provenance: Provenance::default(),
            notices: Vec::new(),
        },
        meshes: BTreeMap::new(),
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
fn the_hinge_of_the_two_bars_is_found() {
    let Some(data) = data() else { return };
    let (out, notices) = inferred(&data.join("mujoco-hinge"));
    println!("{out:#?} {notices:?}");
    let joint = &out.joints[0];
    assert_eq!(joint.kind, JointKind::Revolute);
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
#[ignore = "prints what is found in the folders of PALPATE_WORLDS, a list separated by colons"]
fn survey() {
    let list = std::env::var("PALPATE_WORLDS").unwrap_or_default();
    for root in list.split(':').filter(|x| !x.is_empty()) {
        let start = std::time::SystemTime::now();
        let (out, notices) = inferred(Path::new(root));
        println!("## {root} {:.1}s", start.elapsed().expect("time").as_secs_f64());
        let truth = std::fs::read_to_string(Path::new(root).join("truth.json")).unwrap_or_else(|_| "{}".into());
        let truth: serde_json::Value = serde_json::from_str(&truth).expect("JSON");
        for j in &out.joints {
            let list = |key: &str| truth["joints"][0][key].as_array().map(|v| v.iter().filter_map(|x| x.as_f64()).collect::<Vec<_>>());
            if let (Some(a), Some(sd)) = (list("axis"), j.axis.sd) {
                println!("    axis z {:.2?}", (0..3).map(|i| (j.axis.value[i] - a[i]) / sd[i]).collect::<Vec<_>>());
            }
            if let (Some(o), Some(sd)) = (list("origin"), j.origin.sd) {
                println!("    origin z {:.2?} mm {:.3?}", (0..3).map(|i| (j.origin.value[i] - o[i]) / sd[i]).collect::<Vec<_>>(),
                   (0..3).map(|i| (j.origin.value[i] - o[i]) * 1e3).collect::<Vec<_>>());
            }
            println!("  {} {:?} p {:.4} axis {:.4?} sd {:.4?} origin {:.4?} sd {:.4?}", j.name, j.kind, j.probability,
                j.axis.value, j.axis.sd, j.origin.value, j.origin.sd);
            println!("    travelled {:.4?} limits {:?} alt {:?}", j.travelled, j.limits.as_ref().map(|l| (l.value, l.sd)),
                j.alternatives.iter().filter(|a| a.probability > 1e-6).map(|a| (a.kind, a.probability)).collect::<Vec<_>>());
        }
        let out_joints = out.joints.clone();
        for r in related(Path::new(root), out.joints) {
            println!("  {}|{} {:?} {} {} p {:.3} {:?} {:?} truth {}", r.a, r.b, r.kind, r.rotation_dof, r.translation_dof, r.probability, r.from, r.breakaway.map(|b| b.value), truth["relations"]);
        }
        for j in out_joints.iter().filter(|j| j.parent == "world") {
            println!("  {} sd {:?} probability {}", j.name, j.origin.sd, j.probability);
        }
        for n in &notices.0 {
            println!("  note {}: {}", n.about, n.message);
        }
    }
}
