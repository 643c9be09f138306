//! Contact impulses of one step: projected Gauss-Seidel over normal, friction and rolling, mass 1 kg.
//!
//! Normal impulses push only; friction keeps within Coulomb's cone (isotropic, by one effective mass for both tangents,
//! so that at the end it opposes the slip exactly); the rolling moment keeps within `rolling * normal force`.

use pulp::Simd;

use super::floor::{SPOTS, Spot};
use super::lanes::{F, Mask, V3, less, more, pick};
use super::path::STEP;
use super::turns::M3;

/// Velocities of the centroid, world axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion<S: Simd> {
    pub v: V3<S>,
    pub w: V3<S>,
}

/// The coefficients that matter, of each trial.
#[derive(Clone, Copy, Debug)]
pub(super) struct Laws<S: Simd> {
    pub floor: F<S>,
    pub tool: F<S>,
    pub rolling: F<S>,
    pub restitution: F<S>,
    /// Bias rate, mass scale and impulse scale of the yielding contact at the tool.
    pub soft: Soft<S>,
}

/// A contact that yields as a critically damped spring of time constant `tau`, integrated implicitly (Catto 2011, "Soft
/// constraints"): the same for a light and a heavy thing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Soft<S: Simd> {
    rate: F<S>,
    mass: F<S>,
    impulse: F<S>,
}

impl<S: Simd> Soft<S> {
    #[inline(always)]
    pub(super) fn new(tau: F<S>, h: f32) -> Self {
        let stiff = tau.like(h).over(tau);
        let a1 = stiff + 2.0;
        let a2 = stiff * a1;
        let a3 = (a2 + 1.0).inverse();
        Self {
            rate: (tau * a1).inverse(),
            mass: a2 * a3,
            impulse: a3,
        }
    }
}

/// Impulses at the floor, kept from step to step as a first guess.
#[derive(Clone, Copy, Debug)]
pub(super) struct FloorImpulses<S: Simd> {
    normal: [F<S>; SPOTS],
    slip: [(F<S>, F<S>); SPOTS],
    roll: V3<S>,
}

impl<S: Simd> FloorImpulses<S> {
    #[inline(always)]
    pub(super) fn zero(simd: S) -> Self {
        let zero = F::all(simd, 0.0);
        Self {
            normal: [zero; SPOTS],
            slip: [(zero, zero); SPOTS],
            roll: V3::zero(simd),
        }
    }

    /// Takes over those of the trials that are awake.
    #[inline(always)]
    pub(super) fn keep(&mut self, awake: Mask<S>, new: &Self) {
        for k in 0..SPOTS {
            self.normal[k] = pick(awake, new.normal[k], self.normal[k]);
            self.slip[k].0 = pick(awake, new.slip[k].0, self.slip[k].0);
            self.slip[k].1 = pick(awake, new.slip[k].1, self.slip[k].1);
        }
        self.roll = V3::pick(awake, new.roll, self.roll);
    }
}

/// The floor's contacts of one step.
pub(super) struct Floor<'a, S: Simd> {
    pub spots: &'a [Spot<S>],
    pub impulses: &'a mut FloorImpulses<S>,
    stiffness: [(F<S>, F<S>); SPOTS],
    turning: F<S>,
}

impl<'a, S: Simd> Floor<'a, S> {
    /// Prepares the contacts and applies the impulses of the step before.
    #[inline(always)]
    pub(super) fn new(
        spots: &'a [Spot<S>],
        impulses: &'a mut FloorImpulses<S>,
        inverse: &M3<S>,
        motion: &mut Motion<S>,
    ) -> Self {
        let i = inverse;
        let one = motion.v.x.like(1.0);
        let mut stiffness = [(one, one); SPOTS];
        for (k, spot) in spots.iter().enumerate() {
            let V3 { x, y, z } = spot.r;
            let normal = one + y * y * i.a.x - (x * y + x * y) * i.a.y + x * x * i.b.y;
            let along_x = one + z * z * i.b.y - (z * y + z * y) * i.b.z + y * y * i.c.z;
            let along_y = one + z * z * i.a.x - (z * x + z * x) * i.a.z + x * x * i.c.z;
            stiffness[k] = (normal.inverse(), along_x.max(along_y).inverse());
            let p = V3::new(impulses.slip[k].0, impulses.slip[k].1, impulses.normal[k]);
            motion.v = motion.v + p;
            motion.w = motion.w + i.apply(spot.r.cross(p));
        }
        motion.w = motion.w + i.apply(impulses.roll);
        Self {
            spots,
            impulses,
            stiffness,
            turning: i.a.x.max(i.b.y).max(i.c.z).inverse(),
        }
    }

