//! Virtual manipulation: a hand takes, pushes or opens, and everything that comes along is named.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::{
    CoefficientCombineRule, ColliderBuilder, ColliderHandle, GenericJointBuilder, JointAxesMask, RigidBodyBuilder,
    RigidBodyHandle,
};

use super::deed::Deed;
use super::engine::{Engine, STEP, inertia_along, no_table};
use super::film::Film;
use super::layout::lay_out;
use super::outcome::{Opened, Outcome, part_outcome};
use super::scene::{Motion, Part, PartId, Scene};
use crate::base::{Error, Result};
use crate::twin::{JointKind, Model, read_twin};

/// Time for everything to come to rest before the hand comes, and after it is done, s.
const SETTLING: f64 = 0.5;
/// Height of a lift, m, and its time, s.
const LIFT: f64 = 0.12;
const LIFT_TIME: f64 = 1.5;
/// Radius of a fingertip, and its distance from the thing before it comes, m.
const FINGER: f64 = 0.008;
const GAP: f64 = 0.003;
/// How far a finger goes on once it has come to the thing, m.
const PUSH: f64 = 0.1;
/// Where no end of a joint is known: how far it is opened, m or rad.
const OPENING: f64 = 0.1;
const TURNING: f64 = 1.0;
/// Share of the way to the known end of a joint that it is opened.
const SHARE: f64 = 0.95;
/// A hand does not pull harder than this, N.
const STRENGTH: f64 = 60.0;
/// No deed takes longer, s.
const LONGEST: f64 = 12.0;

/// Reads the twin of a folder and does `deed` to it in the embedded engine.
///
/// # Errors
/// Where the twin cannot be read, has no table, or has no such part or joint.
pub fn manipulate_folder(folder: &Path, deed: &Deed) -> Result<Outcome> {
    let (model, _) = read_twin(folder)?;
    manipulate(&model, deed)
}

/// How a film is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilmFormat {
    /// One binary glTF with an animation.
    Animation,
    /// PNG pictures in their order.
    Pictures,
}

/// As [`manipulate_folder`], with a film of it, the bytes of each file: 31 pictures a second; the hand is not drawn.
///
/// # Errors
/// As [`manipulate_folder`], and where pictures are wanted of what has no shape.
pub fn film_folder(folder: &Path, deed: &Deed, format: FilmFormat) -> Result<(Outcome, Vec<Vec<u8>>)> {
    let (model, _) = read_twin(folder)?;
    let scene = lay_out(&model)?;
    let mut engine = Engine::new(&scene, &model).ok_or_else(no_table)?.refined();
    engine.film = Some(Film::default());
    let mut play = Play::new(engine);
    let outcome = play.carry_out(&scene, &model, deed)?;
    let film = play.engine.film.take().unwrap_or_default();
    let files = match format {
        FilmFormat::Animation => vec![film.glb(&scene, &model)?],
        FilmFormat::Pictures => film.pngs(&scene, &model)?,
    };
    Ok((outcome, files))
}

/// Does `deed` to a twin in the embedded engine, from the pose of the first view.
///
/// # Errors
/// Where the twin has no table, or no such part or joint.
pub fn manipulate(model: &Model, deed: &Deed) -> Result<Outcome> {
    let scene = lay_out(model)?;
    let engine = Engine::new(&scene, model).ok_or_else(no_table)?.refined();
    Play::new(engine).carry_out(&scene, model, deed)
}

fn find(scene: &Scene, name: &str) -> Result<PartId> {
    let of_tree = || scene.trees.iter().position(|t| t.name == name);
    let found = scene
        .find(name)
        .or_else(|| of_tree().map(|tree| PartId { tree, part: 0 }));
    found.ok_or_else(|| {
        let names: Vec<&str> = scene.parts().map(|(_, p)| p.link.as_str()).collect();
        Error::bad_input("twin.json", "bodies", name, format!("one of {}", names.join(", ")))
    })
}

