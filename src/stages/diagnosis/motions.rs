//! Motions of a joint as the ladder of laws sees them: the load of the tool along the freedom, sample by sample, against
//! where the joint is and how fast it moves.
//!
//! Plain model: `load = J q'' + f sgn(q')` while it moves, the sign rounded off below a creep speed, and anything up to
//! `f` while it stands. A joint that stands tells only where the load is more than dry friction can hold, so there the
//! prediction is the measured load, cut to what friction allows.

use nalgebra::Vector3;

use super::Quantity;
use super::asking::Imagined;
use super::family::{Active, Channel, ChannelKind, Covariate, Family, Group, Parameter, Sheet};
use super::fit::Fit;
use super::levels::{Level, Number};
use super::motion_bars;
use super::motion_blur::{Open, gains, inertia_of};
use super::motion_faced::{both_ways, chord};
use super::motion_free::Free;
use super::motion_history::{Turning, bonded, loose};
use super::motion_laws::{Moved, TOLD, base_of, effort, form, held, motion_laws, open_at_rest, set_in, sliding};
use super::motion_reads::{BIN, CUTS, Read, largest_component, read_all, scatter_of};
use super::motion_sensor::{lagging, late, read};
use super::motion_stops::{Stop, mark_stops, weighed};
use super::motion_touches::Handle;
use super::shows_in::{ACCELERATION, BACK, DIRECTION, TIME};
use crate::capture::{Capture, Segmented};
use crate::math::{median, quantile};
use crate::stages::estimation::JointLoad;
use crate::twin::{Evidence, Joint, JointKind, Model};

/// Share of the load that the arm of the force, the same in all motions, may be off by.
pub(super) const EVEN: f64 = 0.015;
/// Share of the fast speeds below which the direction of friction is not sure.
const SLOW: f64 = 0.06;
/// Share of the range below which a play is not told from how motions start: damped drawers of MuJoCo start as if they had one of 0.016.
const RESOLVED: f64 = 0.02;
/// Step of the sensor over dry friction from which on its rounding is no noise.
const COARSE: f64 = 0.5;
/// Logarithm of what a joint may rub over what is read of it where that is cut off.
const CUT: f64 = 0.7;
/// Standard deviations by which what is read of a joint that stands may be above its friction.
const HELD: f64 = 2.0;
/// Fewest samples that move, and fewest motions.
const FEWEST: (usize, usize) = (20, 3);

/// How large things are in these motions.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// N·m or N.
    pub load: f64,
    /// Largest force of the tool along the freedom, N.
    pub force: f64,
    /// Of its components in the room where it moves, the largest but for noise, N.
    pub component: f64,
    /// rad/s or m/s.
    pub speed: f64,
    /// Lowest and highest position, rad or m.
    pub range: [f64; 2],
    pub turns: bool,
    /// Motions lead both ways.
    pub faces: bool,
    /// What a finger that touched nothing read.
    pub free: Free,
}

/// All motions of one joint.
#[derive(Clone)]
pub struct Motions {
    pub(super) joint: String,
    pub(super) sheet: Sheet,
    pub(super) moments: Vec<Vec<Moved>>,
    pub(super) friction: f64,
    /// Dry friction that the twin has, N·m or N.
    told: Option<f64>,
    pub(super) slow: f64,
    /// Inertia by which the load goes with the acceleration, roughly, kg·m² or kg.
    inert: f64,
    /// Lowest and highest position, rad or m.
    pub(super) ends: [f64; 2],
    pub(super) turns: bool,
    /// A weight can load it.
    weighed: bool,
    /// What a finger that touched nothing read.
    free: Free,
    /// N·m per N, usually.
    pub(super) lever: f64,
    /// When the first motion began, s, of the capture's clock.
    pub(super) zero: f64,
    pub(super) turning: Turning,
    /// Where it can be taken hold of; whether its ends are known.
    pub(super) handle: Option<Handle>,
    pub(super) bounded: bool,
    /// Of each group that was measured whether it was struck and swung on by itself.
    pub(super) struck: Vec<bool>,
    /// Only the path of a hand tells where it was.
    by_hand: bool,
    /// How well it is known where its position is 0, rad or m.
    counted_from: f64,
    /// Its forces are rounded to steps as large as they are.
    coarse: bool,
}

