//! Spring-damper welds between two frames: glue, a tool's grip, a pin.

use nalgebra::{UnitQuaternion, Vector3};

use super::body::{Frame, Wrench};

/// Highest natural frequency that a stiff connection may have, rad/s.
pub(crate) const STIFFEST: f64 = 6000.0;

/// The least stiffness of `wanted` and what the compliance (1/kg or 1/(kg·m²)) allows, with its critical damping.
pub(crate) fn stiff(wanted: f64, compliance: f64) -> (f64, f64) {
    let mass = 1.0 / compliance.max(1e-12);
    let stiffness = wanted.min(STIFFEST * STIFFEST * mass);
    (stiffness, 2.0 * (stiffness * mass.min(1e6)).sqrt())
}

/// Stiffness and damping of a weld.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WeldSpring {
    /// N/m and N·s/m.
    pub linear: (f64, f64),
    /// N·m/rad and N·m·s/rad; zeros for a pin.
    pub angular: (f64, f64),
}

/// Holds `b` to `a` as they are when it is made.
#[derive(Clone, Debug)]
pub(crate) struct Weld {
    anchor_a: Vector3<f64>,
    anchor_b: Vector3<f64>,
    a_from_b: UnitQuaternion<f64>,
    spring: WeldSpring,
}

impl Weld {
    /// Without strain, at a world point.
    pub fn new(a: &Frame, b: &Frame, point: &Vector3<f64>, spring: WeldSpring) -> Self {
        Self {
            anchor_a: a.local(point),
            anchor_b: b.local(point),
            a_from_b: a.rotation.inverse() * b.rotation,
            spring,
        }
    }

    /// The wrench on `b` (its force acts at the anchor of `a`) and the torque about that anchor.
    pub fn act(&self, a: &Frame, b: &Frame) -> (Wrench, Vector3<f64>) {
        let (at, at_b) = (a.point(&self.anchor_a), b.point(&self.anchor_b));
        let (k, c) = self.spring.linear;
        let force = (at - at_b) * k + (a.velocity_at(&at) - b.velocity_at(&at_b)) * c;
        let torque = self.twist_back(a, b);
        let mut wrench = Wrench::zero();
        wrench.push(&at, force);
        wrench.moment += torque;
        (wrench, torque)
    }

    fn twist_back(&self, a: &Frame, b: &Frame) -> Vector3<f64> {
        let (k, c) = self.spring.angular;
        if k == 0.0 {
            return Vector3::zeros();
        }
        rotation_error(a, b, &self.a_from_b) * -k - (b.angular_velocity - a.angular_velocity) * c
    }
}

/// The small rotation (world axes) that has taken `b` away from where it is held on `a`.
pub(crate) fn rotation_error(a: &Frame, b: &Frame, a_from_b: &UnitQuaternion<f64>) -> Vector3<f64> {
    let error = b.rotation * (a.rotation * a_from_b).inverse();
    let sign = if error.w < 0.0 { -2.0 } else { 2.0 };
    error.imag() * sign
}
