//! What couples motions in the embedded engine, as stiff springs and dampers between them: a joint and the one that it follows,
//! the turn and the advance of a screw.

use std::f64::consts::TAU;

use nalgebra::{Unit, Vector3};
use rapier3d_f64::prelude::RigidBodyHandle;

use super::engine::{Engine, STEP, inertia_along};
use super::scene::{Attachment, Motion, Part, PartId};

/// Stiffness and damping between a joint and the one that it follows, over inertia and step: far below what overshoots.
const FOLLOWING: [f64; 2] = [0.1, 0.4];
/// The same of a thread, which carries what hangs on it: as stiff as one step bears.
const THREAD: [f64; 2] = [0.5, 0.5];

/// A joint with one freedom; of a screw the turn.
pub(super) struct Single<'a> {
    /// Parent and child.
    pub(super) ends: [RigidBodyHandle; 2],
    pub(super) part: &'a Part,
    pub(super) above: &'a Part,
    pub(super) hold: &'a Attachment,
    pub(super) motion: &'a Motion,
}

impl<'a> Engine<'a> {
    /// The joints with one freedom, by the twin's names.
    pub(super) fn single(&self) -> Vec<Single<'a>> {
        let of = |(id, part): (PartId, &'a Part)| {
            let hold = part.hold()?;
            let [motion] = hold.motions.as_slice() else { return None };
            let above = PartId {
                part: hold.parent,
                ..id
            };
            Some(Single {
                ends: [self.body(above)?, self.body(id)?],
                part,
                above: self.scene.part(above),
                hold,
                motion,
            })
        };
        self.scene.parts().filter_map(of).collect()
    }

    /// A stiff spring and damper between a joint and its leader.
    pub(super) fn follow(&mut self, own: &Single, leader: &Single, ratio: f64) {
        let at = |j: &Single| self.position_and_speed(j.ends, j.hold, j.motion);
        let ((q, v), (p, u)) = (at(own), at(leader));
        // Of both, as if nothing else hung on them, so that no explicit spring overshoots.
        let inertia = 1.0
            / (1.0 / inertia_along(own.part, own.motion) + ratio * ratio / inertia_along(leader.part, leader.motion));
        let (stiffness, damping) = (FOLLOWING[0] * inertia / (STEP * STEP), FOLLOWING[1] * inertia / STEP);
        let effort = stiffness * (ratio * p - q) + damping * (ratio * u - v);
        self.load(own, effort);
        self.load(leader, -ratio * effort);
    }

    /// Holds the advance of a screw to pitch times turn; what is pushed along the axis turns, by virtual work.
    pub(super) fn thread(&mut self, screw: &Single) {
        let pitch = screw.hold.pitch;
        let (turn, spin) = self.position_and_speed(screw.ends, screw.hold, screw.motion);
        let (advance, speed) = self.slide(screw);
        let yields = |part: &Part, handle: RigidBodyHandle| {
            let fixed = self.world.bodies[handle].is_fixed();
            let both = 1.0 / part.mass + pitch * pitch / inertia_along(part, screw.motion);
            if fixed { 0.0 } else { both }
        };
        let inertia = 1.0 / (yields(screw.above, screw.ends[0]) + yields(screw.part, screw.ends[1])).max(1e-12);
        let (stiffness, damping) = (THREAD[0] * inertia / (STEP * STEP), THREAD[1] * inertia / STEP);
        let force = stiffness * (pitch * turn - advance) + damping * (pitch * spin - speed);
        self.push_apart(screw, force);
        self.load(screw, -pitch * force);
    }

    /// How far a joint's child went along its axis, m, and how fast, m/s, from the first view.
    fn slide(&self, joint: &Single) -> (f64, f64) {
        let along = Motion {
            turns: false,
            ..joint.motion.clone()
        };
        self.position_and_speed(joint.ends, joint.hold, &along)
    }

    /// Loads a joint, N·m or N, and its parent the other way.
    pub(super) fn load(&mut self, joint: &Single, effort: f64) {
        if !joint.motion.turns {
            return self.push_apart(joint, effort);
        }
        let effort = self.axis_now(joint).into_inner() * effort;
        for (handle, effort) in joint.ends.into_iter().zip([-effort, effort]) {
            self.world.bodies[handle].add_torque(effort.into(), true);
        }
    }

    /// A force along a joint's axis on its child, N, and the other way on its parent.
    fn push_apart(&mut self, joint: &Single, force: f64) {
        let force = self.axis_now(joint).into_inner() * force;
        let origin = self.pose(joint.ends[1]).translation.vector;
        for (handle, force) in joint.ends.into_iter().zip([-force, force]) {
            self.world.bodies[handle].add_force_at_point(force.into(), origin.into(), true);
        }
    }

    fn axis_now(&self, joint: &Single) -> Unit<Vector3<f64>> {
        self.pose(joint.ends[1]).rotation * joint.motion.axis
    }
}

/// A turn of which an engine tells what is left of whole rounds, as the one nearest to `about`.
pub(super) fn whole_turns(turn: f64, about: f64) -> f64 {
    turn + TAU * ((about - turn) / TAU).round()
}
