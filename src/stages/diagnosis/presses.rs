//! Presses as the ladder of laws sees them: force into the support against how far the tool went in, sample by sample.

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::Quantity;
use super::asking::Imagined;
use super::family::{Active, Channel, ChannelKind, Family, Group, Parameter, Sheet};
use super::fit::Fit;
use super::levels::{Level, Number};
use super::predict::Scene;
use super::press_catalogue::{press_laws, scatter};
use super::press_laws::{Memory, Met, lower, slight, sunk};
use super::press_moment::Moment;
use super::press_reads::Read;
use super::press_spots::uneven_pad;
use super::shows_in::TIME;
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::median;
use crate::stages::estimation::support_normal;
use crate::twin::{Evidence, Model};

/// Seconds of one sample.
pub(super) const BIN: f64 = 0.05;
/// What the plain spring leaves open of the force, as a share of it.
pub(super) const EVEN: f64 = 0.01;
/// Presses closer than this are at the same spot, m.
const SPOT: f64 = 0.006;
/// How well one press tells where the surface is, m.
const SURFACE: f64 = 5e-5;
/// Log standard deviation of a body's stiffness, and of that of a spot about it.
const STIFF: [f64; 2] = [0.5, 0.08];

/// Force, N, by which the plain model may be off where the tool has met the surface, and the way over which that comes up, m.
const STEP: (f64, f64) = (0.04, 5e-5);
/// Parts of a sample in which the tool meets the surface or leaves it: its mean force is not that at its mean depth.
pub(super) const PARTS: usize = 5;
/// All presses of one capture.
#[derive(Clone)]
pub struct Presses {
    pub(super) sheet: Sheet,
    pub(super) moments: Vec<Vec<Moment>>,
    /// Spot and body of each group.
    pub(super) spots: Vec<usize>,
    pub(super) bodies: Vec<usize>,
    /// Stiffness of each body in the twin, N/m.
    pub(super) stiffness: Vec<f64>,
    pub(super) names: Vec<String>,
    /// How many of the groups were measured: what could be done next comes after them.
    pub(super) done: usize,
    /// How the tool met the surface in each group.
    pub(super) met: Vec<Met>,
    /// How deep each group went from where it met the surface, m.
    pub(super) reached: Vec<f64>,
    /// Deepest earlier press at the same spot, and anywhere on the body, m.
    pub(super) past: Vec<[f64; 2]>,
    /// Where each body was pressed first, and each group from there, m.
    middles: Vec<Point2<f64>>,
    pub(super) places: Vec<Vector2<f64>>,
    /// Where each group met the surface, world, m, and which way is up.
    pub(super) spots_at: Vec<Point3<f64>>,
    pub(super) up: Vector3<f64>,
    /// How many spots there are.
    pub(super) all_spots: usize,
    /// Deepest press of all, m.
    pub deepest: f64,
    /// Largest force of all, N, and the step to which it is rounded.
    pub largest: f64,
    step: f64,
}

/// Bodies and spots that were pressed so far, with how deep.
#[derive(Default)]
struct Known {
    bodies: Vec<(String, f64)>,
    spots: Vec<(usize, Point3<f64>, f64)>,
    /// Where the tool met each body at first, m.
    levels: Vec<f64>,
}

impl Known {
    /// The parameters of the plain model.
    fn base(&self) -> Vec<Parameter> {
        let of = |count: usize, sd: f64| (0..count).map(move |_| Parameter::amplitude("log_stiffness", "1", sd));
        let mut base: Vec<Parameter> = of(self.bodies.len(), STIFF[0])
            .chain(of(self.spots.len(), STIFF[1]))
            .collect();
        // Where the tool met each body at first, and the slope of its face.
        for level in &self.levels {
            base.push(Parameter {
                unit: "m",
                ..Parameter::place("surface", *level, 0.01)
            });
            base.extend([0, 1].map(|_| Parameter::amplitude("slope", "1", 0.05)));
        }
        // Path and force of the tool are read by different instruments.
        base.push(Parameter::amplitude("delay", "s", 0.003));
        // How a tip meets a surface is not quite that of a spring.
        base.push(Parameter::amplitude("step", "N", STEP.0));
        base
    }
}

impl Presses {
    /// The same where every force is off by up to `lost` (N, standard deviation) since finer ones are rounded away.
    pub fn rounded(mut self, lost: f64) -> Self {
        self.sheet.kinds.iter_mut().for_each(|k| k.sigma = k.sigma.hypot(lost));
        self.step = 12.0_f64.sqrt() * lost;
        self
    }

