//! Contact impulses of one step: projected Gauss-Seidel over normal, friction and rolling, mass 1 kg.
//!
//! Normal impulses push only; friction keeps within Coulomb's cone (isotropic, by one effective mass for both tangents,
//! so that at the end it opposes the slip exactly); the rolling moment keeps within `rolling * normal force`.

use super::floor::{SPOTS, Spot};
use super::lanes::{F, M3, V3, all, less, more, pick};
use super::path::STEP;

/// Velocities of the centroid, world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub v: V3,
    pub w: V3,
}

/// The coefficients that matter, of each trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Laws {
    pub floor: F,
    pub tool: F,
    pub rolling: F,
    pub restitution: F,
    /// Bias rate, mass scale and impulse scale of the yielding contact at the tool.
    pub soft: Soft,
}

/// A contact that yields as a critically damped spring of time constant `tau`, integrated implicitly (Catto 2011, "Soft
/// constraints"): the same for a light and a heavy thing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Soft {
    rate: F,
    mass: F,
    impulse: F,
}

impl Soft {
    pub(super) fn new(tau: F, h: F) -> Self {
        let stiff = h / tau;
        let a1 = all(2.0) + stiff;
        let a2 = stiff * a1;
        let a3 = F::ONE / (F::ONE + a2);
        Self {
            rate: F::ONE / (tau * a1),
            mass: a2 * a3,
            impulse: a3,
        }
    }
}

/// Impulses at the floor, kept from step to step as a first guess.
#[derive(Clone, Copy, Debug)]
pub(super) struct FloorImpulses {
    normal: [F; SPOTS],
    slip: [(F, F); SPOTS],
    roll: V3,
}

impl FloorImpulses {
    pub(super) const ZERO: Self = Self {
        normal: [F::ZERO; SPOTS],
        slip: [(F::ZERO, F::ZERO); SPOTS],
        roll: V3::ZERO,
    };
}

/// The floor's contacts of one step.
pub(super) struct Floor<'a> {
    pub spots: &'a [Spot],
    pub impulses: &'a mut FloorImpulses,
    stiffness: [(F, F); SPOTS],
    turning: F,
}

impl<'a> Floor<'a> {
    /// Prepares the contacts and applies the impulses of the step before.
    pub(super) fn new(spots: &'a [Spot], impulses: &'a mut FloorImpulses, inverse: &M3, motion: &mut Motion) -> Self {
        let i = inverse;
        let mut stiffness = [(F::ONE, F::ONE); SPOTS];
        for (k, spot) in spots.iter().enumerate() {
            let V3 { x, y, z } = spot.r;
            let normal = F::ONE + y * y * i.a.x - (x * y + x * y) * i.a.y + x * x * i.b.y;
            let along_x = F::ONE + z * z * i.b.y - (z * y + z * y) * i.b.z + y * y * i.c.z;
            let along_y = F::ONE + z * z * i.a.x - (z * x + z * x) * i.a.z + x * x * i.c.z;
            stiffness[k] = (F::ONE / normal, F::ONE / along_x.fast_max(along_y));
            let p = V3::new(impulses.slip[k].0, impulses.slip[k].1, impulses.normal[k]);
            motion.v = motion.v + p;
            motion.w = motion.w + i.apply(spot.r.cross(p));
        }
        motion.w = motion.w + i.apply(impulses.roll);
        Self {
            spots,
            impulses,
            stiffness,
            turning: F::ONE / i.a.x.fast_max(i.b.y).fast_max(i.c.z),
        }
    }

    /// One round over all of them; `inverse_h` is one over the step.
    #[inline(always)]
    pub(super) fn relax(&mut self, motion: &mut Motion, inverse: &M3, laws: &Laws, inverse_h: F) {
        let mut load = F::ZERO;
        for (k, spot) in self.spots.iter().enumerate() {
            let (kn, kt) = self.stiffness[k];
            let r = spot.r;
            // An open gap may close within the step; an overlap is mended by place, not by speed.
            let room = spot.gap.fast_max(F::ZERO) * inverse_h;
            let vz = motion.v.z + motion.w.x * r.y - motion.w.y * r.x;
            let old = self.impulses.normal[k];
            let new = (old - (vz + room) * kn).fast_max(F::ZERO);
            let dn = new - old;
            let pushed = V3::new(r.y * dn, -(r.x * dn), F::ZERO);
            motion.v.z += dn;
            motion.w = motion.w + inverse.apply(pushed);
            self.impulses.normal[k] = new;
            load += new;

            let vx = motion.v.x + motion.w.y * r.z - motion.w.z * r.y;
            let vy = motion.v.y + motion.w.z * r.x - motion.w.x * r.z;
            let (ox, oy) = self.impulses.slip[k];
            let (nx, ny) = clamp2(ox - vx * kt, oy - vy * kt, laws.floor * new);
            let (dx, dy) = (nx - ox, ny - oy);
            motion.v.x += dx;
            motion.v.y += dy;
            let turned = V3::new(-(r.z * dy), r.z * dx, r.x * dy - r.y * dx);
            motion.w = motion.w + inverse.apply(turned);
            self.impulses.slip[k] = (nx, ny);
        }
        let bound = laws.rolling * load;
        let old = self.impulses.roll;
        let wished = old - motion.w * self.turning;
        let size = (wished.norm2() + all(1e-30)).sqrt();
        let new = wished * (bound / size).fast_min(F::ONE);
        motion.w = motion.w + inverse.apply(new - old);
        self.impulses.roll = new;
    }
}

