//! A URDF as a twin: links with their inertials, joints with their losses, meshes and primitives.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Matrix3, Vector3};
use urdf_rs::{Geometry, JointType, Robot};

use super::adopt::{Trust, empty, placed, shape};
use super::inertial::six;
use super::xml::{Element, parse};
use crate::base::{Error, Pose, Result, read_bytes, read_text};
use crate::geometry::{Mesh, parse_mesh, solids};
use crate::twin::{Body, Coupling, Joint, JointEffects, JointKind, Link, Model};

/// Sides of a primitive that is round, and subdivisions of a ball.
const SIDES: usize = 48;
const FINENESS: usize = 3;
/// How many folders above the file a `package://` path is looked for.
const ABOVE: usize = 4;

/// The model of the robot in `file`, its root's frame on the world's. What hangs by a joint of type `floating` is a body of
/// its own.
pub(super) fn adopt_urdf(file: &Path, trust: Trust) -> Result<Model> {
    let text = read_text(file)?;
    let bad = |found: String| Error::bad_input(file, "robot", found, "a URDF");
    let robot = urdf_rs::read_from_string(&text).map_err(|e| bad(e.to_string()))?;
    let tags = parse(file, &text)?;
    let worlds = super::load_urdf::place(&robot, |_| Isometry3::identity());
    let worlds = worlds.ok_or_else(|| bad("joints that make no tree".into()))?;
    let mut model = empty(&robot.name);
    for root in roots(&robot) {
        let mut body = Body {
            name: root.clone(),
            links: Vec::new(),
            joints: Vec::new(),
        };
        let mut open = vec![root];
        while let Some(name) = open.pop() {
            let Some(link) = robot.links.iter().find(|l| l.name == name) else {
                return Err(bad(format!("a joint names the link {name}, which is not there")));
            };
            let world = worlds[&name];
            let mut out = Link::new(name.clone(), Pose(world));
            matter(&mut out, link, trust);
            surface(&mut out, &tags, trust);
            let (seen, touching) = meshes(file, link)?;
            shape(&mut model, &mut out, &seen, &touching);
            body.links.push(out);
            let held = robot.joints.iter().filter(|j| j.parent.link == name);
            for joint in held.filter(|j| j.joint_type != JointType::Floating) {
                body.joints.push(hold(file, joint, &worlds[&joint.child.link], trust)?);
                open.push(joint.child.link.clone());
            }
        }
        model.twin.bodies.push(body);
    }
    Ok(model)
}

/// Links that nothing holds, or that float.
fn roots(robot: &Robot) -> Vec<String> {
    let held = |name: &str| {
        let mut holders = robot.joints.iter().filter(|j| j.child.link == name);
        holders.any(|j| j.joint_type != JointType::Floating)
    };
    let free = robot.links.iter().filter(|l| !held(&l.name));
    free.map(|l| l.name.clone()).collect()
}

/// An inertial without a mass says nothing.
fn matter(out: &mut Link, link: &urdf_rs::Link, trust: Trust) {
    let i = &link.inertial;
    if i.mass.value <= 0.0 {
        return;
    }
    let place = super::load_urdf::isometry(&i.origin);
    out.mass = Some(trust.estimate(i.mass.value, "kg"));
    out.com = Some(trust.estimate(place.translation.vector.into(), "m"));
    let m = &i.inertia;
    let own = Matrix3::new(m.ixx, m.ixy, m.ixz, m.ixy, m.iyy, m.iyz, m.ixz, m.iyz, m.izz);
    let turn = place.rotation.to_rotation_matrix();
    let tensor = turn * own * turn.transpose();
    if tensor.trace() > 0.0 {
        out.inertia = Some(trust.estimate(six(&tensor), "kg·m²"));
    }
}

/// Coefficients that the reader of URDFs drops: the tags of PyBullet and Drake.
fn surface(out: &mut Link, tags: &Element, trust: Trust) {
    let mine = tags.children("link").find(|l| l.get("name") == Some(&out.name));
    let Some(link) = mine else { return };
    let value = |e: &Element| e.get("value").and_then(|v| v.parse::<f64>().ok());
    let contact = link.child("contact");
    let of_bullet = |tag: &str| contact.and_then(|c| c.child(tag)).and_then(value);
    let of_drake = |tag: &str| {
        let mut all = link.children("collision");
        let found = all.find_map(|c| c.child("drake:proximity_properties")?.child(tag).and_then(value));
        found.map(|v| trust.estimate(v, "1"))
    };
    let sliding = of_bullet("lateral_friction").map(|v| trust.estimate(v, "1"));
    out.friction.kinetic = of_drake("drake:mu_dynamic").or(sliding);
    out.friction.static_ = of_drake("drake:mu_static");
    out.restitution = of_bullet("restitution").map(|v| trust.estimate(v, "1"));
}

