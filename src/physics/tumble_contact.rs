//! Impacts and contacts of a body that tumbles: which corners touch, with what impulses, and the steps in time.

use nalgebra::{Matrix2, Matrix3, SMatrix, UnitQuaternion, Vector2, Vector3};

use super::tumble::{HINGE, Landing, Mass, Rows, State, Thrown, Velocity};

/// Below this speed of approach nothing rebounds, m/s.
const REBOUND: f64 = 0.02;
/// Distance at which a corner touches, m.
const TOUCH: f64 = 2e-5;
/// Rounds of projected Gauss-Seidel.
const ROUNDS: usize = 30;
/// Impacts within one step.
const IMPACTS: usize = 6;

struct Touching {
    rows: Rows,
    /// Mass⁻¹ rowsᵀ.
    back: SMatrix<f64, 7, 3>,
    /// Inverse inertia seen along the normal and across.
    along: f64,
    across: f64,
    gap: f64,
    impulse: Vector3<f64>,
    target: f64,
}

impl Thrown {
    /// Distances of the corners to the support, with their places from `O` (the foot of the rounded corner).
    fn corners<'a>(&'a self, s: &'a State, land: &'a Landing) -> impl Iterator<Item = (f64, Vector3<f64>, bool)> + 'a {
        let base = land.normal.dot(&s.place) - land.height;
        self.posed(s).flat_map(move |p| {
            let hinged = p.hinged;
            p.part.corners.iter().map(move |c| {
                let r = p.turn * c;
                (
                    base + land.normal.dot(&r) - self.rounding,
                    r - land.normal.into_inner() * self.rounding,
                    hinged,
                )
            })
        })
    }

    /// The lowest corner above the support, m.
    pub fn clearance(&self, s: &State, land: &Landing) -> f64 {
        self.corners(s, land).map(|c| c.0).fold(f64::INFINITY, f64::min)
    }

    /// The plane through the corners within `within` of the lowest, those that bear a body which lies: its mean height over
    /// the support, m, and its slope along x and y, rad (zero where fewer than three corners bear it).
    pub fn seat(&self, s: &State, land: &Landing, within: f64) -> [f64; 3] {
        let lowest = self.clearance(s, land);
        let near: Vec<(f64, Vector3<f64>)> = self
            .corners(s, land)
            .filter(|c| c.0 < lowest + within)
            .map(|c| (c.0, c.1))
            .collect();
        let n = near.len().max(1) as f64;
        let height = near.iter().map(|c| c.0).sum::<f64>() / n;
        let middle = near.iter().map(|c| c.1).sum::<Vector3<f64>>() / n;
        let (mut square, mut slope) = (Matrix2::zeros(), Vector2::zeros());
        for (h, r) in &near {
            let away = Vector2::new(r.x - middle.x, r.y - middle.y);
            square += away * away.transpose();
            slope += away * (h - height);
        }
        let flat = square.symmetric_eigenvalues().min() > n * within * within * 0.25;
        let solved = square.try_inverse().filter(|_| near.len() >= 3 && flat);
        let slope = solved.map_or_else(Vector2::zeros, |inverse| inverse * slope);
        [height, slope.x, slope.y]
    }

    /// Height over the support of the highest of the corners within `within` of the lowest, m.
    pub fn bearing(&self, s: &State, land: &Landing, within: f64) -> f64 {
        let lowest = self.clearance(s, land);
        let near = self.corners(s, land).map(|c| c.0).filter(|h| *h <= lowest + within);
        near.fold(lowest, f64::max)
    }

    fn touching(&self, s: &State, land: &Landing, inverse: &Mass, within: f64) -> Vec<Touching> {
        let axis = self.axis(s);
        let near = self.corners(s, land).filter(|c| c.0 < within);
        near.map(|(gap, r, hinged)| {
            let rows = Self::rows(&r, hinged, &axis);
            let back = inverse * rows.transpose();
            let seen: Matrix3<f64> = rows * back;
            let along = land.normal.dot(&(seen * land.normal.into_inner()));
            Touching {
                rows,
                back,
                along,
                across: 0.5 * (seen.trace() - along),
                gap,
                impulse: Vector3::zeros(),
                target: 0.0,
            }
        })
        .collect()
    }

    /// Projected Gauss-Seidel over what touches, dry friction of the hinge with it; `grip` is the most that friction of
    /// the hinge can give.
    fn solve(&self, v: &mut Velocity, inverse: &Mass, land: &Landing, all: &mut [Touching], grip: f64) {
        let n = land.normal.into_inner();
        let mut held = 0.0;
        for round in 0..ROUNDS {
            let mut moved = 0.0f64;
            if grip > 0.0 {
                let wanted: f64 = held - v[HINGE] / inverse[(HINGE, HINGE)];
                let next = wanted.clamp(-grip, grip);
                *v += inverse.column(HINGE) * (next - held);
                moved = moved.max((next - held).abs() * inverse[(HINGE, HINGE)] * 0.05);
                held = next;
            }
            for c in all.iter_mut() {
                let u: Vector3<f64> = c.rows * *v;
                let normal = c.impulse.dot(&n);
                let next = (normal + (c.target - n.dot(&u)) / c.along).max(0.0);
                let slip = u - n * n.dot(&u);
                let speed = slip.norm();
                let mu = land.friction * land.share(speed);
                let mut side = c.impulse - n * normal - slip / c.across;
                let most = mu * next;
                if side.norm() > most {
                    side *= most / side.norm();
                }
                let change = n * next + side - c.impulse;
                c.impulse += change;
                *v += c.back * change;
                moved = moved.max(change.norm() * c.along);
            }
            if moved < 1e-7 && round > 0 {
                break;
            }
        }
    }

    fn moved(&self, s: &State, v: &Velocity, h: f64) -> State {
        let spin: Vector3<f64> = v.fixed_rows::<3>(3).into();
        State {
            place: s.place + v.fixed_rows::<3>(0) * h,
            turn: UnitQuaternion::from_scaled_axis(spin * h) * s.turn,
            angle: s.angle + v[HINGE] * h,
            velocity: *v,
        }
    }

    /// One step without looking for new impacts.
    fn glide(&self, s: &State, land: &Landing, h: f64) -> State {
        let (inverse, force) = self.dynamics(s, land);
        let grip = self.second.as_ref().map_or(0.0, |(_, hinge)| hinge.friction * h);
        let lands = land.height > f64::NEG_INFINITY;
        let mut on = if lands {
            self.touching(s, land, &inverse, TOUCH)
        } else {
            Vec::new()
        };
        if !on.is_empty() {
            let mut v = s.velocity + inverse * force * h;
            for c in &mut on {
                c.target = -c.gap.max(0.0) / h;
            }
            self.solve(&mut v, &inverse, land, &mut on, grip);
            return self.moved(s, &v, h);
        }
        // Free: the midpoint rule, second order.
        let half = self.moved(s, &(s.velocity + inverse * force * (0.25 * h)), 0.5 * h);
        let half = State {
            velocity: s.velocity + inverse * force * (0.5 * h),
            ..half
        };
        let (inverse, force) = self.dynamics(&half, land);
        let mut v = s.velocity + inverse * force * h;
        let mut middle = half.velocity;
        if grip > 0.0 {
            self.solve(&mut v, &inverse, land, &mut [], grip);
            middle = (s.velocity + v) * 0.5;
        }
        State {
            velocity: v,
            ..self.moved(s, &middle, h)
        }
    }

    /// Rebound of all that touches and comes nearer.
    fn strike(&self, s: &mut State, land: &Landing) {
        if self.clearance(s, land) >= TOUCH {
            return;
        }
        let (inverse, _) = self.dynamics(s, land);
        let mut on = self.touching(s, land, &inverse, TOUCH);
        let mut hit = false;
        for c in &mut on {
            let approach = -land.normal.dot(&(c.rows * s.velocity));
            if approach > REBOUND {
                c.target = land.restitution * approach;
                hit = true;
            }
        }
        if hit {
            let mut v = s.velocity;
            self.solve(&mut v, &inverse, land, &mut on, 0.0);
            s.velocity = v;
        }
    }

    /// The state after `h` seconds.
    pub fn step(&self, start: &State, land: &Landing, h: f64) -> State {
        if land.height == f64::NEG_INFINITY {
            return self.glide(start, land, h);
        }
        let mut s = *start;
        let mut left = h;
        for _ in 0..IMPACTS {
            self.strike(&mut s, land);
            let next = self.glide(&s, land, left);
            let mut first = 1.0f64;
            for ((before, _, _), (after, _, _)) in self.corners(&s, land).zip(self.corners(&next, land)) {
                if before > TOUCH && after < 0.0 {
                    first = first.min((before - 0.25 * TOUCH) / (before - after));
                }
            }
            if first >= 1.0 {
                return next;
            }
            let part = (first * left).max(1e-6);
            s = self.glide(&s, land, part);
            left -= part;
            if left < 1e-7 {
                return s;
            }
        }
        self.glide(&s, land, left)
    }

    /// States at `times` (s, rising; the first is that of `start`), at steps of at most `h`.
    pub fn fly(&self, start: &State, land: &Landing, times: &[f64], h: f64) -> Vec<State> {
        let mut s = *start;
        let mut out = Vec::with_capacity(times.len());
        out.extend(times.first().map(|_| s));
        for pair in times.windows(2) {
            let span = pair[1] - pair[0];
            let steps = (span / h).ceil().max(1.0);
            for _ in 0..steps as usize {
                s = self.step(&s, land, span / steps);
            }
            out.push(s);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Hinge, Part};
    use super::*;
    use nalgebra::Unit;

    const G: f64 = 9.81;

    fn cube(half: f64) -> Thrown {
        let corner = |i: usize| Vector3::new(sign(i & 1), sign(i & 2), sign(i & 4)) * half;
        let root = Part {
            mass: 1.0,
            centre: Vector3::zeros(),
            inertia: Matrix3::identity() * (2.0 / 3.0 * half * half),
            corners: (0..8).map(corner).collect(),
        };
        Thrown {
            root,
            second: None,
            rounding: 0.0,
        }
    }

    fn sign(bit: usize) -> f64 {
        if bit == 0 { -1.0 } else { 1.0 }
    }

    fn table(restitution: f64, friction: f64) -> Landing {
        Landing {
            gravity: Vector3::new(0.0, 0.0, -G),
            normal: Vector3::z_axis(),
            height: 0.0,
            restitution,
            friction,
            excess: (0.0, 0.1),
            viscous: 0.0,
            drag: 0.0,
        }
    }

    fn state(height: f64, turn: [f64; 3], velocity: [f64; 7]) -> State {
        State {
            place: Vector3::new(0.0, 0.0, height),
            turn: UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
            angle: 0.3,
            velocity: Velocity::from_row_slice(&velocity),
        }
    }

    #[test]
    fn a_flat_fall_rebounds_with_the_coefficient() {
        let start = state(0.15, [0.0; 3], [0.0; 7]);
        let states = cube(0.05).fly(&start, &table(0.5, 0.3), &[0.0, 0.1428 + 0.0714], 1e-3);
        // Falls 0.1 m in 0.1428 s, rises by a quarter of it in half that time.
        assert!((states[1].place.z - 0.05 - 0.025).abs() < 2e-4, "{}", states[1].place.z);
    }

    #[test]
    fn a_sliding_cube_stops_after_the_distance_of_the_textbook() {
        let start = state(0.05, [0.0; 3], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let states = cube(0.05).fly(&start, &table(0.0, 0.4), &[0.0, 0.6], 1e-3);
        assert!(
            (states[1].place.x - 1.0 / (2.0 * 0.4 * G)).abs() < 1e-3,
            "{}",
            states[1].place.x
        );
        assert!((states[1].place.z - 0.05).abs() < 1e-4);
    }

    #[test]
    fn a_hinged_body_in_flight_keeps_momentum_and_energy() {
        let link = |x: f64| Part {
            mass: 0.5,
            centre: Vector3::new(x, 0.01, 0.0),
            inertia: Matrix3::from_diagonal(&Vector3::new(2e-4, 5e-4, 4e-4)),
            corners: Vec::new(),
        };
        let hinge = Hinge {
            axis: Unit::new_normalize(Vector3::new(0.1, 1.0, 0.2)),
            zero: UnitQuaternion::identity(),
            friction: 0.0,
            damping: 0.0,
        };
        let body = Thrown {
            root: link(-0.05),
            second: Some((link(0.06), hinge)),
            rounding: 0.0,
        };
        let land = Landing {
            gravity: Vector3::zeros(),
            height: f64::NEG_INFINITY,
            ..table(0.3, 0.3)
        };
        let start = state(1.0, [0.2, 0.1, 0.0], [0.3, -0.2, 0.5, 4.0, -3.0, 6.0, 8.0]);
        let end = body.fly(&start, &land, &[0.0, 0.3], 1e-3)[1];
        let (before, after) = (body.momentum(&start), body.momentum(&end));
        assert!((after.0 / before.0 - 1.0).abs() < 2e-4);
        assert!((after.1 - before.1).norm() < 2e-4 * before.1.norm());
        assert!((after.2 - before.2).norm() < 2e-4 * before.2.norm());
    }

    #[test]
    fn half_the_step_changes_a_window_about_an_impact_little() {
        let start = state(0.12, [0.5, 0.4, 0.1], [0.6, 0.2, -1.0, 3.0, -2.0, 4.0, 0.0]);
        let land = table(0.3, 0.25);
        let [coarse, fine] = [2e-3, 1e-3].map(|h| cube(0.05).fly(&start, &land, &[0.0, 0.07], h)[1]);
        let off = (coarse.place - fine.place).norm();
        assert!(off < 2e-4, "{off}");
        assert!(coarse.turn.angle_to(&fine.turn) < 4e-3);
    }
}
