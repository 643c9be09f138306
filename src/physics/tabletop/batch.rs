//! Trials under way, side by side; each sleeps by itself while it rests and its tool is far.

use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use pulp::Simd;

use super::floor::{Spot, floor_spots, lowest};
use super::lanes::{F, MOST_LANES, Mask, V3, less, more, pick};
use super::path::{Row, STEP};
use super::solve::{Floor, FloorImpulses, Grip, Impulse, Laws, Motion, Soft};
use super::touch::{Corners, touch};
use super::trial::{Coefficients, Outcome, Stage, Trial};
use super::turns::{M3, Turn};

/// Rounds of the contact solver per step at most, and the change of a round below which a trial needs no further one,
/// m/s (squared, of the centroid or of the farthest point about it).
const ROUNDS: usize = 8;
const SETTLED: f32 = 4e-10;
/// Overlap that is left alone, m, and the share of the rest that is mended per step.
const SLOP: f32 = 5e-5;
const MEND: f32 = 0.2;
/// Slower than this is at rest, m/s and rad/s (squared).
const STILL: (f32, f32) = (1e-6, 4e-4);
/// Steps between looks whether a trial is at rest.
const LOOK: usize = 4;
/// Room around thing and tool within which they are tested for touch, and beyond what they can close in a step, within which
/// they are in contact, m.
const NEAR: f32 = 0.01;
const CLOSE: f32 = 1e-3;

const H: f32 = STEP as f32;
const INVERSE_H: f32 = (1.0 / STEP) as f32;

/// As many trials as there are lanes.
pub(super) struct Batch<'a, S: Simd> {
    simd: S,
    stage: &'a Stage<'a>,
    /// The last one stands in lanes that are left over.
    lanes: Vec<Trial>,
    count: usize,
    /// The step at which each goes on; `usize::MAX` when it is over.
    wakes: [usize; MOST_LANES],
    place: V3<S>,
    turn: Turn<S>,
    motion: Motion<S>,
    laws: Laws<S>,
    floor: FloorImpulses<S>,
    impulse: V3<S>,
    touched: F<S>,
    shift: V3<S>,
    /// Support-from-tool, where it never changes.
    tool: Option<M3<S>>,
    room: Vec<V3<S>>,
    corners: Corners<S>,
    grips: Vec<Grip<S>>,
    /// Impulses of the tool's parts and spots in the step before, a first guess for the next.
    held: Vec<Impulse<S>>,
}

fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

impl<'a, S: Simd> Batch<'a, S> {
    #[inline(always)]
    pub(super) fn new(simd: S, stage: &'a Stage<'a>, trials: &[Trial]) -> Self {
        let mut lanes: Vec<Trial> = trials.to_vec();
        lanes.resize(S::F32_LANES, trials[trials.len() - 1]);
        let starts: Vec<Isometry3<f64>> = lanes.iter().map(|t| t.start * stage.solid.mesh_from_solid).collect();
        let turns: Vec<UnitQuaternion<f64>> = starts.iter().map(|s| s.rotation).collect();
        let law = |of: fn(&Coefficients) -> f64| F::each(simd, |k| of(&lanes[k].coefficients) as f32);
        let laws = Laws {
            floor: law(|c| c.friction),
            tool: law(|c| c.tool_friction),
            rolling: law(|c| c.rolling),
            restitution: law(|c| c.restitution),
            soft: Soft::new(law(|c| c.yielding.max(1e-4)), H),
        };
        let fixed = lanes.iter().all(|t| !stage.paths[t.path].turns);
        let first = |k: usize| stage.paths[lanes[k].path].row(0);
        let tool = fixed.then(|| matrix(simd, first));
        let zero = V3::zero(simd);
        Self {
            simd,
            stage,
            count: trials.len(),
            wakes: [0; MOST_LANES],
            place: V3::each(simd, |k| single(&starts[k].translation.vector)),
            turn: Turn::each(simd, &turns),
            motion: Motion { v: zero, w: zero },
            laws,
            floor: FloorImpulses::zero(simd),
            impulse: zero,
            touched: zero.x,
            shift: V3::each(simd, |k| single(&lanes[k].shift)),
            tool,
            lanes,
            room: Vec::with_capacity(64),
            corners: Corners {
                thing: Vec::with_capacity(64),
                part: Vec::with_capacity(64),
            },
            grips: Vec::with_capacity(16),
            held: vec![(zero.x, zero.x, zero.x); 4 * stage.tool.parts.len()],
        }
    }

