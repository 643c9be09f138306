//! The right answers of a scene, in the words of the truth file.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Cuboid, Cylinder, Shape};

use super::matter::Matter;
use super::obj::write_obj;
use super::surface::face;
use super::{BodySpec, ConvexPart, JointSpec, JointSpecKind, PartShape, Scene, ShapeSpec, Solid};
use crate::geometry::Mesh;
use crate::twin::{JointKind, TrueBody, TrueJoint, TruePlane, TrueRelation, Truth};

/// Bodies nearer than this touch, m.
const TOUCH: f64 = 3e-4;
/// A centre of mass off by more than this is a cause, m.
const COM_OFFSET: f64 = 2e-3;

/// The truth of `scene`, and the files beside it: the true surfaces.
pub(super) fn truth(scene: &Scene, solids: &BTreeMap<String, Solid>) -> (Truth, Vec<(String, Vec<u8>)>) {
    let mut truth = Truth::default();
    let mut files = Vec::new();
    for body in &scene.body {
        let Some(solid) = solids.get(&body.name) else { continue };
        let frame_from_body = frame_from_body(body, solid);
        let path = format!("truth/{}.obj", body.name);
        files.push((path.clone(), write_obj(&moved(&solid.mesh, &frame_from_body))));
        let mut right = true_body(body, solid, &frame_from_body);
        right.mesh = Some(path);
        truth.bodies.insert(body.name.clone(), right);
    }
    truth.joints = scene.joint.iter().map(true_joint).collect();
    truth.relations = relations(scene, solids);
    causes(scene, solids, &mut truth);
    (truth, files)
}

/// The frame in which quantities of a body are told: the track's, which is the body frame; for what is never tracked a
/// frame at the centre of its surface with the axes of the world.
fn frame_from_body(body: &BodySpec, solid: &Solid) -> Isometry3<f64> {
    if body.tracked {
        return Isometry3::identity();
    }
    let turned = Isometry3::from_parts(Translation3::identity(), solid.world_from_body.rotation);
    let center = moved(&solid.mesh, &turned)
        .bounds()
        .map_or(Vector3::zeros(), |(low, high)| (low.coords + high.coords) / 2.0);
    Translation3::from(-center) * turned
}

fn moved(mesh: &Mesh, pose: &Isometry3<f64>) -> Mesh {
    Mesh {
        vertices: mesh.vertices.iter().map(|v| pose * v).collect(),
        ..mesh.clone()
    }
}

fn true_body(body: &BodySpec, solid: &Solid, frame_from_body: &Isometry3<f64>) -> TrueBody {
    let turn = frame_from_body.rotation.to_rotation_matrix();
    let i = turn * solid.inertia * turn.transpose();
    let stands = !body.fixed && lowest(solid) < TOUCH;
    TrueBody {
        mass: Some(solid.mass),
        friction_static: stands.then_some(body.friction.static_),
        friction_kinetic: stands.then_some(body.friction.kinetic),
        com: Some((frame_from_body * solid.com).coords.map(without_dust).into()),
        inertia: Some([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| without_dust(i[at]))),
        stiffness: body.foam.map(|foam| foam.stiffness),
        damping: body.foam.map(|foam| foam.damping),
        restitution: None,
        mesh: None,
        symmetry: symmetry(&body.shape)
            .into_iter()
            .map(|normal| {
                let normal = frame_from_body.rotation * normal;
                TruePlane {
                    normal: normal.into(),
                    offset: normal.dot(&frame_from_body.translation.vector),
                }
            })
            .collect(),
    }
}

/// The number without what rounding left where zero should be; 1 pm and 1e-12 kg·m² are far below what is scored.
fn without_dust(value: f64) -> f64 {
    if value.abs() < 1e-12 { 0.0 } else { value }
}

/// Height of the lowest point above the support, m.
fn lowest(solid: &Solid) -> f64 {
    moved(&solid.mesh, &solid.world_from_body)
        .bounds()
        .map_or(f64::INFINITY, |(low, _)| low.z)
}

/// Normals of the planes through the body frame's origin in which the shape mirrors itself. Of the many planes of a
/// thing turned about z it tells those of x and y.
fn symmetry(shape: &ShapeSpec) -> Vec<Vector3<f64>> {
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    match shape {
        ShapeSpec::Box { size } => {
            let mut planes = vec![x, y, z];
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                if (size[a] - size[b]).abs() < 1e-9 {
                    let (u, v) = ([x, y, z][a], [x, y, z][b]);
                    planes.extend([(u + v).normalize(), (u - v).normalize()]);
                }
            }
            planes
        }
        ShapeSpec::Cylinder { .. } | ShapeSpec::Sphere { .. } => vec![x, y, z],
        ShapeSpec::Lathe { handle: None, .. } => vec![x, y],
        ShapeSpec::Lathe { handle: Some(_), .. } => vec![y],
        ShapeSpec::Tray { open, .. } => {
            let axis = face(open).map_or(2, |(axis, _)| axis);
            (0..3).filter(|k| *k != axis).map(|k| [x, y, z][k]).collect()
        }
        ShapeSpec::Mesh { .. } => Vec::new(),
    }
}

fn true_joint(joint: &JointSpec) -> TrueJoint {
    TrueJoint {
        a: joint.a.clone(),
        b: joint.b.clone(),
        kind: match joint.kind {
            JointSpecKind::Revolute => JointKind::Revolute,
            JointSpecKind::Prismatic => JointKind::Prismatic,
            JointSpecKind::Screw => JointKind::Screw,
        },
        axis: Vector3::from(joint.axis).normalize().into(),
        origin: (joint.kind != JointSpecKind::Prismatic).then_some(joint.origin),
        limits: joint.limits,
        friction: Some(joint.friction),
        damping: Some(joint.damping),
        stiffness: Some(joint.stiffness),
    }
}

