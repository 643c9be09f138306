//! One smooth solid for a shape: superquadrics fitted to surface points.

use std::f64::consts::FRAC_PI_4;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use super::{Mesh, SurfaceDistance, SurfaceSample, sample_surface};
use crate::base::{Pose, Seed, rng_for};

/// `((x/a)^(2/e2) + (y/b)^(2/e2))^(e2/e1) + (z/c)^(2/e1) = 1` (Barr 1981), fitted to a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct SuperquadricFit {
    /// Half sizes a, b, c, m.
    pub size: [f64; 3],
    /// Exponents e1 (along z), e2 (around z), each 0.1 to 2: 0.1 is a box, 1 round, 2 pointed.
    pub exponents: [f64; 2],
    /// Mesh-from-superquadric.
    pub pose: Pose,
    /// Root mean square of the radial distance of the surface points that face the open, m.
    pub residual: f64,
}

const MIN_EXPONENT: f64 = 0.1;
const MAX_EXPONENT: f64 = 2.0;
/// Points and iterations of the trial of a start, and of what the best starts get after it.
const TRIAL: (usize, usize) = (150, 12);
const POLISH: (usize, usize) = (800, 40);
/// Starts that are polished.
const BEST: usize = 3;
/// Exponent from which a shape is pointed rather than rounded.
const POINTED: f64 = 1.5;
/// Share of the samples that must face the open, or all are taken.
const LEAST_OPEN: f64 = 0.3;
const PARAMETERS: usize = 11;

/// Least squares on the radial distance (Solina & Bajcsy 1990 with the distance of Gross & Boult 1988), by
/// Levenberg-Marquardt from several starts: each axis of the principal frame, and of the mesh's own frame, as the
/// superquadric's z, each also turned by 45 degrees about it (a box is a pointed shape of the frame between: Liu et
/// al. 2022, sec. 4.3). Only surface that faces the open counts, so that a vessel is taken for its outside.
/// Nothing for a mesh without area or extent.
pub fn superquadric_fit(mesh: &Mesh) -> Option<SuperquadricFit> {
    let points = open_points(mesh);
    let few: Vec<Point3<f64>> = points.iter().step_by(POLISH.0 / TRIAL.0).copied().collect();
    let mut trials: Vec<(f64, State)> = starts(&points)
        .into_iter()
        .filter_map(|start| fit_from(start, &few, TRIAL.1))
        .collect();
    trials.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let polished = trials
        .into_iter()
        .take(BEST)
        .filter_map(|(_, s)| fit_from(s, &points, POLISH.1));
    let (residual, state) = polished.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    Some(SuperquadricFit {
        size: state.size,
        exponents: state.exponents,
        pose: state.pose.into(),
        residual,
    })
}

/// A box is also the pointed shape of the frame turned by 45 degrees: of two descriptions that fit alike the plain one
/// is meant.
fn cost((residual, state): &(f64, State)) -> f64 {
    let pointed = state.exponents.iter().any(|e| *e > POINTED);
    if pointed { 2.0 * residual } else { *residual }
}

/// Samples of the surface whose normals meet no other part of it.
fn open_points(mesh: &Mesh) -> Vec<Point3<f64>> {
    let mut rng = rng_for(Seed(0), "superquadric");
    let samples = sample_surface(mesh, POLISH.0, &mut rng);
    let all = || samples.iter().map(|s| s.point).collect();
    let Some(surface) = SurfaceDistance::new(mesh) else {
        return all();
    };
    let (low, high) = mesh.bounds().unwrap_or_default();
    let size = (high - low).norm();
    let is_open = |s: &&SurfaceSample| !surface.is_hit(&(s.point + s.normal * (1e-3 * size)), &s.normal, size);
    let open: Vec<Point3<f64>> = samples.iter().filter(is_open).map(|s| s.point).collect();
    if open.len() as f64 > LEAST_OPEN * samples.len() as f64 {
        open
    } else {
        all()
    }
}

#[derive(Clone, Debug)]
struct State {
    size: [f64; 3],
    exponents: [f64; 2],
    pose: Isometry3<f64>,
}

