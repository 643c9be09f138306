//! Which touch next: the one from which most is expected to be learnt of mass, friction and centre of mass.
//!
//! The belief about a thing is normal about the twin's estimates. A touch is worth the expected shrinking of the doubts
//! that are wanted smaller, by linearised forward models, averaged over draws of the belief: a design that is best at
//! the likeliest state alone stops too early (Chaloner and Verdinelli 1995, Bayesian experimental design).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::belief::{Belief, Information, State};
use super::candidates::{Candidate, Way, pool};
use super::expected::{Senses, information};
use super::thing::Thing;
use crate::base::{Estimate, Pose, Seed, Status, rng_for};
use crate::capture::{Interaction, Kind, Noise, Touch};
use crate::stages::estimation::Config;
use crate::stages::estimation::pool::relative_sd;
use crate::twin::{Link, Model};

/// How well the numbers are wanted: one standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// Mass, as a share of it.
    pub mass: f64,
    /// Kinetic friction, as a share of it.
    pub friction: f64,
    /// Centre of mass in the plane of the support, m.
    pub centre: f64,
}

impl Default for Wanted {
    fn default() -> Self {
        Self {
            mass: 0.05,
            friction: 0.05,
            centre: 1.5e-3,
        }
    }
}

/// How touches are chosen.
#[derive(Clone, Debug)]
pub struct NextTouchConfig {
    /// When a thing is known well enough.
    pub wanted: Wanted,
    /// Draws of the belief over which a touch's worth is averaged.
    pub draws: usize,
    /// Least worth of a touch, bits.
    pub least: f64,
    /// Priors and scatter, as the estimation has them.
    pub estimation: Config,
    /// Of the draws.
    pub seed: Seed,
}

impl Default for NextTouchConfig {
    fn default() -> Self {
        Self {
            wanted: Wanted::default(),
            draws: 6,
            least: 0.15,
            estimation: Config::default(),
            seed: Seed(0),
        }
    }
}

/// A touch that is worth doing.
#[derive(Clone, Debug)]
pub struct TouchChoice {
    /// What to ask of the rig.
    pub touch: Touch,
    /// Expected shrinking of the wanted doubts, bits.
    pub bits: f64,
    /// In words: what it is and what it should bring.
    pub why: String,
    pub(super) key: String,
}

/// What to do next.
#[derive(Clone, Debug)]
pub enum TouchDecision {
    /// This touch.
    Touch(Box<TouchChoice>),
    /// Nothing more; the reason.
    Stop(String),
}

/// Chooses touches, remembers what was done and refused.
#[derive(Clone, Debug)]
pub struct NextTouch {
    config: NextTouchConfig,
    pub(super) kinds: Vec<Kind>,
    noise: Noise,
    done: BTreeMap<String, usize>,
    refused: BTreeSet<String>,
    /// Whether tools that hold were seen to feel torques; true until a lift says otherwise.
    torques: bool,
    pub(super) asked: usize,
}

/// A thing with what is believed of it and what is still wanted.
pub(super) struct Known {
    pub(super) name: String,
    pub(super) belief: Belief,
    pub(super) met: bool,
}

/// A doubt below this share of what is wanted earns nothing more.
const PLENTY: f64 = 0.6;
/// Weight of what is learnt of everything else, against what is wanted.
const ASIDE: f64 = 0.02;
/// How often every touch of the pool could be done at most, where it is asked what they could ever tell.
const EVER: f64 = 10.0;

impl NextTouch {
    /// For a rig that can do `kinds` and whose sensors have that `noise`.
    pub fn new(config: NextTouchConfig, kinds: &[Kind], noise: Noise) -> Self {
        Self {
            config,
            kinds: kinds.to_vec(),
            noise,
            done: BTreeMap::new(),
            refused: BTreeSet::new(),
            torques: true,
            asked: 0,
        }
    }

