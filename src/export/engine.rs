//! The twin in the embedded engine: bodies, table, joints with their losses and springs, bonds that give way.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, GenericJoint, GenericJointBuilder, ImpulseJointHandle, JointAxesMask,
    JointAxis, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};

use super::colliders::colliders;
use super::coupled::whole_turns;
use super::film::Film;
use super::scene::{Attachment, Floor, Motion, Part, PartId, Scene, Tree};
use crate::base::Error;
use crate::twin::{JointKind, Model};

/// Step, s.
pub(super) const STEP: f64 = 0.002;
/// Share of the force through a bond that one step contributes to its running mean: the mean is over some 20 ms.
const BOND_SHARE: f64 = 0.1;
/// Rounds of the engine's solver within each of its steps, where a part carries several others or a hand is at work.
const BRANCHED: usize = 4;

/// The widest turn to either side that the engine tells from one the other way round, rad.
const HALF_ROUND: f64 = 3.0;
/// What a joint locks that slides along its axis and turns about it.
const ALONG_AND_ABOUT: JointAxesMask = JointAxesMask::LIN_Y
    .union(JointAxesMask::LIN_Z)
    .union(JointAxesMask::ANG_Y)
    .union(JointAxesMask::ANG_Z);

/// A scene that moves.
pub(super) struct Engine<'a> {
    pub(super) world: PhysicsWorld,
    pub(super) scene: &'a Scene,
    /// By tree and part; empty for a tree without anything that could touch.
    pub(super) handles: Vec<Vec<RigidBodyHandle>>,
    /// Forces of hands, by body, for the next step only: body, force in N, point, world.
    pub(super) pulls: Vec<(RigidBodyHandle, Vector3<f64>, Point3<f64>)>,
    /// What is seen of it, where it is filmed.
    pub(super) film: Option<Film>,
    bonds: Vec<Bond>,
}

/// What holds two bodies together.
struct Bond {
    ends: [PartId; 2],
    handle: ImpulseJointHandle,
    /// N.
    breakaway: Option<f64>,
    /// Mean over the last steps, N.
    force: f64,
    broken: bool,
}

impl<'a> Engine<'a> {
    /// The scene at the first view. Nothing where there is no table, since all would fall.
    pub(super) fn new(scene: &'a Scene, model: &Model) -> Option<Self> {
        Self::of(scene, model, |_| true)
    }

    /// With more rounds of the solver: what a hand does to a joint otherwise flings about what carries it.
    pub(super) fn refined(mut self) -> Self {
        self.world.integration_parameters.num_internal_pgs_iterations = BRANCHED;
        self
    }

    /// As [`Engine::new`], with those trees alone for which `present` holds.
    pub(super) fn of(scene: &'a Scene, model: &Model, present: impl Fn(&Tree) -> bool) -> Option<Self> {
        let floor = scene.floor.as_ref()?;
        let mut world = PhysicsWorld::new();
        world.gravity = scene.gravity.into();
        world.integration_parameters.dt = STEP;
        if scene.trees.iter().any(branches) {
            // With one, what carries two doors creeps by millimetres at rest, and a heavy one is flung about by light ones.
            world.integration_parameters.num_internal_pgs_iterations = BRANCHED;
        }
        add_floor(&mut world, floor);
        let mut handles: Vec<Vec<RigidBodyHandle>> = Vec::new();
        for tree in &scene.trees {
            let bare = tree.parts.iter().all(Part::is_bare);
            let added = if bare || !present(tree) {
                Vec::new()
            } else {
                add_tree(&mut world, tree, model, floor)
            };
            handles.push(added);
        }
        let mut engine = Self {
            world,
            scene,
            handles,
            pulls: Vec::new(),
            film: None,
            bonds: Vec::new(),
        };
        for weld in &scene.welds {
            engine.bond(weld.ends, weld.breakaway);
        }
        Some(engine)
    }

    /// The body of a part, unless it is left out.
    pub(super) fn body(&self, id: PartId) -> Option<RigidBodyHandle> {
        self.handles[id.tree].get(id.part).copied()
    }

    /// Every part that takes part.
    pub(super) fn bodies(&self) -> Vec<(PartId, &'a Part, RigidBodyHandle)> {
        let scene = self.scene;
        scene
            .parts()
            .filter_map(|(id, p)| Some((id, p, self.body(id)?)))
            .collect()
    }

    /// World-from-part.
    pub(super) fn pose(&self, handle: RigidBodyHandle) -> Isometry3<f64> {
        (*self.world.bodies[handle].position()).into()
    }

