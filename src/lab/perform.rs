//! Carries out the actions of a scene in the made-up world and records what perfect sensors would have seen.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};
use rayon::prelude::*;

use super::dynamics::{Frame, Hand, Script, Ties, Tilting, Turning, Wielding, World, participants, put_on_table};
use super::hidden::{Effect, Occasion, altered, effects, faults, occasions, target};
use super::{Scene, Solid};
use crate::base::{Error, Pose, Progress, Result};
use crate::capture::{Kind, Tool};

/// Step of time, s.
const STEP: f64 = 5e-5;
/// Time between two readings, s.
const READING: f64 = 1e-3;
/// Longest time that the scene is given to settle before the recording, s.
const SETTLING: f64 = 0.4;

/// What the lab's sensors saw without noise, at fine and uniform rates.
#[derive(Clone, Debug)]
pub struct Performance {
    /// Name of the action.
    pub name: String,
    /// What was done.
    pub kind: Kind,
    /// The body that was meant; empty for a hold.
    pub target: String,
    /// Kept for checking.
    pub held_out: bool,
    /// The tool, where there was one.
    pub tool: Option<Tool>,
    /// s; empty without a tool.
    pub force_time: Vec<f64>,
    /// N, exerted on the bodies by the tool, world axes, averaged over the time between two readings.
    pub force: Vec<Vector3<f64>>,
    /// N·m about the tool's origin, world axes, likewise.
    pub torque: Vec<Vector3<f64>>,
    /// World-from-tool at `force_time`.
    pub tool_pose: Vec<Pose>,
    /// s.
    pub track_time: Vec<f64>,
    /// World-from-body at `track_time` of all bodies that take part, tracked by an instrument or not.
    pub tracks: BTreeMap<String, Vec<Pose>>,
    /// The support's normal at `track_time`, world axes; empty unless the support was tilted.
    pub support_normal: Vec<UnitVector3<f64>>,
}

/// Carries out every action of the scene, each from the scene as it is at first.
///
/// # Errors
/// An action that names what does not exist, or cannot start.
pub fn perform(scene: &Scene, solids: &BTreeMap<String, Solid>, progress: &Progress) -> Result<Vec<Performance>> {
    perform_in_steps(scene, solids, progress, STEP)
}

pub(super) fn perform_in_steps(
    scene: &Scene,
    solids: &BTreeMap<String, Solid>,
    progress: &Progress,
    dt: f64,
) -> Result<Vec<Performance>> {
    let effects = effects(scene)?;
    let scene = &altered(scene, &effects);
    let ties = Ties::new(scene, solids);
    let scripts: Vec<Script> = scene
        .action
        .iter()
        .map(|action| Script::new(scene, action, solids.values()))
        .collect::<Result<_>>()?;
    let durations: Vec<f64> = scripts.iter().map(|script| script.duration).collect();
    let occasions = occasions(&scene.action, &durations, &scene.pauses());
    let done = scripts.par_iter().zip(occasions).map(|(script, occasion)| {
        let mut scene = scene.on(&script.name);
        // The slope is the table's: what a hand raises hangs as the room has it.
        if script.kind == Kind::Lift && scene.support.tilt != [0.0; 2] {
            scene.to_mut().support.tilt = [0.0; 2];
        }
        let performance = Stage::set(&scene, solids, &ties, (script, &occasion), &effects, dt).play();
        progress.advance();
        performance
    });
    let mut done: Vec<Performance> = done.collect();
    done.iter().try_for_each(finite)?;
    faults(&effects).distort(&mut done);
    Ok(done)
}

/// Nothing is recorded of what flew apart.
fn finite(performance: &Performance) -> Result<()> {
    let whole = |poses: &Vec<Pose>| poses.iter().all(|p| p.0.translation.vector.norm().is_finite());
    match performance.tracks.iter().find(|(_, poses)| !whole(poses)) {
        None => Ok(()),
        Some((body, _)) => Err(Error::Failed(format!(
            "action \"{}\": the motion of \"{body}\" cannot be integrated: it is too light for its friction and damping",
            performance.name
        ))),
    }
}

/// One action about to be carried out.
struct Stage<'a> {
    script: &'a Script,
    world: World,
    hand: Option<Hand>,
    tracked: Vec<usize>,
    gravity: Vector3<f64>,
    dt: f64,
    /// What the tool exerted in the last step: force, and torque about the tool's origin.
    exerted: (Vector3<f64>, Vector3<f64>),
    /// Readings for which nothing has moved.
    quiet: usize,
}

