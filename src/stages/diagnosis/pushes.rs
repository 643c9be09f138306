//! Pushes and pulls of single bodies along the support as the ladder of laws sees them: the force in the plane of the
//! support, with everything that a law of friction, of the table or of the sensor may depend on.

use nalgebra::{Vector2, Vector3};

use super::Quantity;
use super::askew::askew;
use super::asking::Imagined;
use super::blows::{Blow, swings_as_the_whole, swings_on_the_tool};
use super::family::{Active, ChannelKind, Covariate, Family, Parameter, Sheet};
use super::fit::Fit;
use super::levels::{Level, Number};
use super::predict::Scene;
use super::push_catalogue::{self, push_laws, scatter};
use super::push_doubts::{doubt_turns, excuse_blows, ring_as_usual};
use super::push_history::History;
use super::push_laws;
use super::push_motion::paces;
use super::push_plane::{lean_of, origin_of, plane_of};
use super::push_states::{Observed, State, along_one_line};
use super::push_touches::Ready;
use super::push_windows::{USUAL, WIDTH, besides, covariates, only_shown};
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::median;
use crate::twin::{Evidence, Model};

/// Share of that by which the limit surface has a body that turns resist less that it leaves open.
const TURNING: f64 = 0.3;
/// Log evidence, nats, from which on a law that is tried once is named.
const ONE_TRY: f64 = 5.0;

/// Highest speed of the tool over the lowest from which on friction may be asked whether it depends on speed.
const PACES: f64 = 1.4;

/// How common it is that what a finger reads keeps its direction in the room because the finger's frame stands still.
const OF_THE_FINGER: f64 = 0.3;
/// Log evidence, nats, from which on a part is named that swings as the whole does on the tool: what a tip gives is told roughly.
const AS_THE_WHOLE: f64 = 30.0;
/// Fewest pushes from which a cause is named.
const FEWEST: usize = 3;
/// How far the logarithm of a weight that nobody weighed may be off.
const HEAVIER: f64 = 0.4;
/// Share of friction from which on what speeds a body up counts.
const INERT: f64 = 0.02;

/// All pushes of single bodies.
#[derive(Clone)]
pub struct Pushes {
    pub(super) sheet: Sheet,
    pub(super) states: Vec<Vec<State>>,
    /// How many of the groups were measured: what could be done next comes after them.
    pub(super) done: usize,
    /// Which log friction scales a group.
    pub(super) bodies: Vec<usize>,
    pub(super) names: Vec<String>,
    /// Normal load of each body, N, and whether it was weighed.
    pub(super) loads: Vec<f64>,
    pub(super) weighed: Vec<bool>,
    /// Groups in which a hand held the body.
    pub(super) held: Vec<bool>,
    /// Force of the plain model on each body where it does not turn, N.
    even: Vec<f64>,
    /// How each body could be pushed next.
    pub(super) ready: Vec<Option<Ready>>,
    /// Unit vectors along and across each group's motion, plane of the support.
    pub(super) along: Vec<Vector2<f64>>,
    /// Of the plane of the support.
    pub(super) plane: [Vector3<f64>; 2],
    /// What the weight does along a support that is known not to be level, over the load.
    lean: Vector2<f64>,
    pub(super) largest: f64,
    /// The lowest and the highest speed of the tool, m/s.
    paces: [f64; 2],
    /// How the tool met the bodies, each with the number of the body.
    pub(super) blows: Vec<(usize, Blow)>,
}

