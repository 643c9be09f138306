//! Contact of points of one thing with a convex piece of another, and of a body with the table.

use nalgebra::Vector3;

use super::body::{Frame, Wrench};
use super::distance::{Piece, nearest};
use super::footprint::Foot;
use super::friction::{Bristle, DryFriction};
use crate::lab::hidden::{Make, Pad, SlideLaw};

/// Natural frequency of a body on its contacts, rad/s: it sags by g/ω² = 0.6 µm under its own weight.
pub(crate) const CONTACT_FREQUENCY: f64 = 4000.0;
/// Damping ratio of contacts.
const RATIO: f64 = 0.8;
/// Stiffness of the table under light bodies, N/m, as far as this frequency allows it, rad/s.
const PRESSED: (f64, f64) = (1.5e6, 6000.0);
/// A point hardens beyond this multiple of the usual penetration, by this share of the whole stiffness, at least beyond
/// this depth, m.
const HARDENING: (f64, f64, f64) = (4.0, 0.1, 2e-6);
/// Time over which the usual penetration forgets a larger one, s.
const ADAPTING: f64 = 0.005;

/// How a contact answers penetration. It can only push.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spring {
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    pub damping: f64,
    /// Penetration over which the damping sets in, m (0 = at once): no step of force at first touch.
    pub onset: f64,
    /// What it carries, kg.
    pub mass: f64,
    /// Added to the penetration, m: what stands, stands at once with its weight.
    pub preload: f64,
}

impl Spring {
    /// Carries `mass` at the contact frequency, with its sag made up for.
    pub fn carrying(mass: f64) -> Self {
        Self {
            stiffness: mass * CONTACT_FREQUENCY.powi(2),
            damping: 2.0 * RATIO * mass * CONTACT_FREQUENCY,
            onset: 0.0,
            mass,
            preload: 9.81 / CONTACT_FREQUENCY.powi(2),
        }
    }

    /// Carries `mass` on the table: a light body stands no softer than it may, for it may be pressed hard.
    fn on_table(mass: f64) -> Self {
        let stiffness = (mass * CONTACT_FREQUENCY.powi(2)).max(PRESSED.0.min(mass * PRESSED.1.powi(2)));
        Self {
            stiffness,
            damping: 2.0 * RATIO * (mass * stiffness).sqrt(),
            onset: 0.0,
            mass,
            preload: 9.81 * mass / stiffness,
        }
    }

    /// For blows: `stiffness` (less where `mass` is too light for it), damped for `mass`.
    pub fn blow(stiffness: f64, mass: f64) -> Self {
        let stiffness = stiffness.min(mass * CONTACT_FREQUENCY.powi(2));
        Self {
            stiffness,
            damping: 2.0 * RATIO * (stiffness * mass).sqrt(),
            onset: 2e-5,
            mass,
            preload: 0.0,
        }
    }

    /// Normal force of a point with this share of the stiffness, at a penetration and the rate at which it shrinks; never
    /// negative. A point that is loaded far beyond the `usual` penetration hardens, so that edges are sharp when a
    /// body tips over them.
    #[inline]
    fn force(&self, weight: f64, depth: f64, leaving: f64, usual: f64) -> f64 {
        let ramp = if depth < self.onset { depth / self.onset } else { 1.0 };
        let plain = weight * (self.stiffness * depth - self.damping * ramp * leaving).max(0.0);
        let threshold = (HARDENING.0 * usual).max(HARDENING.2);
        let beyond = depth - threshold;
        if self.onset > 0.0 || beyond <= 0.0 {
            return plain;
        }
        let ramp = (beyond / threshold).min(1.0);
        plain + HARDENING.1 * (self.stiffness * beyond - self.damping * ramp * leaving).max(0.0)
    }
}

/// Points of an owner against one piece of another thing.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    feet: Vec<(Foot, f64, Bristle)>,
    reach: f64,
    piece: Piece,
    spring: Spring,
    pad: Option<Pad>,
    law: DryFriction,
    usual: f64,
}

impl Patch {
    /// `reach` encloses all feet about the owner's origin.
    pub fn new(feet: &[(Foot, f64)], reach: f64, piece: Piece, spring: Spring, law: DryFriction) -> Self {
        let feet = feet
            .iter()
            .map(|(foot, weight)| (foot.clone(), *weight, Bristle::default()))
            .collect();
        Self {
            feet,
            reach,
            piece,
            spring,
            pad: None,
            law,
            usual: 0.0,
        }
    }

    /// The largest penetration, m (negative: nearest approach), and the upward part of the normal there.
    pub fn deepest(&self, owner: &Frame, other: &Frame) -> (f64, f64) {
        let (origin, axes) = self.piece.placed(other);
        let centre = axes.tr_mul(&(owner.position - origin));
        let mut best = (f64::NEG_INFINITY, 0.0);
        for (foot, _, _) in &self.feet {
            let (p, radius) = foot.place(owner);
            let found = nearest(&self.piece.shape, &axes.tr_mul(&(p - origin)), &centre);
            if radius - found.distance > best.0 {
                best = (radius - found.distance, (axes * found.normal).z);
            }
        }
        best
    }

    /// Soft in this way from now on.
    pub fn tip_with(&mut self, pad: Pad) {
        self.pad = Some(pad);
    }

    /// Makes the present penetration the one at which the owner rests.
    pub fn level_out(&mut self, depth: f64) {
        self.spring.preload -= depth;
    }