    /// What a capture has of them; nothing where none was measured.
    pub fn new(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<Self> {
        let mut reads: Vec<Read> = Vec::new();
        for interaction in capture.interactions.iter().filter(|i| i.kind == Kind::Press) {
            let cut = segmented.iter().find(|s| s.interaction == interaction.name);
            reads.extend(Read::of(&Scene {
                capture,
                interaction,
                segmented: cut,
                model,
            }));
        }
        reads.sort_by(|a, b| a.time[0].total_cmp(&b.time[0]));
        let begin = |i: &Interaction| i.force.as_ref().and_then(|f| f.time.first().copied());
        let zero = capture
            .interactions
            .iter()
            .filter_map(begin)
            .fold(f64::INFINITY, f64::min);
        let mut out = Self {
            sheet: Sheet {
                scatter: scatter(),
                ..Sheet::default()
            },
            moments: Vec::new(),
            spots: Vec::new(),
            bodies: Vec::new(),
            stiffness: Vec::new(),
            names: Vec::new(),
            done: 0,
            met: Vec::new(),
            reached: Vec::new(),
            past: Vec::new(),
            middles: Vec::new(),
            places: Vec::new(),
            spots_at: Vec::new(),
            up: support_normal(capture, model).into_inner(),
            all_spots: 0,
            deepest: 0.0,
            largest: 0.0,
            step: 0.0,
        };
        let mut known = Known::default();
        let mut noise = Vec::new();
        for read in &reads {
            out.add(read, zero, &mut known);
            noise.push(read.noise);
        }
        let sigma = median(&noise)?.max(1e-4);
        let kind = |quantity, sigma, jitter| ChannelKind {
            quantity,
            sigma,
            jitter,
        };
        out.done = out.moments.len();
        out.sheet.kinds = vec![
            kind(Quantity::Force, sigma, 0.12),
            kind(Quantity::Position, SURFACE, 0.0),
        ];
        out.sheet.base = known.base();
        out.names = known.bodies.iter().map(|b| b.0.clone()).collect();
        out.sheet.laws = press_laws(&out);
        Some(out)
    }

    /// Deepest press before a group at its spot, and anywhere on its body, from where the surface was at first, m.
    fn past(&self, group: usize, active: &[Active]) -> [f64; 2] {
        if active.iter().all(|a| lower(a, [f64::INFINITY; 2]) == 0.0) {
            return self.past[group];
        }
        let mut all: Vec<(usize, f64)> = Vec::new();
        for g in (0..group.min(self.done)).chain([group]) {
            let deepest = |here: &dyn Fn(usize) -> bool| {
                let same = all.iter().filter(|(other, _)| here(*other));
                same.map(|(_, depth)| *depth).fold(0.0, f64::max)
            };
            let past = [
                deepest(&|other| self.spots[other] == self.spots[g]),
                deepest(&|other| self.bodies[other] == self.bodies[g]),
            ];
            if g == group {
                return past;
            }
            all.push((g, self.reached[g] + sunk(past, active)));
        }
        [0.0; 2]
    }

    fn add(&mut self, read: &Read, zero: f64, known: &mut Known) {
        let contact = read.contact;
        let (moments, force) = read.moments(zero);
        // The last sample above the surface has all of its neighbours on the way down.
        let above = moments.iter().position(|m| m.depth > 0.0).map(|i| i.saturating_sub(1));
        self.met.push(Met {
            speed: above.map_or(0.0, |i| moments[i].rate.max(0.0)),
            force: read.told_by,
        });
        let reached = moments.iter().map(|m| m.depth).fold(0.0, f64::max);
        let body = known.bodies.iter().position(|b| b.0 == read.target).unwrap_or_else(|| {
            known.bodies.push((read.target.clone(), 0.0));
            self.stiffness.push(read.stiffness);
            known.levels.push(contact);
            self.middles.push(read.at.xy());
            known.bodies.len() - 1
        });
        let near = |s: &(usize, Point3<f64>, f64)| s.0 == body && (s.1.xy() - read.at.xy()).norm() < SPOT;
        let spot = known.spots.iter().position(near).unwrap_or_else(|| {
            known.spots.push((body, read.at, 0.0));
            known.spots.len() - 1
        });
        self.reached.push(reached);
        self.past.push([known.spots[spot].2, known.bodies[body].1]);
        known.spots[spot].2 = known.spots[spot].2.max(reached);
        known.bodies[body].1 = known.bodies[body].1.max(reached);
        self.deepest = self.deepest.max(reached);
        self.largest = force.iter().copied().fold(self.largest, f64::max);
        let starts: Vec<bool> = (0..moments.len())
            .map(|i| i == 0 || moments[i].step > 1.5 * BIN)
            .collect();
        let change = (0..force.len())
            .map(|i| if starts[i] { 0.0 } else { force[i] - force[i - 1] })
            .collect();
        let off = moments.iter().map(|m| {
            if m.depth > 0.0 {
                read.stiffness * read.wanders
            } else {
                0.0
            }
        });
        let aside = force.iter().zip(off).map(|(f, off)| (EVEN * f).hypot(off)).collect();
        let loads = Channel {
            kind: 0,
            measured: force,
            starts,
            change,
            aside,
        };
        let surface = Channel {
            kind: 1,
            measured: vec![contact],
            starts: vec![true],
            change: vec![0.0],
            aside: vec![0.0],
        };
        self.sheet.groups.push(Group {
            name: read.interaction.clone(),
            held_out: read.held_out,
            channels: vec![loads, surface],
        });
        self.moments.push(moments);
        self.spots.push(spot);
        self.bodies.push(body);
        self.places.push(read.at.xy() - self.middles[body]);
        self.spots_at.push(read.at + self.up * (reached - read.below));
        self.all_spots = known.spots.len();
    }
}

impl Family for Presses {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn negligible(&self, law: usize, values: &[f64]) -> bool {
        // A step at first contact that is less than one of the sensor's own is none.
        let rounded = self.sheet.laws[law].cause == "preload" && values[0].abs() < self.step;
        rounded || slight(self.sheet.laws[law].form, values)
    }

