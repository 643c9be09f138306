//! One push, sample by sample: what was read, beside everything that a law of friction, of the table or of the sensor
//! may depend on.

use nalgebra::{UnitQuaternion, Vector2, Vector3};

use super::blows::Blow;
use super::family::{Channel, Group};
use super::predict::Scene;
use super::push_history::{History, TurnedBack};
use super::push_loads::{borne, foretold_load, lade};
use super::push_motion::{Motion, approach, drawn_back, going, going_on, impact, leaves, rise, tool_turn};
use super::push_ringing::{self, Ringing};
use super::push_windows::{beyond_noise, windows};
use super::rubbing::{Rubbing, rubbing};
use super::slide_touches::flies;
use crate::base::Estimate;
use crate::capture::Interaction;
use crate::math::median;
use crate::physics::Hold;
use crate::stages::estimation::{action_of, replay_push, travel_direction, tumbles};

/// Seconds of one sample.
const BIN: f64 = 0.02;
/// Share of the usual speed above which it moves steadily.
const STEADY: f64 = 0.7;
/// A tool may set out slowly, over so much slip, m, and at this share of the usual speed or more.
const SETS_OUT: f64 = 6e-3;
const SLOW: f64 = 0.06;
/// Share of the body's speed with which the tool goes on at least while it moves that.
const GOES_ON: f64 = 0.2;
/// Slip after the force rose from which on the model speaks, m: before that the finger's tip gives way.
const SETTLED: f64 = 1e-4;
/// What the plain model leaves open of the force in each window, as a share of it.
const EVEN: f64 = 0.01;
/// What it leaves open of the force that speeds the mass up: when exactly the tool did is known less well.
const HURRIED: f64 = 0.5;
/// How well the direction of the surface at the contact is known, rad; and the way along which a hand leads that holds on.
const DIRECTION: f64 = 0.15;
const LED: f64 = 0.03;
/// Seconds in which the blow of a tool that bounces off dies down to a third.
pub const RINGING: f64 = 0.1;
/// Share of a ringing that is none of one rate and decay.
const UNEVEN: f64 = 0.25;
/// Mean resultant length of doubled headings from which on all go along one line: half of them may be 20 degrees off the others.
const ONE_LINE: f64 = 0.94;
/// Seconds after which what was pushed is free, and the share of the usual force from which on a finger that stopped still presses.
const FREED: f64 = 0.6;
const PRESSES: f64 = 0.2;
/// Everything that a law may depend on at one moment.
#[derive(Clone, Debug)]
pub struct State {
    /// Seconds since the capture began.
    pub time: f64,
    /// Seconds for which the body had not been moved before.
    pub wait: f64,
    /// The tool moves the body.
    pub contact: bool,
    /// The first push of this body in the capture.
    pub first: bool,
    /// Seconds since the tool met the body, and how long the stretch lasts that this stands for.
    pub since: f64,
    pub span: f64,
    /// Slip since this push began, m.
    pub slip: f64,
    /// Slip since the capture began, m.
    pub worn: f64,
    /// Mean speed of what rubs, m/s: the centre's with the turning about it.
    pub speed: f64,
    /// How far it has turned since this push began, rad.
    pub turned: f64,
    /// Unit direction in which it moves, plane of the support.
    pub heading: Vector2<f64>,
    /// Position of its centre, plane of the support, m.
    pub at: Vector2<f64>,
    /// How far it has turned about the normal since the capture began, rad.
    pub turn: f64,
    /// What the table bears over the weight: a hand that holds may press down, or take weight off, and a finger does so by its friction.
    pub loaded: f64,
    /// Force of the tool in the plain model, N.
    pub force: Vector2<f64>,
    /// Force that speeds its mass up, along its heading, N.
    pub inertia: f64,
    /// The most of it, N, just before and after, of a hand that leads it: where that speeds up and slows down is smoothed.
    pub hurried: f64,
    /// Size of what may still ring from the blow of the tool, N.
    pub ringing: f64,
    /// The two phases of how the force rings, N.
    pub phases: [f64; 2],
    /// World-from-tool.
    pub tool: UnitQuaternion<f64>,
    /// By how much the tool is turned about the normal from how it was held before, rad; nought in what was measured.
    pub twist: f64,
    /// Doubt of the direction of friction that the noise of a path makes, rad.
    pub veer: f64,
    /// A hand holds it rigidly, and leads it.
    pub led: bool,
}