/// Joints whose motions can be judged, one family each.
pub fn of_all_joints(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Motions> {
    let joints = model.twin.joints();
    let kinds = joints.filter(|j| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic));
    kinds
        .filter_map(|j| {
            let reads = read_all(capture, segmented, model, j);
            let motions = Motions::new(&reads, j, &capture.gravity, |f| Free::of(capture, segmented, f))?;
            Some(Motions {
                handle: Handle::of(capture, j, &reads),
                ..motions
            })
        })
        .collect()
}

impl Motions {
    fn new(reads: &[Read], joint: &Joint, gravity: &Vector3<f64>, free: impl Fn(f64) -> Free) -> Option<Self> {
        let loads = || reads.iter().flat_map(|r| r.loads.iter());
        let speeds: Vec<f64> = loads().map(|l| l.speed.abs()).collect();
        let fast = quantile(&speeds, 0.95)?;
        let slow = SLOW * fast;
        let moving: Vec<&JointLoad> = loads().filter(|l| l.speed.abs() > slow).collect();
        let turns = joint.kind == JointKind::Revolute;
        if moving.len() < FEWEST.0 || reads.len() < FEWEST.1 || fast < if turns { 0.02 } else { 2e-3 } {
            return None;
        }
        let sizes: Vec<f64> = moving.iter().map(|l| l.load.abs()).collect();
        let (friction, largest) = (median(&sizes)?.max(1e-6), quantile(&sizes, 0.95)?.max(1e-6));
        let of = |value: &dyn Fn(&JointLoad) -> f64| moving.iter().map(|l| value(l)).collect::<Vec<f64>>();
        let (places, lever) = (of(&|l| l.position), median(&of(&|l| l.lever))?);
        let free = free(friction / lever);
        let felt = |l: &JointLoad| l.load / l.lever;
        let scale = Scale {
            load: largest,
            // A single reading may stray.
            force: quantile(&loads().map(|l| felt(l).abs()).collect::<Vec<_>>(), 0.998)?,
            component: largest_component(reads.iter().map(|r| r.loads.as_slice()), slow),
            speed: fast,
            range: [quantile(&places, 0.0)?, quantile(&places, 1.0)?],
            turns,
            faces: both_ways(reads),
            free,
        };
        let noise = median(&reads.iter().map(|r| r.noise).collect::<Vec<f64>>())? * lever;
        let zero = loads().map(|l| l.time).fold(f64::INFINITY, f64::min);
        let mut out = Self {
            joint: joint.name.clone(),
            sheet: Sheet {
                groups: Vec::new(),
                kinds: vec![ChannelKind {
                    quantity: if turns { Quantity::Torque } else { Quantity::Force },
                    sigma: noise.max(1e-3 * largest),
                    jitter: 0.12,
                }],
                base: base_of(fast, turns),
                scatter: scatter_of(lever),
                laws: motion_laws(&joint.name, &scale),
            },
            moments: Vec::new(),
            friction,
            told: joint.friction.as_ref().map(|f| f.value).filter(|f| *f > 0.0),
            slow,
            inert: inertia_of(reads, slow),
            ends: scale.range,
            turns,
            weighed: weighed(joint, gravity),
            free,
            lever,
            zero,
            turning: Turning::new(RESOLVED * (scale.range[1] - scale.range[0])),
            handle: None,
            struck: Vec::new(),
            bounded: joint.limits.is_some(),
            by_hand: reads.iter().any(|r| r.by_hand),
            counted_from: reads.first().map_or(0.0, |r| r.zero),
            coarse: false,
        };
        for read in reads {
            out.add(read);
        }
        mark_stops(&mut out.moments, reads.iter().map(|r| (r.reach(), r.jitter)));
        out.judge_blows(reads);
        let gains: Vec<f64> = out.moments.iter().flatten().map(|m| m.gain.abs()).collect();
        let gain = quantile(&gains, 0.9)?.max(1e-6);
        out.sheet.base[1] = Parameter::positive("inertia", out.sheet.base[1].unit, 2.0 * largest / gain);
        Some(out)
    }

