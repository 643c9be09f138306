//! Friction of a body on its support under a pressure that is spread below it.
//!
//! With pressure shares `p_i` at `r_i` from the centre of mass and the twist `(v, w)` the support's friction is
//! `-P sum p_i u_i/|u_i|`, `u_i = v + w x r_i` (Goyal, Ruina and Papadopoulos 1991). The pressure follows the load: it is that of the
//! even body times a slope, and nowhere negative. The ellipsoid of Lee and Cutkosky through pure sliding and pure turning is off
//! by up to a third of the force and half of the moment between the two, and the load that tips forward moves the
//! friction's centre by millimetres: both tell a radius of gyration wrongly if they are left out.

use nalgebra::{Matrix2, Vector2};
use wide::f64x4;

use super::rubbing::ByWanted;

/// Cells over a footprint, per side: so many points stand for it.
const CELLS: usize = 7;
/// Steps towards a slope that brings the load where it acts, and how near is near enough, m.
const STEPS: usize = 4;
const NEAR: f64 = 1e-4;

/// A pressure below a body, as points.
#[derive(Clone, Debug)]
pub struct LimitSurface {
    /// Mean distance of the pressure from its centre: the torsional radius, m.
    radius: f64,
    /// Four by four; what is missing to the last four carries nothing.
    points: Vec<Points>,
    /// Slope per metre by which the load's centre is moved.
    slope: Matrix2<f64>,
}

/// Four points about the centre of the pressure, axes of the body in the plane, m, with their shares of the load.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points {
    pub x: f64x4,
    pub y: f64x4,
    share: f64x4,
}

impl Points {
    fn of(four: &[(Vector2<f64>, f64)]) -> Self {
        let row = |value: fn(&(Vector2<f64>, f64)) -> f64| {
            let mut row = [0.0; 4];
            row.iter_mut().zip(four).for_each(|(to, from)| *to = value(from));
            f64x4::new(row)
        };
        Self {
            x: row(|(p, _)| p.x),
            y: row(|(p, _)| p.y),
            share: row(|(_, share)| *share),
        }
    }

    /// Pressure over that of the even body; below nought where it would pull.
    fn times(&self, slope: &Vector2<f64>) -> f64x4 {
        self.x * slope.x + self.y * slope.y + 1.0
    }

    pub fn pressed(&self, slope: &Vector2<f64>) -> f64x4 {
        (self.share * self.times(slope)).max(f64x4::ZERO)
    }

    /// Shares of the points that bear.
    pub fn bearing(&self, slope: &Vector2<f64>) -> f64x4 {
        let times = self.times(slope).to_array();
        let share = self.share.to_array();
        f64x4::new([0, 1, 2, 3].map(|k| if times[k] > 0.0 { share[k] } else { 0.0 }))
    }
}

/// How a body slides, axes of the body in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Sliding<T = f64> {
    /// Of the centre of mass, m/s, and about it, rad/s.
    pub velocity: Vector2<T>,
    /// rad/s.
    pub spin: T,
    /// From the centre of the even body's pressure to the centre of mass, m.
    pub centre: Vector2<T>,
    /// From below the centre of mass to where the load acts, m.
    pub ahead: Vector2<T>,
    /// Torsional radius over that of the pressure.
    pub scale: T,
    /// Speed below which friction is that of a step of time, which never turns a motion round, m/s.
    pub slow: T,
}

impl LimitSurface {
    /// Of a pressure: points about its centre with their shares of the load, axes of the body in the plane. Nothing where they
    /// have no extent.
    pub fn of(points: &[(Vector2<f64>, f64)]) -> Option<Self> {
        let radius: f64 = points.iter().map(|(p, share)| share * p.norm()).sum();
        if radius.is_nan() || radius <= 0.0 {
            return None;
        }
        let mut points = gathered(points, CELLS);
        // Gathering draws in: the torsional radius stays.
        let drawn: f64 = points.iter().map(|(p, share)| share * p.norm()).sum();
        points.iter_mut().for_each(|(p, _)| *p *= radius / drawn);
        let moments: Matrix2<f64> = points.iter().map(|(p, share)| p * p.transpose() * *share).sum();
        Some(Self {
            radius,
            slope: moments.try_inverse()?,
            points: points.chunks(4).map(Points::of).collect(),
        })
    }