impl State {
    /// Moves by logarithms of sizes, exponents, a turn and a shift in its own frame.
    fn moved(&self, d: &DVector<f64>) -> Self {
        let exponent = |e: f64, by: f64| (e + by).clamp(MIN_EXPONENT, MAX_EXPONENT);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(d[5], d[6], d[7]));
        Self {
            size: [0, 1, 2].map(|i| self.size[i] * d[i].clamp(-0.5, 0.5).exp()),
            exponents: [exponent(self.exponents[0], d[3]), exponent(self.exponents[1], d[4])],
            pose: self.pose * Isometry3::from_parts(Vector3::new(d[8], d[9], d[10]).into(), turn),
        }
    }

    /// Distance of each point from the surface along its ray from the centre, m.
    fn residuals(&self, points: &[Point3<f64>]) -> DVector<f64> {
        let inverse = self.pose.inverse();
        DVector::from_iterator(points.len(), points.iter().map(|p| self.radial(&(inverse * p))))
    }

    fn radial(&self, p: &Point3<f64>) -> f64 {
        let [e1, e2] = self.exponents;
        let u = [0, 1, 2].map(|i| (p[i] / self.size[i]).abs().max(1e-9));
        // The larger term is taken out of each power, or small exponents would overflow.
        let large = u[0].max(u[1]);
        let around = large * ((u[0] / large).powf(2.0 / e2) + (u[1] / large).powf(2.0 / e2)).powf(0.5 * e2);
        let large = around.max(u[2]);
        let inside_outside = large * ((around / large).powf(2.0 / e1) + (u[2] / large).powf(2.0 / e1)).powf(0.5 * e1);
        p.coords.norm() * (1.0 - 1.0 / inside_outside)
    }
}

fn starts(points: &[Point3<f64>]) -> Vec<State> {
    if points.is_empty() {
        return Vec::new();
    }
    let mean = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64;
    let spread: Matrix3<f64> = points
        .iter()
        .map(|p| (p.coords - mean) * (p.coords - mean).transpose())
        .sum();
    let mut axes = spread.symmetric_eigen().eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    let to_z = [
        Rotation3::identity(),
        Rotation3::from_matrix_unchecked(Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)),
        Rotation3::from_matrix_unchecked(Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0)),
    ];
    let frames = [Rotation3::identity(), Rotation3::from_matrix_unchecked(axes)];
    let halfway = [0.0, FRAC_PI_4].map(|a| Rotation3::from_axis_angle(&Vector3::z_axis(), a));
    let turns = frames.iter().flat_map(|f| to_z.iter().map(move |t| f * t));
    let turns = turns.flat_map(|f| halfway.map(|h| f * h));
    turns.filter_map(|turn| boxed(points, &turn)).collect()
}

/// The start whose box in a turned frame holds the points.
fn boxed(points: &[Point3<f64>], turn: &Rotation3<f64>) -> Option<State> {
    let first = turn.inverse() * points.first()?;
    let (lo, hi) = points
        .iter()
        .map(|p| turn.inverse() * p)
        .fold((first, first), |(lo, hi), p| (lo.inf(&p), hi.sup(&p)));
    let half = (hi - lo) * 0.5;
    let least = 1e-3 * half.max();
    let center = turn * nalgebra::center(&lo, &hi);
    (least > 0.0).then(|| State {
        size: [half.x.max(least), half.y.max(least), half.z.max(least)],
        exponents: [0.6, 0.6],
        pose: Isometry3::from_parts(center.into(), UnitQuaternion::from_rotation_matrix(turn)),
    })
}

/// Root mean square of the radial distances, m, and what has it.
fn fit_from(start: State, points: &[Point3<f64>], iterations: usize) -> Option<(f64, State)> {
    let mut state = start;
    let mut residuals = state.residuals(points);
    let mut damping = 1e-3;
    for _ in 0..iterations {
        let jacobian = jacobian(&state, &residuals, points);
        let normal = jacobian.transpose() * &jacobian;
        let gradient = jacobian.transpose() * &residuals;
        let before = residuals.norm_squared();
        let mut improved = false;
        while damping < 1e8 && !improved {
            let damped = &normal + DMatrix::from_diagonal(&normal.diagonal().map(|d| damping * d + 1e-15));
            let step = -damped.cholesky()?.solve(&gradient);
            let trial = state.moved(&step);
            let trial_residuals = trial.residuals(points);
            improved = trial_residuals.norm_squared() < before;
            if improved {
                (state, residuals) = (trial, trial_residuals);
            }
            damping *= if improved { 0.2 } else { 5.0 };
        }
        if !improved || residuals.norm_squared() > before * (1.0 - 1e-6) {
            break;
        }
    }
    let residual = (residuals.norm_squared() / points.len() as f64).sqrt();
    residual.is_finite().then_some((residual, state))
}

