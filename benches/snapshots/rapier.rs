//! A trial of a tool on a prescribed path, in rapier.

use nalgebra::{Isometry3, Point3, Vector2, Vector3};
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, FrictionModel, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
};

/// Step, s.
const STEP: f64 = 0.001;

/// The shape of a tool.
#[derive(Clone, Copy)]
pub enum Hand {
    /// Radius.
    Ball(f64),
    /// Half extents.
    Box([f64; 3]),
    /// Radius, half height, along z.
    Cylinder(f64, f64),
}

/// The shape of a thing.
pub enum Body<'a> {
    /// Radius.
    Ball(f64),
    /// Corners.
    Hull(&'a [Point3<f64>]),
}

/// What all trials of a task share.
pub struct World<'a> {
    pub body: Body<'a>,
    pub hand: Hand,
    /// Friction, rolling resistance (m), friction against the tool.
    pub coefficients: [f64; 3],
    pub gravity: f64,
}

impl World<'_> {
    /// The displacement on the support. All friction is Coulomb's at each point; rapier has no rolling resistance, so that a
    /// torque of the rolling length times the weight opposes the turn about level axes.
    pub fn play(&self, start: &Isometry3<f64>, times: &[f64], poses: &[Isometry3<f64>], seconds: f64) -> Vector2<f64> {
        let [friction, rolling, tool_friction] = self.coefficients;
        let mut world = PhysicsWorld::new();
        world.gravity = Vector3::new(0.0, 0.0, -self.gravity).into();
        world.integration_parameters.dt = STEP;
        world.integration_parameters.friction_model = FrictionModel::Coulomb;
        let floor = ColliderBuilder::cuboid(5.0, 5.0, 0.5)
            .position(Isometry3::translation(0.0, 0.0, -0.5).into())
            .friction(friction)
            .friction_combine_rule(CoefficientCombineRule::Multiply);
        let ground = world.insert_body(RigidBodyBuilder::fixed());
        world.insert_collider(floor, Some(ground));
        let thing = world.insert_body(RigidBodyBuilder::dynamic().pose((*start).into()).can_sleep(false));
        let shape = match &self.body {
            Body::Ball(radius) => ColliderBuilder::ball(*radius),
            Body::Hull(corners) => {
                let corners: Vec<_> = corners.iter().map(|p| p.coords.into()).collect();
                ColliderBuilder::convex_hull(&corners).expect("a hull")
            }
        };
        let rule = CoefficientCombineRule::Multiply;
        world.insert_collider(
            shape
                .mass(0.1)
                .friction(1.0)
                .friction_combine_rule(rule)
                .restitution(0.0),
            Some(thing),
        );
        let hand = world.insert_body(RigidBodyBuilder::kinematic_position_based().pose(poses[0].into()));
        let upright = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
        let tip = match self.hand {
            Hand::Ball(radius) => ColliderBuilder::ball(radius),
            Hand::Box([x, y, z]) => ColliderBuilder::cuboid(x, y, z),
            Hand::Cylinder(radius, half) => ColliderBuilder::cylinder(half, radius).position(upright.into()),
        };
        let tip = tip.friction(tool_friction).friction_combine_rule(rule).restitution(0.0);
        world.insert_collider(tip, Some(hand));
        for k in 1..=(seconds / STEP).round() as usize {
            world.bodies[hand].set_next_kinematic_position(at(times, poses, k as f64 * STEP).into());
            resist(&mut world, thing, rolling * 0.1 * self.gravity);
            world.step();
        }
        let end: Vector3<f64> = world.bodies[thing].translation().into();
        (end - start.translation.vector).xy()
    }
}

/// A moment of at most `most` (N m) against the turn about level axes; no more than stops it within the step.
fn resist(world: &mut PhysicsWorld, thing: RigidBodyHandle, most: f64) {
    let body = &mut world.bodies[thing];
    let spin: Vector3<f64> = body.angvel().into();
    let level = Vector3::new(spin.x, spin.y, 0.0);
    let inertia = 0.4 * 0.1 * 0.03 * 0.03;
    let moment = most.min(0.5 * level.norm() * inertia / STEP);
    body.reset_torques(false);
    if let Some(way) = level.try_normalize(1e-6) {
        body.add_torque((-way * moment).into(), true);
    }
}

fn at(times: &[f64], poses: &[Isometry3<f64>], time: f64) -> Isometry3<f64> {
    let after = times.partition_point(|t| *t <= time);
    if after == 0 || after >= poses.len() {
        return poses[after.min(poses.len() - 1)];
    }
    let share = (time - times[after - 1]) / (times[after] - times[after - 1]);
    let place = poses[after - 1]
        .translation
        .vector
        .lerp(&poses[after].translation.vector, share);
    Isometry3::from_parts(place.into(), poses[after].rotation)
}
