//! Puts a model where a scene was first seen: bodies in their places, joints at the positions that they had.

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};

use super::{Body, Joint, JointKind, Model, Twin};
use crate::base::Pose;

/// Moves every body of `model` that has a link of the same name in `seen` to where that is, and its joints to the
/// positions that the other links show; positions then count from the first view, as those of a twin do. Table and gravity
/// become those of `seen`.
pub fn placed_as(model: &mut Model, seen: &Twin) {
    for body in &mut model.twin.bodies {
        let found = body
            .links
            .iter()
            .find_map(|l| Some((l.pose.0, seen.link(&l.name)?.pose.0)));
        if let Some((own, there)) = found {
            let moved = there * own.inverse();
            let all: Vec<String> = body.links.iter().map(|l| l.name.clone()).collect();
            move_links(body, &all, &moved);
            turn_joints(body, seen);
        }
    }
    model.twin.gravity = seen.gravity;
    if seen.support.is_some() {
        model.twin.support.clone_from(&seen.support);
    }
}

/// The links of these names, with the joints that hold them.
fn move_links(body: &mut Body, names: &[String], moved: &Isometry3<f64>) {
    for link in body.links.iter_mut().filter(|l| names.contains(&l.name)) {
        link.pose = Pose(moved * link.pose.0);
    }
    for joint in body.joints.iter_mut().filter(|j| names.contains(&j.child)) {
        joint.axis.value = (moved * Vector3::from(joint.axis.value)).into();
        joint.origin.value = (moved * Point3::from(joint.origin.value)).coords.into();
    }
}

fn turn_joints(body: &mut Body, seen: &Twin) {
    let mut open: Vec<String> = body.links.first().map(|l| l.name.clone()).into_iter().collect();
    while let Some(parent) = open.pop() {
        let held: Vec<usize> = (0..body.joints.len())
            .filter(|k| body.joints[*k].parent == parent)
            .collect();
        for k in held {
            open.push(body.joints[k].child.clone());
            let Some(q) = position(body, &body.joints[k], seen) else {
                continue;
            };
            let moved = motion(&body.joints[k], q);
            let names = body.hung_on(&body.joints[k].child);
            move_links(body, &names, &moved);
            let joint = &mut body.joints[k];
            if let Some(limits) = &mut joint.limits {
                limits.value = limits.value.map(|x| x - q);
                limits.ci95 = limits.ci95.map(|c| c.map(|end| end.map(|x| x - q)));
            }
            if let Some(rest) = &mut joint.rest {
                rest.value -= q;
                rest.ci95 = rest.ci95.map(|c| c.map(|x| x - q));
            }
        }
    }
}

/// How far a joint is from where the model has it, by where its child was seen.
fn position(body: &Body, joint: &Joint, seen: &Twin) -> Option<f64> {
    let own = body.links.iter().find(|l| l.name == joint.child)?.pose.0;
    let moved = seen.link(&joint.child)?.pose.0 * own.inverse();
    let axis = Vector3::from(joint.axis.value);
    match joint.kind {
        JointKind::Prismatic => {
            let at = Point3::from(own.translation.vector);
            Some((moved * at - at).dot(&axis))
        }
        JointKind::Revolute => Some(moved.rotation.scaled_axis().dot(&axis)),
        _ => None,
    }
}

fn motion(joint: &Joint, q: f64) -> Isometry3<f64> {
    let axis = Unit::new_normalize(Vector3::from(joint.axis.value));
    if joint.kind == JointKind::Prismatic {
        return Isometry3::from_parts(Translation3::from(axis.into_inner() * q), UnitQuaternion::identity());
    }
    let turn = UnitQuaternion::from_axis_angle(&axis, q);
    let origin = Vector3::from(joint.origin.value);
    Isometry3::from_parts(Translation3::from(origin - turn * origin), turn)
}