    /// A blow on a stop makes all that holds the part swing, and so does one of a finger that lets it swing on.
    fn judge_blows(&mut self, reads: &[Read]) {
        self.struck = reads.iter().map(|r| r.swings_on(self.slow)).collect();
        let struck = self.struck.iter().filter(|s| **s).count();
        if 2 * struck > reads.len() || self.moments.iter().flatten().any(|m| m.stop == Stop::Hit) {
            self.sheet.laws.retain(|l| l.form != form::LOOSE);
        }
    }

    /// The same where every force is off by up to `lost` (N, standard deviation) since finer ones are rounded away.
    pub fn rounded(mut self, lost: f64) -> Self {
        let kind = &mut self.sheet.kinds[0];
        kind.sigma = kind.sigma.hypot(lost * self.lever);
        self.coarse = lost * 12.0_f64.sqrt() * self.lever > COARSE * self.friction;
        self
    }

    /// The joint that they are of.
    pub fn joint(&self) -> &str {
        &self.joint
    }

    fn add(&mut self, read: &Read) {
        let (l, faced) = (&read.loads, chord(&read.loads));
        let (mut travelled, mut rests) = (0.0_f64, 0.0);
        let mut moments = Vec::with_capacity(l.len());
        self.turning.begin();
        let gains = gains(l, &read.halves, read.jitter);
        let open: Vec<Open> = (0..l.len())
            .map(|i| Open::at(read, &gains, i, [self.slow, self.friction, self.inert]))
            .collect();
        for i in 0..l.len() {
            let turned = i > 0 && l[i].speed * l[i - 1].speed < 0.0;
            let still = l[i].speed.abs() < self.slow;
            rests = if still { rests + BIN } else { 0.0 };
            // Slip since it last stood or turned back.
            travelled = if turned || rests > 2.0 * BIN { 0.0 } else { travelled };
            travelled += if i > 0 {
                (l[i].position - l[i - 1].position).abs()
            } else {
                0.0
            };
            let (back, turned_back) = self.turning.back(l[i].position, l[i].speed, still);
            moments.push(Moved {
                time: l[i].time - self.zero,
                position: l[i].position,
                ends: self.ends,
                doubt: read.jitter,
                speed: l[i].speed,
                gain: gains[i],
                load: l[i].load,
                lever: l[i].lever,
                way: l[i].way,
                faced,
                slip: travelled,
                back,
                turned_back,
                began: self.turning.began(l[i].position),
                reached: self.turning.reached(l[i].position),
                still,
                unsure: open[i].unsure,
                stop: Stop::None,
            });
        }
        let anew = |i: usize| i == 0 || l[i].time - l[i - 1].time > 1.5 * BIN;
        let starts: Vec<bool> = (0..l.len()).map(anew).collect();
        let change = (0..l.len()).map(|i| if starts[i] { 0.0 } else { l[i].load - l[i - 1].load });
        self.sheet.groups.push(Group {
            name: read.interaction.clone(),
            held_out: read.held_out,
            channels: vec![Channel {
                kind: 0,
                measured: l.iter().map(|l| l.load).collect(),
                change: change.collect(),
                aside: open.iter().map(|o| o.aside).collect(),
                starts,
            }],
        });
        self.moments.push(moments);
    }
}