    /// Torsional radius, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    pub(super) fn points(&self) -> &[Points] {
        &self.points
    }

    /// Friction on the body over the friction force: a force, and the moment about the centre of mass, m.
    pub fn friction(&self, sliding: &Sliding) -> (Vector2<f64>, f64) {
        let wanted = sliding.centre + sliding.ahead;
        let (slope, reached) = self.sloped_towards(&wanted);
        // From below the centre of mass to a point: `arm = (p - reached) * scale + ahead`.
        let shift = sliding.ahead - reached * sliding.scale;
        let slow = sliding.slow * sliding.slow;
        let (mut fx, mut fy, mut about, mut load) = (f64x4::ZERO, f64x4::ZERO, f64x4::ZERO, f64x4::ZERO);
        for four in &self.points {
            let pressed = four.pressed(&slope);
            let (x, y) = (four.x * sliding.scale + shift.x, four.y * sliding.scale + shift.y);
            let (u, v) = (
                -y * sliding.spin + sliding.velocity.x,
                x * sliding.spin + sliding.velocity.y,
            );
            let per = pressed / (u * u + v * v + slow).sqrt().max(f64x4::splat(1e-12));
            let (rub_x, rub_y) = (u * per, v * per);
            fx -= rub_x;
            fy -= rub_y;
            about -= x * rub_y - y * rub_x;
            load += pressed;
        }
        let load = load.reduce_add().max(1e-12);
        (
            Vector2::new(fx.reduce_add(), fy.reduce_add()) / load,
            about.reduce_add() / load,
        )
    }

    /// The slope of the pressure that brings the load's centre to `wanted`, as far as that can be, and that centre.
    fn sloped_towards(&self, wanted: &Vector2<f64>) -> (Vector2<f64>, Vector2<f64>) {
        let mut slope = self.slope * wanted;
        // Where nothing lifts off, the first step is exact.
        let lightest = self
            .points
            .iter()
            .fold(f64x4::ONE, |least, p| least.min(p.times(&slope)));
        if lightest.to_array().iter().all(|l| *l >= 0.0) {
            return (slope, *wanted);
        }
        let mut reached = self.centre_under(&slope);
        for _ in 1..STEPS {
            let missing = wanted - reached;
            if missing.norm() < NEAR {
                break;
            }
            slope += self.slope * missing;
            reached = self.centre_under(&slope);
        }
        (slope, reached)
    }

    /// The same, with how both go with `wanted`.
    pub(super) fn sloped_with_slopes(&self, wanted: &Vector2<f64>) -> (Vector2<f64>, Vector2<f64>, ByWanted) {
        let (slope, reached) = self.sloped_towards(wanted);
        if reached == *wanted {
            return (slope, reached, (self.slope, Matrix2::identity()));
        }
        let mut at = self.slope * wanted;
        let mut by = self.slope;
        for step in 1..=STEPS {
            let centre = self.centre_under(&at);
            let (mut second, mut first, mut load) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
            for four in &self.points {
                let bears = four.bearing(&at);
                let (x, y) = (four.x * bears, four.y * bears);
                let xy = (x * four.y).reduce_add();
                second += Matrix2::new((x * four.x).reduce_add(), xy, xy, (y * four.y).reduce_add());
                first += Vector2::new(x.reduce_add(), y.reduce_add());
                load += four.pressed(&at).reduce_add();
            }
            let moved = (second - centre * first.transpose()) * by / f64::max(load, 1e-12);
            let missing = wanted - centre;
            if step == STEPS || missing.norm() < NEAR {
                return (at, centre, (by, moved));
            }
            at += self.slope * missing;
            by += self.slope * (Matrix2::identity() - moved);
        }
        (slope, reached, (by, Matrix2::zeros()))
    }

    /// The load's centre where the pressure has a slope.
    fn centre_under(&self, slope: &Vector2<f64>) -> Vector2<f64> {
        let (mut x, mut y, mut load) = (f64x4::ZERO, f64x4::ZERO, f64x4::ZERO);
        for four in &self.points {
            let pressed = four.pressed(slope);
            x += four.x * pressed;
            y += four.y * pressed;
            load += pressed;
        }
        Vector2::new(x.reduce_add(), y.reduce_add()) / load.reduce_add().max(1e-12)
    }
}

