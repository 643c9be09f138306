//! Recorded touches in the embedded engine.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, ColliderHandle, FrictionModel, GenericJointBuilder, ImpulseJointHandle,
    JointAxesMask, RigidBodyBuilder, RigidBodyHandle,
};

use super::engine::{Engine, STEP, no_table};
use super::layout::lay_out;
use super::rest::{RestResult, rest_for};
use super::scene::Scene;
use super::trial::{Hold, Played, Trial, TrialShape, place};
use crate::base::{Error, Pose, Result};
use crate::twin::Model;

/// Time for everything to come to rest before the tool comes, s.
pub(super) const SETTLING: f64 = 0.5;
/// Steps over which a force is averaged: a hundredth of a second.
const MEAN: usize = 5;

/// Plays `trial` in the embedded engine.
///
/// # Errors
/// Where the twin has no table, or no such link with a solid shape.
pub fn play(model: &Model, trial: &Trial) -> Result<Played> {
    let scene = lay_out(model)?;
    let present = trial.trees(&scene);
    let mut engine = Engine::of(&scene, model, |t| present.contains(&t.name)).ok_or_else(no_table)?;
    // Friction at every point of contact: the engine's other model gives a sliding face its whole resistance to turning too.
    engine.world.integration_parameters.friction_model = FrictionModel::Coulomb;
    let placed = place(&scene, &trial.start);
    for (id, _, handle) in engine.bodies() {
        engine.world.bodies[handle].set_position(placed.parts[id.tree][id.part].into(), true);
    }
    for _ in 0..(SETTLING / STEP) as usize {
        engine.step();
    }
    let settled = links(&engine);
    let tool = Tool::new(&mut engine, &scene, trial)?;
    let mut force = Vec::new();
    let mut sum = Vector3::zeros();
    for k in 1..=(trial.duration() / STEP) as usize {
        let pose = trial.tool_at(STEP * k as f64);
        engine.world.bodies[tool.hand].set_next_kinematic_position(pose.into());
        engine.step();
        sum += tool.force(&engine);
        if k.is_multiple_of(MEAN) {
            force.push((STEP * k as f64, (sum / MEAN as f64).into()));
            sum = Vector3::zeros();
        }
    }
    Ok(Played {
        settled,
        ended: links(&engine),
        force,
    })
}

/// What each part does while nothing touches it for `seconds`, of which the first half second is for settling.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn rest_in_engine(model: &Model, seconds: f64) -> Result<Vec<RestResult>> {
    Ok(rest_for(&lay_out(model)?, model, (seconds / STEP) as usize))
}

fn links(engine: &Engine) -> BTreeMap<String, Pose> {
    let link = |part: &super::scene::Part, handle| {
        let world_from_link = engine.pose(handle) * Translation3::from(part.link_origin);
        (part.link.clone(), Pose(world_from_link))
    };
    engine.bodies().into_iter().map(|(_, p, h)| link(p, h)).collect()
}

/// A tool on its way, moved without regard to what stands there.
struct Tool {
    hand: RigidBodyHandle,
    tip: Option<ColliderHandle>,
    held: Option<ImpulseJointHandle>,
}

impl Tool {
    fn new(engine: &mut Engine, scene: &Scene, trial: &Trial) -> Result<Self> {
        let missing = || {
            Error::Failed(format!(
                "{}: no solid shape was seen, so it cannot be touched",
                trial.target
            ))
        };
        let id = scene.find(&trial.target).ok_or_else(missing)?;
        let target = engine.body(id).ok_or_else(missing)?;
        let pose = trial.tool_at(0.0);
        let hand = RigidBodyBuilder::kinematic_position_based().pose(pose.into());
        let hand = engine.world.insert_body(hand);
        let mut tool = Self {
            hand,
            tip: None,
            held: None,
        };
        if trial.hold == Hold::Touch {
            // Of two coefficients the engine takes the geometric mean here, so that the product is what was measured.
            let body = scene.part(id).surface.kinetic_friction.max(1e-9);
            let tip = collider(&trial.shape)
                .ok_or_else(|| Error::Failed(format!("{}: a tool without a volume", trial.name)))?
                .friction(trial.friction * trial.friction / body)
                .friction_combine_rule(CoefficientCombineRule::GeometricMean)
                .restitution(0.0);
            tool.tip = Some(engine.world.insert_collider(tip, Some(hand)));
            return Ok(tool);
        }
        let mask = match trial.hold {
            Hold::Pin => JointAxesMask::LOCKED_SPHERICAL_AXES,
            _ => JointAxesMask::LOCKED_FIXED_AXES,
        };
        let target_from_hand: Isometry3<f64> = engine.pose(target).inverse() * pose;
        let joint = GenericJointBuilder::new(mask)
            .contacts_enabled(false)
            .local_frame2(target_from_hand.into());
        tool.held = Some(engine.world.insert_impulse_joint(hand, target, joint.build()));
        Ok(tool)
    }

    /// On what it touches, N, world: of contacts the normal part alone.
    fn force(&self, engine: &Engine) -> Vector3<f64> {
        let world = &engine.world;
        let mut sum = Vector3::zeros();
        if let Some(tip) = self.tip {
            for pair in world.narrow_phase.contact_pairs_with(tip) {
                let impulse: Vector3<f64> = pair.total_impulse().into();
                sum += if pair.collider1 == tip { impulse } else { -impulse };
            }
            return sum / STEP;
        }
        let step = STEP / world.integration_parameters.num_solver_iterations as f64;
        if let Some(joint) = self.held.and_then(|h| world.impulse_joints.get(h)) {
            let local = Vector3::from_fn(|i, _| joint.impulses[i]) / step;
            sum = engine.pose(self.hand).rotation * local;
        }
        sum
    }
}

/// A tool's shape in its own frame; nothing where it has no volume.
pub(super) fn collider(shape: &TrialShape) -> Option<ColliderBuilder> {
    let upright = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let built = match shape {
        TrialShape::Sphere { radius } => ColliderBuilder::ball(*radius),
        TrialShape::Box { half: [x, y, z] } => ColliderBuilder::cuboid(*x, *y, *z),
        TrialShape::Cylinder { radius, half_height } => {
            ColliderBuilder::cylinder(*half_height, *radius).position(upright.into())
        }
        TrialShape::Hull { points } => {
            let points: Vec<_> = points.iter().map(|p| Point3::from(*p).coords.into()).collect();
            ColliderBuilder::convex_hull(&points)?
        }
    };
    Some(built.density(0.0))
}
