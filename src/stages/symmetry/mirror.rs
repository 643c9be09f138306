//! How well a mesh falls on itself under a reflection or a turn, and the plane nearby that does it best.

use nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};

use super::Config;
use crate::base::rng_for;
use crate::geometry::{Mesh, SurfaceDistance, SurfaceSample, sample_triangles};

/// A plane `normal · (x - center of the mirror) = offset`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub normal: Unit<Vector3<f64>>,
    pub offset: f64,
}

/// Distances are cut off at this many tolerances: a part without a counterpart costs a fixed amount.
const CUT_OFF: f64 = 3.0;
/// Weight of a point that falls on surface nobody saw: it can confirm little and contradict little.
const UNSEEN_WEIGHT: f64 = 0.25;
/// Share of points that must fall on surface that was seen, for full marks.
const FULL_SUPPORT: f64 = 0.4;
const SAMPLES: usize = 1200;

/// Points of the seen surface, ready to be moved and compared with the whole surface.
pub(super) struct Mirror {
    surface: SurfaceDistance,
    seen: Vec<bool>,
    samples: Vec<SurfaceSample>,
    /// Centroid of the surface.
    pub center: Point3<f64>,
    /// A miss of one, m.
    pub tolerance: f64,
}

impl Mirror {
    /// Nothing for a mesh without area.
    pub fn new(mesh: &Mesh, config: &Config) -> Option<Self> {
        let surface = SurfaceDistance::new(mesh)?;
        let flag = |v: &u32| mesh.seen.get(*v as usize).copied().unwrap_or(true);
        let mut seen: Vec<bool> = mesh.triangles.iter().map(|t| t.iter().all(flag)).collect();
        let all = vec![true; seen.len()];
        if !seen.contains(&true) {
            seen = all.clone();
        }
        let mut rng = rng_for(config.seed, "symmetry");
        let whole = sample_triangles(mesh, SAMPLES, &mut rng, |t| all[t]);
        let mut samples = sample_triangles(mesh, SAMPLES, &mut rng, |t| seen[t]);
        if samples.is_empty() {
            return None;
        }
        spread(&mut samples);
        let center = whole.iter().map(|s| s.point.coords).sum::<Vector3<f64>>() / whole.len() as f64;
        let (lo, hi) = mesh.bounds()?;
        samples.iter_mut().for_each(|s| s.point -= center);
        Some(Self {
            surface,
            seen,
            samples,
            center: center.into(),
            tolerance: config.tolerance + config.relative_tolerance * (hi - lo).norm(),
        })
    }

    /// Where the points are, from the center.
    pub fn points(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.samples.iter().map(|s| s.point.coords)
    }

    /// Score of a motion that is given in coordinates from the center, on the first `count` points.
    fn score(&self, count: usize, tolerance: f64, moved: impl Fn(&Point3<f64>) -> Point3<f64>) -> f64 {
        let limit = CUT_OFF * tolerance;
        let (mut cost, mut weight, mut supported) = (0.0, 0.0, 0.0);
        let count = count.min(self.samples.len());
        for sample in &self.samples[..count] {
            let place = moved(&sample.point) + self.center.coords;
            let nearest = self.surface.nearest_within(&place, limit);
            let miss = nearest.map_or(CUT_OFF, |n| n.distance / tolerance);
            let on_seen = nearest.is_none_or(|n| self.seen[n.triangle]);
            let w = if on_seen { 1.0 } else { UNSEEN_WEIGHT };
            cost += w * miss * miss;
            weight += w;
            supported += f64::from(u8::from(on_seen));
        }
        (-cost / weight).exp() * (supported / count as f64 / FULL_SUPPORT).min(1.0)
    }

    /// exp(-mean squared miss) of the mirrored points, 0 to 1; `coarse` widens the tolerance by that factor.
    pub fn reflection_score(&self, plane: &Plane, count: usize, coarse: f64) -> f64 {
        self.score(count, coarse * self.tolerance, |p| reflected(plane, p))
    }

