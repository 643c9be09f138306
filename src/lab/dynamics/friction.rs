//! Dry friction of one contact point: an elastic bristle that breaks at the static level and slides at the kinetic one.
//!
//! The bristle is that of LuGre (Canudas de Wit et al. 1995) in the elasto-plastic form of Dupont et al. (2002): below
//! break-away it is purely elastic, so that a loaded body does not creep. Forces are per unit of normal force.

use nalgebra::Vector3;

/// Sliding speed at which the coefficient has fallen most of the way to the kinetic one, m/s.
const STRIBECK: f64 = 0.0005;
/// Stretch at break-away, m.
const PRESLIDING: f64 = 15e-6;
/// Damping ratio of a body that stands on its bristles under its own weight.
const RATIO: f64 = 0.7;
/// Largest `c dt / m` of the bristles of a contact.
const BEARABLE: f64 = 0.25;

/// The law of one pair of surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DryFriction {
    pub static_: f64,
    pub kinetic: f64,
    /// 1/m.
    stiffness: f64,
    /// s/m.
    damping: f64,
}

impl DryFriction {
    /// From the two coefficients; a static one below the kinetic one is raised to it.
    pub fn new(static_: f64, kinetic: f64) -> Self {
        let static_ = static_.max(kinetic);
        let stiffness = static_.max(1e-3) / PRESLIDING;
        Self {
            static_,
            kinetic,
            stiffness,
            damping: 2.0 * RATIO * (stiffness / 9.81).sqrt(),
        }
    }

    /// With no more damping than steps of `dt` bear where `load` presses on `mass`: explicit damping `c` needs
    /// `c dt / m` well below 2.
    #[inline]
    pub fn eased(&self, mass: f64, load: f64, dt: f64) -> Self {
        Self {
            damping: self.damping.min(BEARABLE * mass / (dt * load.max(1e-9))),
            ..*self
        }
    }

    /// With this factor on both coefficients.
    #[inline]
    pub fn times(&self, factor: f64) -> Self {
        Self {
            static_: self.static_ * factor,
            kinetic: self.kinetic * factor,
            ..*self
        }
    }

    /// With a break-away stretch that is longer by `length`, m.
    pub fn softened(&self, length: f64) -> Self {
        let stiffness = self.static_.max(1e-3) / (PRESLIDING + length);
        Self {
            stiffness,
            damping: 2.0 * RATIO * (stiffness / 9.81).sqrt(),
            ..*self
        }
    }

    #[inline]
    fn level(&self, slipping: bool, speed: f64) -> f64 {
        if !slipping {
            return self.static_;
        }
        let ratio = speed / STRIBECK;
        if ratio > 5.0 {
            return self.kinetic;
        }
        self.kinetic + (self.static_ - self.kinetic) * (-ratio * ratio).exp()
    }
}

/// The state of one contact point.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Bristle {
    stretch: Vector3<f64>,
    slipping: bool,
}

impl Bristle {
    /// Contact is lost.
    #[inline]
    pub fn release(&mut self) {
        *self = Self::default();
    }

    /// Advances by `dt` with the sliding velocity `velocity` (its part along `normal` is ignored) and gives the friction
    /// force per unit of normal force on the thing that has this velocity.
    #[inline]
    pub fn advance(
        &mut self,
        law: &DryFriction,
        normal: &Vector3<f64>,
        velocity: &Vector3<f64>,
        dt: f64,
    ) -> Vector3<f64> {
        let sliding = velocity - normal * normal.dot(velocity);
        let stretch = self.stretch - normal * normal.dot(&self.stretch) + sliding * dt;
        let speed = sliding.norm();
        let level = law.level(self.slipping, speed);
        let (length, limit) = (stretch.norm(), level / law.stiffness);
        if length >= limit {
            self.slipping = true;
            self.stretch = stretch * (limit / length.max(1e-300));
            return self.stretch * -law.stiffness;
        }
        self.stretch = stretch;
        let force = stretch * law.stiffness + sliding * law.damping;
        let size = force.norm();
        self.slipping = if self.slipping {
            speed > 0.2 * STRIBECK
        } else {
            size > level
        };
        -if size > level { force * (level / size) } else { force }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_breaks_at_the_static_level_and_slides_at_the_kinetic_one() {
        let law = DryFriction::new(0.4, 0.3);
        let mut bristle = Bristle::default();
        let mut peak: f64 = 0.0;
        let mut last = Vector3::zeros();
        for _ in 0..10_000 {
            last = bristle.advance(&law, &Vector3::z(), &Vector3::new(0.02, 0.0, 0.0), 5e-5);
            peak = peak.max(last.norm());
        }
        assert!((peak - 0.4).abs() < 1e-9);
        assert!((last.x + 0.3).abs() < 1e-9);
    }
}
