//! A plate that is pushed turns as the sum over what it stands on tells, along it and across it.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::predict_push;
use super::push::tests::pushed;
use super::riders::riders;
use crate::base::Pose;
use crate::geometry::solids::cuboid;
use crate::twin::{Body, Link, Relation, RelationKind};

const SIZE: [f64; 3] = [0.2, 0.04, 0.08];
const LEVER: f64 = 0.003;
const WAY: f64 = 0.005;

/// How far a plate turns that a finger drives ahead by [`WAY`] and that sticks to it, `half` its length along the push and `side`
/// across, m: moments about the finger, summed over a grid of the face.
fn summed(half: f64, side: f64) -> f64 {
    let grid = |size: f64, k: u32, n: u32| size * ((f64::from(k) + 0.5) / f64::from(n) - 0.5);
    let moment = |spin: f64| -> f64 {
        let each = (0..120).flat_map(|i| (0..120).map(move |j| (grid(2.0 * half, i, 120), grid(side, j, 120))));
        let of = |(x, y): (f64, f64)| {
            let arm = (x + half, y - LEVER);
            let v = (1.0 - spin * arm.1, spin * arm.0);
            (arm.0 * v.1 - arm.1 * v.0) / v.0.hypot(v.1)
        };
        each.map(of).sum()
    };
    let (mut low, mut high) = (-50.0, 50.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if moment(middle) > 0.0 {
            high = middle
        } else {
            low = middle
        }
    }
    WAY * 0.5 * (low + high)
}

/// The same as it is foretold, the plate turned by `about` from where it lies along the push.
fn foretold(about: f64, half: f64) -> f64 {
    let (mut model, mut action) = pushed(5.0);
    model.meshes.insert("box.obj".into(), cuboid(SIZE));
    let pose = Pose(Isometry3::from_parts(
        Vector3::new(0.0, 0.0, 0.04).into(),
        UnitQuaternion::from_scaled_axis(Vector3::z() * about),
    ));
    model.twin.bodies[0].links[0].pose = pose;
    action.start.insert("box".into(), pose);
    let n = action.tool.time.len();
    // Without a weight nothing tips ahead.
    model.twin.bodies[0].links[0].mass = None;
    let place = |k: usize| Point3::new(-half - 0.008 + WAY * k as f64 / (n - 1) as f64, LEVER, 0.04);
    action.tool.position = (0..n).map(place).collect();
    let found = predict_push(&model, &action, 0.0).expect("a prediction");
    let last = found.prediction.poses["box"].last().expect("a pose");
    (last.rotation * pose.rotation.inverse()).scaled_axis().z
}

#[test]
fn a_long_plate_turns_along_and_across_a_push_as_its_points_tell() {
    for (about, half, side) in [(0.0, 0.1, 0.04), (std::f64::consts::FRAC_PI_2, 0.02, 0.2)] {
        let (found, truth) = (foretold(about, half), summed(half, side));
        assert!((found / truth - 1.0).abs() < 0.06, "{about}: {found} for {truth}");
    }
}

#[test]
fn what_stands_on_another_rides_on_it_though_no_touch_told_a_bond() {
    let (mut model, _) = pushed(0.3);
    let put = |name: &str, at: [f64; 3]| {
        let mut link = Link::new(name, Pose(Isometry3::translation(at[0], at[1], at[2])));
        link.mesh = Some("box.obj".into());
        link
    };
    for (name, at) in [("above", [0.0, 0.0, 0.12]), ("beside", [0.1, 0.0, 0.04])] {
        model.twin.bodies.push(Body::rigid(put(name, at)));
        model.twin.relations.push(Relation {
            a: "box".into(),
            b: name.into(),
            kind: RelationKind::Unknown,
            rotation_dof: 3,
            translation_dof: 3,
            probability: 0.8,
            from: Vec::new(),
            breakaway: None,
        });
    }
    let mut start: BTreeMap<String, Pose> = model.twin.links().map(|(_, l)| (l.name.clone(), l.pose)).collect();
    assert_eq!(riders(&model, "box", &start), ["above"]);
    // Between touches one was taken off, and the other put on.
    let put = |x: f64, z: f64| Pose(Isometry3::translation(x, 0.0, z));
    start.insert("above".into(), put(0.5, 0.04));
    start.insert("beside".into(), put(0.01, 0.12));
    assert_eq!(riders(&model, "box", &start), ["beside"]);
    // What has no place is not there.
    start.remove("beside");
    assert!(riders(&model, "box", &start).is_empty());
}