impl State {
    /// How far the direction of the force goes astray, as a share of that of a force through a surface that is known so well.
    pub fn astray(&self) -> f64 {
        if self.led { LED / DIRECTION } else { 1.0 }
    }
}

/// One push, ready for the family.
pub struct Observed {
    /// Whose friction is felt: the body, with what moved along with it.
    pub body: String,
    /// Normal load, N, and whether it was weighed.
    pub load: f64,
    pub weighed: bool,
    /// A hand held it, which may press down or take weight off as it likes, or something known lay on it.
    pub held: bool,
    pub noise: f64,
    pub largest: f64,
    pub along: Vector2<f64>,
    pub states: Vec<State>,
    /// How the tool met it.
    pub blow: Blow,
    pub(super) measured: Vec<Vector2<f64>>,
    pub(super) spread: Vec<f64>,
    pub(super) name: String,
    pub(super) held_out: bool,
}

impl Observed {
    pub fn of(scene: &Scene, plane: &[Vector3<f64>; 2], zero: f64, history: &mut History) -> Option<Self> {
        let (interaction, model) = (scene.interaction, scene.model);
        let action = action_of(scene.capture, interaction, scene.segmented, model)?;
        let body = model.twin.body_of(&action.target).filter(|b| b.links.len() == 1)?;
        let link = body.links.first()?;
        let normal = action.normal.into_inner();
        if interaction.tracks.get(&link.name).is_some_and(|t| tumbles(t, &normal)) {
            return None;
        }
        let Rubbing { whose, load, laden } = rubbing(scene, link, action.gravity)?;
        let direction = travel_direction(&action)?;
        let (_, found) = replay_push(model, interaction, scene.segmented, &action, 0.0, 3)?;
        let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&plane[0]), v.dot(&plane[1]));
        let along = flat(&direction).try_normalize(1e-6)?;
        let (time, force, noise) = scene.raw_force(BIN)?;
        let mut motion = Motion::of(&found, link, plane)?;
        if let Some(track) = interaction.tracks.get(&link.name) {
            motion.led_by(track, link, plane);
        }
        let touched = motion.touched_by(&found, scene.segmented.filter(|_| action.tool.hold != Hold::Push))?;
        let [begun, onset] = rise(&time, (&force, noise?), &flat, &along, &found, touched)?;
        let last = history.of(&link.name);
        let wait = (onset - last.map_or(zero, |l| l.0)).max(0.0);
        let past = Past {
            zero,
            wait,
            begun,
            bristles: history.bristles,
            first: last.is_none(),
            worn: last.map_or(0.0, |l| l.1) + history.slid_before(&link.name),
            strained: scene.segmented.is_some_and(|s| s.preload.is_some()),
            drawn: interaction
                .tracks
                .get(&link.name)
                .is_some_and(|track| drawn_back(track, &(plane[0] * along.x + plane[1] * along.y), touched.1)),
        };
        let (mut states, measured, slip) = moments(
            interaction,
            (&time, &force),
            (&motion, onset, touched),
            &past,
            plane,
            &along,
        );
        history.note(&link.name, touched.1, slip);
        if states.iter().filter(|s| s.contact).count() < 6 {
            return None;
        }
        let mass = link.mass.as_ref().map_or(0.3, |m| m.value);
        let mut blow = Blow {
            interaction: interaction.name.clone(),
            held_out: interaction.held_out,
            came: going(interaction, plane, &along, [onset, touched.1]).unwrap_or(0.0),
            wait,
            first: last.is_none(),
            ..impact(&time, &force, (&motion, touched.1), onset, mass)
        };
        blow.rings = ringing(scene, &flat, &along, [onset, touched.1], blow.swings);
        ring(&mut states, &blow, onset - zero, mass * laden);
        borne(&mut states, scene, &normal, load);
        lade(&mut states, mass, laden, foretold_load(scene, link, &found.carried));
        let (states, measured, spread) = windows(&states, &measured, &along, noise?);
        let sizes = force.iter().map(|f| flat(f).norm());
        let largest = sizes.filter(|f| f.is_finite()).fold(0.0, f64::max);
        Some(Self {
            body: whose,
            load,
            weighed: link.mass.as_ref().is_some_and(weighed),
            held: action.tool.hold != Hold::Push || laden > 1.0,
            noise: noise?,
            largest,
            along,
            states,
            blow,
            measured,
            spread,
            name: interaction.name.clone(),
            held_out: interaction.held_out,
        })
    }

    /// When the tool moves the body, s of the capture's clock; the states count from `zero`.
    pub fn stretch(&self, zero: f64) -> Option<[f64; 2]> {
        let touched = || self.states.iter().filter(|s| s.contact);
        Some([touched().next()?.time + zero, touched().next_back()?.time + zero])
    }

    /// The push as the family sees it.
    pub fn group(&self) -> Group {
        Group {
            name: self.name.clone(),
            held_out: self.held_out,
            channels: channels(&self.states, &self.measured, &self.spread, &self.along),
        }
    }
}

