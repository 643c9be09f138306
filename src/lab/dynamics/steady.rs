//! How fine the step of time must be for the joints of a tree.
//!
//! The step takes momenta by the forces of where things are, then the poses by the new velocities: a mode of stiffness k
//! and damping c on the mass m is stable where `2 c dt / m + k dt² / m < 4`. Springs that each alone keep that with much
//! to spare add up on a light part which many of them hold, so the sum is taken: the largest eigenvalue of
//! `M⁻¹ (2 D dt + K dt²)` of all bodies and joints.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::body::RigidBody;
use super::joint::{Grasp, Joint};

/// What joints may take of the 4: a tool that holds on takes 1.3 by its point and as much again by its grip, seldom in one
/// direction with what the joints take most in.
const MOST: f64 = 1.9;

/// Into how many steps a step of `dt` must be cut.
pub(super) fn fineness(joints: &[Joint], bodies: &[RigidBody], dt: f64) -> usize {
    let Some(masses) = masses(bodies) else { return 1 };
    let mut all = DMatrix::zeros(6 * bodies.len(), 6 * bodies.len());
    for joint in joints {
        let Grasp { point, free, stays } = joint.grasp(bodies);
        let (shift, turn) = (shift_rows(joint, bodies, &point), turn_rows(joint, bodies));
        let [linear, angular, bristle] = joint.springs().map(|(k, c)| 2.0 * c * dt + k * dt * dt);
        let along = bristle + 2.0 * joint.viscous() * dt;
        all += shift.transpose() * (stays.shift * linear + free.shift * along) * &shift;
        all += turn.transpose() * (stays.turn * angular + free.turn * along) * &turn;
    }
    let largest = (&masses * all * &masses).symmetric_eigenvalues().max();
    (largest / MOST).ceil().max(1.0) as usize
}

/// `M^(-1/2)` of velocities and angular velocities in world axes; what is held to the world gives way to nothing.
fn masses(bodies: &[RigidBody]) -> Option<DMatrix<f64>> {
    let mut out = DMatrix::zeros(6 * bodies.len(), 6 * bodies.len());
    for (i, body) in bodies.iter().enumerate().filter(|(_, b)| !b.fixed) {
        let turn = body.frame.matrix;
        let inertia = (turn * body.inertia * turn.transpose()).symmetric_eigen();
        let root = inertia.eigenvalues.map(|x| 1.0 / x.max(1e-12).sqrt());
        let root = inertia.eigenvectors * Matrix3::from_diagonal(&root) * inertia.eigenvectors.transpose();
        let light = Matrix3::identity() / body.mass.sqrt();
        out.fixed_view_mut::<3, 3>(6 * i, 6 * i).copy_from(&light);
        out.fixed_view_mut::<3, 3>(6 * i + 3, 6 * i + 3).copy_from(&root);
    }
    out.iter().all(|x| x.is_finite()).then_some(out)
}

/// Velocity of `b` against `a` at a point, of all velocities.
fn shift_rows(joint: &Joint, bodies: &[RigidBody], point: &Vector3<f64>) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(3, 6 * bodies.len());
    for (body, sign) in [(joint.b, 1.0), (joint.a, -1.0)] {
        let arm = point - bodies[body].frame.position;
        rows.fixed_view_mut::<3, 3>(0, 6 * body)
            .copy_from(&(Matrix3::identity() * sign));
        rows.fixed_view_mut::<3, 3>(0, 6 * body + 3)
            .copy_from(&(arm.cross_matrix() * -sign));
    }
    rows
}

/// Angular velocity of `b` against `a`, of all velocities.
fn turn_rows(joint: &Joint, bodies: &[RigidBody]) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(3, 6 * bodies.len());
    for (body, sign) in [(joint.b, 1.0), (joint.a, -1.0)] {
        rows.fixed_view_mut::<3, 3>(0, 6 * body + 3)
            .copy_from(&(Matrix3::identity() * sign));
    }
    rows
}
