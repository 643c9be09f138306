//! The bodies that take part, all that acts between them, and the step of time.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};

use super::body::{Frame, RigidBody, Wrench, reach_of};
use super::distance::Piece;
use super::hiding::Hiding;
use super::joint::{Joint, geared};
use super::patch::{Patch, Spring, Standing};
use super::prepared::{Prepared, law_of, shell_of, standing_of, standing_patches};
use super::steady::fineness;
use super::tool::{Hand, Touched};
use super::weld::{Weld, WeldSpring, stiff};
use crate::lab::hidden::{Act, Effect, Occasion};
use crate::lab::{PartShape, Scene, Solid};

/// Stiffness of one point of contact between bodies that meet, N/m.
const MEETING: f64 = 1e4;
/// Stiffness of glue, N/m and N·m/rad.
const GLUE: (f64, f64) = (2e6, 5e3);

#[derive(Clone, Debug)]
struct Contact {
    owner: usize,
    other: usize,
    patch: Patch,
    /// Counts only once one of the two leans.
    leaning_only: bool,
    /// Counts only once this bond has broken.
    after_bond: Option<usize>,
}

#[derive(Clone, Debug)]
struct Bond {
    a: usize,
    b: usize,
    weld: Weld,
    breakaway: f64,
    /// From a to b, axes of a.
    apart: Vector3<f64>,
    broken: bool,
}

/// A turning frame of reference: rate and its derivative, rad/s and rad/s².
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turning {
    pub rate: Vector3<f64>,
    pub acceleration: Vector3<f64>,
}

/// Bodies on a table, z = 0.
#[derive(Clone, Debug)]
pub(crate) struct World {
    pub names: Vec<String>,
    pub bodies: Vec<RigidBody>,
    pub gravity: Vector3<f64>,
    pub turning: Option<Turning>,
    standings: Vec<Option<Standing>>,
    contacts: Vec<Contact>,
    joints: Vec<Joint>,
    bonds: Vec<Bond>,
    hiding: Option<Hiding>,
}

/// Gravity in the axes of the table, which rises by the hidden slopes along +x and +y.
pub(crate) fn gravity_on_table(scene: &Scene) -> Vector3<f64> {
    let [x, y] = scene.support.tilt;
    let normal = Vector3::new(-x.tan(), -y.tan(), 1.0);
    let turn = UnitQuaternion::rotation_between(&normal, &Vector3::z()).unwrap_or_else(UnitQuaternion::identity);
    turn * Vector3::from(scene.gravity)
}

impl World {
    /// The named bodies as they are at first.
    pub fn new(scene: &Scene, solids: &BTreeMap<String, Solid>, names: &[String]) -> Self {
        let prepared: Vec<Prepared> = names
            .iter()
            .filter_map(|name| solids.get(name))
            .map(|solid| Prepared::new(scene, solid))
            .collect();
        let fixed = |name: &String| scene.body.iter().any(|b| &b.name == name && b.fixed);
        let bodies: Vec<RigidBody> = prepared
            .iter()
            .map(|p| RigidBody::new(p.solid, fixed(&p.solid.name), reach_of(p.solid)))
            .collect();
        let mut world = Self {
            names: prepared.iter().map(|p| p.solid.name.clone()).collect(),
            standings: prepared
                .iter()
                .zip(&bodies)
                .map(|(p, body)| standing_of(p, body))
                .collect(),
            bodies,
            gravity: gravity_on_table(scene),
            turning: None,
            contacts: Vec::new(),
            joints: Vec::new(),
            bonds: Vec::new(),
            hiding: None,
        };
        world.add_joints(scene);
        world.add_bonds(scene);
        world.add_contacts(scene, &prepared);
        world
    }