    /// The wrench on the owner; the other thing gets the opposite.
    pub fn act(&mut self, owner: &Frame, other: &Frame, dt: f64) -> Wrench {
        let mut wrench = Wrench::zero();
        let (origin, axes) = self.piece.placed(other);
        let apart = owner.position - origin;
        if apart.norm_squared() > (self.reach + self.piece.reach + 1e-4).powi(2) {
            return wrench;
        }
        let centre = axes.tr_mul(&apart);
        let (usual, mut total) = (self.usual, 0.0);
        let law = self.law.eased(self.spring.mass, self.spring.stiffness * usual, dt);
        for (foot, weight, bristle) in &mut self.feet {
            let (p, radius) = foot.place(owner);
            let found = nearest(&self.piece.shape, &axes.tr_mul(&(p - origin)), &centre);
            let depth = radius - found.distance + self.spring.preload;
            if depth <= 0.0 || found.distance < -0.02 {
                bristle.release();
                continue;
            }
            let normal = axes * found.normal;
            let at = p - normal * (radius - 0.5 * depth.min(radius));
            let velocity = owner.velocity_at(&at) - other.velocity_at(&at);
            total += *weight * depth;
            let leaving = normal.dot(&velocity);
            let size = match self.pad {
                Some(pad) => *weight * pad.pushes(depth, leaving),
                None => self.spring.force(*weight, depth, leaving, usual),
            };
            let friction = bristle.advance(&law, &normal, &velocity, dt);
            wrench.push(&at, (normal + friction) * size);
        }
        self.usual = total.max(usual + (total - usual) * dt / ADAPTING);
        wrench
    }
}

/// A body on the table, the plane z = 0.
#[derive(Clone, Debug)]
pub(crate) struct Standing {
    feet: Vec<(Foot, f64, Bristle)>,
    /// Points all over, for a body that has fallen over.
    guards: Vec<(Foot, f64, Bristle)>,
    reach: f64,
    spring: Spring,
    law: DryFriction,
    stands: bool,
    usual: f64,
}

impl Standing {
    /// `lowest`: height of the lowest foot at first.
    pub fn new(
        feet: &[(Foot, f64)],
        guards: &[(Foot, f64)],
        reach: f64,
        mass: f64,
        lowest: f64,
        law: DryFriction,
    ) -> Self {
        let with = |feet: &[(Foot, f64)]| feet.iter().map(|(f, w)| (f.clone(), *w, Bristle::default())).collect();
        let mut spring = Spring::on_table(mass);
        let stands = lowest.abs() < 5e-4;
        if stands {
            spring.preload += lowest;
        }
        Self {
            feet: with(feet),
            guards: with(guards),
            reach,
            spring,
            law,
            stands,
            usual: 0.0,
        }
    }

    /// Whether the body stood on the table at first.
    pub fn stands(&self) -> bool {
        self.stands
    }

    /// Stands otherwise than it should.
    pub fn make(&mut self, make: Make, owner: &Frame) {
        match make {
            Make::Presliding(length) => self.law = self.law.softened(length),
            Make::Soft(compliance) if compliance > 0.0 => {
                let before = self.spring.stiffness;
                let stiffness = before / (1.0 + compliance * before);
                self.spring.damping *= (stiffness / before).sqrt();
                self.spring.stiffness = stiffness;
                self.spring.preload *= before / stiffness;
                // What hardens far beyond the usual would not be soft.
                self.spring.onset = 1e-9;
            }
            Make::Soft(_) => {}
            Make::Pressure(share) => {
                let far = |foot: &Foot| (foot.place(owner).0 - owner.position).xy().norm_squared();
                let most = self.feet.iter().map(|(foot, ..)| far(foot)).fold(1e-12, f64::max);
                let sum = |feet: &[(Foot, f64, Bristle)]| feet.iter().map(|(_, weight, _)| weight).sum::<f64>();
                let before = sum(&self.feet);
                for (foot, weight, _) in &mut self.feet {
                    *weight *= 1.0 + share * far(foot) / most;
                }
                let kept = before / sum(&self.feet);
                self.feet.iter_mut().for_each(|(_, weight, _)| *weight *= kept);
            }
        }
    }

    /// The wrench on the body, whose friction on the table is changed by what is `hidden`.
    pub fn act(&mut self, owner: &Frame, leans: bool, hidden: &[SlideLaw], dt: f64) -> Wrench {
        let mut wrench = Wrench::zero();
        if owner.position.z > self.reach + 1e-3 {
            return wrench;
        }
        let (usual, mut total) = (self.usual, 0.0);
        let law = self.law.eased(self.spring.mass, self.spring.stiffness * usual, dt);
        let all = if leans { self.guards.as_mut_slice() } else { &mut [] };
        for (foot, weight, bristle) in self.feet.iter_mut().chain(all) {
            let (p, radius) = foot.place(owner);
            let depth = radius - p.z + self.spring.preload;
            if depth <= 0.0 {
                bristle.release();
                continue;
            }
            let at = Vector3::new(p.x, p.y, p.z - radius);
            let velocity = owner.velocity_at(&at);
            total += *weight * depth;
            let size = self.spring.force(*weight, depth, velocity.z, usual);
            let factor: f64 = hidden.iter().map(|h| h.factor(&at, &velocity)).product();
            let law = if hidden.is_empty() { law } else { law.times(factor) };
            let friction = bristle.advance(&law, &Vector3::z(), &velocity, dt);
            wrench.push(&at, (Vector3::z() + friction) * size);
        }
        self.usual = total.max(usual + (total - usual) * dt / ADAPTING);
        wrench
    }
}