fn find_joint(scene: &Scene, name: &str) -> Result<PartId> {
    let movable = |p: &Part| p.hold().is_some_and(|h| !h.motions.is_empty());
    let called = |p: &Part| p.link == name || p.hold().is_some_and(|h| h.joint == name || h.name == name);
    let found = scene.parts().find(|(_, p)| movable(p) && called(p)).map(|(id, _)| id);
    found.ok_or_else(|| {
        let held = scene.parts().filter(|(_, p)| movable(p)).filter_map(|(_, p)| p.hold());
        let names: Vec<&str> = held.map(|h| h.joint.as_str()).collect();
        let expected = match names.as_slice() {
            [] => "a twin with joints that move".to_string(),
            names => format!("one of {}", names.join(", ")),
        };
        Error::bad_input("twin.json", "joints", name, expected)
    })
}

/// A scene at rest, and what each part was like then.
struct Play<'a> {
    engine: Engine<'a>,
    start: Vec<Isometry3<f64>>,
    up: Vector3<f64>,
    /// Effort of the hand in the steps in which it had any, N.
    efforts: Vec<f64>,
}

impl<'a> Play<'a> {
    fn new(engine: Engine<'a>) -> Self {
        let up = engine
            .scene
            .floor
            .as_ref()
            .map_or(Vector3::z(), |f| f.normal.into_inner());
        let mut play = Self {
            engine,
            start: Vec::new(),
            up,
            efforts: Vec::new(),
        };
        play.wait(SETTLING);
        play.start = play.poses();
        play
    }

    fn carry_out(&mut self, scene: &Scene, model: &Model, deed: &Deed) -> Result<Outcome> {
        match deed {
            Deed::Pick { target } => self.pick(find(scene, target)?),
            Deed::Push { target, heading, speed } => self.push(find(scene, target)?, model, *heading, *speed),
            Deed::Open { joint, speed } => self.open(find_joint(scene, joint)?, model, *speed),
        }
    }

    fn wait(&mut self, seconds: f64) {
        (0..(seconds / STEP) as usize).for_each(|_| self.engine.step());
    }

    fn poses(&self) -> Vec<Isometry3<f64>> {
        self.engine
            .bodies()
            .iter()
            .map(|(_, _, h)| self.engine.pose(*h))
            .collect()
    }

    fn handle(&self, id: PartId) -> Result<RigidBodyHandle> {
        let name = &self.engine.scene.part(id).link;
        let shapeless = || Error::Failed(format!("{name}: no solid shape was seen, so it cannot be touched"));
        self.engine.body(id).ok_or_else(shapeless)
    }

    /// Where the centre of mass of a part is now.
    fn com(&self, id: PartId, handle: RigidBodyHandle) -> Point3<f64> {
        self.engine.pose(handle) * Point3::from(self.engine.scene.part(id).com)
    }

    /// What became of every part; `way` is the hand's own, world.
    fn outcome(&self, target: PartId, way: Vector3<f64>) -> Outcome {
        let scene = self.engine.scene;
        let moved = self.engine.bodies().into_iter().zip(&self.start);
        let parts = moved.map(|((id, part, handle), start)| {
            let end = self.engine.pose(handle);
            part_outcome(part, [start, &end], &way, id == target)
        });
        let names = |[a, b]: [PartId; 2]| [a, b].map(|id| scene.part(id).link.clone());
        let left_out = scene.parts().filter(|(id, _)| self.engine.body(*id).is_none());
        let efforts = &self.efforts;
        Outcome {
            parts: parts.collect(),
            broken: self.engine.broken().into_iter().map(names).collect(),
            left_out: left_out.map(|(_, p)| p.link.clone()).collect(),
            mean_effort: (!efforts.is_empty()).then(|| efforts.iter().sum::<f64>() / efforts.len() as f64),
            opened: None,
        }
    }