/// How the force of a push rings.
fn ringing(
    scene: &Scene,
    flat: &dyn Fn(&Vector3<f64>) -> Vector2<f64>,
    along: &Vector2<f64>,
    within: [f64; 2],
    swings: f64,
) -> Option<Ringing> {
    let (time, force, _) = scene.raw_force(push_ringing::BIN)?;
    let force: Vec<f64> = force.iter().map(|f| flat(f).dot(along)).collect();
    Ringing::of(&time, &force, within, swings)
}

/// What may ring in these states after a blow at `onset` (s since the capture began), and what speeds up a `mass` (kg).
fn ring(states: &mut [State], blow: &Blow, onset: f64, mass: f64) {
    for s in states.iter_mut().filter(|s| s.contact) {
        let since = s.time - onset;
        let fades = blow.size * (-since / RINGING).exp();
        s.ringing = blow.rings.map_or(fades, |r| UNEVEN * r.envelope(since));
        s.phases = blow.rings.map_or([0.0; 2], |r| r.phases(since, BIN));
        s.inertia *= mass;
        s.hurried *= mass;
    }
    beyond_noise(states);
}

/// Whether a mass was told by what is not pushed: one that pushes tell goes with the friction that they are read with.
fn weighed(mass: &Estimate) -> bool {
    mass.is_told() && !mass.method.starts_with("accelerated-push")
}

/// Whether all went to and fro along one line, of the room or of the body itself.
pub fn along_one_line<'a>(states: impl Iterator<Item = &'a State>, of_body: bool) -> bool {
    let axis = |s: &State| {
        let turned = if of_body { s.turn } else { 0.0 };
        let double = 2.0 * (s.heading.y.atan2(s.heading.x) - turned);
        Vector2::new(double.cos(), double.sin())
    };
    let moving = states.filter(|s| s.contact && s.heading.norm() > 0.5);
    let (sum, count) = moving.fold((Vector2::zeros(), 0.0), |(sum, n), s| (sum + axis(s), n + 1.0));
    sum.norm() > ONE_LINE * f64::max(count, 1.0)
}

/// What had been done to a body before, and what it did after.
struct Past {
    zero: f64,
    wait: f64,
    /// When the force began to rise, s.
    begun: f64,
    /// Way over which friction turns round where a hand turns back, m.
    bristles: f64,
    first: bool,
    worn: f64,
    /// A hand held already, and strained at what rested.
    strained: bool,
    /// It came back after the tool when that was drawn back.
    drawn: bool,
}

