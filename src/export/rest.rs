//! Lets the exported scene rest in the embedded engine: what drifts, sinks or flies apart is a bad export.

use std::fmt;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, GenericJoint, GenericJointBuilder, JointAxesMask, JointAxis, PhysicsWorld,
    RigidBodyBuilder, RigidBodyHandle,
};
use serde::Serialize;

use super::colliders::colliders;
use super::scene::{Attachment, Floor, Part, Scene, Tree};
use crate::twin::{JointKind, Model};

/// Step, s; steps to settle; steps in all.
const STEP: f64 = 0.002;
const SETTLED: usize = 250;
const STEPS: usize = 1000;
/// Drift, m, after settling, and the way there, m, above which a part does not rest.
const LATE_DRIFT: f64 = 1e-3;
const SETTLING: f64 = 10e-3;

/// What a part did while nothing touched it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RestResult {
    /// The part, as the exports name it.
    pub part: String,
    /// How far its centre of mass moved in the first half second, m.
    pub settling: f64,
    /// How far it moved in the 1.5 s after that, m.
    pub late_drift: f64,
    /// How far it turned in the 1.5 s after that, rad.
    pub late_turn: f64,
    /// It never left the finite numbers.
    pub finite: bool,
    /// It hangs on a planar joint, whose freedom nothing brakes: where it glides to says nothing.
    pub glides: bool,
}

impl RestResult {
    /// Whether the part stays where it is.
    pub fn is_calm(&self) -> bool {
        self.finite && (self.glides || (self.settling < SETTLING && self.late_drift < LATE_DRIFT))
    }
}

impl fmt::Display for RestResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (settling, late) = (1e3 * self.settling, 1e3 * self.late_drift);
        let turn = self.late_turn.to_degrees();
        write!(
            f,
            "{}: settles by {settling:.3} mm, then drifts {late:.3} mm and {turn:.3} degrees",
            self.part
        )?;
        if self.finite {
            Ok(())
        } else {
            write!(f, ", and is lost")
        }
    }
}

/// Two seconds of rest. Trees without anything that could touch fall, and are left out; so is all where there
/// is no table.
pub(super) fn rest(scene: &Scene, model: &Model) -> Vec<RestResult> {
    let Some(floor) = &scene.floor else { return Vec::new() };
    let mut world = PhysicsWorld::new();
    world.gravity = scene.gravity.into();
    world.integration_parameters.dt = STEP;
    add_floor(&mut world, floor);
    let mut bodies: Vec<(&Part, RigidBodyHandle)> = Vec::new();
    let mut handles: Vec<Vec<RigidBodyHandle>> = Vec::new();
    for tree in &scene.trees {
        let added = if tree.parts.iter().all(Part::is_bare) {
            Vec::new()
        } else {
            add_tree(&mut world, tree, model, &floor.normal)
        };
        bodies.extend(tree.parts.iter().zip(&added).map(|(p, h)| (p, *h)));
        handles.push(added);
    }
    for [a, b] in &scene.welds {
        let ends = [a, b].map(|id| handles[id.tree].get(id.part).copied());
        if let [Some(ha), Some(hb)] = ends {
            let between = scene.part(*a).world_from_part.inverse() * scene.part(*b).world_from_part;
            let weld = GenericJointBuilder::new(JointAxesMask::LOCKED_FIXED_AXES)
                .contacts_enabled(false)
                .local_frame1(between.into());
            world.insert_impulse_joint(ha, hb, weld.build());
        }
    }
    run(&mut world, &bodies)
}

fn run(world: &mut PhysicsWorld, bodies: &[(&Part, RigidBodyHandle)]) -> Vec<RestResult> {
    let start = poses(world, bodies);
    (0..SETTLED).for_each(|_| world.step());
    let settled = poses(world, bodies);
    (SETTLED..STEPS).for_each(|_| world.step());
    let end = poses(world, bodies);
    let way = |a: &(Vector3<f64>, UnitQuaternion<f64>), b: &(Vector3<f64>, UnitQuaternion<f64>)| (a.0 - b.0).norm();
    bodies
        .iter()
        .enumerate()
        .map(|(i, (part, _))| RestResult {
            part: part.name.clone(),
            settling: way(&start[i], &settled[i]),
            late_drift: way(&settled[i], &end[i]),
            late_turn: settled[i].1.angle_to(&end[i].1),
            finite: end[i].0.iter().all(|v| v.is_finite()),
            glides: part.attachment.as_ref().is_some_and(|a| a.kind == JointKind::Planar),
        })
        .collect()
}