/// Joints, glue, and what merely stands on something else that is not the table.
fn relations(scene: &Scene, solids: &BTreeMap<String, Solid>) -> BTreeMap<String, TrueRelation> {
    let mut relations = BTreeMap::new();
    for joint in &scene.joint {
        let freedom = match joint.kind {
            JointSpecKind::Revolute | JointSpecKind::Screw => [1, 0],
            JointSpecKind::Prismatic => [0, 1],
        };
        relations.insert(format!("{}|{}", joint.a, joint.b), TrueRelation::Freedom(freedom));
    }
    for bond in &scene.bond {
        relations.insert(format!("{}|{}", bond.a, bond.b), TrueRelation::Freedom([0, 0]));
    }
    for (i, a) in scene.body.iter().enumerate() {
        for b in &scene.body[i + 1..] {
            let told = [format!("{}|{}", a.name, b.name), format!("{}|{}", b.name, a.name)]
                .iter()
                .any(|key| relations.contains_key(key));
            let (Some(one), Some(other)) = (solids.get(&a.name), solids.get(&b.name)) else {
                continue;
            };
            let both_stand = lowest(one) < TOUCH && lowest(other) < TOUCH;
            if !told && !both_stand && touch(one, other) {
                relations.insert(format!("{}|{}", a.name, b.name), TrueRelation::Word("resting".into()));
            }
        }
    }
    relations
}

fn touch(a: &Solid, b: &Solid) -> bool {
    a.parts
        .iter()
        .any(|p| b.parts.iter().any(|q| distance(a, p, b, q) < TOUCH))
}

/// World-from-shape of a part; parry's cylinders stand along y, the lab's along z.
fn place(solid: &Solid, part: &ConvexPart) -> parry3d_f64::math::Pose {
    let mut pose = solid.world_from_body.0 * part.body_from_part.0;
    if matches!(part.shape, PartShape::Cylinder { .. }) {
        pose *= Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    }
    let (t, r) = (pose.translation.vector, pose.rotation.scaled_axis());
    parry3d_f64::math::Pose::new(Vector::new(t.x, t.y, t.z), Vector::new(r.x, r.y, r.z))
}

fn distance(a: &Solid, p: &ConvexPart, b: &Solid, q: &ConvexPart) -> f64 {
    let (p_pose, q_pose) = (place(a, p), place(b, q));
    query::distance(&p_pose, &*parry_shape(&p.shape), &q_pose, &*parry_shape(&q.shape))
        .map_or(f64::INFINITY, |found| found.distance)
}

fn parry_shape(shape: &PartShape) -> Box<dyn Shape> {
    match shape {
        PartShape::Box { half } => Box::new(Cuboid::new(Vector::new(half.x, half.y, half.z))),
        PartShape::Cylinder { radius, half_height } => Box::new(Cylinder::new(*half_height, *radius)),
        PartShape::Sphere { radius } => Box::new(Ball::new(*radius)),
    }
}

/// What a plain model of this scene gets wrong.
fn causes(scene: &Scene, solids: &BTreeMap<String, Solid>, truth: &mut Truth) {
    let angle = scene.support.lean();
    if angle > 0.0 {
        truth.causes.push("support-tilt".into());
        let parameters = BTreeMap::from([("angle".to_owned(), angle)]);
        truth.cause_parameters.insert("support-tilt".into(), parameters);
    }
    let shift = scene
        .body
        .iter()
        .filter(|body| !body.weight.is_empty())
        .filter_map(|body| solids.get(&body.name))
        .map(|solid| (solid.com - Matter::filling(&solid.mesh, 1.0).com).norm())
        .fold(0.0, f64::max);
    if shift > COM_OFFSET {
        truth.causes.push("com-offset".into());
        let parameters = BTreeMap::from([("distance".to_owned(), shift)]);
        truth.cause_parameters.insert("com-offset".into(), parameters);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::lab::{build_solids, scene_named, scenes};

    #[test]
    fn no_two_bodies_of_a_scene_are_in_each_other() {
        for (name, _) in scenes() {
            let scene = scene_named(name).expect("a scene");
            let solids: Vec<Solid> = build_solids(&scene, Path::new("."))
                .expect("solids")
                .into_values()
                .collect();
            for (i, a) in solids.iter().enumerate() {
                for b in &solids[i + 1..] {
                    for (p, q) in a.parts.iter().flat_map(|p| b.parts.iter().map(move |q| (p, q))) {
                        let (one, other) = (parry_shape(&p.shape), parry_shape(&q.shape));
                        let contact = query::contact(&place(a, p), &*one, &place(b, q), &*other, 0.0).expect("shapes");
                        let depth = contact.map_or(0.0, |c| -c.dist);
                        assert!(depth < 1e-5, "{name}: {} is {depth} m inside {}", a.name, b.name);
                    }
                }
            }
        }
    }

    #[test]
    fn a_body_that_is_never_tracked_is_told_at_its_centre_in_world_axes() {
        let mut scene = scene_named("weighted-box").expect("a scene");
        scene.body[0].tracked = false;
        scene.body[0].yaw = std::f64::consts::FRAC_PI_2;
        let solids = build_solids(&scene, Path::new(".")).expect("solids");
        let (told, _) = truth(&scene, &solids);
        let (own, com) = (solids["box"].com, told.bodies["box"].com.expect("com"));
        for (a, b) in com.iter().zip([-own.y, own.x, own.z]) {
            assert!((a - b).abs() < 1e-12, "{com:?} from {own}");
        }
    }
}