#[inline(always)]
fn clamp2(x: F, y: F, bound: F) -> (F, F) {
    let size = (x * x + y * y + all(1e-30)).sqrt();
    let scale = (bound / size).fast_min(F::ONE);
    (x * scale, y * scale)
}

/// One spot of the tool.
pub(super) struct Grip {
    pub spot: Spot,
    pub normal: V3,
    pub tangents: [V3; 2],
    /// Velocity of the tool there.
    pub driven: V3,
    /// Speed along the normal that is asked for at least.
    least: F,
    stiffness: (F, F),
    /// Mass scale and impulse scale: 1 and 0 where it does not yield.
    soft: (F, F),
    impulse: (F, F, F),
}

/// Speed of approach below which nothing rebounds, m/s.
const QUIET: f32 = 0.02;

impl Grip {
    pub(super) fn new(
        spot: Spot,
        normal: V3,
        tangents: [V3; 2],
        driven: V3,
        inverse: &M3,
        motion: &Motion,
        laws: &Laws,
    ) -> Self {
        let inverse_h = all((1.0 / STEP) as f32);
        let stiff = |d: V3| {
            let c = spot.r.cross(d);
            F::ONE + c.dot(inverse.apply(c))
        };
        let along = stiff(tangents[0]).fast_max(stiff(tangents[1]));
        let approach = (motion.v + motion.w.cross(spot.r) - driven).dot(normal);
        let room = spot.gap.fast_max(F::ZERO) * inverse_h;
        // A contact that rebounds is hard; one that does not yields.
        let yields = less(laws.restitution, all(1e-6));
        let inside = yields & less(spot.gap + approach.fast_min(F::ZERO) / inverse_h, F::ZERO);
        let hits = less(approach, all(-QUIET)) & less(approach + room, F::ZERO);
        Self {
            spot,
            normal,
            tangents,
            driven,
            least: {
                let rigid = pick(hits, -approach * laws.restitution, -room);
                pick(inside, -spot.gap * laws.soft.rate, rigid)
            },
            soft: (
                pick(inside, laws.soft.mass, F::ONE),
                pick(inside, laws.soft.impulse, F::ZERO),
            ),
            stiffness: (F::ONE / stiff(normal), F::ONE / along),
            impulse: (F::ZERO, F::ZERO, F::ZERO),
        }
    }

    #[inline(always)]
    pub(super) fn relax(&mut self, motion: &mut Motion, inverse: &M3, laws: &Laws) {
        let slip = motion.v + motion.w.cross(self.spot.r) - self.driven;
        let (n, x, y) = self.impulse;
        let asked = (self.least - slip.dot(self.normal)) * self.stiffness.0 * self.soft.0;
        let new_n = (n + asked - n * self.soft.1).fast_max(F::ZERO);
        let push = self.normal * (new_n - n);
        motion.v = motion.v + push;
        motion.w = motion.w + inverse.apply(self.spot.r.cross(push));
        let slip = motion.v + motion.w.cross(self.spot.r) - self.driven;
        let (new_x, new_y) = clamp2(
            x - slip.dot(self.tangents[0]) * self.stiffness.1,
            y - slip.dot(self.tangents[1]) * self.stiffness.1,
            laws.tool * new_n,
        );
        let drag = self.tangents[0] * (new_x - x) + self.tangents[1] * (new_y - y);
        motion.v = motion.v + drag;
        motion.w = motion.w + inverse.apply(self.spot.r.cross(drag));
        self.impulse = (new_n, new_x, new_y);
    }

    /// What the tool gave, N·s for a mass of 1 kg.
    pub(super) fn given(&self) -> V3 {
        let (n, x, y) = self.impulse;
        self.normal * n + self.tangents[0] * x + self.tangents[1] * y
    }

    /// Mask of the trials in which it bears.
    pub(super) fn bears(&self) -> F {
        more(self.impulse.0, F::ZERO)
    }
}