    #[inline(always)]
    pub(super) fn run(mut self) -> Vec<Outcome> {
        let mut last = [0; MOST_LANES];
        for (k, trial) in self.lanes.iter().enumerate() {
            last[k] = (trial.seconds / STEP).round() as usize;
        }
        let mut step = 0;
        for (k, last) in last.iter().enumerate().take(S::F32_LANES) {
            self.sleep(k, 0, *last);
        }
        loop {
            let next = self.wakes[..S::F32_LANES].iter().copied().min().unwrap_or(usize::MAX);
            if next == usize::MAX {
                break;
            }
            step = step.max(next);
            let awake = F::each(self.simd, |k| if self.wakes[k] <= step { 1.0 } else { 0.0 });
            self.advance(step, more(awake, awake.like(0.5)));
            step += 1;
            let still = step.is_multiple_of(LOOK).then(|| self.still());
            for k in 0..S::F32_LANES {
                if self.wakes[k] >= step {
                    continue;
                }
                if step >= last[k] {
                    self.wakes[k] = usize::MAX;
                } else if still.is_some_and(|s| s[k] > 0.0) {
                    self.sleep(k, step, last[k]);
                }
            }
        }
        (0..self.count).map(|k| self.outcome(k)).collect()
    }

    /// 1 where all is at rest.
    #[inline(always)]
    fn still(&self) -> [f32; MOST_LANES] {
        let (v, w) = (self.motion.v.norm2(), self.motion.w.norm2());
        let rests = less(v, v.like(STILL.0)) & less(w, w.like(STILL.1));
        pick(rests, v.like(1.0), v.like(0.0)).to_array()
    }

    /// Lets a trial rest from `step` on until its tool comes near, for good where it does not before `last`.
    #[inline(always)]
    fn sleep(&mut self, k: usize, step: usize, last: usize) {
        let reach = f64::from(self.stage.solid.reach + self.stage.tool.reach + NEAR);
        let at = Vector3::new(
            self.place.x.to_array()[k].into(),
            self.place.y.to_array()[k].into(),
            self.place.z.to_array()[k].into(),
        ) - self.lanes[k].shift;
        let near = self.stage.paths[self.lanes[k].path].first_near(&at, reach, step);
        self.wakes[k] = if near < last {
            near.saturating_sub(2).max(step)
        } else {
            usize::MAX
        };
    }

