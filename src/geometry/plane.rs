//! Planes: a robust fit to points, and the plane that separates two sets.

use nalgebra::{Matrix4, Point3, UnitVector3, Vector3, Vector4};
use rand::Rng;

use super::closing::best_plane;

/// The points `p` with `normal . p = offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: UnitVector3<f64>,
    /// Signed distance of the plane from the origin, m.
    pub offset: f64,
}

impl Plane {
    /// Signed distance of a point, positive where the normal points.
    pub fn height(&self, p: &Point3<f64>) -> f64 {
        self.normal.dot(&p.coords) - self.offset
    }

    /// The plane through a point.
    pub fn through(point: &Point3<f64>, normal: UnitVector3<f64>) -> Self {
        Self {
            normal,
            offset: normal.dot(&point.coords),
        }
    }

    /// Random sample consensus (Fischler and Bolles 1981) over triples, then a least-squares fit to the points
    /// within `tolerance`, twice. Only planes that `accept` takes; the normal's sign is up to `accept`, which is
    /// asked for both. Returns the plane and the fraction of points within the tolerance.
    pub fn ransac(
        points: &[Point3<f64>],
        tolerance: f64,
        trials: usize,
        rng: &mut impl Rng,
        accept: impl Fn(&UnitVector3<f64>) -> bool,
    ) -> Option<(Self, f64)> {
        let n = points.len();
        let mut best: Option<(usize, Self)> = None;
        for _ in 0..if n < 3 { 0 } else { trials } {
            let [a, b, c] = [0; 3].map(|_| points[rng.random_range(0..n)]);
            let Some(normal) = UnitVector3::try_new((b - a).cross(&(c - a)), 1e-12) else {
                continue;
            };
            let Some(normal) = [normal, -normal].into_iter().find(|n| accept(n)) else {
                continue;
            };
            let plane = Self::through(&a, normal);
            let votes = points.iter().filter(|p| plane.height(p).abs() < tolerance).count();
            if best.is_none_or(|(most, _)| votes > most) {
                best = Some((votes, plane));
            }
        }
        let mut plane = best?.1;
        for _ in 0..2 {
            plane = plane.refit(points, tolerance);
        }
        let votes = points.iter().filter(|p| plane.height(p).abs() < tolerance).count();
        Some((plane, votes as f64 / n as f64))
    }

    /// Least squares to the points within `tolerance` of this plane.
    pub fn refit(&self, points: &[Point3<f64>], tolerance: f64) -> Self {
        let near = points.iter().filter(|p| self.height(p).abs() < tolerance).copied();
        if near.clone().count() < 3 {
            return *self;
        }
        let (centre, axes) = best_plane(near);
        let normal = if axes[2].dot(&self.normal) < 0.0 {
            -axes[2]
        } else {
            axes[2]
        };
        Self::through(&centre, UnitVector3::new_normalize(normal))
    }

    /// The plane that separates `below` (negative side) from `above` best, by ridge-damped logistic regression
    /// with both sets given the same say (Newton's method), and the fraction of points on the wrong side.
    pub fn separating(below: &[Point3<f64>], above: &[Point3<f64>]) -> Option<(Self, f64)> {
        let all = || below.iter().chain(above);
        let n = all().count();
        if below.is_empty() || above.is_empty() {
            return None;
        }
        let centre = all().map(|p| p.coords).sum::<Vector3<f64>>() / n as f64;
        let scale = (all().map(|p| (p.coords - centre).norm_squared()).sum::<f64>() / n as f64).sqrt();
        let lifted = |p: &Point3<f64>| {
            let x = (p.coords - centre) / scale.max(1e-12);
            Vector4::new(x.x, x.y, x.z, 1.0)
        };
        let weight = [0.5 / below.len() as f64, 0.5 / above.len() as f64];
        let rows: Vec<(Vector4<f64>, f64, f64)> = below
            .iter()
            .map(|p| (lifted(p), 0.0, weight[0]))
            .chain(above.iter().map(|p| (lifted(p), 1.0, weight[1])))
            .collect();
        let w = logistic(&rows)?;
        let length = w.xyz().norm();
        let normal = UnitVector3::try_new(w.xyz(), 1e-9)?;
        let offset = normal.dot(&centre) - w.w / length * scale;
        let (offset, wrong) = best_offset(&normal, offset, below, above);
        Some((Self { normal, offset }, wrong as f64 / n as f64))
    }
}

