//! Friction of a body on its support under the true pressure below it, set beside the ellipsoid that stands for it.
//!
//! With pressure shares `p_i` at `r_i` from their centre and the twist `(v, w)` the support's friction is
//! `-P sum p_i u_i/|u_i|`, `u_i = v + w x r_i` (Goyal, Ruina and Papadopoulos 1991). The ellipsoid of Lee and Cutkosky
//! through the same force of pure sliding and moment of pure turning is off by up to a third of the force and half of the moment
//! between the two; how much, in every direction, is laid out once in a table.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector2;

/// Directions of the velocity in the body, and steps of `atan(c w / v)` over a right angle.
const DIRECTIONS: usize = 24;
const STEPS: usize = 16;

/// The ratios of a pressure's friction to that of the ellipsoid, by the twist.
#[derive(Clone, Debug)]
pub struct LimitSurface {
    /// Mean distance of the pressure from its centre: the torsional radius, m.
    radius: f64,
    /// Force and moment, by direction and step.
    ratios: Vec<[f64; 2]>,
}

impl LimitSurface {
    /// Of a pressure: points about its centre with their shares of the load, axes of the body in the plane. Nothing where they
    /// have no extent.
    pub fn of(points: &[(Vector2<f64>, f64)]) -> Option<Self> {
        let radius: f64 = points.iter().map(|(p, share)| share * p.norm()).sum();
        if radius.is_nan() || radius <= 0.0 {
            return None;
        }
        let mut ratios = Vec::with_capacity(DIRECTIONS * (STEPS + 1));
        for direction in 0..DIRECTIONS {
            let (sine, cosine) = (TAU * direction as f64 / DIRECTIONS as f64).sin_cos();
            for step in 0..=STEPS {
                // The ends are limits: a little inside of them the ratios are theirs, but for what rounding loses.
                let tilt = (step as f64 / STEPS as f64 * FRAC_PI_2).clamp(1e-3, FRAC_PI_2 - 1e-3);
                ratios.push(ratios_of(points, radius, &Vector2::new(cosine, sine), tilt));
            }
        }
        Some(Self { radius, ratios })
    }

    /// Torsional radius, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Force along the velocity and moment over those of the ellipsoid, for a velocity in the body's axes (m/s) and a spin
    /// times the torsional radius (m/s).
    pub fn ratios(&self, velocity: &Vector2<f64>, turning: f64) -> [f64; 2] {
        let speed = velocity.norm();
        if speed <= 0.0 && turning == 0.0 {
            return [1.0; 2];
        }
        // Turned round as a whole, a motion meets the same friction the other way.
        let way = if turning < 0.0 { -velocity } else { *velocity };
        let at = way.y.atan2(way.x).rem_euclid(TAU) / TAU * DIRECTIONS as f64;
        let (low, share) = (at.floor(), at - at.floor());
        let columns = [low as usize % DIRECTIONS, (low as usize + 1) % DIRECTIONS];
        let tilt = turning.abs().atan2(speed) / FRAC_PI_2 * STEPS as f64;
        let row = (tilt as usize).min(STEPS - 1);
        let along = tilt - row as f64;
        let entry = |column: usize, k: usize| {
            let base = column * (STEPS + 1) + row;
            self.ratios[base][k] * (1.0 - along) + self.ratios[base + 1][k] * along
        };
        [0, 1].map(|k| entry(columns[0], k) * (1.0 - share) + entry(columns[1], k) * share)
    }
}

fn ratios_of(points: &[(Vector2<f64>, f64)], radius: f64, way: &Vector2<f64>, tilt: f64) -> [f64; 2] {
    let (turning, speed) = tilt.sin_cos();
    let spin = turning / radius;
    let (mut force, mut moment) = (Vector2::zeros(), 0.0);
    for (p, share) in points {
        let u = way * speed + spin * Vector2::new(-p.y, p.x);
        let unit = u / u.norm().max(1e-9);
        force += unit * *share;
        moment += share * p.perp(&unit);
    }
    [force.dot(way) / speed, moment / (radius * turning)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn box_points(size: [f64; 2]) -> Vec<(Vector2<f64>, f64)> {
        let n = 40;
        let at = |k: usize, edge: f64| ((k as f64 + 0.5) / n as f64 - 0.5) * edge;
        (0..n * n)
            .map(|k| {
                (
                    Vector2::new(at(k % n, size[0]), at(k / n, size[1])),
                    1.0 / (n * n) as f64,
                )
            })
            .collect()
    }

    #[test]
    fn a_ring_is_known_and_a_plate_turns_more_easily_while_it_slides() {
        let plate = LimitSurface::of(&box_points([0.105, 0.08])).expect("a plate");
        assert!((plate.radius() - 0.03558).abs() < 1e-4);
        // Sliding along the long side with a quarter of it as turning: the sums over the plate.
        let [force, moment] = plate.ratios(&Vector2::new(1.0, 0.0), 0.25);
        let ellipsoid = 1.0 / 1.0625_f64.sqrt();
        assert!((force * ellipsoid - 0.9770).abs() < 4e-3, "{force}");
        assert!((moment * 0.25 * ellipsoid - 0.1830).abs() < 4e-3, "{moment}");
        // Pure sliding and pure turning are the ellipsoid's.
        assert!((plate.ratios(&Vector2::new(0.0, 1.0), 0.0)[0] - 1.0).abs() < 1e-3);
        assert!((plate.ratios(&Vector2::new(0.0, 0.0), 1.0)[1] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_motion_and_its_reverse_meet_the_same_friction() {
        let mut lopsided = box_points([0.1, 0.06]);
        lopsided.iter_mut().for_each(|(p, share)| *share *= 1.0 + 8.0 * p.x);
        let centre: Vector2<f64> = lopsided.iter().map(|(p, s)| p * *s).sum();
        lopsided.iter_mut().for_each(|(p, _)| *p -= centre);
        let surface = LimitSurface::of(&lopsided).expect("a plate");
        let way = Vector2::new(0.3, 0.2);
        assert_eq!(surface.ratios(&way, -0.1), surface.ratios(&-way, 0.1));
    }
}