impl<'a> Stage<'a> {
    fn set(
        scene: &Scene,
        solids: &BTreeMap<String, Solid>,
        ties: &Ties,
        (script, occasion): (&'a Script, &Occasion),
        effects: &[Effect],
        dt: f64,
    ) -> Self {
        let names = participants(solids, ties, script);
        let alone: BTreeMap<String, Solid>;
        let solids = if script.tilting.is_some() {
            alone = names
                .iter()
                .filter_map(|n| Some((n.clone(), put_on_table(solids.get(n)?))))
                .collect();
            &alone
        } else {
            solids
        };
        let mut world = World::new(scene, solids, &names);
        let about = target(scene).and_then(|name| world.index(name));
        let dt = dt / world.fineness(dt) as f64;
        world.make_otherwise(effects, about);
        settle(&mut world, dt);
        world.hide(effects, about, occasion);
        Self {
            script,
            tracked: (0..world.names.len()).collect(),
            hand: script.wielding.as_ref().and_then(|w| {
                let mut hand = hand_of(scene, solids, &world, script, w)?;
                hand.hide(effects, occasion);
                Some(hand)
            }),
            gravity: world.gravity,
            world,
            dt,
            exerted: (Vector3::zeros(), Vector3::zeros()),
            quiet: 0,
        }
    }

    fn play(mut self) -> Performance {
        let per_reading = ((READING / self.dt).round() as usize).max(1);
        let readings = (self.script.duration / READING).floor() as usize + 1;
        let mut record = Record::new(self.script, &self.world, &self.tracked);
        let start: Vec<Vector3<f64>> = self.world.bodies.iter().map(|b| b.frame.position).collect();
        for reading in 0..readings {
            let time = reading as f64 * READING;
            record.look(self.script, &self.world, &self.tracked, time);
            if self.has_slid(&start) {
                break;
            }
            if self.nothing_happens(time) {
                record.feel(reading, self.exerted, 0.5);
                record.feel(reading + 1, self.exerted, 0.5);
                continue;
            }
            for step in 0..per_reading {
                let nearest = reading + (2 * step + 1) / (per_reading + 1);
                self.advance(time + step as f64 * self.dt);
                record.feel(nearest, self.exerted, 1.0 / per_reading as f64);
            }
        }
        record.finish()
    }

    fn advance(&mut self, time: f64) {
        if let Some(tilting) = &self.script.tilting {
            self.turn(tilting, time);
        }
        let Some((wielding, hand)) = self.script.wielding.as_ref().zip(self.hand.as_mut()) else {
            self.world.step(None, self.dt);
            return;
        };
        let tool = wielding.drive.frame(time);
        if let Some((from, to)) = wielding.holds {
            let now = |moment: f64| (time - moment).abs() <= 0.5 * self.dt;
            if now(from) {
                hand.grasp(&tool, &self.world.bodies);
            } else if now(to) {
                hand.release();
            }
        }
        let wrench = self.world.step(Some((hand, &tool)), self.dt);
        self.exerted = (wrench.force, wrench.torque_about(&tool.position));
    }

    /// Whether all rests and will rest until the next reading: then no step needs to be taken.
    fn nothing_happens(&mut self, time: f64) -> bool {
        let still = self.script.tilting.is_none() && self.world.liveliness() < 1e-8 && !self.world.never_rests();
        self.quiet = if still { self.quiet + 1 } else { 0 };
        if self.quiet < 5 {
            return false;
        }
        let Some((wielding, hand)) = self.script.wielding.as_ref().zip(self.hand.as_ref()) else {
            return true;
        };
        let soon = time + READING + self.dt;
        if wielding
            .holds
            .is_some_and(|(from, to)| [from, to].iter().any(|t| *t > time - self.dt && *t < soon))
        {
            return false;
        }
        let (here, there) = (wielding.drive.moves.at(time), wielding.drive.moves.at(soon));
        let at_rest = here == there && here.1 == 0.0 && !wielding.drive.twists(time, soon);
        let tool = wielding.drive.frame(time);
        at_rest || (!hand.holds() && hand.clearance(&tool, &self.world.bodies) > 1e-3 + 2.0 * READING * here.1.abs())
    }

    /// The world stays in the support's axes; gravity turns the other way, with the forces of the turning frame.
    fn turn(&mut self, tilting: &Tilting, time: f64) {
        let (angle, rate) = tilting.angle.at(time);
        let ahead = tilting.angle.at(time + self.dt).1;
        let world_from_support = UnitQuaternion::from_axis_angle(&tilting.axis, angle);
        self.world.gravity = world_from_support.inverse_transform_vector(&self.gravity);
        self.world.turning = Some(Turning {
            rate: tilting.axis.into_inner() * rate,
            acceleration: tilting.axis.into_inner() * ((ahead - rate) / self.dt),
        });
    }

    fn has_slid(&self, start: &[Vector3<f64>]) -> bool {
        let Some(tilting) = &self.script.tilting else {
            return false;
        };
        let moved = self
            .world
            .bodies
            .iter()
            .zip(start)
            .map(|(b, s)| (b.frame.position - s).xy().norm());
        moved.fold(0.0, f64::max) >= tilting.slide
    }
}

fn hand_of(
    scene: &Scene,
    solids: &BTreeMap<String, Solid>,
    world: &World,
    script: &Script,
    wielding: &Wielding,
) -> Option<Hand> {
    if wielding.holds.is_none() {
        return Some(world.touching(scene, solids, &wielding.shape, wielding.friction));
    }
    Some(Hand::Hold {
        body: world.index(script.target.as_deref()?)?,
        pin: wielding.tool.pin,
        down: wielding.down,
        weld: None,
    })
}

/// Lets contacts, joints and glue take up their loads, with momentum taken away all the while.
fn settle(world: &mut World, dt: f64) {
    let batch = (0.02 / dt).round() as usize;
    for round in 0..(SETTLING / 0.02).round() as usize {
        for _ in 0..batch {
            world.step(None, dt);
            world.bodies.iter_mut().for_each(|body| body.damp(dt, 0.005));
        }
        if round > 3 && world.liveliness() < 1e-7 {
            break;
        }
    }
}

/// What is being written down.
struct Record {
    performance: Performance,
    weights: Vec<f64>,
}

impl Record {
    fn new(script: &Script, world: &World, tracked: &[usize]) -> Self {
        let performance = Performance {
            name: script.name.clone(),
            kind: script.kind,
            target: script.target.clone().unwrap_or_default(),
            held_out: script.held_out,
            tool: script.wielding.as_ref().map(|w| w.tool.clone()),
            force_time: Vec::new(),
            force: Vec::new(),
            torque: Vec::new(),
            tool_pose: Vec::new(),
            track_time: Vec::new(),
            tracks: tracked.iter().map(|i| (world.names[*i].clone(), Vec::new())).collect(),
            support_normal: Vec::new(),
        };
        Self {
            performance,
            weights: Vec::new(),
        }
    }