impl Pushes {
    /// What a capture has of them; nothing where no push was both measured and predicted. Friction turns round over a way of
    /// `bristles` (m) where a hand turns back.
    pub fn new((capture, segmented, model): (&Capture, &[Segmented], &Model), bristles: f64) -> Option<Self> {
        let plane = plane_of(capture, model);
        let mut ordered: Vec<&Interaction> = capture.interactions.iter().collect();
        ordered.sort_by(|a, b| begin(a).total_cmp(&begin(b)));
        let zero = ordered.first().map_or(0.0, |i| begin(i));
        let mut out = Self::nothing(plane, lean_of(capture, &plane));
        let mut names: Vec<String> = Vec::new();
        let mut history = History::of_bristles(bristles);
        let mut all = Vec::new();
        let origin = origin_of(capture, model);
        for interaction in ordered {
            history.tilted(interaction, &origin);
            if !matches!(interaction.kind, Kind::Push | Kind::Pull) {
                continue;
            }
            let cut = segmented.iter().find(|s| s.interaction == interaction.name);
            let scene = Scene {
                capture,
                interaction,
                segmented: cut,
                model,
            };
            let seen = Observed::of(&scene, &plane, zero, &mut history);
            if let Some([slow, fast]) = seen.as_ref().and_then(|s| paces(interaction, s.stretch(zero)?)) {
                out.paces = [out.paces[0].min(slow), out.paces[1].max(fast)];
            }
            all.extend(seen);
        }
        excuse_blows(&mut all);
        ring_as_usual(&mut all);
        doubt_turns(&mut all);
        let noise: Vec<f64> = all.iter().map(|s| s.noise).collect();
        for seen in all {
            let index = names.iter().position(|n| *n == seen.body).unwrap_or_else(|| {
                names.push(seen.body.clone());
                out.loads.push(seen.load);
                out.weighed.push(seen.weighed);
                names.len() - 1
            });
            out.largest = out.largest.max(seen.largest);
            out.blows.push((index, seen.blow.clone()));
            for stroke in seen.strokes() {
                out.bodies.push(index);
                out.along.push(stroke.along);
                out.held.push(stroke.held);
                out.sheet.groups.push(stroke.group());
                out.states.push(stroke.states);
            }
        }
        if out.sheet.groups.is_empty() {
            return None;
        }
        let sigma = median(&noise)?.max(1e-4) / USUAL.sqrt();
        let force = ChannelKind {
            quantity: Quantity::Force,
            sigma,
            jitter: 0.0,
        };
        out.sheet.kinds = vec![force.clone(), force];
        out.sheet.base = out.numbers(&names);
        out.even = (0..out.loads.len()).map(|body| out.evenly(body)).collect();
        out.done = out.states.len();
        out.ready = names.iter().map(|n| Ready::of(model, &plane, n)).collect();
        out.names = names;
        out.sheet.scatter = scatter();
        let scale = out.scale();
        out.sheet.laws = push_laws(&out, scale);
        Some(out)
    }

    /// The numbers of the plain model.
    fn numbers(&self, names: &[String]) -> Vec<Parameter> {
        let mut base: Vec<Parameter> = names
            .iter()
            .map(|_| Parameter::amplitude("log_friction", "1", 0.5))
            .collect();
        base.push(Parameter {
            high: 1.5,
            ..Parameter::positive("static_excess", "1", 0.2)
        });
        base.push(Parameter::scale("slip_length", "m", 5e-4, 0.7));
        // What the limit surface misses of a foot that turns is the same in every push.
        base.push(Parameter::amplitude("turning", "1", TURNING));
        // What a finger adds or takes off counts by the weight, and what speeds the body up goes with it.
        let counts = |s: &State| s.loaded != 1.0 || s.inertia.abs() > INERT * s.force.norm();
        let guessed = |g: usize| !self.weighed[self.bodies[g]] && self.states[g].iter().any(counts);
        if (0..self.states.len()).any(guessed) {
            base.push(Parameter::amplitude("log_weight", "1", HEAVIER));
        }
        base
    }

    fn nothing(plane: [Vector3<f64>; 2], lean: Vector2<f64>) -> Self {
        Self {
            sheet: Sheet::default(),
            states: Vec::new(),
            done: 0,
            bodies: Vec::new(),
            names: Vec::new(),
            loads: Vec::new(),
            weighed: Vec::new(),
            held: Vec::new(),
            even: Vec::new(),
            ready: Vec::new(),
            along: Vec::new(),
            plane,
            lean,
            largest: 0.0,
            paces: [f64::INFINITY, 0.0],
            blows: Vec::new(),
        }
    }

    /// The same where every force is off by up to `lost` (N, standard deviation) since finer ones are rounded away.
    pub fn rounded(mut self, lost: f64) -> Self {
        self.sheet.kinds.iter_mut().for_each(|k| k.sigma = k.sigma.hypot(lost));
        self
    }

    /// Largest force of the plain model on a body, N: that of one that does not turn.
    fn evenly(&self, body: usize) -> f64 {
        let own = self.states.iter().zip(&self.bodies).filter(|(_, b)| **b == body);
        let forces = own.flat_map(|(states, _)| states).map(|s| s.force.norm());
        forces.fold(1e-9, f64::max)
    }

