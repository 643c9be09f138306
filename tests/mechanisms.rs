//! Real doors, drawers and a dishwasher, one recording at a time: the kind of joint, how sure it is, and the radius.
//! Needs the recordings named by `PALPATE_DATA`; without them it says that it is skipped.
//! `cargo test --release --test mechanisms -- --nocapture` prints a row for each recording.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_macros,
    reason = "a test says what it found and stops"
)]

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::Vector3;
use palpate::base::{Notices, Pose};
use palpate::capture::{Capture, read_capture};
use palpate::stages::articulation::{self, Articulation};
use palpate::twin::{Body, Joint, JointKind, Link, Model, Provenance, Twin};

/// A kind is said, rather than left undecided, from this probability on.
const SAID: f64 = 0.9;

const MECHANISMS: [(&str, JointKind); 9] = [
    ("cabinet-one", JointKind::Revolute),
    ("cabinet-two", JointKind::Revolute),
    ("dishwasher", JointKind::Revolute),
    ("drawer", JointKind::Prismatic),
    ("drawer-one", JointKind::Prismatic),
    ("left-door", JointKind::Revolute),
    ("microwave", JointKind::Revolute),
    ("right-door", JointKind::Revolute),
    ("sliding-cabinet", JointKind::Prismatic),
];
/// Two of the kitchen's recordings are of drawers, the others of doors.
const KITCHEN_DRAWERS: [&str; 2] = ["pull-06", "pull-14"];

fn data(name: &str) -> Option<Capture> {
    let Some(root) = std::env::var_os("PALPATE_DATA") else {
        println!("skipped: PALPATE_DATA is not set");
        return None;
    };
    let folder = PathBuf::from(root).join("mechanisms").join(name);
    Some(read_capture(&folder).expect("a capture"))
}

/// The capture with one of its recordings alone.
fn alone(capture: &Capture, name: &str) -> Capture {
    let mut one = capture.clone();
    one.interactions.retain(|i| i.name == name);
    one
}

fn inferred(capture: &Capture) -> (Articulation, Notices) {
    let mut bodies: BTreeMap<String, Body> = BTreeMap::new();
    for (name, stream) in capture.interactions.iter().flat_map(|i| &i.tracks) {
        let first = (0..stream.len()).find_map(|i| stream.pose(i));
        if let Some(pose) = first {
            bodies.insert(name.clone(), Body::rigid(Link::new(name, Pose(pose.0))));
        }
    }
    let model = Model {
        twin: Twin {
            format: "palpate-twin/1".into(),
            name: capture.name.clone(),
            gravity: capture.gravity.into(),
            support: None,
            bodies: bodies.into_values().collect(),
            relations: Vec::new(),
            provenance: Provenance::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes: BTreeMap::new(),
        textures: BTreeMap::new(),
    };
    let mut notices = Notices::default();
    let config = articulation::Config::default();
    let found = articulation::infer(capture, &[], &model, &config, &mut notices).expect("inferred");
    (found, notices)
}

/// Mean distance of the path from the joint's axis, and the share of its standard deviation that the origin has.
fn radius(capture: &Capture, joint: &Joint) -> (f64, f64) {
    let track = &capture.interactions[0].tracks[&joint.child];
    let (axis, origin) = (Vector3::from(joint.axis.value), Vector3::from(joint.origin.value));
    let arms: Vec<Vector3<f64>> = track
        .position
        .iter()
        .filter(|p| p.x.is_finite())
        .map(|p| {
            let arm = p.coords - origin;
            arm - axis * axis.dot(&arm)
        })
        .collect();
    let mean = arms.iter().map(|a| a.norm()).sum::<f64>() / arms.len() as f64;
    let middle = arms[arms.len() / 2].normalize();
    let sd = joint.origin.sd.expect("a spread");
    (mean, (0..3).map(|k| (sd[k] * middle[k]).powi(2)).sum::<f64>().sqrt())
}

fn odds(joint: &Joint, kind: JointKind) -> f64 {
    if joint.kind == kind {
        return joint.probability;
    }
    let found = joint.alternatives.iter().find(|a| a.kind == kind);
    found.map_or(0.0, |a| a.probability)
}

#[derive(Default)]
struct Count {
    right: usize,
    wrong: Vec<String>,
    undecided: Vec<String>,
    radii: Vec<(f64, f64)>,
}

impl Count {
    fn judge(&mut self, capture: &Capture, name: &str, truth: JointKind) {
        let one = alone(capture, name);
        let (found, _) = inferred(&one);
        let about = format!("{} {name}", capture.name);
        let Some(joint) = found.joints.first() else {
            println!("{about:<28} nothing is said");
            self.undecided.push(about);
            return;
        };
        let told = format!(
            "{:?} {:.3}, hinge {:.3}, slide {:.3}",
            joint.kind,
            joint.probability,
            odds(joint, JointKind::Revolute),
            odds(joint, JointKind::Prismatic)
        );
        let mut arc = String::new();
        if joint.kind == JointKind::Revolute {
            let (mean, sd) = radius(&one, joint);
            arc = format!("radius {mean:.4} m, origin ± {sd:.4} along it");
            self.radii.push((mean, sd));
        }
        println!("{about:<28} {told} {arc}");
        if joint.probability < SAID {
            self.undecided.push(about);
        } else if joint.kind == truth {
            self.right += 1;
        } else {
            self.wrong.push(about);
        }
    }
}

#[test]
fn the_kind_is_right_or_said_to_be_undecided() {
    let mut count = Count::default();
    for (name, kind) in MECHANISMS {
        let Some(capture) = data(name) else { return };
        for interaction in &capture.interactions {
            count.judge(&capture, &interaction.name, kind);
        }
    }
    let Some(kitchen) = data("kitchen") else { return };
    for interaction in &kitchen.interactions {
        let kind = if KITCHEN_DRAWERS.contains(&interaction.name.as_str()) {
            JointKind::Prismatic
        } else {
            JointKind::Revolute
        };
        count.judge(&kitchen, &interaction.name, kind);
    }
    let decided = count.right + count.wrong.len();
    println!(
        "{} of {decided} right, wrong: {:?}; undecided: {:?}",
        count.right, count.wrong, count.undecided
    );
    assert!(count.right as f64 >= 0.95 * decided as f64);
    assert!(count.undecided.len() <= 5);
}

/// Radii of what others measured too, m: the mean over the recordings and their spread hold it.
#[test]
fn radii_agree_within_the_spread_between_recordings() {
    for (name, published) in [("dishwasher", 0.655), ("left-door", 0.341), ("right-door", 0.383)] {
        let Some(capture) = data(name) else { return };
        let mut count = Count::default();
        for interaction in &capture.interactions {
            count.judge(&capture, &interaction.name, JointKind::Revolute);
        }
        let n = count.radii.len() as f64;
        let mean = count.radii.iter().map(|r| r.0).sum::<f64>() / n;
        let spread = (count.radii.iter().map(|r| (r.0 - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        println!("{name}: radius {mean:.4} ± {spread:.4} m between {n} recordings, published {published}");
        assert!((mean - published).abs() < spread, "{name}: {mean} ± {spread}");
    }
}
