//! Free sliding on a level support: what a body does once the tool has left it.
//!
//! Friction is that of the ellipsoidal limit surface, `f = -mu m g (v, c² ω) / sqrt(v² + c² ω²)` at the centre of
//! mass (Howe and Cutkosky 1996) less what a patch falls short of it while it turns, now against inertia: `v' = f/m`, `ω' = tau/(m rho²)`. Mass cancels: the way of a
//! coasting body tells `mu` without any force sensor (`s = v²/(2 mu g)`).

use nalgebra::Vector2;

use super::{Between, SHORTFALL, Simulator};

/// Motion in the plane of the support at the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneMotion<T = f64> {
    /// Centre of mass, m.
    pub position: Vector2<T>,
    /// rad.
    pub heading: T,
    /// m/s.
    pub velocity: Vector2<T>,
    /// rad/s.
    pub spin: T,
}

/// What slides.
#[derive(Clone, Copy, Debug)]
pub struct Slider {
    /// Kinetic friction times gravity, m/s².
    pub deceleration: f64,
    /// Torsional radius of the limit surface, m.
    pub torsional_radius: f64,
    /// Radius of gyration about the support's normal, m.
    pub gyration_radius: f64,
}

type Rates = (Vector2<f64>, f64);

impl Slider {
    /// Generalised speed of the limit surface, m/s.
    fn speed(&self, velocity: &Vector2<f64>, spin: f64) -> f64 {
        (velocity.norm_squared() + (self.torsional_radius * spin).powi(2)).sqrt()
    }

    fn rates(&self, velocity: &Vector2<f64>, spin: f64) -> Rates {
        let speed = self.speed(velocity, spin).max(1e-12);
        let between = Between::at((self.torsional_radius * spin / speed).powi(2), SHORTFALL.0);
        let share = self.deceleration / speed;
        let turning = (self.torsional_radius / self.gyration_radius).powi(2);
        (
            -share * between.force * velocity,
            -share * between.moment * turning * spin,
        )
    }

    /// Heun's step; the last one ends where the speed would pass through zero.
    fn step(&self, at: &PlaneMotion, h: f64) -> PlaneMotion {
        let (a, alpha) = self.rates(&at.velocity, at.spin);
        let speed = self.speed(&at.velocity, at.spin);
        let slowing = -(at.velocity.dot(&a) + self.torsional_radius.powi(2) * at.spin * alpha) / speed.max(1e-12);
        if slowing * h >= speed {
            let rest = speed / slowing.max(1e-12);
            return PlaneMotion {
                position: at.position + 0.5 * rest * at.velocity,
                heading: at.heading + 0.5 * rest * at.spin,
                velocity: Vector2::zeros(),
                spin: 0.0,
            };
        }
        let (velocity, spin) = (at.velocity + h * a, at.spin + h * alpha);
        let (b, beta) = self.rates(&velocity, spin);
        let velocity = at.velocity + 0.5 * h * (a + b);
        let spin = at.spin + 0.5 * h * (alpha + beta);
        PlaneMotion {
            position: at.position + h * at.velocity + h * h * (2.0 * a + b) / 6.0,
            heading: at.heading + h * at.spin + h * h * (2.0 * alpha + beta) / 6.0,
            velocity,
            spin,
        }
    }
}

impl Simulator for Slider {
    type Drive = ();
    type State = PlaneMotion;
    type Seen = PlaneMotion;

    const STEP: f64 = 2e-3;

    fn advance(&self, state: &PlaneMotion, _: &(), _: f64, h: f64) -> PlaneMotion {
        if state.velocity == Vector2::zeros() && state.spin == 0.0 {
            return *state;
        }
        self.step(state, h)
    }

    fn seen(&self, state: &PlaneMotion) -> PlaneMotion {
        *state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn start(velocity: f64, spin: f64) -> PlaneMotion {
        PlaneMotion {
            position: Vector2::zeros(),
            heading: 0.0,
            velocity: Vector2::new(velocity, 0.0),
            spin,
        }
    }

    const SLIDER: Slider = Slider {
        deceleration: 3.0,
        torsional_radius: 0.03,
        gyration_radius: 0.035,
    };

    #[test]
    fn without_spin_it_stops_after_the_way_that_energy_gives() {
        let end = SLIDER.simulate(&start(0.5, 0.0), &(), 0.0, &[1.0])[0];
        assert!((end.position.x - 0.25 / 6.0).abs() < 1e-9, "{}", end.position.x);
        assert_eq!(end.velocity, Vector2::zeros());
    }

    #[test]
    fn halving_the_step_moves_the_end_by_less_than_any_tracker_sees() {
        let ends = [2e-3, 1e-3].map(|h| SLIDER.simulate_with_step(&start(0.4, 6.0), &(), 0.0, &[1.0], h)[0]);
        assert!((ends[0].position - ends[1].position).norm() < 2e-6);
        assert!((ends[0].heading - ends[1].heading).abs() < 2e-4);
    }

    #[test]
    fn friction_takes_what_motion_loses() {
        // d/dt (v²/2 + rho² ω²/2) = -mu g s with s the work over the friction force: integrate s along the way.
        let times: Vec<f64> = (0..4000).map(|i| f64::from(i) * 1e-4).collect();
        let path = SLIDER.simulate(&start(0.4, 6.0), &(), 0.0, &times);
        let work = |m: &PlaneMotion| {
            let speed = SLIDER.speed(&m.velocity, m.spin).max(1e-12);
            speed * Between::at((0.03 * m.spin / speed).powi(2), SHORTFALL.0).work
        };
        let way: f64 = path.iter().map(|m| 1e-4 * work(m)).sum();
        let energy = 0.5 * (0.4f64.powi(2) + (0.035f64 * 6.0).powi(2));
        assert!((way * 3.0 / energy - 1.0).abs() < 3e-3, "{way}");
    }
}