impl Family for Motions {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let dry = self.friction * (base[0] + scatter[0]).exp();
        let delay = base[2] + late(active);
        let one = |(m, swings): (&Moved, f64)| {
            let m = m.later(delay);
            let smooth = base[1] * m.gain + effort(&m, active) + swings;
            let left = m.unread(active) - smooth - scatter[1];
            let rubs = if m.still || m.unsure {
                // What comes to rest does not stick yet.
                let stops = !m.still && m.speed * m.gain < 0.0;
                let bound = if stops {
                    dry * sliding(&m, active).min(1.0)
                } else {
                    dry * held(&m, active) + bonded(&m, active)
                };
                // A hand that stopped may hold all that friction can, and noise is no more friction.
                let open = || HELD * self.sheet.kinds[0].sigma + open_at_rest(&m, active);
                let bound = bound + if m.still { open() } else { 0.0 };
                left.clamp(-bound, bound)
            } else {
                (dry * sliding(&m, active) + bonded(&m, active)) * set_in(m.speed / base[3].exp())
            };
            smooth + m.stop.lets(rubs, left)
        };
        let moments = &self.moments[group];
        let exerted: Vec<f64> = moments.iter().zip(loose(moments, active)).map(one).collect();
        let told = lagging(moments, exerted, active);
        let read = |(m, load): (&Moved, f64)| read(&m.later(delay), load, active) + scatter[1];
        moments.iter().zip(told).map(read).collect()
    }

    /// What the twin's own numbers have a place for was told apart from friction before.
    fn levels(&self, fit: &Fit) -> Vec<Level> {
        let told = fit.laws.iter().all(|l| TOLD.contains(&self.sheet.laws[*l].form));
        let against = self.told.filter(|_| !told).map(|f| (self.friction / f).ln());
        let level = Level::of(fit, 0, &self.joint, Number::JointFriction);
        Vec::from_iter(level.zip(against).map(|(level, by)| level.shifted(by)))
    }

    fn imagined(&self) -> Option<Imagined> {
        self.with_touches()
    }

    /// A force of a step or two is read as the one or the other, by where the edge lies: that goes with all it depends on.
    fn shows(&self, _law: usize) -> bool {
        !self.coarse
    }

    fn afresh(&self, law: usize) -> Vec<f64> {
        let cut = self.sheet.laws[law].form == form::SATURATION_ROOM;
        let more = |k: usize| if cut && k == 0 { CUT } else { 0.0 };
        (self.base().iter().enumerate().map(|(k, p)| p.centre + more(k))).collect()
    }

    fn passes_all_places(&self) -> bool {
        true
    }

    fn commonness(&self, law: usize) -> f64 {
        motion_bars::commonness(self.sheet.laws[law].form, self.weighed, &self.free)
    }

    /// A small play is like the start of any motion; a range that ends where the force usually is, is friction.
    fn negligible(&self, law: usize, values: &[f64]) -> bool {
        let form = self.sheet.laws[law].form;
        let plays = matches!(form, form::BACKLASH | form::BACKLASH_ANEW)
            && values[1].exp() < RESOLVED * (self.ends[1] - self.ends[0]);
        plays
            || motion_bars::usual(form, values)
            || form == form::SATURATION_ROOM
                && values[0].exp() < CUTS * self.usual()
                && !self.goes_by_axes(values[0].exp())
    }

    fn may_be_negligible(&self, law: usize, values: &[f64], sds: &[f64]) -> bool {
        let form = self.sheet.laws[law].form;
        let less = values.first().zip(sds.first()).map(|(v, sd)| v - sd);
        self.negligible(law, values) || less.is_some_and(|v| motion_bars::usual(form, &[v]))
    }

    fn refuted(&self, law: usize, values: &[f64]) -> Option<Evidence> {
        motion_bars::refuted(self.sheet.laws[law].form, values, &self.free)
    }

    fn named_from(&self, law: usize, values: &[f64]) -> f64 {
        motion_bars::named_from(self.sheet.laws[law].form, values)
    }

    /// The arm of a force is the same in all motions, and off by the same share.
    fn common_doubt(&self) -> f64 {
        if self.by_hand { EVEN } else { 0.0 }
    }

    fn place_doubt(&self) -> f64 {
        self.counted_from
    }

    fn samples_are(&self) -> &'static str {
        "means over 40 ms"
    }

    fn covariates(&self, group: usize) -> Vec<Covariate> {
        let units = if self.turns { ["rad", "rad/s"] } else { ["m", "m/s"] };
        vec![
            ("joint position", units[0], self.told(group, &|m| m.position)),
            ("joint speed", units[1], self.told(group, &|m| m.speed.abs())),
            (TIME, "s", self.told(group, &|m| m.time)),
        ]
    }

    fn besides(&self, group: usize) -> Vec<Covariate> {
        vec![(DIRECTION, "1", self.told(group, &|m| m.speed.signum()))]
    }

    fn only_shown(&self, group: usize, _law: Option<(usize, &[f64])>) -> Vec<Covariate> {
        let unit = if self.turns { ["rad/s²", "rad"] } else { ["m/s²", "m"] };
        vec![
            (ACCELERATION, unit[0], self.told(group, &|m| m.gain)),
            (BACK, unit[1], self.told(group, &|m| m.back)),
        ]
    }
}