    /// A hand that takes hold of a body where it is.
    fn hold(&mut self, body: RigidBodyHandle) -> RigidBodyHandle {
        let world = &mut self.engine.world;
        let pose = *world.bodies[body].position();
        let hand = world.insert_body(RigidBodyBuilder::kinematic_position_based().pose(pose));
        let grip = GenericJointBuilder::new(JointAxesMask::LOCKED_FIXED_AXES).contacts_enabled(false);
        world.insert_impulse_joint(hand, body, grip.build());
        hand
    }

    fn pick(&mut self, target: PartId) -> Result<Outcome> {
        let part = self.handle(target)?;
        let at = self.engine.pose(part);
        let hand = self.hold(part);
        let steps = (LIFT_TIME / STEP) as usize;
        for k in 1..=steps {
            let s = k as f64 / steps as f64;
            // The way of least jerk (Flash & Hogan 1985).
            let share = s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
            let mut pose = at;
            pose.translation.vector += self.up * (LIFT * share);
            self.engine.world.bodies[hand].set_next_kinematic_position(pose.into());
            self.engine.step();
        }
        self.wait(SETTLING);
        Ok(self.outcome(target, self.up * LIFT))
    }

    fn push(&mut self, target: PartId, model: &Model, heading: f64, speed: f64) -> Result<Outcome> {
        let part = self.handle(target)?;
        let along = self.level(heading);
        let com = self.com(target, part);
        let reach = self.reach(target, part, model, &-along, &com) + FINGER + GAP;
        let start = Isometry3::translation(
            com.x - reach * along.x,
            com.y - reach * along.y,
            com.z - reach * along.z,
        );
        let hand = self
            .engine
            .world
            .insert_body(RigidBodyBuilder::kinematic_position_based().pose(start.into()));
        // Smooth, whatever it touches: friction here would carry an undetermined share of the weight.
        let tip = ColliderBuilder::ball(FINGER)
            .friction(0.0)
            .friction_combine_rule(CoefficientCombineRule::GeometricMean);
        let tip = self.engine.world.insert_collider(tip, Some(hand));
        let travel = GAP + PUSH;
        let steps = ((travel / speed).min(LONGEST) / STEP) as usize;
        for k in 1..=steps {
            let mut pose = start;
            pose.translation.vector += along * (speed * STEP * k as f64);
            self.engine.world.bodies[hand].set_next_kinematic_position(pose.into());
            self.engine.step();
            let effort = self.force_on(tip);
            // From the first touch on, moments without contact count: a thing that slides ahead is braked meanwhile.
            let touched = effort > 0.0 || !self.efforts.is_empty();
            self.efforts.extend(touched.then_some(effort));
        }
        self.engine.world.remove_body(hand);
        self.wait(SETTLING);
        Ok(self.outcome(target, along * (speed * STEP * steps as f64 - GAP)))
    }

    /// A level direction, `heading` about the table's normal from the world's x axis.
    fn level(&self, heading: f64) -> Vector3<f64> {
        let upright = super::urdf::upright_to(&Unit::new_normalize(self.up));
        let about = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        upright * (about * Vector3::x())
    }

    /// How far a part reaches beyond `from` in a direction at about that height, m.
    fn reach(
        &self,
        id: PartId,
        handle: RigidBodyHandle,
        model: &Model,
        along: &Vector3<f64>,
        from: &Point3<f64>,
    ) -> f64 {
        let part = self.engine.scene.part(id);
        let pose = self.engine.pose(handle);
        let meshes = part.hulls.iter().filter_map(|path| model.meshes.get(path));
        let points = meshes.flat_map(|m| &m.vertices).map(|v| pose * (v + part.link_origin));
        points.map(|p| (p - from).dot(along)).fold(0.0, f64::max)
    }

    /// The force between a fingertip and all that it touches, N.
    fn force_on(&self, tip: ColliderHandle) -> f64 {
        let pairs = self.engine.world.narrow_phase.contact_pairs_with(tip);
        let impulse: f64 = pairs.map(|p| p.total_impulse_magnitude()).sum();
        impulse / STEP
    }