/// Centre of mass and orientation.
fn poses(world: &PhysicsWorld, bodies: &[(&Part, RigidBodyHandle)]) -> Vec<(Vector3<f64>, UnitQuaternion<f64>)> {
    let pose = |handle: RigidBodyHandle, com: Vector3<f64>| {
        let body = &world.bodies[handle];
        let isometry: Isometry3<f64> = (*body.position()).into();
        ((isometry * Point3::from(com)).coords, isometry.rotation)
    };
    bodies.iter().map(|(part, handle)| pose(*handle, part.com)).collect()
}

/// The friction of a contact is the body's: the table's is nought and the greater of the two counts.
fn add_floor(world: &mut PhysicsWorld, floor: &Floor) {
    let ground = world.insert_body(RigidBodyBuilder::fixed().translation(floor.point.into()));
    let plane = ColliderBuilder::new(rapier3d_f64::prelude::SharedShape::halfspace(
        floor.normal.into_inner().into(),
    ))
    .friction(0.0)
    .friction_combine_rule(CoefficientCombineRule::Max);
    world.insert_collider(plane, Some(ground));
}

fn add_tree(world: &mut PhysicsWorld, tree: &Tree, model: &Model, up: &Vector3<f64>) -> Vec<RigidBodyHandle> {
    let mut handles: Vec<RigidBodyHandle> = Vec::new();
    for part in &tree.parts {
        let held = tree.anchored && part.attachment.is_none();
        let builder = if held {
            RigidBodyBuilder::fixed()
        } else {
            RigidBodyBuilder::dynamic()
        };
        let matter = MassProperties::with_inertia_matrix(part.com.into(), part.mass, part.inertia.into());
        let body = builder
            .pose(part.world_from_part.into())
            .additional_mass_properties(matter)
            .can_sleep(false);
        let handle = world.insert_body(body);
        for shape in colliders(part, model, up) {
            world.insert_collider(shape, Some(handle));
        }
        if let Some(hold) = &part.attachment {
            world.insert_impulse_joint(handles[hold.parent], handle, joint(hold));
        }
        handles.push(handle);
    }
    handles
}

/// The joint's axis is x of both of its frames. Dry friction is a brake: a motor towards standstill that can do
/// no more than the friction.
fn joint(hold: &Attachment) -> GenericJoint {
    let mask = match hold.kind {
        JointKind::Fixed => JointAxesMask::LOCKED_FIXED_AXES,
        JointKind::Revolute | JointKind::Screw => JointAxesMask::LOCKED_REVOLUTE_AXES,
        JointKind::Prismatic => JointAxesMask::LOCKED_PRISMATIC_AXES,
        JointKind::Cylindrical => {
            JointAxesMask::LIN_Y | JointAxesMask::LIN_Z | JointAxesMask::ANG_Y | JointAxesMask::ANG_Z
        }
        JointKind::Planar => JointAxesMask::LIN_X | JointAxesMask::ANG_Y | JointAxesMask::ANG_Z,
        JointKind::Spherical => JointAxesMask::LOCKED_SPHERICAL_AXES,
    };
    let turn = UnitQuaternion::rotation_between(&Vector3::x(), &hold.axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI));
    let frame = Isometry3::from_parts(Vector3::zeros().into(), turn);
    let mut builder = GenericJointBuilder::new(mask)
        .contacts_enabled(false)
        .local_frame1((hold.parent_from_part * frame).into())
        .local_frame2(frame.into());
    for motion in hold.motions.iter().filter(|m| m.axis == hold.axis) {
        let axis = if motion.turns { JointAxis::AngX } else { JointAxis::LinX };
        if let Some(range) = motion.range {
            builder = builder.limits(axis, range);
        }
        if motion.friction > 0.0 {
            builder = builder
                .motor_velocity(axis, 0.0, 1e6)
                .motor_max_force(axis, motion.friction);
        }
    }
    builder.build()
}