/// The moments at which the tool moves the body steadily or nothing touches, the forces there, and the slip in all.
fn moments(
    interaction: &Interaction,
    (time, force): (&[f64], &[Vector3<f64>]),
    (motion, onset, touched): (&Motion, f64, (f64, f64)),
    past: &Past,
    plane: &[Vector3<f64>; 2],
    along: &Vector2<f64>,
) -> (Vec<State>, Vec<Vector2<f64>>, f64) {
    // The usual speed, not the largest: a tool that tears loose springs ahead.
    let top = motion.speed.iter().copied().fold(0.0, f64::max);
    let moves: Vec<f64> = motion.speed.iter().copied().filter(|v| *v > 0.05 * top).collect();
    let usual = median(&moves).unwrap_or(top);
    let slowly = approach(interaction, plane, along, onset).is_some_and(|v| v < STEADY * usual);
    let goes_on = going_on(interaction, plane, along);
    let pushes = |t: f64, speed: f64| goes_on.as_ref().is_none_or(|tool| tool(t) > GOES_ON * speed);
    let usually = median(
        &motion
            .force
            .iter()
            .map(Vector2::norm)
            .filter(|f| *f > 0.0)
            .collect::<Vec<f64>>(),
    );
    let left = leaves(interaction, plane, along, touched.1);
    // A finger that stopped may press on what sticks.
    let free = |t: f64, f: f64| {
        !past.drawn && t > touched.1 + FREED && (t > left + FREED || f < PRESSES * usually.unwrap_or(0.0))
    };
    let (mut states, mut measured) = (Vec::new(), Vec::new());
    let (mut slip, mut before) = (0.0, onset);
    let (mut turned, led) = (TurnedBack::default(), interaction.tool.as_ref().is_some_and(|t| t.grip));
    for (t, f) in time.iter().zip(force) {
        let moment = motion.at(*t);
        let within = (onset..=touched.1).contains(t);
        if within {
            slip += moment.speed * (t - before).max(0.0);
            before = *t;
            turned.note(&moment.force, slip);
        }
        let sets_out = slip < SETS_OUT && moment.speed > SLOW * usual && slowly;
        // Where the force came up before the plain model has the tool there, it foretells none.
        let foretold = moment.force.norm() > 0.0;
        let steady = moment.speed > STEADY * usual || sets_out;
        let touches = !flies(f.norm(), moment.force.norm(), moment.speed);
        let settled = slip > SETTLED && turned.away(slip, past.bristles);
        let contact = within && foretold && touches && settled && steady && pushes(*t, moment.speed);
        let rest = !past.strained && (*t < past.begun.min(touched.0) - 0.15 || free(*t, f.norm()));
        if !(contact || rest) || !f.iter().all(|x| x.is_finite()) {
            continue;
        }
        measured.push(Vector2::new(f.dot(&plane[0]), f.dot(&plane[1])));
        let slid = if contact { slip } else { 0.0 };
        states.push(State {
            time: t - past.zero,
            wait: past.wait,
            contact,
            first: past.first,
            since: t - onset,
            span: 0.0,
            slip: slid,
            worn: past.worn + slid,
            speed: moment.speed,
            heading: moment.force.try_normalize(1e-9).unwrap_or(*along),
            at: moment.at,
            turn: motion.start + moment.turn,
            turned: moment.turn,
            loaded: f.dot(&plane[0].cross(&plane[1])),
            force: if contact { moment.force } else { Vector2::zeros() },
            inertia: if contact { motion.acceleration(*t, BIN) } else { 0.0 },
            hurried: if contact && led { motion.hurry(*t, BIN) } else { 0.0 },
            ringing: 0.0,
            phases: [0.0; 2],
            tool: tool_turn(interaction, *t),
            twist: 0.0,
            veer: 0.0,
            led,
        });
    }
    (states, measured, slip)
}

/// The size of the force while the tool pushes, its part along the push at rest; and its part across.
fn channels(states: &[State], measured: &[Vector2<f64>], spread: &[f64], along: &Vector2<f64>) -> Vec<Channel> {
    let across = Vector2::new(-along.y, along.x);
    let channel = |(kind, axis): (usize, &Vector2<f64>)| {
        let value = |(m, s): (&Vector2<f64>, &State)| match (s.contact, kind) {
            (true, 0) => m.norm(),
            _ => m.dot(axis),
        };
        let values: Vec<f64> = measured.iter().zip(states).map(value).collect();
        let n = values.len();
        Channel {
            kind,
            change: vec![0.0; n],
            starts: vec![true; n],
            aside: doubts(states, spread, kind),
            measured: values,
        }
    };
    [(0, along), (1, &across)].into_iter().map(channel).collect()
}

/// What the plain model leaves open on purpose of the force along and across, N, beside the spread of each mean.
pub fn doubts(states: &[State], spread: &[f64], kind: usize) -> Vec<f64> {
    let doubt = |(s, spread): (&State, &f64)| {
        let share = [EVEN, s.veer.hypot(DIRECTION * s.astray())][kind];
        let own = if s.contact { share * s.force.norm() } else { 0.0 };
        let hurried = HURRIED * s.inertia.abs().max(s.hurried.abs());
        own.hypot(s.ringing).hypot(hurried).hypot(*spread)
    };
    states.iter().zip(spread).map(doubt).collect()
}