    fn open(&mut self, target: PartId, model: &Model, speed: f64) -> Result<Outcome> {
        let child = self.handle(target)?;
        let scene = self.engine.scene;
        let (Some(hold), Some(motion)) = (
            scene.part(target).hold(),
            scene.part(target).hold().and_then(|h| h.motions.first()),
        ) else {
            return Err(Error::Failed("nothing to open".into()));
        };
        let parent = self.handle(PartId {
            part: hold.parent,
            ..target
        })?;
        let other_hand = self.hold(parent);
        let goal = goal(motion);
        let grip = self.grip(target, model, motion.turns && hold.kind != JointKind::Spherical);
        let (mut furthest, mut drive) = (0.0_f64, 0.0_f64);
        for _ in 0..((goal.abs() / speed + 2.0).min(LONGEST) / STEP) as usize {
            let (q, now) = self.engine.position_and_speed([parent, child], hold, motion);
            furthest = if goal * (q - furthest) > 0.0 { q } else { furthest };
            if (q - goal) * goal > 0.0 {
                break;
            }
            let pose = self.engine.pose(child);
            let point = pose * grip;
            let axis = pose.rotation * motion.axis.into_inner();
            let arm = point.coords - pose.translation.vector;
            let lever = if motion.turns { axis.cross(&arm) } else { axis };
            let error = goal.signum() * speed - now;
            // A servo on the speed: proportional and integral, no stronger than a hand.
            let [gain, rate] = servo(inertia_along(scene.part(target), motion), lever.norm());
            drive = (drive + gain * rate * STEP * error).clamp(-STRENGTH, STRENGTH);
            let force = lever.normalize() * (drive + gain * error).clamp(-STRENGTH, STRENGTH);
            self.efforts.push(force.norm());
            self.engine.pulls.push((child, force, point));
            self.engine.step();
        }
        self.engine.world.remove_body(other_hand);
        self.wait(SETTLING);
        let (left, _) = self.engine.position_and_speed([parent, child], hold, motion);
        let com = Point3::from(scene.part(target).com);
        let began = self.engine.bodies().iter().position(|b| b.0 == target);
        let began = began.map_or(com, |i| self.start[i] * com);
        let mut outcome = self.outcome(target, self.com(target, child) - began);
        outcome.opened = Some(Opened {
            joint: hold.joint.clone(),
            furthest,
            left,
            unit: if motion.turns { "rad" } else { "m" },
        });
        Ok(outcome)
    }

    /// Where a hand takes hold: the centre of mass, or of what turns the corner furthest from the axis, part frame.
    fn grip(&self, id: PartId, model: &Model, turns: bool) -> Point3<f64> {
        let part = self.engine.scene.part(id);
        let Some(hold) = part.hold().filter(|_| turns) else {
            return part.com.into();
        };
        let meshes = part.hulls.iter().filter_map(|path| model.meshes.get(path));
        let points = meshes.flat_map(|m| &m.vertices).map(|v| v + part.link_origin);
        let off = |p: &Point3<f64>| hold.axis.cross(&p.coords).norm();
        points
            .max_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(part.com.into())
    }
}

/// Gains of a servo on the speed of what has that inertia (kg·m² or kg) at that lever (m, or 1): force per speed, and how fast
/// what is lacking adds up, 1/s. One step takes away a fifth of an error at most, or what is light would be flung to and fro.
fn servo(inertia: f64, lever: f64) -> [f64; 2] {
    let lever = lever.max(0.02);
    let gain = (0.2 * inertia / (lever * STEP)).min(4.0);
    [gain, (10.0 / lever).min(0.25 * gain * lever / inertia)]
}

/// How far to open: nearly to the end that is further away, or by a documented way where no end is known.
fn goal(motion: &Motion) -> f64 {
    let documented = if motion.turns { TURNING } else { OPENING };
    match motion.range {
        Some([low, _]) if motion.lay => documented * if low < 0.0 { -1.0 } else { 1.0 },
        Some([low, high]) if high >= -low => SHARE * high,
        Some([low, _]) => SHARE * low,
        None => documented,
    }
}