    fn samples_are_free(&self) -> bool {
        true
    }

    /// Where the law of the spring itself is another; what it holds beside that is how its presses are read.
    fn levels(&self, fit: &Fit) -> Vec<Level> {
        let curved = [
            "hardening-stiffness",
            "second-stage",
            "preload",
            "guide-friction",
            "snap-through",
            "force-saturation",
            "stress-relaxation",
        ];
        if !fit.laws.iter().any(|l| curved.contains(&self.sheet.laws[*l].cause)) {
            return Vec::new();
        }
        let each = self.names.iter().enumerate();
        each.filter_map(|(k, name)| Level::of(fit, k, name, Number::Stiffness))
            .collect()
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let (body, bodies) = (self.bodies[group], self.stiffness.len());
        let level = base[body] + base[bodies + self.spots[group]] + scatter[2];
        let stiffness = self.stiffness[body] * level.exp();
        let past = self.past(group, active);
        // Laws of another thing do nothing here.
        let another = |a: &&Active| self.names.iter().any(|n| *n == a.law.place && *n != self.names[body]);
        let active: Vec<Active> = active.iter().filter(|a| !another(a)).cloned().collect();
        let active = active.as_slice();
        let mut memory = Memory::new(stiffness, self.deepest, past);
        let [delay, step] = [base[base.len() - 2], base[base.len() - 1]];
        // What is read late tells the surface late.
        let late = self.met[group].late(stiffness, delay, active);
        let mut before = None;
        let read = self.moments[group].iter().map(|m| {
            let count = if m.parts.is_some() { PARTS } else { 1 };
            let taken = before;
            let one = |m: Moment| {
                before = Some(m.time);
                let shift = scatter[0] - late + delay * m.rate;
                let meets = step * (1.0 - (-(m.depth - shift).max(0.0) / STEP.1).exp());
                memory.force(&m, shift, active) + meets
            };
            m.each(taken).map(one).sum::<f64>() / count as f64
        });
        let mut out: Vec<f64> = read.map(|f| f + scatter[1]).collect();
        let face = &base[bodies + self.all_spots + 3 * body..][..3];
        let slope = Vector2::new(face[1], face[2]).dot(&self.places[group]);
        out.push(face[0] + slope + sunk(past, active) + scatter[3] + late);
        out
    }

    fn taken_up(&self, plain: &Fit) -> Option<Evidence> {
        uneven_pad(self, plain)
    }

    fn imagined(&self) -> Option<Imagined> {
        self.with_touches()
    }

    fn samples_are(&self) -> &'static str {
        "means over 50 ms"
    }

    fn covariates(&self, group: usize) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        let of = |value: &dyn Fn(&Moment) -> f64| {
            let each = self.moments[group]
                .iter()
                .map(|m| if m.depth > 0.0 { value(m) } else { f64::NAN });
            each.chain([f64::NAN]).collect::<Vec<f64>>()
        };
        vec![
            ("depth", "m", of(&|m| m.depth)),
            ("rate of the press", "m/s", of(&|m| m.rate)),
            (TIME, "s", of(&|m| m.time)),
        ]
    }
}