    fn outcome(&self, k: usize) -> Outcome {
        let of = |v: V3<S>| {
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

    /// One step of the trials that are awake.
    #[inline(always)]
    fn advance(&mut self, step: usize, awake: Mask<S>) {
        let solid = self.stage.solid;
        let turn = self.turn.matrix();
        let inverse = turn.turned_diagonal(solid.inertia.map(|i| 1.0 / i));
        let mut motion = self.motion;
        motion.v = motion.v + V3::all(self.simd, single(&self.stage.gravity)) * H;
        self.grasp(step, &turn, &inverse, &motion);
        let (spots, count) = floor_spots(self.simd, solid, &turn, self.place.z, &mut self.room);
        let spots = &spots[..count];
        for grip in &self.grips {
            grip.resume(&mut motion, &inverse);
        }
        let mut impulses = self.floor;
        let mut floor = Floor::new(spots, &mut impulses, &inverse, &mut motion);
        let reach2 = solid.reach * solid.reach;
        let mut open = awake;
        for _ in 0..ROUNDS {
            let before = motion;
            for grip in &mut self.grips {
                grip.relax(&mut motion, &inverse, &self.laws, open);
            }
            floor.relax(&mut motion, &inverse, &self.laws, INVERSE_H, open);
            let change = (motion.v - before.v)
                .norm2()
                .max((motion.w - before.w).norm2() * reach2);
            open = open & more(change, change.like(SETTLED));
            if !open.any() {
                break;
            }
        }
        self.carry(&turn, &motion, spots, &impulses, awake);
    }

    /// Takes up what a step's impulses did, in the trials that are awake.
    #[inline(always)]
    fn carry(
        &mut self,
        turn: &M3<S>,
        motion: &Motion<S>,
        spots: &[Spot<S>],
        impulses: &FloorImpulses<S>,
        awake: Mask<S>,
    ) {
        let zero = F::all(self.simd, 0.0);
        let mut mend = V3::zero(self.simd);
        let (mut worst, mut given, mut bore) = (zero, mend, zero);
        let hard = more(self.laws.restitution, zero.like(1e-6));
        self.held.fill((zero, zero, zero));
        for grip in &self.grips {
            self.held[grip.number] = grip.kept(awake);
            given = given + grip.given();
            bore = pick(grip.bears(), zero.like(1.0), bore);
            let inside = pick(hard, (-grip.spot.gap - SLOP).positive(), zero);
            mend = V3::pick(more(inside, worst), grip.normal * inside, mend);
            worst = worst.max(inside);
        }
        let bears = more(bore, zero.like(0.5));
        let under = (-lowest(spots) - SLOP).positive();
        // What slides on by itself is carried by the mean of both speeds (the trapezoidal rule): the later one alone would
        // take half a step off every coast. Where the tool bears the speed may jump, and the later one counts.
        let mean = (self.motion.v + motion.v) * 0.5;
        let carried = V3::pick(bears, motion.v, V3::new(mean.x, mean.y, motion.v.z));
        let turned = V3::pick(bears, motion.w, (self.motion.w + motion.w) * 0.5);
        let mut place = self.place + carried * H + mend * MEND;
        place.z = place.z + under * MEND;
        let after = self.turn.advanced(turned, H);
        let spin = if self.stage.solid.ball.is_some() {
            motion.w
        } else {
            carried_spin(self.stage.solid.inertia, turn, &after.matrix(), motion.w)
        };
        self.impulse = V3::pick(awake, self.impulse + given, self.impulse);
        self.touched = pick(awake & bears, self.touched + H, self.touched);
        self.place = V3::pick(awake, place, self.place);
        self.turn.w = pick(awake, after.w, self.turn.w);
        self.turn.v = V3::pick(awake, after.v, self.turn.v);
        self.motion.v = V3::pick(awake, motion.v, self.motion.v);
        self.motion.w = V3::pick(awake, spin, self.motion.w);
        self.floor.keep(awake, impulses);
    }

    /// Contacts with the tool in this step; none where it is far from the thing in every trial.
    #[inline(always)]
    fn grasp(&mut self, step: usize, turn: &M3<S>, inverse: &M3<S>, motion: &Motion<S>) {
        self.grips.clear();
        let stage = self.stage;
        let mut rows: [&Row; MOST_LANES] = [stage.paths[self.lanes[0].path].row(step); MOST_LANES];
        for (row, trial) in rows.iter_mut().zip(&self.lanes) {
            *row = stage.paths[trial.path].row(step);
        }
        let place = V3::each(self.simd, |k| rows[k].place) + self.shift;
        let reach = stage.solid.reach + stage.tool.reach + NEAR;
        let apart = self.place - place;
        let far = apart.norm2();
        if !less(far, far.like(reach * reach)).any() {
            return;
        }
        let tool = self.tool.unwrap_or_else(|| matrix(self.simd, |k| rows[k]));
        let v = V3::each(self.simd, |k| rows[k].velocity);
        let w = match self.tool {
            Some(_) => V3::zero(self.simd),
            None => V3::each(self.simd, |k| rows[k].spin),
        };
        let part_from_solid = tool.transposed_times(turn);
        let at = tool.apply_transposed(apart);
        let speed = (v - motion.v).norm2().sqrt()
            + motion.w.norm2().sqrt() * stage.solid.reach
            + w.norm2().sqrt() * stage.tool.reach;
        let margin = speed * H + CLOSE;
        for (number, part) in stage.tool.parts.iter().enumerate() {
            let found = touch(
                self.simd,
                part,
                stage.solid,
                &part_from_solid,
                at,
                tool.c,
                &mut self.corners,
            );
            let near = less(found.gap, margin);
            if !near.any() {
                continue;
            }
            let normal = tool.apply(found.normal);
            let tangents = [tool.apply(found.tangents[0]), tool.apply(found.tangents[1])];
            for (k, spot) in found.spots[..found.count].iter().enumerate() {
                let arm = tool.apply(spot.r);
                let own = Spot {
                    r: arm - apart,
                    gap: spot.gap,
                };
                let mut grip = Grip::new(own, normal, tangents, v + w.cross(arm), inverse, motion, &self.laws);
                grip.number = 4 * number + k;
                grip.hold(near, self.held[grip.number]);
                self.grips.push(grip);
            }
        }
    }
}

/// Support-from-tool of rows.
#[inline(always)]
fn matrix<'r, S: Simd>(simd: S, of: impl Fn(usize) -> &'r Row) -> M3<S> {
    M3 {
        a: V3::each(simd, |k| of(k).turn[0]),
        b: V3::each(simd, |k| of(k).turn[1]),
        c: V3::each(simd, |k| of(k).turn[2]),
    }
}

/// The angular velocity after the turn of a step: angular momentum is kept, not the velocity.
#[inline(always)]
fn carried_spin<S: Simd>(inertia: [f32; 3], before: &M3<S>, after: &M3<S>, w: V3<S>) -> V3<S> {
    let i = inertia;
    let own = before.apply_transposed(w);
    let momentum = before.apply(V3::new(own.x * i[0], own.y * i[1], own.z * i[2]));
    let own = after.apply_transposed(momentum);
    after.apply(V3::new(
        own.x * (1.0 / i[0]),
        own.y * (1.0 / i[1]),
        own.z * (1.0 / i[2]),
    ))
}
