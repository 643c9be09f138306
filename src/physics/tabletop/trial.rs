//! Trials of a tool on a prescribed path against a thing on the support: many at once, the same whatever the threads.

use nalgebra::{Isometry3, Vector3};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::batch::Batch;
use super::path::Path;
use super::solid::{Solid, Tool};

/// What the outcome of a trial depends on beyond shapes and paths. Mass is not among them: on a prescribed path it
/// scales every force and moves nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Friction against the support.
    pub friction: f64,
    /// Rolling resistance, m: the moment that resists rolling over the normal force.
    pub rolling: f64,
    /// Friction against the tool.
    pub tool_friction: f64,
    /// Restitution at the tool; above 0 the contact is hard.
    pub restitution: f64,
    /// Time constant with which the contact at the tool yields, s, where it does not rebound.
    pub yielding: f64,
}

/// One trial. All poses are in the support's frame: z along its normal, the plane at z = 0.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// Support-from-mesh at the start, at rest on the support.
    pub start: Isometry3<f64>,
    /// Which of the paths the tool takes, and how far it is shifted, m.
    pub path: usize,
    /// Shift of the path, m.
    pub shift: Vector3<f64>,
    /// Seconds until the outcome is read.
    pub seconds: f64,
    /// The coefficients.
    pub coefficients: Coefficients,
}

/// How a trial ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Support-from-mesh at the end.
    pub end: Isometry3<f64>,
    /// Impulse that the tool gave, per kg of the thing, m/s.
    pub impulse: Vector3<f64>,
    /// Seconds during which the tool bore on it.
    pub touched: f64,
}

/// What all trials of a batch share.
#[derive(Clone, Copy, Debug)]
pub struct Stage<'a> {
    /// The thing.
    pub solid: &'a Solid,
    /// The tool.
    pub tool: &'a Tool,
    /// Paths of the tool, support frame.
    pub paths: &'a [Path],
    /// Gravity in the support's frame, m/s².
    pub gravity: Vector3<f64>,
}

/// Simulates trials, in their order. A trial's outcome depends on that trial only, to the last bit: not on threads, nor on
/// its neighbours, nor on how many lanes the processor has.
///
/// Rigid bodies, semi-implicit Euler at 240 Hz with contacts as velocity constraints (Stewart and Trinkle 1996;
/// projected Gauss-Seidel), Coulomb friction, rolling resistance, Newton restitution at the tool.
pub fn simulate(stage: &Stage, trials: &[Trial]) -> Vec<Outcome> {
    let arch = Arch::new();
    let lanes = arch.dispatch(Lanes);
    let chunks: Vec<Vec<Outcome>> = trials
        .par_chunks(lanes)
        .map(|trials| arch.dispatch(SideBySide { stage, trials }))
        .collect();
    chunks.into_iter().flatten().collect()
}

/// Asks how many trials go side by side.
struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> usize {
        S::F32_LANES
    }
}

/// Runs as many trials as there are lanes.
struct SideBySide<'a> {
    stage: &'a Stage<'a>,
    trials: &'a [Trial],
}

impl WithSimd for SideBySide<'_> {
    type Output = Vec<Outcome>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<Outcome> {
        Batch::new(simd, self.stage, self.trials).run()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::*;
    use crate::geometry::Mesh;

    fn brick() -> Solid {
        let vertices = (0..8)
            .map(|i| {
                let s = |bit: usize| if i & bit == 0 { -1.0 } else { 1.0 };
                Point3::new(0.04 * s(1), 0.03 * s(2), 0.02 * s(4))
            })
            .collect();
        let mesh = Mesh {
            vertices,
            ..Mesh::default()
        };
        Solid::of(&mesh).expect("a solid")
    }

    fn stroke(length: f64, speed: f64) -> Path {
        let at = |x: f64| Isometry3::translation(x, 0.0, 0.02);
        Path::new(&[0.0, length / speed], &[at(-0.08), at(length - 0.08)]).expect("a path")
    }

    fn trials(solid: &Solid, count: usize) -> Vec<Trial> {
        (0..count)
            .map(|k| {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.37 * k as f64);
                Trial {
                    start: Isometry3::from_parts(
                        Vector3::new(0.0, 0.004 * (k % 5) as f64, solid.standing_height(&turn)).into(),
                        turn,
                    ),
                    path: k % 2,
                    shift: Vector3::zeros(),
                    seconds: 1.5 + 0.1 * (k % 3) as f64,
                    coefficients: Coefficients {
                        friction: 0.2 + 0.05 * (k % 7) as f64,
                        rolling: 1e-5,
                        tool_friction: 0.3,
                        restitution: 0.05 * (k % 2) as f64,
                        yielding: 4e-3,
                    },
                }
            })
            .collect()
    }

    #[test]
    fn a_trial_ends_alike_alone_and_among_others() {
        let (solid, tool) = (brick(), Tool::cylinder(0.01, 0.05));
        let paths = [stroke(0.14, 0.3), stroke(0.12, 0.5)];
        let stage = Stage {
            solid: &solid,
            tool: &tool,
            paths: &paths,
            gravity: Vector3::new(0.0, 0.0, -9.81),
        };
        let all = trials(&solid, 37);
        let together = simulate(&stage, &all);
        let alone: Vec<Outcome> = all
            .iter()
            .flat_map(|t| simulate(&stage, std::slice::from_ref(t)))
            .collect();
        assert_eq!(together, alone);
        // And however many lanes there are.
        let narrow: Vec<Outcome> = all
            .chunks(1)
            .flat_map(|trials| {
                let stage = &stage;
                SideBySide { stage, trials }.with_simd(pulp::Scalar)
            })
            .collect();
        assert_eq!(together, narrow);
    }

    #[test]
    fn a_thing_that_is_let_go_coasts_as_far_as_friction_lets_it() {
        let (solid, tool) = (brick(), Tool::cuboid(&Vector3::new(0.01, 0.1, 0.02)));
        let (speed, friction) = (0.4, 0.3);
        let paths = [stroke(0.12, speed)];
        let stage = Stage {
            solid: &solid,
            tool: &tool,
            paths: &paths,
            gravity: Vector3::new(0.0, 0.0, -9.81),
        };
        let mut trial = trials(&solid, 1)[0];
        trial.coefficients.friction = friction;
        trial.coefficients.restitution = 0.0;
        let end = simulate(&stage, &[trial])[0].end.translation.vector.x;
        // The tool's face stops at x = 0.05; the thing, 0.04 before it, goes on by v^2 / (2 mu g).
        let expected = 0.05 + 0.04 + speed * speed / (2.0 * friction * 9.81);
        assert!((end - expected).abs() < 1e-3, "{end} for {expected}");
    }
}