/// The offset along `normal` that leaves the fewest points on the wrong side, nearest to `guess` among equals;
/// and that number.
fn best_offset(normal: &UnitVector3<f64>, guess: f64, below: &[Point3<f64>], above: &[Point3<f64>]) -> (f64, usize) {
    let place = |p: &Point3<f64>| normal.dot(&p.coords);
    let mut line: Vec<(f64, bool)> = below.iter().map(|p| (place(p), false)).collect();
    line.extend(above.iter().map(|p| (place(p), true)));
    line.sort_by(|a, b| a.0.total_cmp(&b.0));
    // With the border under everything, every point of the lower set is on the wrong side.
    let mut wrong = below.len();
    let mut best = (wrong, f64::INFINITY, guess);
    for (i, (at, is_above)) in line.iter().enumerate() {
        if *is_above {
            wrong += 1
        } else {
            wrong -= 1
        }
        let next = line.get(i + 1).map_or(*at, |n| n.0);
        let border = guess.clamp(*at, next);
        let middle = 0.5 * (at + next);
        let candidate = (wrong, (border - guess).abs(), middle);
        if (candidate.0, candidate.1) < (best.0, best.1) {
            best = candidate;
        }
    }
    (best.2, best.0)
}

/// Weighted logistic regression of (row, outcome, weight) by damped Newton steps.
fn logistic(rows: &[(Vector4<f64>, f64, f64)]) -> Option<Vector4<f64>> {
    const RIDGE: f64 = 1e-6;
    let loss = |w: &Vector4<f64>| {
        let fit: f64 = rows
            .iter()
            .map(|(x, y, weight)| {
                let t = x.dot(w) * (1.0 - 2.0 * y);
                weight * (t.max(0.0) + (-t.abs()).exp().ln_1p())
            })
            .sum();
        fit + 0.5 * RIDGE * w.norm_squared()
    };
    let mut w = Vector4::zeros();
    let mut at = loss(&w);
    for _ in 0..40 {
        let mut gradient = w * RIDGE;
        let mut hessian = Matrix4::identity() * RIDGE;
        for (x, y, weight) in rows {
            let p = 1.0 / (1.0 + (-x.dot(&w)).exp());
            gradient += x * (weight * (p - y));
            hessian += x * x.transpose() * (weight * p * (1.0 - p));
        }
        let step = hessian.cholesky()?.solve(&gradient);
        let mut share = 1.0;
        while share > 1e-4 && loss(&(w - step * share)) > at {
            share *= 0.5;
        }
        let next = w - step * share;
        let reached = loss(&next);
        if reached.is_nan() || reached >= at - 1e-9 {
            break;
        }
        (w, at) = (next, reached);
    }
    Some(w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, rng_for};

    #[test]
    fn a_table_is_found_under_clutter() {
        let mut rng = rng_for(Seed(1), "test");
        let mut points = Vec::new();
        for i in 0..2000 {
            let (x, y) = (rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5));
            let z = if i % 3 == 0 {
                rng.random_range(0.0..0.3)
            } else {
                0.1 * x + rng.random_range(-0.001..0.001)
            };
            points.push(Point3::new(x, y, z));
        }
        let found = Plane::ransac(&points, 0.003, 300, &mut rng, |n| n.z > 0.8);
        let (plane, share) = found.expect("a plane");
        let truth = Vector3::new(-0.1, 0.0, 1.0).normalize();
        assert!((plane.normal.into_inner() - truth).norm() < 0.002 && plane.offset.abs() < 5e-4);
        assert!(share > 0.6);
    }

    #[test]
    fn two_stacked_sets_part_at_their_border() {
        let set = |low: f64| -> Vec<Point3<f64>> {
            (0..400)
                .map(|i| {
                    Point3::new(
                        f64::from(i % 20) * 0.003,
                        f64::from(i / 20) * 0.003,
                        low + 0.002 * f64::from(i % 17),
                    )
                })
                .collect()
        };
        let (plane, wrong) = Plane::separating(&set(0.0), &set(0.034)).expect("a plane");
        assert!(wrong < 1e-9);
        assert!(
            plane.normal.z > 0.999 && (plane.offset - 0.033).abs() < 0.001,
            "{plane:?}"
        );
    }
}