    /// The touch from which most is expected; `model` holds the estimates so far, `now` where its links are by now
    /// (those that are not named are where they were at first).
    pub fn decide(&mut self, model: &Model, now: &BTreeMap<String, Pose>) -> TouchDecision {
        let scene = self.scene(model, now);
        if scene.known.is_empty() {
            return TouchDecision::Stop("there is nothing whose shape is known well enough to be touched".into());
        }
        let Wanted { mass, friction, centre } = self.config.wanted;
        if scene.known.iter().all(|k| k.met) {
            return TouchDecision::Stop(format!(
                "of every thing, mass is known to {:.0} %, friction to {:.0} %, the centre of mass to {:.1} mm or better",
                100.0 * mass,
                100.0 * friction,
                1e3 * centre
            ));
        }
        let best = self.best(&scene);
        match best {
            Some((candidate, bits)) if bits >= self.config.least => {
                self.asked += 1;
                TouchDecision::Touch(Box::new(self.choice(&scene, &candidate, bits)))
            }
            _ => TouchDecision::Stop(format!(
                "no touch that this rig can do is expected to tell much more ({})",
                self.open(&scene)
            )),
        }
    }

    /// What no number of touches of this rig could bring to what is wanted, one line a thing.
    pub fn out_of_reach(&self, model: &Model, now: &BTreeMap<String, Pose>) -> Vec<(String, String)> {
        let scene = self.scene(model, now);
        let mut out = Vec::new();
        for (k, known) in scene.known.iter().enumerate() {
            let pool = scene.pool.iter().filter(|c| c.thing == k);
            let most = pool.fold(known.belief.information, |sum, c| {
                sum + information(c, &known.belief.mean, &scene.senses) * EVER
            });
            let never = self.missing(&Belief::doubts(&most));
            if !never.is_empty() {
                let said = format!(
                    "no touch that this rig can do will tell its {}: {}",
                    never.join(", "),
                    self.remedy(&never)
                );
                out.push((known.name.clone(), said));
            }
        }
        out
    }

    /// The rig did it; whether a lift felt torques is learnt from what it recorded.
    pub fn did(&mut self, choice: &TouchChoice, recorded: &Interaction) {
        *self.done.entry(choice.key.clone()).or_default() += 1;
        if recorded.kind == Kind::Lift {
            let felt = |t: &Vector3<f64>| t.iter().all(|x| x.is_finite()) && t.norm() > 0.0;
            self.torques = recorded
                .force
                .as_ref()
                .is_some_and(|f| f.torque.iter().flatten().any(felt));
        }
    }

    /// The rig would not do it: it is not asked for again.
    pub fn refuse(&mut self, choice: &TouchChoice) {
        self.refused.insert(choice.key.clone());
    }

    /// Every touch that could be asked for now, for policies that are compared with this one.
    pub fn every(&mut self, model: &Model, now: &BTreeMap<String, Pose>) -> Vec<TouchChoice> {
        let scene = self.scene(model, now);
        self.asked += 1;
        scene.pool.iter().map(|c| self.choice(&scene, c, 0.0)).collect()
    }

    /// One slow push for each thing, another than was done, to be kept for checking what the fitted ones told.
    pub fn checks(&mut self, model: &Model, now: &BTreeMap<String, Pose>) -> Vec<TouchChoice> {
        let scene = self.scene(model, now);
        let fresh = |k: usize| {
            let slow = |c: &&Candidate| c.thing == k && matches!(c.way, Way::Push { .. });
            scene.pool.iter().filter(slow).find(|c| !self.done.contains_key(&c.key))
        };
        let found: Vec<Candidate> = (0..scene.known.len()).filter_map(fresh).cloned().collect();
        let mut out = Vec::new();
        for candidate in found {
            self.asked += 1;
            let mut choice = self.choice(&scene, &candidate, 0.0);
            choice.touch.held_out = true;
            choice.why = format!("{}, kept for checking what the others told", candidate.words);
            out.push(choice);
        }
        out
    }

    /// Whether mass, friction and centre of mass of a link are as well known as wanted.
    pub fn is_met(&self, link: &Link, normal: &Vector3<f64>) -> bool {
        let Wanted { mass, friction, centre } = self.config.wanted;
        let enough = |e: &Option<Estimate>, wanted: f64| {
            e.as_ref()
                .is_some_and(|e| e.status != Status::Assumed && relative_sd(e) <= wanted)
        };
        let local = link.pose.rotation.inverse() * normal;
        let centred = link
            .com
            .as_ref()
            .filter(|c| c.status != Status::Assumed)
            .is_some_and(|c| {
                c.sd.is_none_or(|sd| (0..3).all(|k| local[k].abs() > 0.7 || sd[k] <= centre))
            });
        enough(&link.mass, mass) && enough(&link.friction.kinetic, friction) && centred
    }

