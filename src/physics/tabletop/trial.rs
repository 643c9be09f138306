//! Trials of a tool on a prescribed path against a thing on the support: many at once, the same whatever the threads.

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::floor::{floor_spots, lowest};
use super::lanes::{F, LANES, M3, Turn, V3, all, gather, less, more, pick};
use super::path::{Path, Row, STEP};
use super::solid::{Solid, Tool};
use super::solve::{Floor, FloorImpulses, Grip, Laws, Motion, Soft};
use super::touch::touch;

/// Rounds of the contact solver per step.
const ROUNDS: usize = 8;
/// Overlap that is left alone, m, and the share of the rest that is mended per step.
const SLOP: f32 = 5e-5;
const MEND: f32 = 0.2;
/// Slower than this is at rest, m/s and rad/s (squared).
const STILL: (f32, f32) = (1e-6, 4e-4);
/// Steps between looks whether all is at rest.
const LOOK: usize = 12;
/// Room around thing and tool within which they are tested for touch, m.
const NEAR: f32 = 0.01;

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

/// Simulates trials, in their order. Every trial's outcome depends on that trial and its seven neighbours' timing
/// only, never on threads.
///
/// Rigid bodies, semi-implicit Euler at 240 Hz with contacts as velocity constraints (Stewart and Trinkle 1996;
/// projected Gauss-Seidel), Coulomb friction, rolling resistance, Newton restitution at the tool.
pub fn simulate(stage: &Stage, trials: &[Trial]) -> Vec<Outcome> {
    let chunks: Vec<Vec<Outcome>> = trials
        .par_chunks(LANES)
        .map(|chunk| Batch::new(stage, chunk).run())
        .collect();
    chunks.into_iter().flatten().collect()
}

/// Eight trials under way.
struct Batch<'a> {
    stage: &'a Stage<'a>,
    lanes: [Trial; LANES],
    count: usize,
    place: V3,
    turn: Turn,
    motion: Motion,
    laws: Laws,
    floor: FloorImpulses,
    impulse: V3,
    touched: F,
    corners: Vec<V3>,
}

impl<'a> Batch<'a> {
    fn new(stage: &'a Stage<'a>, trials: &[Trial]) -> Self {
        let lanes: [Trial; LANES] = std::array::from_fn(|k| trials[k.min(trials.len() - 1)]);
        let starts = lanes.map(|t| t.start * stage.solid.mesh_from_solid);
        let law = |of: fn(&Coefficients) -> f64| F::new(lanes.map(|t| of(&t.coefficients) as f32));
        Self {
            stage,
            lanes,
            count: trials.len(),
            place: gather(&starts.map(|s| s.translation.vector)),
            turn: Turn::gather(&starts.map(|s| s.rotation)),
            motion: Motion {
                v: V3::ZERO,
                w: V3::ZERO,
            },
            laws: Laws {
                floor: law(|c| c.friction),
                tool: law(|c| c.tool_friction),
                rolling: law(|c| c.rolling),
                restitution: law(|c| c.restitution),
                soft: Soft::new(law(|c| c.yielding.max(1e-4)), all(STEP as f32)),
            },
            floor: FloorImpulses::ZERO,
            impulse: V3::ZERO,
            touched: F::ZERO,
            corners: Vec::with_capacity(64),
        }
    }

    fn run(mut self) -> Vec<Outcome> {
        let last = self.lanes.map(|t| (t.seconds / STEP).round() as usize);
        let end = last.iter().copied().max().unwrap_or(0);
        let mut ends: [Option<Outcome>; LANES] = [None; LANES];
        let mut step = self.next_near(0, end).saturating_sub(2);
        while step < end {
            self.advance(step);
            step += 1;
            for k in 0..LANES {
                if step >= last[k] && ends[k].is_none() {
                    ends[k] = Some(self.outcome(k));
                }
            }
            if step.is_multiple_of(LOOK) && self.is_still() {
                step = step.max(self.next_near(step, end).saturating_sub(2));
            }
        }
        (0..self.count)
            .map(|k| ends[k].unwrap_or_else(|| self.outcome(k)))
            .collect()
    }

    fn is_still(&self) -> bool {
        (less(self.motion.v.norm2(), all(STILL.0)) & less(self.motion.w.norm2(), all(STILL.1))).all()
    }

    /// The first step from `from` on at which any tool comes near its thing where that rests now.
    fn next_near(&self, from: usize, end: usize) -> usize {
        let reach = f64::from(self.stage.solid.reach + self.stage.tool.reach + NEAR);
        let (x, y, z) = (
            self.place.x.to_array(),
            self.place.y.to_array(),
            self.place.z.to_array(),
        );
        let of = |k: usize| {
            let at = Vector3::new(f64::from(x[k]), f64::from(y[k]), f64::from(z[k])) - self.lanes[k].shift;
            self.stage.paths[self.lanes[k].path].first_near(&at, reach, from)
        };
        (0..LANES).map(of).min().unwrap_or(end).min(end)
    }

    fn outcome(&self, k: usize) -> Outcome {
        let of = |v: V3| {
            Vector3::new(
                v.x.to_array()[k].into(),
                v.y.to_array()[k].into(),
                v.z.to_array()[k].into(),
            )
        };
        let v: Vector3<f64> = of(self.turn.v);
        let q = UnitQuaternion::from_quaternion(Quaternion::new(self.turn.w.to_array()[k].into(), v.x, v.y, v.z));
        let solid = Isometry3::from_parts(Point3::from(of(self.place)).into(), q);
        Outcome {
            end: solid * self.stage.solid.mesh_from_solid.inverse(),
            impulse: of(self.impulse),
            touched: self.touched.to_array()[k].into(),
        }
    }