    /// Index of a body by name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    fn add_joints(&mut self, scene: &Scene) {
        for spec in &scene.joint {
            let axis = Vector3::from(spec.axis).try_normalize(1e-9);
            if let (Some(a), Some(b), Some(axis)) = (self.index(&spec.a), self.index(&spec.b), axis) {
                self.joints.push(Joint::new(spec, axis, (a, b), &self.bodies));
            }
        }
    }

    fn add_bonds(&mut self, scene: &Scene) {
        for spec in &scene.bond {
            let (Some(a), Some(b)) = (self.index(&spec.a), self.index(&spec.b)) else {
                continue;
            };
            let (body_a, body_b) = (&self.bodies[a], &self.bodies[b]);
            let middle = (body_a.frame.position + body_b.frame.position) * 0.5;
            let spring = WeldSpring {
                linear: stiff(GLUE.0, body_a.compliance_at(&middle) + body_b.compliance_at(&middle)),
                angular: stiff(GLUE.1, body_a.angular_compliance() + body_b.angular_compliance()),
            };
            let apart = (body_b.frame.position - body_a.frame.position)
                .try_normalize(1e-9)
                .unwrap_or_else(Vector3::z);
            self.bonds.push(Bond {
                a,
                b,
                weld: Weld::new(&body_a.frame, &body_b.frame, &middle, spring),
                breakaway: spec.breakaway.unwrap_or(f64::INFINITY),
                apart: body_a.frame.matrix.tr_mul(&apart),
                broken: false,
            });
        }
    }

    fn add_contacts(&mut self, scene: &Scene, prepared: &[Prepared]) {
        for i in 0..prepared.len() {
            for j in i + 1..prepared.len() {
                let joined = |a: usize, b: usize| (a, b) == (i, j) || (a, b) == (j, i);
                let bond = self.bonds.iter().position(|bond| joined(bond.a, bond.b));
                let jointed = self.joints.iter().any(|joint| joined(joint.a, joint.b));
                let both_fixed = self.bodies[i].fixed && self.bodies[j].fixed;
                if !jointed && !both_fixed {
                    self.add_contact(scene, prepared, (i, j), bond);
                }
            }
        }
    }

    fn add_contact(&mut self, scene: &Scene, prepared: &[Prepared], (i, j): (usize, usize), bond: Option<usize>) {
        let mut resting = false;
        let mut inside = false;
        for (owner, other) in [(i, j), (j, i)] {
            let (upper, lower) = (&prepared[owner], &prepared[other]);
            let patches = standing_patches(upper, lower, &self.bodies[owner], &self.bodies[other], scene);
            resting |= !patches.is_empty();
            inside |= lower.pieces.len() > 1;
            self.contacts.extend(patches.into_iter().map(|patch| Contact {
                owner,
                other,
                patch,
                leaning_only: false,
                after_bond: bond,
            }));
        }
        let law = law_of(scene, &prepared[i], &prepared[j]);
        for (owner, other) in [(i, j), (j, i)] {
            let (a, b) = (&self.bodies[owner], &self.bodies[other]);
            let mass = [a, b]
                .iter()
                .filter(|x| !x.fixed)
                .map(|x| x.mass)
                .fold(f64::INFINITY, f64::min);
            let spring = Spring::blow(MEETING, 0.25 * mass);
            let patches = prepared[other].pieces.iter().map(|piece| Contact {
                owner,
                other,
                patch: Patch::new(&prepared[owner].shell, a.reach, piece.clone(), spring, law),
                leaning_only: resting && !inside,
                after_bond: bond,
            });
            self.contacts.extend(patches);
        }
    }

    /// Lets the body `about` stand otherwise than it should.
    pub fn make_otherwise(&mut self, effects: &[Effect], about: Option<usize>) {
        let Some((about, standing)) = about.and_then(|i| Some((i, self.standings.get_mut(i)?.as_mut()?))) else {
            return;
        };
        for effect in effects {
            if let Act::Make(make) = &effect.act {
                standing.make(*make, &self.bodies[about].frame);
            }
        }
    }

    /// Hides effects in the laws of what slides (the body `about`) and turns, from now on.
    pub fn hide(&mut self, effects: &[Effect], about: Option<usize>, occasion: &Occasion) {
        self.hiding = about.and_then(|i| Hiding::new(effects, (i, self.bodies.get_mut(i)?), occasion));
        for effect in effects {
            if let Act::Joint(law) = effect.act {
                self.joints.iter_mut().for_each(|joint| joint.hide(law));
            }
        }
    }

    /// Whether something goes on even where all is still.
    pub fn never_rests(&self) -> bool {
        self.hiding.as_ref().is_some_and(Hiding::never_rests)
    }

    /// A tool of this shape that touches whatever it meets.
    pub fn touching(&self, scene: &Scene, solids: &BTreeMap<String, Solid>, shape: &PartShape, friction: f64) -> Hand {
        let touched = self.bodies.iter().enumerate().filter_map(|(index, body)| {
            let solid = solids.get(&self.names[index])?;
            Some(Touched {
                index,
                body,
                pieces: solid.parts.iter().map(|part| Piece::of(solid, part)).collect(),
                shell: shell_of(solid),
                foam: scene.body.iter().find(|b| b.name == solid.name).and_then(|b| b.foam),
            })
        });
        Hand::touching(shape, friction, touched.collect())
    }

    /// Into how many steps a step of `dt` must be cut for the joints' sake.
    pub fn fineness(&self, dt: f64) -> usize {
        if self.joints.is_empty() {
            return 1;
        }
        fineness(&self.joints, &self.bodies, dt)
    }

    /// Largest speed of a point of any body, m/s.
    pub fn liveliness(&self) -> f64 {
        self.bodies
            .iter()
            .map(|b| b.frame.velocity.norm() + b.reach * b.frame.angular_velocity.norm())
            .fold(0.0, f64::max)
    }

    /// One step; gives what the tool exerts on the bodies.
    pub fn step(&mut self, tool: Option<(&mut Hand, &Frame)>, dt: f64) -> Wrench {
        self.weigh();
        if let Some(hiding) = &mut self.hiding {
            hiding.act(&mut self.bodies, &self.gravity, dt);
        }
        for (i, (body, standing)) in self.bodies.iter_mut().zip(&mut self.standings).enumerate() {
            if let Some(standing) = standing {
                let leans = body.leans() || !standing.stands();
                let laws = self.hiding.as_ref().map_or(&[][..], |hiding| hiding.laws_of(i));
                let wrench = standing.act(&body.frame, leans, laws, dt);
                body.wrench.add(&wrench, 1.0);
                if let Some(hiding) = &mut self.hiding {
                    hiding.feel(i, wrench.force.z);
                }
            }
        }
        self.touch_each_other(dt);
        for joint in &mut self.joints {
            let wrench = joint.act(&self.bodies[joint.a].frame, &self.bodies[joint.b].frame, dt);
            self.bodies[joint.b].wrench.add(&wrench, 1.0);
            self.bodies[joint.a].wrench.add(&wrench, -1.0);
        }
        self.turn_gears();
        self.hold_bonds();
        let exerted = tool.map_or(Wrench::zero(), |(hand, frame)| hand.act(frame, &mut self.bodies, dt));
        self.bodies.iter_mut().for_each(|body| body.integrate(dt));
        exerted
    }

    /// Weight, and what a turning frame of reference adds (centrifugal, Coriolis and Euler force on each mass).
    fn weigh(&mut self) {
        for body in &mut self.bodies {
            let mut pull = self.gravity;
            if let Some(Turning { rate, acceleration }) = self.turning {
                let (x, v) = (body.frame.position, body.frame.velocity);
                pull -= rate.cross(&v) * 2.0 + rate.cross(&rate.cross(&x)) + acceleration.cross(&x);
            }
            body.wrench.push(&body.frame.position, pull * body.mass);
        }
    }

    fn touch_each_other(&mut self, dt: f64) {
        for contact in &mut self.contacts {
            let waits = contact.after_bond.is_some_and(|bond| !self.bonds[bond].broken);
            let (owner, other) = (&self.bodies[contact.owner], &self.bodies[contact.other]);
            if waits || (contact.leaning_only && !owner.leans() && !other.leans()) {
                continue;
            }
            let wrench = contact.patch.act(&owner.frame, &other.frame, dt);
            self.bodies[contact.owner].wrench.add(&wrench, 1.0);
            self.bodies[contact.other].wrench.add(&wrench, -1.0);
        }
    }

    fn turn_gears(&mut self) {
        let [first, second, ..] = self.joints.as_slice() else {
            return;
        };
        let Some(efforts) = geared(first, second) else { return };
        for (joint, effort) in [first, second].into_iter().zip(efforts) {
            let wrench = joint.along(&self.bodies[joint.a].frame, &self.bodies[joint.b].frame, effort);
            self.bodies[joint.b].wrench.add(&wrench, 1.0);
            self.bodies[joint.a].wrench.add(&wrench, -1.0);
        }
    }

    fn hold_bonds(&mut self) {
        for bond in self.bonds.iter_mut().filter(|bond| !bond.broken) {
            let frame = &self.bodies[bond.a].frame;
            let (wrench, _) = bond.weld.act(frame, &self.bodies[bond.b].frame);
            let apart = frame.matrix * bond.apart;
            let tension = -wrench.force.dot(&apart);
            let across = wrench.force + apart * tension;
            bond.broken = across.norm().hypot(tension.max(0.0)) > bond.breakaway;
            self.bodies[bond.b].wrench.add(&wrench, 1.0);
            self.bodies[bond.a].wrench.add(&wrench, -1.0);
        }
    }
}