    /// One step of [`STEP`]: springs, dampers and rolling resistance act on the state at its beginning.
    pub(super) fn step(&mut self) {
        if let Some(mut film) = self.film.take() {
            film.step(|| self.bodies().iter().map(|(id, _, h)| (*id, self.pose(*h))).collect());
            self.film = Some(film);
        }
        for (_, _, handle) in self.bodies() {
            let body = &mut self.world.bodies[handle];
            body.reset_forces(false);
            body.reset_torques(false);
        }
        for (handle, force, point) in std::mem::take(&mut self.pulls) {
            self.world.bodies[handle].add_force_at_point(force.into(), point.coords.into(), true);
        }
        self.joints();
        self.rolling();
        self.world.step();
        self.bonds_give();
    }

    /// The bonds that gave way.
    pub(super) fn broken(&self) -> Vec<[PartId; 2]> {
        self.bonds.iter().filter(|b| b.broken).map(|b| b.ends).collect()
    }

    fn bond(&mut self, ends: [PartId; 2], breakaway: Option<f64>) {
        let [a, b] = ends;
        let (Some(ha), Some(hb)) = (self.body(a), self.body(b)) else {
            return;
        };
        let between = self.scene.part(a).world_from_part.inverse() * self.scene.part(b).world_from_part;
        let weld = GenericJointBuilder::new(JointAxesMask::LOCKED_FIXED_AXES)
            .contacts_enabled(false)
            .local_frame1(between.into());
        let handle = self.world.insert_impulse_joint(ha, hb, weld.build());
        self.bonds.push(Bond {
            ends,
            handle,
            breakaway,
            force: 0.0,
            broken: false,
        });
    }

    fn bonds_give(&mut self) {
        // The engine keeps the impulse of its last solver step only.
        let step = STEP / self.world.integration_parameters.num_solver_iterations as f64;
        for bond in self.bonds.iter_mut().filter(|b| !b.broken) {
            let Some(limit) = bond.breakaway else { continue };
            let Some(joint) = self.world.impulse_joints.get(bond.handle) else {
                continue;
            };
            let now = Vector3::from_fn(|i, _| joint.impulses[i]).norm() / step;
            bond.force += BOND_SHARE * (now - bond.force);
            if bond.force > limit {
                bond.broken = true;
                self.world.remove_impulse_joint(bond.handle);
            }
        }
    }

    /// Springs and viscous damping of joints with one freedom, what holds a joint to the one that it follows, and threads, as
    /// forces on both of their parts.
    fn joints(&mut self) {
        let all = self.single();
        for joint in &all {
            let motion = joint.motion;
            if motion.stiffness > 0.0 || motion.damping > 0.0 {
                let (q, speed) = self.position_and_speed(joint.ends, joint.hold, motion);
                // No explicit damper may do more in a step than stop the part.
                let damping = motion.damping.min(0.5 * inertia_along(joint.part, motion) / STEP);
                self.load(joint, -motion.stiffness * (q - motion.rest) - damping * speed);
            }
            if joint.hold.is_threaded() {
                self.thread(joint);
            }
            let Some((leader, ratio)) = &joint.hold.follows else {
                continue;
            };
            if let Some(leader) = all.iter().find(|l| l.hold.joint == *leader) {
                self.follow(joint, leader, *ratio);
            }
        }
    }

    /// Of a joint with one freedom: m or rad, and the same a second, from the first view.
    pub(super) fn position_and_speed(
        &self,
        [parent, child]: [RigidBodyHandle; 2],
        hold: &Attachment,
        motion: &Motion,
    ) -> (f64, f64) {
        let (from_parent, from_child) = (self.pose(parent), self.pose(child));
        let start_from_now = (from_parent * hold.parent_from_part).inverse() * from_child;
        let axis = from_child.rotation * motion.axis.into_inner();
        let (a, b) = (&self.world.bodies[parent], &self.world.bodies[child]);
        if motion.turns {
            let q = start_from_now.rotation.scaled_axis().dot(&motion.axis);
            let q = match motion.range {
                _ if hold.is_threaded() => {
                    whole_turns(q, start_from_now.translation.vector.dot(&motion.axis) / hold.pitch)
                }
                Some([low, high]) => whole_turns(q, 0.5 * (low + high)),
                None => q,
            };
            let spin: Vector3<f64> = (b.angvel() - a.angvel()).into();
            (q, spin.dot(&axis))
        } else {
            let at = from_child.translation.vector;
            let slip: Vector3<f64> = (b.velocity_at_point(at.into()) - a.velocity_at_point(at.into())).into();
            (start_from_now.translation.vector.dot(&motion.axis), slip.dot(&axis))
        }
    }