    /// Median force of the plain model, N.
    fn scale(&self) -> f64 {
        let forces: Vec<f64> = self
            .states
            .iter()
            .flatten()
            .filter(|s| s.contact)
            .map(|s| s.force.norm())
            .collect();
        median(&forces).unwrap_or(1.0)
    }

    /// How far a thing in the way of a law had been brought before a group, m along the law's direction.
    fn reached_before(&self, group: usize, active: &Active) -> f64 {
        use push_laws::form::{HIDDEN_BODY, HIDDEN_BODY_ANEW};
        if !matches!(active.law.form, HIDDEN_BODY | HIDDEN_BODY_ANEW) {
            return 0.0;
        }
        let way = push_laws::way_of(active);
        if active.law.form == HIDDEN_BODY_ANEW {
            let first = self.states[group].iter().find(|s| s.contact);
            // Who sets out beyond it does not meet it.
            let beyond = first.is_some_and(|s| way.dot(&s.at) > active.values[2]);
            return if beyond { f64::INFINITY } else { active.values[2] };
        }
        let earlier = self.states[..group.min(self.done)]
            .iter()
            .flatten()
            .filter(|s| s.contact);
        let towards = earlier.filter(|s| way.dot(&s.heading) > 0.5);
        // It stays where the last window of a push ended, half a window beyond its middle.
        let ends = towards.map(|s| way.dot(&s.at) + 0.5 * WIDTH);
        ends.fold(active.values[2], f64::max)
    }
}

/// When anything was first read of it, s; a tilt has no force, but the capture's clock runs.
fn begin(interaction: &Interaction) -> f64 {
    let force = interaction.force.iter().filter_map(|f| f.time.first());
    let tool = interaction.tool_path.iter().filter_map(|p| p.time.first());
    let support = interaction.support_path.iter().filter_map(|p| p.time.first());
    let tracks = interaction.tracks.values().filter_map(|t| t.time.first());
    let firsts = force.chain(tool).chain(support).chain(tracks);
    firsts.copied().fold(f64::INFINITY, f64::min)
}

impl Family for Pushes {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn is_tare(&self, scatter: usize) -> bool {
        push_catalogue::TARES.contains(&scatter)
    }

    /// What a finger reads that moves with the way of the push has its own law; what keeps its direction in the room is of the
    /// room, unless the finger's own frame stands still in it.
    fn commonness(&self, law: usize) -> f64 {
        let law = &self.sheet.laws[law];
        if law.form == push_laws::form::BIAS_HELD {
            OF_THE_FINGER
        } else {
            1.0
        }
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let states = &self.states[group];
        let n = states.len();
        let bodies = self.loads.len();
        let level = (base[self.bodies[group]] + scatter[0]).exp();
        let (excess, length) = (base[bodies], base[bodies + 1].exp());
        let load = self.loads[self.bodies[group]];
        let (along, even) = (self.along[group], self.even[self.bodies[group]]);
        let across = Vector2::new(-along.y, along.x);
        let weighed = self.weighed[self.bodies[group]];
        let weight = base.get(bodies + 3).filter(|_| !weighed).map_or(1.0, |w| w.exp());
        let mut out = vec![0.0; 2 * n];
        let mut reached: Vec<f64> = active.iter().map(|a| self.reached_before(group, a)).collect();
        for (i, s) in states.iter().enumerate() {
            // Level, slow change with the way and with the turning: what a surface and a shape leave open in each push.
            let drift = scatter[4] * (s.slip / 0.03) + scatter[5] * s.turned.abs();
            let turning = (1.0 - s.force.norm() / even).max(0.0) * base[bodies + 2];
            let mut share = 1.0 + excess * (-s.slip / length).exp() + drift + turning;
            let loaded = (1.0 - (1.0 - s.loaded) / weight).max(0.0);
            let (mut table, mut offset) = (-self.lean * (load * loaded), Vector2::zeros());
            let mut viscous = 0.0;
            for (a, reached) in active.iter().zip(&mut reached) {
                push_laws::pushed_along(a, s, reached, &mut viscous);
                push_laws::share(a, s, length, load, &mut share);
                push_laws::table(a, s, load, &mut table);
                push_laws::offset(a, s, &along, &self.plane, &mut offset);
                push_laws::viscous(a, s, &mut viscous);
                viscous += push_laws::loose(a, states, i, load);
            }
            let rubs = s.force * (level * share * loaded) + s.heading * (viscous + s.inertia * weight);
            let force = match s.contact {
                true if s.led => rubs + table,
                true => push_laws::held(&rubs, &table),
                false => Vector2::zeros(),
            };
            let turned = force + Vector2::new(-force.y, force.x) * (scatter[3] * s.astray());
            let mut read = turned + offset;
            for a in active {
                read = push_laws::read(a, read, &along);
            }
            // The size of the force, where the tool pushes: its direction follows the surface at the contact, which is
            // known less well.
            out[i] = if s.contact {
                read.norm() + scatter[6] * s.ringing + scatter[7] * s.phases[0] + scatter[8] * s.phases[1]
            } else {
                read.dot(&along)
            } + scatter[1];
            out[n + i] = read.dot(&across) + scatter[2];
        }
        out
    }

