//! A rigid body in maximal coordinates: centre of mass, rotation, linear and angular momentum.

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::base::Pose;
use crate::lab::Solid;

/// Where a thing is and how it moves; of a body the origin is its centre of mass. World axes.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub position: Vector3<f64>,
    pub rotation: UnitQuaternion<f64>,
    pub matrix: Matrix3<f64>,
    pub velocity: Vector3<f64>,
    pub angular_velocity: Vector3<f64>,
}

impl Frame {
    /// At rest.
    pub fn at(position: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self {
            position,
            rotation,
            matrix: rotation.to_rotation_matrix().into_inner(),
            velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        }
    }

    /// World point of a local point.
    #[inline]
    pub fn point(&self, local: &Vector3<f64>) -> Vector3<f64> {
        self.position + self.matrix * local
    }

    /// Local coordinates of a world point.
    #[inline]
    pub fn local(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.matrix.tr_mul(&(point - self.position))
    }

    /// Velocity of the material point that is at the world point `point`.
    #[inline]
    pub fn velocity_at(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.angular_velocity.cross(&(point - self.position))
    }

    /// As a pose.
    pub fn pose(&self) -> Pose {
        Pose(Isometry3::from_parts(Translation3::from(self.position), self.rotation))
    }
}

/// Force and its moment about the world's origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wrench {
    pub force: Vector3<f64>,
    pub moment: Vector3<f64>,
}

impl Wrench {
    /// No force.
    pub fn zero() -> Self {
        Self {
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
        }
    }

    /// Adds a force that acts at a world point.
    #[inline]
    pub fn push(&mut self, point: &Vector3<f64>, force: Vector3<f64>) {
        self.force += force;
        self.moment += point.cross(&force);
    }

    /// Adds another wrench, `sign` times.
    #[inline]
    pub fn add(&mut self, other: &Wrench, sign: f64) {
        self.force += other.force * sign;
        self.moment += other.moment * sign;
    }

    /// Its torque about a world point.
    #[inline]
    pub fn torque_about(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.moment - point.cross(&self.force)
    }
}

/// A rigid body and the wrench that acts on it in the current step.
#[derive(Clone, Debug)]
pub(crate) struct RigidBody {
    pub frame: Frame,
    pub mass: f64,
    pub inertia: Matrix3<f64>,
    inverse_inertia: Matrix3<f64>,
    angular_momentum: Vector3<f64>,
    pub wrench: Wrench,
    pub com_in_body: Vector3<f64>,
    pub fixed: bool,
    /// Radius about the centre of mass within which all its pieces lie.
    pub reach: f64,
    first_rotation: UnitQuaternion<f64>,
}

impl RigidBody {
    /// The solid at rest where it is at first.
    pub fn new(solid: &Solid, fixed: bool, reach: f64) -> Self {
        let com = solid.world_from_body.0 * solid.com;
        Self {
            frame: Frame::at(com.coords, solid.world_from_body.0.rotation),
            mass: solid.mass,
            inertia: solid.inertia,
            inverse_inertia: solid.inertia.try_inverse().unwrap_or_else(Matrix3::zeros),
            angular_momentum: Vector3::zeros(),
            wrench: Wrench::zero(),
            com_in_body: solid.com.coords,
            fixed,
            reach,
            first_rotation: solid.world_from_body.0.rotation,
        }
    }

    /// World-from-body.
    pub fn pose(&self) -> Pose {
        let origin = self.frame.point(&-self.com_in_body);
        Pose(Isometry3::from_parts(Translation3::from(origin), self.frame.rotation))
    }

    /// How readily a world point gives way in its softest direction, 1/kg: the largest eigenvalue of
    /// `1/m - [r] I⁻¹ [r]` with the arm `r`; 0 for what is held to the world.
    pub fn compliance_at(&self, point: &Vector3<f64>) -> f64 {
        if self.fixed {
            return 0.0;
        }
        let arm = self.frame.local(point).cross_matrix();
        let turning = arm.transpose() * self.inverse_inertia * arm;
        1.0 / self.mass + turning.symmetric_eigenvalues().max()
    }

    /// 1/I of the lightest axis; 0 for what is held to the world.
    pub fn angular_compliance(&self) -> f64 {
        if self.fixed {
            return 0.0;
        }
        1.0 / self.inertia.symmetric_eigenvalues().min().max(1e-9)
    }

    /// Whether it leans by more than about 5° from where it was at first (turning about the vertical is no leaning).
    #[inline]
    pub fn leans(&self) -> bool {
        let up = self.first_rotation.inverse_transform_vector(&Vector3::z());
        (self.frame.matrix * up).z < 0.996
    }

    /// Takes momentum away at the rate `1/time` (while the scene settles).
    pub fn damp(&mut self, dt: f64, time: f64) {
        let keep = 1.0 - dt / time;
        self.frame.velocity *= keep;
        self.angular_momentum *= keep;
        self.frame.angular_velocity *= keep;
    }

    /// Sets the velocities (tests and launches).
    #[cfg(test)]
    pub fn launch(&mut self, velocity: Vector3<f64>, angular_velocity: Vector3<f64>) {
        self.frame.velocity = velocity;
        self.frame.angular_velocity = angular_velocity;
        let r = self.frame.matrix;
        self.angular_momentum = r * (self.inertia * r.tr_mul(&angular_velocity));
    }

    /// One semi-implicit Euler step: momenta first, then the pose with the new velocities. The angular momentum
    /// is kept in world axes, so that the gyroscopic term is exact.
    pub fn integrate(&mut self, dt: f64) {
        let wrench = std::mem::replace(&mut self.wrench, Wrench::zero());
        if self.fixed {
            return;
        }
        let torque = wrench.torque_about(&self.frame.position);
        self.frame.velocity += wrench.force * (dt / self.mass);
        self.angular_momentum += torque * dt;
        self.frame.position += self.frame.velocity * dt;
        let turn = self.turning();
        let mut rotation = UnitQuaternion::from_scaled_axis(turn * dt) * self.frame.rotation;
        rotation.renormalize_fast();
        self.frame.rotation = rotation;
        self.frame.matrix = rotation.to_rotation_matrix().into_inner();
        self.frame.angular_velocity = self.turning();
    }

    fn turning(&self) -> Vector3<f64> {
        let r = &self.frame.matrix;
        r * (self.inverse_inertia * r.tr_mul(&self.angular_momentum))
    }
}

/// Radius about the centre of mass that encloses mesh and pieces.
pub(crate) fn reach_of(solid: &Solid) -> f64 {
    let far = |p: &Point3<f64>| (p - solid.com).norm();
    let mesh = solid.mesh.vertices.iter().map(far).fold(0.0, f64::max);
    let parts = solid.parts.iter().map(|part| {
        let centre = Point3::from(part.body_from_part.0.translation.vector);
        far(&centre) + super::distance::reach(&part.shape)
    });
    parts.fold(mesh, f64::max)
}