    /// Resistance to rolling: a torque of the rolling length times the weight against the turn about level axes.
    fn rolling(&mut self) {
        let up = self
            .scene
            .floor
            .as_ref()
            .map_or(Vector3::z(), |f| f.normal.into_inner());
        let gravity = self.scene.gravity.norm();
        for (_, part, handle) in self.bodies() {
            let Some(length) = part.surface.rolling else { continue };
            let touches = self.world.bodies[handle].colliders().iter().any(|c| {
                let mut pairs = self.world.narrow_phase.contact_pairs_with(*c);
                pairs.any(|p| p.has_any_active_contact())
            });
            let spin: Vector3<f64> = self.world.bodies[handle].angvel().into();
            let level = spin - up * spin.dot(&up);
            let rate = level.norm();
            if !touches || rate < 1e-9 {
                continue;
            }
            let stop = 0.5 * part.inertia.symmetric_eigenvalues().min() * rate / STEP;
            let torque = -level / rate * stop.min(length * part.mass * gravity);
            self.world.bodies[handle].add_torque(torque.into(), true);
        }
    }
}

/// Without a table there is nothing to play.
pub(super) fn no_table() -> Error {
    Error::Failed("no table: everything would fall".into())
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

/// Whether a part carries several others.
fn branches(tree: &Tree) -> bool {
    let carriers = || tree.parts.iter().filter_map(|p| Some(p.hold()?.parent));
    carriers().any(|part| carriers().filter(|other| *other == part).count() > 1)
}

/// Inertia of a part along a freedom, as if nothing hung on it and it turned about its own centre: kg·m² or kg.
pub(super) fn inertia_along(part: &Part, motion: &Motion) -> f64 {
    let inverse = part.inertia.try_inverse().filter(|_| motion.turns);
    inverse.map_or(part.mass, |inverse| {
        let axis = motion.axis.into_inner();
        1.0 / axis.dot(&(inverse * axis)).max(1e-12)
    })
}

fn add_tree(world: &mut PhysicsWorld, tree: &Tree, model: &Model, floor: &Floor) -> Vec<RigidBodyHandle> {
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
        for shape in colliders(part, model, floor) {
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
        JointKind::Screw if hold.is_threaded() => ALONG_AND_ABOUT,
        JointKind::Revolute | JointKind::Screw => JointAxesMask::LOCKED_REVOLUTE_AXES,
        JointKind::Prismatic => JointAxesMask::LOCKED_PRISMATIC_AXES,
        JointKind::Cylindrical => ALONG_AND_ABOUT,
        JointKind::Planar => JointAxesMask::LIN_X | JointAxesMask::ANG_Y | JointAxesMask::ANG_Z,
        JointKind::Spherical => JointAxesMask::LOCKED_SPHERICAL_AXES,
    };
    let turn = UnitQuaternion::rotation_between(&Vector3::x(), &hold.axis)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI));
    let frame = Isometry3::from_parts(Vector3::zeros().into(), turn);
    let along = || hold.motions.iter().filter(|m| m.axis == hold.axis);
    // Where a turn goes beyond half a round its middle is the engine's zero, which tells angles within half a round of it.
    let beyond = |range: &[f64; 2]| range.iter().any(|end| end.abs() > HALF_ROUND);
    let far = along().filter(|m| m.turns && !hold.is_threaded());
    let far = far.filter_map(|m| m.range).find(beyond);
    let middle = far.map_or(0.0, |[low, high]| 0.5 * (low + high));
    let about = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), middle);
    let mut builder = GenericJointBuilder::new(mask)
        .contacts_enabled(false)
        .local_frame1((hold.parent_from_part * frame * about).into())
        .local_frame2(frame.into());
    for motion in along() {
        let axis = if motion.turns { JointAxis::AngX } else { JointAxis::LinX };
        match motion.range {
            Some(ends) if motion.turns && hold.is_threaded() && beyond(&ends) => {
                let [a, b] = ends.map(|end| end * hold.pitch);
                builder = builder.limits(JointAxis::LinX, [a.min(b), a.max(b)]);
            }
            Some(ends) if motion.turns => {
                let ends = ends.map(|end| end - middle);
                if !beyond(&ends) {
                    builder = builder.limits(axis, ends);
                }
            }
            Some(range) => builder = builder.limits(axis, range),
            None => {}
        }
        if motion.friction > 0.0 {
            builder = builder
                .motor_velocity(axis, 0.0, 1e6)
                .motor_max_force(axis, motion.friction);
        }
    }
    builder.build()
}