    /// One round over all of them in the trials that are `open`; `inverse_h` is one over the step.
    #[inline(always)]
    pub(super) fn relax(
        &mut self,
        motion: &mut Motion<S>,
        inverse: &M3<S>,
        laws: &Laws<S>,
        inverse_h: f32,
        open: Mask<S>,
    ) {
        let mut load = motion.v.x.like(0.0);
        for (k, spot) in self.spots.iter().enumerate() {
            let (kn, kt) = self.stiffness[k];
            let r = spot.r;
            // An open gap may close within the step; an overlap is mended by place, not by speed.
            let room = spot.gap.positive() * inverse_h;
            let vz = motion.v.z + motion.w.x * r.y - motion.w.y * r.x;
            let old = self.impulses.normal[k];
            let new = pick(open, (old - (vz + room) * kn).positive(), old);
            let dn = new - old;
            motion.v.z = motion.v.z + dn;
            let (tx, ty) = (r.y * dn, -(r.x * dn));
            let i = inverse;
            motion.w.x = motion.w.x + i.a.x * tx + i.a.y * ty;
            motion.w.y = motion.w.y + i.b.x * tx + i.b.y * ty;
            motion.w.z = motion.w.z + i.c.x * tx + i.c.y * ty;
            self.impulses.normal[k] = new;
            load = load + new;

            let vx = motion.v.x + motion.w.y * r.z - motion.w.z * r.y;
            let vy = motion.v.y + motion.w.z * r.x - motion.w.x * r.z;
            let (ox, oy) = self.impulses.slip[k];
            let (nx, ny) = clamp2(ox - vx * kt, oy - vy * kt, laws.floor * new);
            let (nx, ny) = (pick(open, nx, ox), pick(open, ny, oy));
            let (dx, dy) = (nx - ox, ny - oy);
            motion.v.x = motion.v.x + dx;
            motion.v.y = motion.v.y + dy;
            let turned = V3::new(-(r.z * dy), r.z * dx, r.x * dy - r.y * dx);
            motion.w = motion.w + inverse.apply(turned);
            self.impulses.slip[k] = (nx, ny);
        }
        let bound = laws.rolling * load;
        let old = self.impulses.roll;
        let wished = old - motion.w * self.turning;
        let size = (wished.norm2() + 1e-30).sqrt();
        let new = V3::pick(open, wished * bound.over(size).min(bound.like(1.0)), old);
        motion.w = motion.w + inverse.apply(new - old);
        self.impulses.roll = new;
    }
}

#[inline(always)]
fn clamp2<S: Simd>(x: F<S>, y: F<S>, bound: F<S>) -> (F<S>, F<S>) {
    let size = (x * x + y * y + 1e-30).sqrt();
    let scale = bound.over(size).min(bound.like(1.0));
    (x * scale, y * scale)
}

/// Normal impulse and those along both tangents.
pub(super) type Impulse<S> = (F<S>, F<S>, F<S>);

/// One spot of the tool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip<S: Simd> {
    /// Which of the tool's spots it is.
    pub number: usize,
    pub spot: Spot<S>,
    pub normal: V3<S>,
    pub tangents: [V3<S>; 2],
    /// Velocity of the tool there.
    pub driven: V3<S>,
    /// Speed along the normal that is asked for at least.
    least: F<S>,
    stiffness: (F<S>, F<S>),
    /// Mass scale and impulse scale: 1 and 0 where it does not yield.
    soft: (F<S>, F<S>),
    impulse: Impulse<S>,
}

/// Speed of approach below which nothing rebounds, m/s.
const QUIET: f32 = 0.02;

