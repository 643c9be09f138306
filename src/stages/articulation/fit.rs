//! Fits one kind of joint to relative poses: a first guess in closed form, then damped least squares with
//! Huber weights (Levenberg-Marquardt; the joint positions are eliminated sample by sample).

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Unit, UnitQuaternion, Vector3};

use super::manifold::{Manifold, Projection, Sample, across};
use crate::twin::JointKind;

/// A fitted kind of joint.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The joint, parent frame.
    pub manifold: Manifold,
    /// Sum of squared residuals with Huber's loss, in units of the samples' noise.
    pub chi2: f64,
    /// Covariance of [`Manifold::stepped`]'s parameters for unit residual variance; gauge directions are 0.
    pub covariance: DMatrix<f64>,
    /// The projection of each sample.
    pub projections: Vec<Projection>,
}

/// Residuals beyond this many times the typical one lose weight (Huber).
const HUBER: f64 = 3.0;

/// Fits `kind` to the samples; nothing where a first guess cannot be made.
pub fn fit(kind: JointKind, samples: &[Sample]) -> Option<Fit> {
    let mut best = first_guess(kind, samples)?;
    let (mut projections, mut chi2) = evaluate(&best, samples);
    let mut damping = 1e-3;
    let mut normal = normal_matrix(&best, samples, &projections);
    for _ in 0..30 {
        let (information, gradient) = &normal;
        let mut damped = information.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] += damping * information[(i, i)] + 1e-9 * information.trace();
        }
        let step = damped.lu().solve(gradient)?;
        let trial = best.stepped(step.as_slice());
        let (trial_projections, trial_chi2) = evaluate(&trial, samples);
        let gain = chi2 - trial_chi2;
        if gain > 0.0 {
            (best, chi2, projections) = (trial, trial_chi2, trial_projections);
            damping = (damping * 0.2).max(1e-9);
            if gain < 1e-6 * (1.0 + chi2) {
                break;
            }
            normal = normal_matrix(&best, samples, &projections);
        } else {
            damping *= 6.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    let (information, _) = normal_matrix(&best, samples, &projections);
    Some(Fit {
        covariance: pseudo_inverse(&information),
        manifold: best,
        chi2,
        projections,
    })
}

/// Typical size of a residual, so that Huber's threshold follows the data where the noise is understated.
fn typical(projections: &[Projection]) -> f64 {
    let mut sizes: Vec<f64> = projections.iter().map(|p| p.residual.norm()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).copied().unwrap_or(1.0).max(1.0)
}

fn evaluate(manifold: &Manifold, samples: &[Sample]) -> (Vec<Projection>, f64) {
    let projections = manifold.project_all(samples);
    let threshold = HUBER * typical(&projections);
    let chi2 = projections
        .iter()
        .map(|p| {
            let size = p.residual.norm();
            if size <= threshold {
                size * size
            } else {
                threshold * (2.0 * size - threshold)
            }
        })
        .sum();
    (projections, chi2)
}

fn normal_matrix(manifold: &Manifold, samples: &[Sample], projections: &[Projection]) -> (DMatrix<f64>, DVector<f64>) {
    let n = manifold.chart();
    let threshold = HUBER * typical(projections);
    let moved: Vec<Manifold> = (0..n)
        .map(|k| {
            let mut step = vec![0.0; n];
            step[k] = 1e-6;
            manifold.stepped(&step)
        })
        .collect();
    let mut information = DMatrix::zeros(n, n);
    let mut gradient = DVector::zeros(n);
    for (sample, projection) in samples.iter().zip(projections) {
        let weight = (threshold / projection.residual.norm().max(1e-12)).min(1.0);
        let mut columns = DMatrix::zeros(6, n);
        for (k, m) in moved.iter().enumerate() {
            let there = m.project_near(sample, projection.z[0]).residual;
            columns.set_column(k, &((projection.residual - there) / 1e-6));
        }
        information += weight * columns.transpose() * &columns;
        gradient += weight * columns.transpose() * projection.residual;
    }
    (information, gradient)
}

fn pseudo_inverse(information: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = information.clone().symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let inverted = eigen
        .eigenvalues
        .map(|l| if l > 1e-11 * largest { 1.0 / l } else { 0.0 });
    &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose()
}