    /// The same for a turn about an axis through `point` (from the center).
    pub fn rotation_score(&self, point: &Vector3<f64>, axis: &Unit<Vector3<f64>>, angle: f64) -> f64 {
        let turn = UnitQuaternion::from_axis_angle(axis, angle);
        self.score(300, self.tolerance, |p| turn * (p - point) + point)
    }

    /// Turns and shifts a plane until the mirrored points lie best on the surface: point-to-plane ICP with
    /// Tukey's weights, whose width shrinks from `wide` tolerances to one and a half.
    pub fn refined(&self, plane: &Plane, count: usize, iterations: usize, wide: f64) -> Plane {
        let mut plane = *plane;
        for i in 0..iterations {
            let progress = i as f64 / (iterations.max(2) - 1) as f64;
            let width = self.tolerance * (wide + (1.5 - wide) * progress);
            plane = self.step(&plane, count, width).unwrap_or(plane);
        }
        plane
    }

    /// One Gauss-Newton step in (two turns of the normal, offset). With x' = x - 2 (n·x - d) n the derivatives are
    /// dx'/dalpha = -2 (t·x) n - 2 (n·x - d) t for a turn of n towards t, and dx'/dd = 2 n.
    fn step(&self, plane: &Plane, count: usize, width: f64) -> Option<Plane> {
        let n = plane.normal.into_inner();
        let (t1, t2) = tangents(&plane.normal);
        let mut normal = Matrix3::zeros();
        let mut gradient = Vector3::zeros();
        for sample in &self.samples[..count.min(self.samples.len())] {
            let place = reflected(plane, &sample.point);
            let Some(nearest) = self.surface.nearest_within(&(place + self.center.coords), width) else {
                continue;
            };
            let facing = self.surface.normal(nearest.triangle);
            let mirrored_normal = sample.normal - n * (2.0 * n.dot(&sample.normal));
            if facing.dot(&mirrored_normal) < 0.3 {
                continue;
            }
            let u = 1.0 - (nearest.distance / width).powi(2);
            let weight = u
                * u
                * if self.seen[nearest.triangle] {
                    1.0
                } else {
                    UNSEEN_WEIGHT
                };
            let residual = facing.dot(&(place + self.center.coords - nearest.point));
            let x = sample.point.coords;
            let height = n.dot(&x) - plane.offset;
            let turned = |t: &Vector3<f64>| facing.dot(&(n * (t.dot(&x)) + t * height)) * -2.0;
            let row = Vector3::new(turned(&t1), turned(&t2), 2.0 * facing.dot(&n));
            normal += row * row.transpose() * weight;
            gradient += row * (residual * weight);
        }
        // Directions in which the shape slides on itself (a cylinder about its axis) are left alone.
        let damping = normal.diagonal().map(|d| 1e-3 * d + 1e-12);
        let step = (normal + Matrix3::from_diagonal(&damping))
            .cholesky()?
            .solve(&-gradient);
        let moved = Plane {
            normal: Unit::new_normalize(n + t1 * step.x + t2 * step.y),
            offset: plane.offset + step.z,
        };
        (step.x.hypot(step.y) < 0.5 && step.iter().all(|s| s.is_finite())).then_some(moved)
    }
}

fn reflected(plane: &Plane, p: &Point3<f64>) -> Point3<f64> {
    p - plane.normal.into_inner() * (2.0 * (plane.normal.dot(&p.coords) - plane.offset))
}

/// Two unit vectors square to `n` and to each other.
pub(super) fn tangents(n: &Unit<Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let least = n.iamin();
    let t1 = n.cross(&Vector3::ith(least, 1.0)).normalize();
    (t1, n.cross(&t1))
}

/// Reorders points that follow the triangles, so that the first few are spread over the whole surface: index times a
/// number that shares no factor with the count runs through all of them in even strides.
fn spread(samples: &mut Vec<SurfaceSample>) {
    let count = samples.len();
    let stride = (count as f64 * 0.618_033_988_7) as usize;
    let coprime = (stride.max(1)..).find(|s| gcd(*s, count) == 1).unwrap_or(1);
    *samples = (0..count).map(|i| samples[i * coprime % count]).collect();
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