impl<S: Simd> Grip<S> {
    #[inline(always)]
    pub(super) fn new(
        spot: Spot<S>,
        normal: V3<S>,
        tangents: [V3<S>; 2],
        driven: V3<S>,
        inverse: &M3<S>,
        motion: &Motion<S>,
        laws: &Laws<S>,
    ) -> Self {
        let h = STEP as f32;
        let inverse_h = (1.0 / STEP) as f32;
        let along = stiff(&spot, tangents[0], inverse).max(stiff(&spot, tangents[1], inverse));
        let approach = (motion.v + motion.w.cross(spot.r) - driven).dot(normal);
        let room = spot.gap.positive() * inverse_h;
        let (zero, one) = (room.like(0.0), room.like(1.0));
        // A contact that rebounds is hard; one that does not yields.
        let yields = less(laws.restitution, room.like(1e-6));
        let inside = yields & less(spot.gap + approach.min(zero) * h, zero);
        let hits = less(approach, room.like(-QUIET)) & less(approach + room, zero);
        let rigid = pick(hits, -approach * laws.restitution, -room);
        Self {
            number: 0,
            spot,
            normal,
            tangents,
            driven,
            least: pick(inside, -spot.gap * laws.soft.rate, rigid),
            soft: (pick(inside, laws.soft.mass, one), pick(inside, laws.soft.impulse, zero)),
            stiffness: (stiff(&spot, normal, inverse).inverse(), along.inverse()),
            impulse: (zero, zero, zero),
        }
    }

    /// Begins with impulses of the step before; where it is not `near` it never bears.
    #[inline(always)]
    pub(super) fn hold(&mut self, near: Mask<S>, impulse: Impulse<S>) {
        let zero = self.least.like(0.0);
        self.least = pick(near, self.least, zero.like(-1e9));
        self.impulse = (
            pick(near, impulse.0, zero),
            pick(near, impulse.1, zero),
            pick(near, impulse.2, zero),
        );
    }

    /// The impulses in the trials that are awake, none in the others.
    #[inline(always)]
    pub(super) fn kept(&self, awake: Mask<S>) -> Impulse<S> {
        let zero = self.least.like(0.0);
        let (n, x, y) = self.impulse;
        (pick(awake, n, zero), pick(awake, x, zero), pick(awake, y, zero))
    }

    /// Applies the impulses that it begins with.
    #[inline(always)]
    pub(super) fn resume(&self, motion: &mut Motion<S>, inverse: &M3<S>) {
        let given = self.given();
        motion.v = motion.v + given;
        motion.w = motion.w + inverse.apply(self.spot.r.cross(given));
    }

    #[inline(always)]
    pub(super) fn relax(&mut self, motion: &mut Motion<S>, inverse: &M3<S>, laws: &Laws<S>, open: Mask<S>) {
        let slip = motion.v + motion.w.cross(self.spot.r) - self.driven;
        let (n, x, y) = self.impulse;
        let asked = (self.least - slip.dot(self.normal)) * self.stiffness.0 * self.soft.0;
        let new_n = pick(open, (n + asked - n * self.soft.1).positive(), n);
        let push = self.normal * (new_n - n);
        motion.v = motion.v + push;
        motion.w = motion.w + inverse.apply(self.spot.r.cross(push));
        let slip = motion.v + motion.w.cross(self.spot.r) - self.driven;
        let (new_x, new_y) = clamp2(
            x - slip.dot(self.tangents[0]) * self.stiffness.1,
            y - slip.dot(self.tangents[1]) * self.stiffness.1,
            laws.tool * new_n,
        );
        let (new_x, new_y) = (pick(open, new_x, x), pick(open, new_y, y));
        let drag = self.tangents[0] * (new_x - x) + self.tangents[1] * (new_y - y);
        motion.v = motion.v + drag;
        motion.w = motion.w + inverse.apply(self.spot.r.cross(drag));
        self.impulse = (new_n, new_x, new_y);
    }

    /// What the tool gave, N·s for a mass of 1 kg.
    #[inline(always)]
    pub(super) fn given(&self) -> V3<S> {
        let (n, x, y) = self.impulse;
        self.normal * n + self.tangents[0] * x + self.tangents[1] * y
    }

    /// Mask of the trials in which it bears.
    #[inline(always)]
    pub(super) fn bears(&self) -> Mask<S> {
        more(self.impulse.0, self.impulse.0.like(0.0))
    }
}

/// One over the effective mass of a spot along `d`.
#[inline(always)]
fn stiff<S: Simd>(spot: &Spot<S>, d: V3<S>, inverse: &M3<S>) -> F<S> {
    let c = spot.r.cross(d);
    c.dot(inverse.apply(c)) + 1.0
}