fn meshes(file: &Path, link: &urdf_rs::Link) -> Result<(Vec<Mesh>, Vec<Mesh>)> {
    let of = |g: &Geometry, origin: &urdf_rs::Pose| geometry(file, g, &super::load_urdf::isometry(origin));
    let seen = link.visual.iter().map(|v| of(&v.geometry, &v.origin));
    let touching = link.collision.iter().map(|c| of(&c.geometry, &c.origin));
    Ok((seen.collect::<Result<_>>()?, touching.collect::<Result<_>>()?))
}

fn geometry(file: &Path, geometry: &Geometry, place: &Isometry3<f64>) -> Result<Mesh> {
    let one = Vector3::repeat(1.0);
    Ok(match geometry {
        Geometry::Box { size } => placed(&solids::cuboid(size.0), place, &one),
        Geometry::Cylinder { radius, length } => placed(&solids::cylinder(*radius, *length, SIDES), place, &one),
        Geometry::Sphere { radius } => placed(&solids::sphere(*radius, FINENESS), place, &one),
        Geometry::Capsule { radius, length } => {
            let mut capsule = solids::sphere(*radius, FINENESS);
            for v in &mut capsule.vertices {
                v.z += 0.5 * length * v.z.signum();
            }
            placed(&capsule, place, &one)
        }
        Geometry::Mesh { filename, scale } => {
            let path = find(file, filename)?;
            let scale = scale.as_ref().map_or(one, |s| Vector3::from(s.0));
            placed(&parse_mesh(&path, &read_bytes(&path)?)?, place, &scale)
        }
    })
}

/// A mesh's path from the folder of the URDF; `package://NAME/…` is looked for there and in the folders above, with and
/// without NAME.
fn find(file: &Path, name: &str) -> Result<PathBuf> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let plain = name.strip_prefix("file://").unwrap_or(name);
    let Some(packaged) = plain.strip_prefix("package://") else {
        return Ok(folder.join(plain));
    };
    let without = packaged.split_once('/').map_or(packaged, |(_, rest)| rest);
    let mut above = folder.to_path_buf();
    for _ in 0..=ABOVE {
        for candidate in [above.join(packaged), above.join(without)] {
            if candidate.is_file() {
                return Ok(candidate);
            }
        }
        above.push("..");
    }
    let expected = "a mesh in the folder of the URDF or one of the four above";
    Err(Error::bad_input(file, "mesh", name, expected))
}

fn hold(file: &Path, joint: &urdf_rs::Joint, world: &Isometry3<f64>, trust: Trust) -> Result<Joint> {
    let kind = match joint.joint_type {
        JointType::Fixed => JointKind::Fixed,
        JointType::Revolute | JointType::Continuous => JointKind::Revolute,
        JointType::Prismatic => JointKind::Prismatic,
        JointType::Planar => JointKind::Planar,
        JointType::Spherical => JointKind::Spherical,
        JointType::Floating => {
            return Err(Error::bad_input(
                file,
                &joint.name,
                "a floating joint",
                "one that holds",
            ));
        }
    };
    let axis = world * Vector3::from(joint.axis.xyz.0);
    let axis = axis.try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let turns = kind != JointKind::Prismatic;
    let (friction, damping) = if turns {
        ("N·m", "N·m·s/rad")
    } else {
        ("N", "N·s/m")
    };
    let ends = matches!(joint.joint_type, JointType::Revolute | JointType::Prismatic);
    let range = [joint.limit.lower, joint.limit.upper];
    let losses = joint.dynamics.as_ref();
    Ok(Joint {
        name: joint.name.clone(),
        kind,
        parent: joint.parent.link.clone(),
        child: joint.child.link.clone(),
        probability: 1.0,
        alternatives: Vec::new(),
        axis: trust.estimate(axis.into(), "1"),
        origin: trust.estimate(world.translation.vector.into(), "m"),
        pitch: None,
        limits: ends.then(|| trust.estimate(range, if turns { "rad" } else { "m" })),
        travelled: None,
        position: None,
        friction: losses.map(|d| trust.estimate(d.friction, friction)),
        damping: losses.map(|d| trust.estimate(d.damping, damping)),
        stiffness: None,
        rest: None,
        effort: None,
        effects: JointEffects {
            coupling: joint.mimic.as_ref().map(|m| Coupling {
                leader: m.joint.clone(),
                ratio: trust.estimate(m.multiplier.unwrap_or(1.0), "1"),
            }),
            ..JointEffects::default()
        },
        lateral: None,
    })
}