    /// At one speed of the tool what rubs is slower only where the body turns, and how that goes is the footprint's.
    fn shows(&self, law: usize) -> bool {
        use push_laws::form::{
            ANISOTROPY, ANISOTROPY_CREASED, ANISOTROPY_OF_BODY, ANISOTROPY_OF_BODY_CREASED, RATE_STATE, VISCOUS,
            VISCOUS_POWER, WEAKENING, WEAKENING_SHAPED, WEAKENING_SQUARE,
        };
        let fitted = || (0..self.states.len()).filter(|g| !self.sheet.groups[*g].held_out);
        match self.sheet.laws[law].form {
            RATE_STATE | VISCOUS | VISCOUS_POWER | WEAKENING | WEAKENING_SHAPED | WEAKENING_SQUARE => {
                self.paces[1] <= 0.0 || self.paces[1] >= PACES * self.paces[0]
            }
            form @ (ANISOTROPY | ANISOTROPY_CREASED | ANISOTROPY_OF_BODY | ANISOTROPY_OF_BODY_CREASED) => {
                let of_body = matches!(form, ANISOTROPY_OF_BODY | ANISOTROPY_OF_BODY_CREASED);
                !along_one_line(fitted().flat_map(|g| &self.states[g]), of_body)
            }
            _ => true,
        }
    }

    /// A law that may act at many places is tried as often, and one of the tries fits by chance: in twenty clean captures of
    /// MuJoCo worlds no other law gained half a nat, those of a place up to nine.
    ///
    /// One or two pushes name nothing: what is odd in one of them is not seen again.
    fn named_from(&self, law: usize, values: &[f64]) -> f64 {
        if self.sheet.groups.iter().filter(|g| !g.held_out).count() < FEWEST {
            return f64::INFINITY;
        }
        let loose = self.laws()[law].form == push_laws::form::LOOSE_MASS;
        if loose && swings_as_the_whole(self.blows.iter().map(|b| &b.1), values[1].exp()) {
            return AS_THE_WHOLE;
        }
        ONE_TRY + (self.sheet.laws[law].grid.len().max(1) as f64).ln()
    }

    fn levels(&self, fit: &Fit) -> Vec<Level> {
        let each = self.names.iter().enumerate();
        each.filter_map(|(k, name)| Level::of(fit, k, name, Number::Friction))
            .collect()
    }

    fn imagined(&self) -> Option<Imagined> {
        self.with_touches()
    }

    fn unforeseen(&self) -> f64 {
        self.sheet.scatter[0].tau * self.scale()
    }

    fn taken_up(&self, plain: &Fit) -> Option<Evidence> {
        askew(&self.states, plain)
    }

    fn samples_are(&self) -> &'static str {
        "means over stretches of its way"
    }

    fn covariates(&self, group: usize) -> Vec<Covariate> {
        covariates(&self.states[group])
    }

    fn negligible(&self, law: usize, own: &[f64]) -> bool {
        let loose = self.laws()[law].form == push_laws::form::LOOSE_MASS;
        loose && swings_on_the_tool(self.blows.iter().map(|b| &b.1), own[0], own[1].exp())
    }

    fn besides(&self, group: usize) -> Vec<Covariate> {
        besides(&self.states[group])
    }

    fn only_shown(&self, group: usize, law: Option<(usize, &[f64])>) -> Vec<Covariate> {
        let place = law.filter(|(l, _)| push_laws::is_about_a_place(self.laws()[*l].form));
        let place = place.map(|(_, v)| Vector2::new(v[1], v[2]));
        only_shown(&self.states[group], self.loads[self.bodies[group]], place)
    }
}