fn first_guess(kind: JointKind, samples: &[Sample]) -> Option<Manifold> {
    let first = samples.first()?;
    let home = Isometry3::from_parts(
        first.position.into(),
        first.rotation.unwrap_or_else(UnitQuaternion::identity),
    );
    let oriented = samples.iter().any(|s| s.rotation.is_some());
    let spread = spread_of_positions(samples);
    let turning = oriented.then(|| turning_axis(samples, &home)).flatten();
    let (axis, point) = match kind {
        JointKind::Fixed => (Vector3::z(), home.translation.vector),
        JointKind::Prismatic => (spread.column(0).into(), home.translation.vector),
        JointKind::Planar => (
            turning.unwrap_or_else(|| spread.column(2).into()),
            home.translation.vector,
        ),
        JointKind::Spherical => (
            Vector3::z(),
            centre_of_turning(samples, &home).or_else(|| sphere(samples))?,
        ),
        JointKind::Screw if !oriented => return None,
        JointKind::Revolute | JointKind::Screw | JointKind::Cylindrical => match turning {
            Some(axis) => (axis, centre_of_turning(samples, &home)?),
            None => better_arc(
                kind,
                &home,
                samples,
                [circle(samples, &spread), parabola(samples, &spread)],
            )?,
        },
    };
    let mut manifold = Manifold {
        kind,
        home,
        axis: Unit::try_new(axis, 1e-12)?,
        point,
        pitch: 0.0,
    };
    if kind == JointKind::Screw {
        manifold.pitch = pitch(&manifold, samples);
    }
    Some(manifold)
}

/// Principal directions of the positions, largest spread first.
fn spread_of_positions(samples: &[Sample]) -> Matrix3<f64> {
    let mean = samples.iter().map(|s| s.position).sum::<Vector3<f64>>() / samples.len() as f64;
    let scatter: Matrix3<f64> = samples
        .iter()
        .map(|s| (s.position - mean) * (s.position - mean).transpose())
        .sum();
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    Matrix3::from_columns(&order.map(|i| eigen.eigenvectors.column(i).into_owned()))
}

/// The principal direction of the rotations away from the first pose.
fn turning_axis(samples: &[Sample], home: &Isometry3<f64>) -> Option<Vector3<f64>> {
    let scatter: Matrix3<f64> = samples
        .iter()
        .filter_map(|s| s.rotation)
        .map(|r| (r * home.rotation.inverse()).scaled_axis())
        .map(|v| v * v.transpose())
        .sum();
    let eigen = scatter.symmetric_eigen();
    (eigen.eigenvalues.max() > 0.0).then(|| eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned())
}

/// The point that stays where it is, `(I - R) c = p - R p0`, in least squares with a weak pull to the origin
/// of the child where the data leave it open (along the axis).
fn centre_of_turning(samples: &[Sample], home: &Isometry3<f64>) -> Option<Vector3<f64>> {
    let mut information = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for sample in samples {
        let turn = (sample.rotation? * home.rotation.inverse())
            .to_rotation_matrix()
            .into_inner();
        let a = Matrix3::identity() - turn;
        information += a.transpose() * a;
        right += a.transpose() * (sample.position - turn * home.translation.vector);
    }
    let weak = 1e-5 * information.trace() + 1e-12;
    information += Matrix3::identity() * weak;
    right += home.translation.vector * weak;
    information.lu().solve(&right)
}

/// A circle through positions: the plane of largest spread, then the algebraic fit (Kåsa).
fn circle(samples: &[Sample], spread: &Matrix3<f64>) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mean = samples.iter().map(|s| s.position).sum::<Vector3<f64>>() / samples.len() as f64;
    let (e1, e2) = (spread.column(0), spread.column(1));
    let mut information = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for sample in samples {
        let d = sample.position - mean;
        let row = Vector3::new(e1.dot(&d), e2.dot(&d), 1.0);
        information += row * row.transpose();
        right += row * (row.x * row.x + row.y * row.y);
    }
    let solved = information.lu().solve(&right)?;
    let centre = mean + e1 * (0.5 * solved.x) + e2 * (0.5 * solved.y);
    Some((spread.column(0).cross(&spread.column(1)), centre))
}

