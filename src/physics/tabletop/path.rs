//! The prescribed motion of a tool, at the steps of the simulation.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

/// Seconds of a step.
pub(super) const STEP: f64 = 1.0 / 240.0;

/// Place, turn and velocities of a tool at one step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Row {
    pub place: [f32; 3],
    /// Rows of support-from-tool.
    pub turn: [[f32; 3]; 3],
    pub velocity: [f32; 3],
    pub spin: [f32; 3],
}

/// The way of a tool from time 0 on, support frame; before and after it the tool stands still.
#[derive(Clone, Debug)]
pub struct Path {
    rows: Vec<Row>,
    /// Whether the tool turns on its way.
    pub(super) turns: bool,
    places: Vec<Vector3<f64>>,
}

impl Path {
    /// From poses (support-from-tool) at times that do not decrease, in s from the start of the trial. Linear between
    /// them. Nothing where there is no pose.
    pub fn new(times: &[f64], poses: &[Isometry3<f64>]) -> Option<Self> {
        let last = *times.last().filter(|_| times.len() == poses.len())?;
        let steps = (last.max(0.0) / STEP).ceil() as usize + 1;
        let at = |time: f64| {
            let after = times.partition_point(|t| *t <= time);
            if after == 0 || after >= poses.len() {
                return poses[after.min(poses.len() - 1)];
            }
            let (before, then) = (times[after - 1], times[after]);
            between(&poses[after - 1], &poses[after], (time - before) / (then - before))
        };
        let row = |k: usize| {
            let time = k as f64 * STEP;
            let here = at(time);
            // The velocity about the middle of the step: a tool that stops within a step lets go neither always too early
            // nor always too late.
            let (a, b) = (at(time + 0.48 * STEP), at(time + 0.52 * STEP));
            let matrix = here.rotation.to_rotation_matrix();
            let of = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
            Row {
                place: of(here.translation.vector),
                turn: [0, 1, 2].map(|i| of(matrix.matrix().row(i).transpose())),
                velocity: of((b.translation.vector - a.translation.vector) / (0.04 * STEP)),
                spin: of((b.rotation * a.rotation.inverse()).scaled_axis() / (0.04 * STEP)),
            }
        };
        Some(Self {
            rows: (0..=steps).map(row).collect(),
            turns: poses.iter().any(|p| p.rotation != poses[0].rotation),
            places: (0..=steps).map(|k| at(k as f64 * STEP).translation.vector).collect(),
        })
    }

    /// Seconds until it stands still.
    pub fn seconds(&self) -> f64 {
        (self.rows.len() - 1) as f64 * STEP
    }

    pub(super) fn row(&self, step: usize) -> &Row {
        &self.rows[step.min(self.rows.len() - 1)]
    }

    /// The first step from `from` on at which the tool's origin is within `reach` of `at`; `usize::MAX` where it
    /// never is.
    pub(super) fn first_near(&self, at: &Vector3<f64>, reach: f64, from: usize) -> usize {
        let near = |p: &Vector3<f64>| (p - at).norm_squared() < reach * reach;
        let from_here = from.min(self.places.len() - 1);
        let found = self.places[from_here..].iter().position(near);
        // A tool that stands still beside a thing at rest moves nothing more.
        match found {
            Some(0) if from >= self.places.len() - 1 => usize::MAX,
            Some(k) => from_here + k,
            None => usize::MAX,
        }
    }
}

fn between(a: &Isometry3<f64>, b: &Isometry3<f64>, share: f64) -> Isometry3<f64> {
    let turn: UnitQuaternion<f64> = a.rotation.try_slerp(&b.rotation, share, 1e-9).unwrap_or(b.rotation);
    Isometry3::from_parts(a.translation.vector.lerp(&b.translation.vector, share).into(), turn)
}