    fn scene(&self, model: &Model, now: &BTreeMap<String, Pose>) -> Scene {
        let support = model.twin.support.as_ref();
        let gravity = Vector3::from(model.twin.gravity);
        let normal = support.map_or(-gravity, |s| Vector3::from(s.normal));
        let normal = normal.try_normalize(1e-9).unwrap_or_else(Vector3::z);
        let turn = UnitQuaternion::rotation_between(&normal, &Vector3::z()).unwrap_or_else(UnitQuaternion::identity);
        let plane = Isometry3::from_parts(Translation3::identity(), turn);
        let g = gravity.norm().max(1e-3);
        let mut scene = Scene {
            plane,
            senses: Senses::new(
                &self.noise,
                self.torques,
                g,
                (
                    self.config.estimation.friction_scatter,
                    self.config.estimation.model_form,
                ),
            ),
            things: Vec::new(),
            known: Vec::new(),
            pool: Vec::new(),
        };
        for (_, link) in model.twin.links() {
            let Some(mesh) = link.mesh.as_ref().and_then(|path| model.meshes.get(path)) else {
                continue;
            };
            let pose = plane * now.get(&link.name).unwrap_or(&link.pose).0;
            let Some(thing) = Thing::new(&link.name, mesh, &pose) else {
                continue;
            };
            scene.known.push(Known {
                name: link.name.clone(),
                belief: Belief::of((link, mesh, &pose), &thing, g, &self.config.estimation),
                met: self.is_met(link, &normal),
            });
            scene.things.push(thing);
        }
        let beliefs: Vec<Belief> = scene.known.iter().map(|k| k.belief.clone()).collect();
        let floor = support.map(|s| (turn * Vector3::from(s.point)).z);
        scene.pool = pool(&scene.things, &beliefs, &self.kinds, floor);
        scene.pool.retain(|c| !self.refused.contains(&c.key));
        scene
    }

    fn best(&self, scene: &Scene) -> Option<(Candidate, f64)> {
        let mut best: Option<(Candidate, f64)> = None;
        for (k, known) in scene.known.iter().enumerate().filter(|(_, known)| !known.met) {
            // The same draws for every touch: what is compared differs by the touch alone.
            let mut dice = rng_for(self.config.seed, &format!("touch {} {}", known.name, self.asked));
            let draws: Vec<State> = (0..self.config.draws).map(|_| known.belief.draw(&mut dice)).collect();
            for candidate in scene.pool.iter().filter(|c| c.thing == k) {
                let bits = self.worth(candidate, known, &draws, &scene.senses);
                if best.as_ref().is_none_or(|(_, most)| bits > *most) {
                    best = Some((candidate.clone(), bits));
                }
            }
        }
        best
    }

    /// Expected bits of `candidate`; what was done before tells less anew, its faults being the same again.
    fn worth(&self, candidate: &Candidate, known: &Known, draws: &[State], senses: &Senses) -> f64 {
        let before = known.belief.information;
        let again = 1.0 + self.done.get(&candidate.key).copied().unwrap_or(0) as f64;
        let total: f64 = draws
            .iter()
            .map(|state| {
                self.gain(
                    &before,
                    &(before + information(candidate, state, senses) / (again * again)),
                )
            })
            .sum();
        total / draws.len().max(1) as f64 / std::f64::consts::LN_2
    }

    fn gain(&self, before: &Information, after: &Information) -> f64 {
        let floors = self.floors().map(|f| PLENTY * f);
        let (old, new) = (Belief::doubts(before), Belief::doubts(after));
        let aimed: f64 = floors
            .iter()
            .enumerate()
            .map(|(k, floor)| (old[k].max(*floor) / new[k].max(*floor)).ln())
            .sum();
        let all = 0.5 * (after.determinant() / before.determinant()).max(1.0).ln();
        aimed + ASIDE * all
    }

    pub(super) fn floors(&self) -> [f64; 4] {
        let Wanted { mass, friction, centre } = self.config.wanted;
        [mass, friction, centre, centre]
    }
}

pub(super) struct Scene {
    /// Plane frame from world.
    pub(super) plane: Isometry3<f64>,
    pub(super) senses: Senses,
    pub(super) things: Vec<Thing>,
    pub(super) known: Vec<Known>,
    pub(super) pool: Vec<Candidate>,
}