/// The one of several arcs that lies nearer to the positions.
fn better_arc(
    kind: JointKind,
    home: &Isometry3<f64>,
    samples: &[Sample],
    arcs: [Option<(Vector3<f64>, Vector3<f64>)>; 2],
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let misfit = |(axis, point): &(Vector3<f64>, Vector3<f64>)| {
        let axis = Unit::try_new(*axis, 1e-12)?;
        let manifold = Manifold {
            kind,
            home: *home,
            axis,
            point: *point,
            pitch: 0.0,
        };
        Some(evaluate(&manifold, samples).1)
    };
    let weighed = arcs.into_iter().flatten().filter_map(|arc| Some((misfit(&arc)?, arc)));
    weighed.min_by(|a, b| a.0.total_cmp(&b.0)).map(|w| w.1)
}

/// The circle that osculates a parabola through positions: for arcs too short for the algebraic circle, which
/// noise pulls towards small radii.
fn parabola(samples: &[Sample], spread: &Matrix3<f64>) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mean = samples.iter().map(|s| s.position).sum::<Vector3<f64>>() / samples.len() as f64;
    let along: Vector3<f64> = spread.column(0).into();
    let (mut information, mut right) = (Matrix3::zeros(), Matrix3::zeros());
    for sample in samples {
        let d = sample.position - mean;
        let x = along.dot(&d);
        let row = Vector3::new(1.0, x, x * x);
        information += row * row.transpose();
        right += row * d.transpose();
    }
    let solved = information.lu().solve(&right)?;
    let bend: Vector3<f64> = solved.row(2).transpose();
    let bend = bend - along * along.dot(&bend);
    let inward = bend.try_normalize(1e-9)?;
    let vertex = mean + solved.row(0).transpose();
    Some((along.cross(&inward), vertex + inward / (2.0 * bend.norm())))
}

/// A sphere through positions (algebraic fit).
fn sphere(samples: &[Sample]) -> Option<Vector3<f64>> {
    let mean = samples.iter().map(|s| s.position).sum::<Vector3<f64>>() / samples.len() as f64;
    let mut information = nalgebra::Matrix4::zeros();
    let mut right = nalgebra::Vector4::zeros();
    for sample in samples {
        let d = sample.position - mean;
        let row = nalgebra::Vector4::new(d.x, d.y, d.z, 1.0);
        information += row * row.transpose();
        right += row * d.norm_squared();
    }
    let solved = information.lu().solve(&right)?;
    Some(mean + 0.5 * solved.xyz())
}

/// Slope of the shift along the axis over the angle within interactions: between them it may have made whole turns.
fn pitch(manifold: &Manifold, samples: &[Sample]) -> f64 {
    let pairs = manifold.turns_and_shifts(samples);
    let (mut over, mut under, mut from) = (0.0, 0.0, 0);
    for rows in samples.chunk_by(|a, b| a.run == b.run) {
        let here = &pairs[from..from + rows.len()];
        let n = here.len() as f64;
        let mean = |k: usize| here.iter().map(|z| z[k]).sum::<f64>() / n;
        let (angle, shift) = (mean(0), mean(1));
        over += here.iter().map(|z| (z[0] - angle) * (z[1] - shift)).sum::<f64>();
        under += here.iter().map(|z| (z[0] - angle).powi(2)).sum::<f64>();
        from += rows.len();
    }
    if under > 0.0 { over / under } else { 0.0 }
}

impl Fit {
    /// Covariance of the axis direction, parent frame, for unit residual variance.
    pub fn axis_map(&self) -> DMatrix<f64> {
        let (e1, e2) = across(&self.manifold.axis);
        let mut map = DMatrix::zeros(3, self.covariance.nrows());
        if self.manifold.kind != JointKind::Spherical && map.ncols() >= 8 {
            map.set_column(6, &e1);
            map.set_column(7, &e2);
        }
        map
    }

    /// How the point of the axis at signed distance `along` from `point` moves with the parameters.
    pub fn point_map(&self, along: f64) -> DMatrix<f64> {
        let (e1, e2) = across(&self.manifold.axis);
        let mut map = self.axis_map() * along;
        match self.manifold.kind {
            JointKind::Spherical => map.view_mut((0, 6), (3, 3)).copy_from(&Matrix3::identity()),
            JointKind::Fixed | JointKind::Prismatic | JointKind::Planar => {
                map.view_mut((0, 3), (3, 3)).copy_from(&Matrix3::identity());
            }
            _ => {
                map.set_column(8, &e1);
                map.set_column(9, &e2);
            }
        }
        map
    }
}