    fn advance(&mut self, step: usize) {
        let (h, inverse_h) = (all(STEP as f32), all((1.0 / STEP) as f32));
        let solid = self.stage.solid;
        let turn = self.turn.matrix();
        let inverse = turn.turned_diagonal(solid.inertia.map(|i| 1.0 / i));
        let g = self.stage.gravity;
        let mut motion = self.motion;
        motion.v = motion.v + V3::all([g.x as f32, g.y as f32, g.z as f32]) * h;
        let grips = self.grips(step, &turn, &inverse, &motion);
        let (spots, count) = floor_spots(solid, &turn, self.place.z, &mut self.corners);
        let spots = &spots[..count];
        let mut floor = Floor::new(spots, &mut self.floor, &inverse, &mut motion);
        let mut grips = grips;
        for _ in 0..ROUNDS {
            for grip in &mut grips {
                grip.relax(&mut motion, &inverse, &self.laws);
            }
            floor.relax(&mut motion, &inverse, &self.laws, inverse_h);
        }
        let mut mend = V3::ZERO;
        let mut worst = F::ZERO;
        let mut bears = F::ZERO;
        for grip in &grips {
            self.impulse = self.impulse + grip.given();
            bears |= grip.bears();
            let hard = more(self.laws.restitution, all(1e-6));
            let inside = pick(hard, (-grip.spot.gap - all(SLOP)).fast_max(F::ZERO), F::ZERO);
            mend = V3::pick(more(inside, worst), grip.normal * inside, mend);
            worst = worst.fast_max(inside);
        }
        self.touched += pick(bears, h, F::ZERO);
        let under = (-lowest(spots) - all(SLOP)).fast_max(F::ZERO);
        // What slides on by itself is carried by the mean of both speeds (the trapezoidal rule): the later one alone would
        // take half a step off every coast. Where the tool bears the speed may jump, and the later one counts.
        let mean = V3::new(
            (self.motion.v.x + motion.v.x) * all(0.5),
            (self.motion.v.y + motion.v.y) * all(0.5),
            motion.v.z,
        );
        let carried = V3::pick(bears, motion.v, mean);
        let turned = V3::pick(bears, motion.w, (self.motion.w + motion.w) * all(0.5));
        self.place = self.place + carried * h + mend * all(MEND);
        self.place.z += under * all(MEND);
        self.turn = self.turn.advanced(turned, h);
        self.motion = Motion {
            v: motion.v,
            w: self.carried_spin(&turn, motion.w),
        };
    }

    /// The angular velocity after the turn of this step: angular momentum is kept, not the velocity.
    fn carried_spin(&self, before: &M3, w: V3) -> V3 {
        let solid = self.stage.solid;
        if solid.ball.is_some() {
            return w;
        }
        let i = solid.inertia;
        let own = before.apply_transposed(w);
        let momentum = before.apply(V3::new(own.x * all(i[0]), own.y * all(i[1]), own.z * all(i[2])));
        let after = self.turn.matrix();
        let own = after.apply_transposed(momentum);
        after.apply(V3::new(
            own.x * all(1.0 / i[0]),
            own.y * all(1.0 / i[1]),
            own.z * all(1.0 / i[2]),
        ))
    }

    /// Contacts with the tool in this step; none where it is far from the thing in every trial.
    fn grips(&mut self, step: usize, turn: &M3, inverse: &M3, motion: &Motion) -> Vec<Grip> {
        let rows: [&Row; LANES] = std::array::from_fn(|k| self.stage.paths[self.lanes[k].path].row(step));
        let shift = gather(&self.lanes.map(|t| t.shift));
        let of = |pick: fn(&Row) -> [f32; 3]| {
            let v = rows.map(pick);
            let axis = |a: usize| F::new(std::array::from_fn(|k| v[k][a]));
            V3::new(axis(0), axis(1), axis(2))
        };
        let place = of(|r| r.place) + shift;
        let reach = all(self.stage.solid.reach + self.stage.tool.reach + NEAR);
        let apart = self.place - place;
        if !less(apart.norm2(), reach * reach).any() {
            return Vec::new();
        }
        let tool = M3 {
            a: of(|r| r.turn[0]),
            b: of(|r| r.turn[1]),
            c: of(|r| r.turn[2]),
        };
        let (v, w) = (of(|r| r.velocity), of(|r| r.spin));
        let part_from_solid = tool.transposed_times(turn);
        let at = tool.apply_transposed(apart);
        let mut grips = Vec::with_capacity(4 * self.stage.tool.parts.len());
        for part in &self.stage.tool.parts {
            let found = touch(part, self.stage.solid, &part_from_solid, at, tool.c, &mut self.corners);
            if !less(found.gap, all(NEAR)).any() {
                continue;
            }
            let normal = tool.apply(found.normal);
            let tangents = found.tangents.map(|t| tool.apply(t));
            for spot in &found.spots[..found.count] {
                let arm = tool.apply(spot.r);
                let own = super::floor::Spot {
                    r: arm - apart,
                    gap: spot.gap,
                };
                let driven = v + w.cross(arm);
                grips.push(Grip::new(own, normal, tangents, driven, inverse, motion, &self.laws));
            }
        }
        grips
    }
}
