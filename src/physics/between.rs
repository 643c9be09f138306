//! What a patch of contact resists while it slides and turns at once.
//!
//! With `w = c ω`, `u² = v² + w²` and `s = w²/u²` the work that friction takes is `P u (1 - 4 k s (1 - s))`: the ellipsoid of
//! Lee and Cutkosky (1991) overstates what lies between pure sliding and pure turning by the share `k`. Summed over their points
//! (Goyal, Ruina and Papadopoulos 1991), in the mean over directions, a disc has a `k` of 0.058 to 0.064, a ring 0.069 to 0.10, a
//! square 0.062, a plate of 3 to 1 0.042 to 0.05, three feet 0.072 to 0.11, from little turning to as much turning as sliding.
//! Force and moment are the slopes of the work by `v` and by `ω`, so that what slides along turns the more easily.

/// Share by which the ellipsoid overstates, halfway, and how far that is doubted (1 sd).
pub const SHORTFALL: (f64, f64) = (0.07, 0.02);

/// Factors on what the ellipsoidal limit surface says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// On the work.
    pub work: f64,
    /// On the force.
    pub force: f64,
    /// On the moment.
    pub moment: f64,
}

impl Between {
    /// For the share `turning` that turning has of the square of the generalised speed, and a shortfall.
    pub fn at(turning: f64, shortfall: f64) -> Self {
        let sliding = 1.0 - turning;
        Self {
            work: 1.0 - 4.0 * shortfall * turning * sliding,
            force: 1.0 - 4.0 * shortfall * turning * (3.0 * turning - 1.0),
            moment: 1.0 - 4.0 * shortfall * sliding * (3.0 * sliding - 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::LimitSurface;
    use crate::physics::limit_surface::Sliding;
    use nalgebra::Vector2;

    #[test]
    fn force_and_moment_are_the_slopes_of_the_work() {
        let work = |v: f64, w: f64| {
            let u = v.hypot(w);
            u * Between::at((w / u).powi(2), 0.08).work
        };
        for (v, w) in [(0.3, 0.05), (0.2, 0.2), (0.02, 0.3)] {
            let (u, h) = (f64::hypot(v, w), 1e-6);
            let found = Between::at((w / u).powi(2), 0.08);
            let by_v = (work(v + h, w) - work(v - h, w)) / (2.0 * h);
            let by_w = (work(v, w + h) - work(v, w - h)) / (2.0 * h);
            assert!((found.force * v / u - by_v).abs() < 1e-7);
            assert!((found.moment * w / u - by_w).abs() < 1e-7);
        }
    }

    #[test]
    fn it_lies_near_the_sums_over_a_disc_and_a_ring() {
        let disc: Vec<(Vector2<f64>, f64)> = (0..1600)
            .map(|k| Vector2::new((k % 40) as f64 - 19.5, (k / 40) as f64 - 19.5) / 400.0)
            .filter(|p| p.norm() < 0.05)
            .map(|p| (p, 1.0))
            .collect();
        let ring: Vec<(Vector2<f64>, f64)> = (0..36)
            .map(|k| {
                (
                    Vector2::new((k as f64 / 5.73).cos(), (k as f64 / 5.73).sin()) * 0.05,
                    1.0,
                )
            })
            .collect();
        for (points, near) in [(disc, 0.02), (ring, 0.04)] {
            let all = points.len() as f64;
            let even: Vec<_> = points.iter().map(|(p, _)| (*p, 1.0 / all)).collect();
            let patch = LimitSurface::of(&even).expect("a patch");
            for turning in [0.05, 0.2, 0.5, 0.8] {
                let (v, w) = (f64::sqrt(1.0 - turning), f64::sqrt(turning) / patch.radius());
                let (force, moment) = patch.friction(&Sliding {
                    velocity: Vector2::new(v, 0.0),
                    spin: w,
                    centre: Vector2::zeros(),
                    ahead: Vector2::zeros(),
                    scale: 1.0,
                    slow: 0.0,
                });
                let found = Between::at(turning, SHORTFALL.0);
                let work = -force.x * v - moment * w;
                assert!((work - found.work).abs() < near, "{turning}: {work} {found:?}");
            }
        }
    }
}
