//! Reads a URDF back, by a reader that is not ours, and works out where everything is.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, Vector3};
use urdf_rs::{Geometry, JointType, Robot};

use super::loaded::{Axis, Loaded, Skin, Solid};
use super::xml::{Element, parse};
use crate::base::{Error, Result};

/// The content of `text`, with the root where `world_from_root` puts it (by the root's name).
pub(super) fn load(file: &Path, text: &str, world_from_root: impl Fn(&str) -> Isometry3<f64>) -> Result<Loaded> {
    let bad = |found: String| Error::bad_input(file, "robot", found, "a URDF");
    let robot = urdf_rs::read_from_string(text).map_err(|e| bad(e.to_string()))?;
    let worlds = place(&robot, world_from_root).ok_or_else(|| bad("joints that make no tree".into()))?;
    let mut out = Loaded::default();
    for link in &robot.links {
        let world = worlds[&link.name];
        let i = &link.inertial;
        let frame = world * isometry(&i.origin);
        let m = &i.inertia;
        let tensor = Matrix3::new(m.ixx, m.ixy, m.ixz, m.ixy, m.iyy, m.iyz, m.ixz, m.iyz, m.izz);
        let mut solid = Solid::new(i.mass.value, Vector3::zeros(), &tensor, &frame);
        solid.rotation = world.rotation;
        out.parts.insert(link.name.clone(), solid);
        let shapes = link.visual.iter().map(|v| &v.geometry);
        for geometry in shapes.chain(link.collision.iter().map(|c| &c.geometry)) {
            if let Geometry::Mesh { filename, .. } = geometry {
                out.files.push(filename.clone());
            }
        }
        let materials = link.visual.iter().filter_map(|v| v.material.as_ref());
        let images = materials.filter_map(|m| m.texture.as_ref());
        out.files.extend(images.map(|t| t.filename.clone()));
    }
    for link in parse(file, text)?.children("link") {
        if let Some((name, skin)) = link.get("name").zip(skin(link)) {
            out.skins.insert(name.to_string(), skin);
        }
    }
    for joint in &robot.joints {
        let world = worlds[&joint.child.link];
        let range = [joint.limit.lower, joint.limit.upper];
        let (turns, range) = match joint.joint_type {
            JointType::Continuous => (true, None),
            JointType::Revolute => (true, Some(range)),
            JointType::Prismatic => (false, Some(range)),
            _ => continue,
        };
        let axis = Axis {
            turns,
            direction: world * Vector3::from(joint.axis.xyz.0),
            origin: world.translation.vector,
            range,
            damping: joint.dynamics.as_ref().map(|d| d.damping),
            friction: joint.dynamics.as_ref().map(|d| d.friction),
            stiffness: None,
            follows: joint
                .mimic
                .as_ref()
                .map(|m| (m.joint.clone(), m.multiplier.unwrap_or(1.0))),
        };
        out.axes.insert(joint.name.clone(), axis);
    }
    Ok(out)
}

/// What the tags of PyBullet and Drake say, which the reader of URDFs drops.
fn skin(link: &Element) -> Option<Skin> {
    let value = |of: Option<&Element>, tag: &str| of?.child(tag)?.get("value")?.parse::<f64>().ok();
    let (contact, collision) = (link.child("contact"), link.child("collision"));
    let drake = collision.and_then(|c| c.child("drake:proximity_properties"));
    contact.or(drake)?;
    Some(Skin {
        static_friction: value(drake, "drake:mu_static"),
        kinetic_friction: value(contact, "lateral_friction").or_else(|| value(drake, "drake:mu_dynamic")),
        restitution: value(contact, "restitution"),
        rolling: None,
    })
}

/// World-from-link of every link; nothing where they do not all hang on one root.
pub(super) fn place(
    robot: &Robot,
    root_pose: impl Fn(&str) -> Isometry3<f64>,
) -> Option<BTreeMap<String, Isometry3<f64>>> {
    let is_child = |name: &str| robot.joints.iter().any(|j| j.child.link == name);
    let mut roots = robot.links.iter().filter(|l| !is_child(&l.name));
    let root = &roots.next()?.name;
    let mut worlds = BTreeMap::from([(root.clone(), root_pose(root))]);
    let mut open = vec![root.clone()];
    while let Some(parent) = open.pop() {
        for joint in robot.joints.iter().filter(|j| j.parent.link == parent) {
            let world = worlds[&parent] * isometry(&joint.origin);
            if worlds.insert(joint.child.link.clone(), world).is_some() {
                return None;
            }
            open.push(joint.child.link.clone());
        }
    }
    let all = roots.next().is_none() && robot.links.iter().all(|l| worlds.contains_key(&l.name));
    all.then_some(worlds)
}

/// A pose of a URDF.
pub(super) fn isometry(pose: &urdf_rs::Pose) -> Isometry3<f64> {
    let [r, p, y] = pose.rpy.0;
    let rotation = Rotation3::from_euler_angles(r, p, y).into();
    Isometry3::from_parts(Translation3::from(Vector3::from(pose.xyz.0)), rotation)
}