fn jacobian(state: &State, residuals: &DVector<f64>, points: &[Point3<f64>]) -> DMatrix<f64> {
    let scale = state.size.iter().fold(0.0f64, |a, b| a.max(*b));
    let mut jacobian = DMatrix::zeros(points.len(), PARAMETERS);
    for i in 0..PARAMETERS {
        let mut h = if i < 8 { 1e-6 } else { 1e-6 * scale };
        // Steps point inward at the upper bound of an exponent.
        if (3..5).contains(&i) && state.exponents[i - 3] + h > MAX_EXPONENT {
            h = -h;
        }
        let mut d = DVector::zeros(PARAMETERS);
        d[i] = h;
        jacobian.set_column(i, &((state.moved(&d).residuals(points) - residuals) / h));
    }
    jacobian
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::{cuboid, cylinder, revolve, sphere};

    #[test]
    fn boxes_cylinders_and_spheres_are_told_by_their_exponents() {
        let pose = Isometry3::new(Vector3::new(0.3, -0.1, 0.2), Vector3::new(0.0, 0.0, 0.7));
        for (name, mesh, sizes, e1, e2) in [
            ("box", cuboid([0.06, 0.1, 0.2]), [0.03, 0.05, 0.1], 0.1..0.35, 0.1..0.35),
            (
                "cylinder",
                cylinder(0.035, 0.1, 96),
                [0.035, 0.035, 0.05],
                0.1..0.35,
                0.85..1.15,
            ),
            ("sphere", sphere(0.05, 4), [0.05, 0.05, 0.05], 0.9..1.1, 0.9..1.1),
        ] {
            let fit = superquadric_fit(&mesh.transformed(&pose)).unwrap();
            let mut found = fit.size;
            found.sort_by(f64::total_cmp);
            for (a, b) in found.iter().zip(sizes) {
                assert!((a / b - 1.0).abs() < 0.03, "{name}: {fit:?}");
            }
            assert!(
                e1.contains(&fit.exponents[0]) && e2.contains(&fit.exponents[1]),
                "{name}: {fit:?}"
            );
            assert!(
                (fit.pose.translation.vector - pose.translation.vector).norm() < 5e-4,
                "{name}: {fit:?}"
            );
            assert!(fit.residual < 0.001, "{name}: {fit:?}");
        }
    }

    /// The explicit surface (Barr 1981, eq. 2.6): a ball whose vertices are moved to their superquadric latitudes and
    /// longitudes.
    fn superellipsoid([a, b, c]: [f64; 3], [e1, e2]: [f64; 2]) -> Mesh {
        let power = |x: f64, e: f64| x.signum() * x.abs().powf(e);
        let mut mesh = sphere(1.0, 5);
        for p in &mut mesh.vertices {
            let (eta, omega) = (p.z.clamp(-1.0, 1.0).asin(), p.y.atan2(p.x));
            let flat = power(eta.cos(), e1);
            *p = Point3::new(
                a * flat * power(omega.cos(), e2),
                b * flat * power(omega.sin(), e2),
                c * power(eta.sin(), e1),
            );
        }
        mesh
    }

    fn distance_of_poses(a: &Pose, b: &Isometry3<f64>) -> f64 {
        (a.translation.vector - b.translation.vector).norm()
    }

    #[test]
    fn superquadrics_come_back_from_their_own_surface_in_any_pose() {
        for (i, (size, exponents)) in [
            ([0.03, 0.05, 0.08], [1.0, 1.0]),
            ([0.04, 0.04, 0.07], [0.3, 1.0]),
            ([0.05, 0.03, 0.06], [0.5, 0.4]),
            ([0.03, 0.045, 0.02], [1.3, 0.6]),
        ]
        .into_iter()
        .enumerate()
        {
            let pose = Isometry3::new(
                Vector3::new(0.2, -0.1, 0.05),
                Vector3::new(0.9, -0.6, 0.3) * (1.0 + i as f64),
            );
            let fit = superquadric_fit(&superellipsoid(size, exponents).transformed(&pose)).unwrap();
            assert!(fit.residual < 2e-4, "{exponents:?}: {fit:?}");
            assert!(distance_of_poses(&fit.pose, &pose) < 5e-4, "{exponents:?}: {fit:?}");
            let (mut found, mut truth) = (fit.size, size);
            found.sort_by(f64::total_cmp);
            truth.sort_by(f64::total_cmp);
            for (a, b) in found.iter().zip(truth) {
                assert!((a / b - 1.0).abs() < 0.02, "{exponents:?}: {fit:?}");
            }
            // A ball-like one has no axis of its own.
            if exponents != [1.0, 1.0] {
                for (a, b) in fit.exponents.iter().zip(exponents) {
                    assert!((a - b).abs() < 0.06, "{exponents:?}: {fit:?}");
                }
            }
        }
    }

    #[test]
    fn a_vessel_is_taken_for_its_outside() {
        let profile = [
            [0.0, 0.0],
            [0.04, 0.0],
            [0.04, 0.09],
            [0.036, 0.09],
            [0.036, 0.005],
            [0.0, 0.005],
        ];
        let fit = superquadric_fit(&revolve(&profile, 96)).unwrap();
        let [a, b, c] = fit.size;
        assert!(
            (a - 0.04).abs() < 1e-3 && (b - 0.04).abs() < 1e-3 && (c - 0.045).abs() < 4e-3,
            "{fit:?}"
        );
        assert!(
            fit.exponents[0] < 0.4 && (0.8..1.2).contains(&fit.exponents[1]),
            "{fit:?}"
        );
    }

    #[test]
    fn nothing_fits_nothing() {
        assert_eq!(superquadric_fit(&Mesh::default()), None);
    }
}