/// The points gathered into the cells of a grid of so many a side, each where its load is.
pub(super) fn gathered(points: &[(Vector2<f64>, f64)], side: usize) -> Vec<(Vector2<f64>, f64)> {
    let corner = |pick: fn(f64, f64) -> f64, start: f64| {
        points.iter().fold(Vector2::repeat(start), |c, (p, _)| {
            Vector2::new(pick(c.x, p.x), pick(c.y, p.y))
        })
    };
    let (low, high) = (corner(f64::min, f64::INFINITY), corner(f64::max, f64::NEG_INFINITY));
    let cell = |x: f64, k: usize| {
        let share = (x - low[k]) / (high[k] - low[k]).max(1e-12);
        ((share * side as f64) as usize).min(side - 1)
    };
    let mut cells = vec![(Vector2::zeros(), 0.0); side * side];
    for (p, share) in points {
        let (sum, load) = &mut cells[cell(p.y, 1) * side + cell(p.x, 0)];
        *sum += p * *share;
        *load += share;
    }
    let filled = cells.into_iter().filter(|c| c.1 > 0.0);
    filled.map(|(sum, load)| (sum / load, load)).collect()
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

    fn sliding(velocity: Vector2<f64>, spin: f64) -> Sliding {
        Sliding {
            velocity,
            spin,
            centre: Vector2::zeros(),
            ahead: Vector2::zeros(),
            scale: 1.0,
            slow: 0.0,
        }
    }

    #[test]
    fn a_plate_turns_more_easily_while_it_slides() {
        let plate = LimitSurface::of(&box_points([0.105, 0.08])).expect("a plate");
        let c = plate.radius();
        assert!((c - 0.03558).abs() < 1e-4);
        // Sliding along the long side with a quarter of it as turning: the sums over the plate.
        let (force, moment) = plate.friction(&sliding(Vector2::new(1.0, 0.0), 0.25 / c));
        assert!((force.x + 0.9770).abs() < 4e-3 && force.y.abs() < 1e-6, "{force}");
        assert!((moment / c + 0.1830).abs() < 4e-3, "{}", moment / c);
        let (force, moment) = plate.friction(&sliding(Vector2::zeros(), 1.0));
        assert!(force.norm() < 1e-6 && (moment / c + 1.0).abs() < 1e-9);
    }

    #[test]
    fn friction_acts_where_the_load_is() {
        let plate = LimitSurface::of(&box_points([0.1, 0.08])).expect("a plate");
        let ahead = Vector2::new(0.006, -0.004);
        let way = Vector2::new(0.3, 0.2);
        let loaded = Sliding {
            ahead,
            ..sliding(way, 0.0)
        };
        let (force, moment) = plate.friction(&loaded);
        assert!((force + way.normalize()).norm() < 1e-9);
        assert!((moment - ahead.perp(&force)).abs() < 1e-6, "{moment}");
        // A centre of mass beyond what the footprint can carry keeps the load within it.
        let far = Sliding {
            centre: Vector2::new(0.2, 0.0),
            ..sliding(way, 0.0)
        };
        let (force, _) = plate.friction(&far);
        assert!((force.norm() - 1.0).abs() < 1e-9);
    }
}
