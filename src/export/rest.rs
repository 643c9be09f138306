//! Lets the exported scene rest in the embedded engine: what drifts, sinks or flies apart is a bad export.

use std::fmt;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::Serialize;

use super::engine::{Engine, STEP};
use super::scene::{Attachment, Part, Scene};
use crate::twin::{JointKind, Model};

/// Steps to settle; steps in all of a check.
const SETTLED: usize = 250;
pub(super) const STEPS: usize = 2500;
/// Steps after which what falls freely shows, and the share of a free fall's way that tells it.
const RELEASED: usize = 20;
const FREE: f64 = 0.9;
/// Drift, m, and turn, rad, after settling, and the way there, m, above which a part does not rest.
const LATE_DRIFT: f64 = 1e-3;
const LATE_TURN: f64 = 0.5 * std::f64::consts::PI / 180.0;
const SETTLING: f64 = 10e-3;

/// What a part did while nothing touched it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RestResult {
    /// The part, as the exports name it.
    pub part: String,
    /// How far its centre of mass moved in the first half second, m.
    pub settling: f64,
    /// How far it moved after that, m.
    pub late_drift: f64,
    /// How far it turned after that, rad.
    pub late_turn: f64,
    /// It never left the finite numbers.
    pub finite: bool,
    /// It hangs on a planar joint, or on a spherical one without friction, whose freedom nothing brakes: where it glides or
    /// swings to says nothing.
    pub glides: bool,
    /// It was seen in the air at first (thrown, or held up), touches nothing and falls.
    pub falls: bool,
}

impl RestResult {
    /// Whether the part stays where it is.
    pub fn is_calm(&self) -> bool {
        let still = self.late_drift < LATE_DRIFT && self.late_turn < LATE_TURN;
        self.finite && (self.glides || ((self.falls || self.settling < SETTLING) && still))
    }
}

impl fmt::Display for RestResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (settling, late) = (1e3 * self.settling, 1e3 * self.late_drift);
        let turn = self.late_turn.to_degrees();
        let settles = if self.falls {
            "in the air at first, falls"
        } else {
            "settles"
        };
        write!(
            f,
            "{}: {settles} by {settling:.3} mm, then drifts {late:.3} mm and {turn:.3} degrees",
            self.part
        )?;
        if self.finite {
            Ok(())
        } else {
            write!(f, ", and is lost")
        }
    }
}

/// `steps` of rest. Trees without anything that could touch fall, and are left out; so is all where there
/// is no table.
pub(super) fn rest_for(scene: &Scene, model: &Model, steps: usize) -> Vec<RestResult> {
    let Some(mut engine) = Engine::new(scene, model) else {
        return Vec::new();
    };
    let start = poses(&engine);
    (0..RELEASED).for_each(|_| engine.step());
    let released = poses(&engine);
    (RELEASED..SETTLED).for_each(|_| engine.step());
    let settled = poses(&engine);
    (SETTLED..steps).for_each(|_| engine.step());
    let end = poses(&engine);
    let way = |a: &(Vector3<f64>, UnitQuaternion<f64>), b: &(Vector3<f64>, UnitQuaternion<f64>)| (a.0 - b.0).norm();
    let parts = engine.bodies();
    parts
        .iter()
        .enumerate()
        .map(|(i, (_, part, _))| RestResult {
            part: part.name.clone(),
            settling: way(&start[i], &settled[i]),
            late_drift: way(&settled[i], &end[i]),
            late_turn: settled[i].1.angle_to(&end[i].1),
            finite: end[i].0.iter().all(|v| v.is_finite()),
            glides: part.attachment.as_ref().is_some_and(glides),
            falls: {
                let gravity = Vector3::from(model.twin.felt_gravity());
                let fallen = 0.5 * (RELEASED as f64 * STEP).powi(2) * gravity;
                (released[i].0 - start[i].0).dot(&gravity) > FREE * fallen.dot(&gravity)
            },
        })
        .collect()
}

/// Whether nothing brakes a joint of several freedoms.
fn glides(hold: &Attachment) -> bool {
    let brakes = hold.motions.iter().any(|m| m.friction > 0.0 || m.damping > 0.0);
    hold.kind == JointKind::Planar || hold.kind == JointKind::Spherical && !brakes
}

/// Centre of mass and orientation.
fn poses(engine: &Engine) -> Vec<(Vector3<f64>, UnitQuaternion<f64>)> {
    let pose = |part: &Part, handle| {
        let isometry = engine.pose(handle);
        ((isometry * Point3::from(part.com)).coords, isometry.rotation)
    };
    engine.bodies().iter().map(|(_, p, h)| pose(p, *h)).collect()
}