    fn look(&mut self, script: &Script, world: &World, tracked: &[usize], time: f64) {
        let seen = &mut self.performance;
        seen.track_time.push(time);
        let mut world_from_support = UnitQuaternion::identity();
        if let Some(tilting) = &script.tilting {
            world_from_support = UnitQuaternion::from_axis_angle(&tilting.axis, tilting.angle.at(time).0);
            seen.support_normal
                .push(UnitVector3::new_normalize(world_from_support * Vector3::z()));
        }
        for i in tracked {
            if let Some(track) = seen.tracks.get_mut(&world.names[*i]) {
                track.push(Pose(world_from_support * world.bodies[*i].pose().0));
            }
        }
        if let Some(wielding) = &script.wielding {
            let tool: Frame = wielding.drive.frame(time);
            seen.force_time.push(time);
            seen.tool_pose.push(tool.pose());
        }
    }

    fn feel(&mut self, reading: usize, (force, torque): (Vector3<f64>, Vector3<f64>), weight: f64) {
        let seen = &mut self.performance;
        if seen.force.len() <= reading {
            seen.force.resize(reading + 1, Vector3::zeros());
            seen.torque.resize(reading + 1, Vector3::zeros());
            self.weights.resize(reading + 1, 0.0);
        }
        seen.force[reading] += force * weight;
        seen.torque[reading] += torque * weight;
        self.weights[reading] += weight;
    }

    fn finish(mut self) -> Performance {
        let seen = &mut self.performance;
        let kept = seen.force_time.len();
        seen.force.resize(kept, Vector3::zeros());
        seen.torque.resize(kept, Vector3::zeros());
        for (i, weight) in self.weights.iter().take(kept).enumerate() {
            seen.force[i] /= weight.max(1e-3);
            seen.torque[i] /= weight.max(1e-3);
        }
        self.performance
    }
}
