//! Friction under a spread pressure in numbers that may carry derivatives: the sum over the points gives its own slopes, which
//! costs a few sums instead of one for every unknown.

use nalgebra::{Matrix2, Vector2};
use wide::f64x4;

use super::LimitSurface;
use super::limit_surface::Sliding;
use crate::math::{Dual, Real};

/// Numbers in which friction under a pressure can be computed.
pub trait Rubbing: Real {
    /// Friction on the body over the friction force: along, across, and the moment about the centre of mass, m.
    fn rubbed(surface: &LimitSurface, sliding: &Sliding<Self>) -> [Self; 3];
}

impl Rubbing for f64 {
    fn rubbed(surface: &LimitSurface, sliding: &Sliding) -> [Self; 3] {
        let (force, moment) = surface.friction(sliding);
        [force.x, force.y, moment]
    }
}

impl<const N: usize> Rubbing for Dual<N> {
    fn rubbed(surface: &LimitSurface, sliding: &Sliding<Self>) -> [Self; 3] {
        let given = [
            sliding.velocity.x,
            sliding.velocity.y,
            sliding.spin,
            sliding.centre.x,
            sliding.centre.y,
            sliding.ahead.x,
            sliding.ahead.y,
            sliding.scale,
            sliding.slow,
        ];
        let plain = Sliding {
            velocity: Vector2::new(given[0].value, given[1].value),
            spin: given[2].value,
            centre: Vector2::new(given[3].value, given[4].value),
            ahead: Vector2::new(given[5].value, given[6].value),
            scale: given[7].value,
            slow: given[8].value,
        };
        slopes_of(surface, &plain).map(|(value, by)| {
            let mut out = Self::of(value);
            for (one, slope) in given.iter().zip(by) {
                out.slopes
                    .iter_mut()
                    .zip(&one.slopes)
                    .for_each(|(s, o)| *s += slope * o);
            }
            out
        })
    }
}

/// Sums over the points of what force (two) and moment change with: sliding (two), spin, shift of the points (two), their scale,
/// the slow speed, the slope of the pressure (two).
type Sums = [[f64x4; 9]; 3];

/// Force (two) and moment, each with its slopes by velocity (two), spin, centre (two), ahead (two), scale and slow.
fn slopes_of(surface: &LimitSurface, sliding: &Sliding) -> [(f64, [f64; 9]); 3] {
    let wanted = sliding.centre + sliding.ahead;
    let (slope, reached, by_wanted) = surface.sloped_with_slopes(&wanted);
    let shift = sliding.ahead - reached * sliding.scale;
    let mut sums: Sums = [[f64x4::ZERO; 9]; 3];
    let mut rubs = [f64x4::ZERO; 3];
    let (mut load, mut heavier) = (f64x4::ZERO, [f64x4::ZERO; 2]);
    let (w, slow) = (sliding.spin, sliding.slow);
    for four in surface.points() {
        let (px, py) = (four.x, four.y);
        let (pressed, bears) = (four.pressed(&slope), four.bearing(&slope));
        let (x, y) = (px * sliding.scale + shift.x, py * sliding.scale + shift.y);
        let (u, v) = (-y * w + sliding.velocity.x, x * w + sliding.velocity.y);
        let square = (u * u + v * v + slow * slow).max(f64x4::splat(1e-24));
        let per_speed = f64x4::ONE / square.sqrt();
        let (eu, ev) = (u * per_speed, v * per_speed);
        let per = pressed * per_speed;
        // Slopes of the rub by the sliding of its point.
        let (a, b, c) = (
            (f64x4::ONE - eu * eu) * per,
            (f64x4::ONE - ev * ev) * per,
            -eu * ev * per,
        );
        let (rx, ry) = (u * per, v * per);
        let less = -per_speed * slow;
        let row = |by_u: f64x4, by_v: f64x4, rub: f64x4, unit: f64x4| {
            let by_scale = by_v * px - by_u * py;
            [
                by_u,
                by_v,
                by_v * x - by_u * y,
                by_v * w,
                by_u * -w,
                by_scale * w,
                rub * less * per_speed,
                unit * bears * px,
                unit * bears * py,
            ]
        };
        let moment = x * ry - y * rx;
        let mut turning = row(x * c - y * a, x * b - y * c, moment, x * ev - y * eu);
        turning[3] += ry;
        turning[4] -= rx;
        turning[5] += px * ry - py * rx;
        for (sum, row) in sums.iter_mut().zip([row(a, c, rx, eu), row(c, b, ry, ev), turning]) {
            sum.iter_mut().zip(row).for_each(|(s, r)| *s += r);
        }
        rubs.iter_mut().zip([rx, ry, moment]).for_each(|(s, r)| *s += r);
        load += pressed;
        heavier[0] += bears * px;
        heavier[1] += bears * py;
    }
    let load = load.reduce_add().max(1e-12);
    let heavier = heavier.map(|h| h.reduce_add());
    [0, 1, 2].map(|k| {
        let value = -rubs[k].reduce_add() / load;
        let s = sums[k].map(|s| -s.reduce_add() / load);
        let by_slope = Vector2::new(s[7] - value * heavier[0] / load, s[8] - value * heavier[1] / load);
        let by_shift = Vector2::new(s[3], s[4]);
        let by_centre = by_wanted.0.tr_mul(&by_slope) - by_wanted.1.tr_mul(&by_shift) * sliding.scale;
        let by_ahead = by_centre + by_shift;
        let by_scale = s[5] - by_shift.dot(&reached);
        let by = [
            s[0],
            s[1],
            s[2],
            by_centre.x,
            by_centre.y,
            by_ahead.x,
            by_ahead.y,
            by_scale,
            s[6],
        ];
        (value, by)
    })
}

/// How the slope of a pressure and its load's centre go with the centre that is wanted.
pub(super) type ByWanted = (Matrix2<f64>, Matrix2<f64>);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_friction_are_those_of_differences() {
        let points: Vec<(Vector2<f64>, f64)> = (0..36)
            .map(|k| {
                let at = |k: usize, edge: f64| ((k as f64 + 0.5) / 6.0 - 0.5) * edge;
                (Vector2::new(at(k % 6, 0.1), at(k / 6, 0.07)), 1.0 / 36.0)
            })
            .collect();
        let surface = LimitSurface::of(&points).expect("a plate");
        // Bearing all over, and with a side lifted off.
        for ahead in [0.004, 0.03] {
            let given = [0.11, -0.04, 2.3, 0.003, -0.002, ahead, 0.001, 1.1, 0.01];
            let sliding = |x: &[f64; 9]| Sliding {
                velocity: Vector2::new(x[0], x[1]),
                spin: x[2],
                centre: Vector2::new(x[3], x[4]),
                ahead: Vector2::new(x[5], x[6]),
                scale: x[7],
                slow: x[8],
            };
            let found = slopes_of(&surface, &sliding(&given));
            let plain = f64::rubbed(&surface, &sliding(&given));
            for k in 0..9 {
                let side = |h: f64| {
                    let mut x = given;
                    x[k] += h;
                    f64::rubbed(&surface, &sliding(&x))
                };
                let (up, down) = (side(1e-7), side(-1e-7));
                for j in 0..3 {
                    let by = (up[j] - down[j]) / 2e-7;
                    assert!((found[j].0 - plain[j]).abs() < 1e-12);
                    assert!(
                        (found[j].1[k] - by).abs() < 1e-5 * (1.0 + by.abs()),
                        "{ahead} {j} {k}: {} {by}",
                        found[j].1[k]
                    );
                }
            }
        }
    }
}
