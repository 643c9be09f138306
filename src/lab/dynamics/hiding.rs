//! Hidden effects at work on one body of the world.

use nalgebra::Vector3;

use super::body::RigidBody;
use crate::lab::hidden::{Act, Effect, Occasion, SlideLaw, Surroundings};

/// Raised by more than this, the body is off the table, m.
const OFF: f64 = 1e-3;

/// The hidden laws of one body.
#[derive(Clone, Debug)]
pub(super) struct Hiding {
    body: usize,
    laws: Vec<SlideLaw>,
    /// What weighs, kg.
    mass: f64,
    height: f64,
    clock: f64,
}

impl Hiding {
    /// None where nothing is hidden in how the body slides. Changes the body's mass where some of it moves otherwise.
    pub fn new(effects: &[Effect], (body, rigid): (usize, &mut RigidBody), occasion: &Occasion) -> Option<Self> {
        let of = |effect: &Effect| match &effect.act {
            Act::Slide(law) => Some(law.clone()),
            _ => None,
        };
        let mut laws: Vec<SlideLaw> = effects.iter().filter_map(of).collect();
        if laws.is_empty() || rigid.fixed {
            return None;
        }
        let mass = rigid.mass;
        for law in &mut laws {
            law.begin(occasion.wait, occasion.slid, occasion.first);
            rigid.mass *= law.bear(mass);
        }
        Some(Self {
            body,
            laws,
            mass,
            height: rigid.frame.position.z,
            clock: occasion.start,
        })
    }

    /// The laws that bear on the friction of this body.
    pub fn laws_of(&self, body: usize) -> &[SlideLaw] {
        if body == self.body { &self.laws } else { &[] }
    }

    /// What the table bears of a body, N.
    pub fn feel(&mut self, body: usize, bears: f64) {
        if body == self.body {
            self.laws.iter_mut().for_each(|law| law.feel(bears));
        }
    }

    /// Whether a law acts on what rests.
    pub fn never_rests(&self) -> bool {
        self.laws.iter().any(SlideLaw::never_rests)
    }

    /// Advances the laws and adds their forces.
    pub fn act(&mut self, bodies: &mut [RigidBody], gravity: &Vector3<f64>, dt: f64) {
        let body = &mut bodies[self.body];
        let surroundings = Surroundings {
            place: body.frame.position,
            velocity: body.frame.velocity,
            spin: body.frame.angular_velocity,
            gravity: *gravity,
            mass: self.mass,
            clock: self.clock,
            dt,
        };
        let stands = body.frame.position.z < self.height + OFF;
        for law in &mut self.laws {
            if stands || law.acts_in_the_air() {
                let force = law.advance(&surroundings);
                body.wrench.push(&surroundings.place, force);
                body.wrench.moment += law.couple(&surroundings);
            }
        }
        self.clock += dt;
    }
}
