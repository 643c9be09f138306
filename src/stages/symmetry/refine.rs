//! From a rough motion to the one that lays the surface on itself best, and how well that is known.

use nalgebra::{DMatrix, DVector, Vector3};

use super::motion::Motion;
use super::surface::{Surface, Trust};

/// Normals of a moved point and of the surface under it that differ by more (cosine) are of different faces.
const FACING: f64 = 0.5;
/// Share of the noise of the surface that is common to whole sides of it (the views of one side err alike), and that
/// no residual shows.
const COMMON: f64 = 0.2;

/// Lasting error of a patch in noises of the surface: where all was seen, and what is added per share that was not.
/// Found by `benches/symmetry`, so that the intervals hold.
const LASTING: [f64; 2] = [0.4, 8.0];

/// One moved point on the surface.
struct Pair {
    row: DVector<f64>,
    residual: f64,
    weight: f64,
    /// Slope of weight times residual in the residual.
    slope: f64,
    patches: [usize; 2],
}

impl Surface<'_> {
    /// Iterated closest points on the coarse table, point to plane with Tukey's weights; width in m.
    pub fn roughly_refined(&self, motion: &Motion, count: usize, widths: &[f64]) -> Motion {
        self.iterate(motion, widths, |m, width| self.rough_pairs(m, count, width))
    }

    /// The same on the surface itself.
    pub fn refined(&self, motion: &Motion, count: usize, widths: &[f64]) -> Motion {
        self.iterate(motion, widths, |m, width| self.pairs(m, count, width, false))
    }

    fn iterate(&self, motion: &Motion, widths: &[f64], pairs: impl Fn(&Motion, f64) -> Vec<Pair>) -> Motion {
        let mut motion = *motion;
        for width in widths {
            let Some(step) = solve(&pairs(&motion, *width)) else {
                return motion;
            };
            let tilts = motion.tilts().len();
            let tilt = step.rows(0, tilts).norm();
            let shift = step.rows(tilts, step.len() - tilts).norm();
            if tilt > 0.5 || shift > 0.3 * self.diagonal || !(tilt + shift).is_finite() {
                return motion;
            }
            motion = motion.stepped(&step);
            if tilt < 1e-7 && shift < 1e-8 {
                break;
            }
        }
        motion
    }

    fn rough_pairs(&self, motion: &Motion, count: usize, width: f64) -> Vec<Pair> {
        let linears = motion.linears();
        let mut pairs = Vec::new();
        for (i, sample) in self.samples.iter().take(count).enumerate() {
            let linear = &linears[i % linears.len()];
            let place = motion.moved(linear, &sample.point.coords);
            let Some((under, weight)) = self.table.nearest(&place) else {
                continue;
            };
            if under.normal.dot(&(linear * sample.normal)) < FACING {
                continue;
            }
            let distance = self.table.distance(&place, under);
            let residual = under.normal.dot(&(place - under.point.coords));
            let row = motion.row(linear, &sample.point.coords, &under.normal);
            pairs.extend(pair(row, residual, distance / width, *weight, [0, 0]));
        }
        pairs
    }

    fn pairs(&self, motion: &Motion, count: usize, width: f64, patches: bool) -> Vec<Pair> {
        let linears = motion.linears();
        let mut pairs = Vec::new();
        for (i, sample) in self.samples.iter().take(count).enumerate() {
            let linear = &linears[i % linears.len()];
            let from = sample.point.coords;
            let place = motion.moved(linear, &from);
            let Some(nearest) = self.nearest(&place, width) else {
                continue;
            };
            let normal = self.normal(nearest.triangle);
            if normal.dot(&(linear * sample.normal)) < FACING {
                continue;
            }
            let trust = self.trust(nearest.triangle);
            if trust == Trust::Unseen && !self.whole && self.evidence.floor.is_some() {
                continue;
            }
            let residual = normal.dot(&(self.middle + place - nearest.point));
            let named = if patches {
                [self.patch(&from), self.patch(&place)]
            } else {
                [0, 0]
            };
            let row = motion.row(linear, &from, &normal);
            pairs.extend(pair(row, residual, nearest.distance / width, trust.weight(), named));
        }
        pairs
    }

    /// Covariance of a fitted motion in the order of its tilts and shifts, as far as the residuals show it: the
    /// sandwich of White (1980) with sums over everything that shares a patch, as the source or as the target of a
    /// moved point (dyadic clusters, Aronow, Samii & Assenova 2015), since errors of a fused surface are alike over
    /// centimetres and each pair of images is met twice. What no residual shows is added: a lasting error of every patch
    /// of the size of the noise, which matters where few patches hold a motion, and what whole sides have in common.
    pub fn covariance(&self, motion: &Motion) -> Option<DMatrix<f64>> {
        let pairs = self.pairs(motion, usize::MAX, 2.0 * self.tolerance, true);
        let size = pairs.first()?.row.len();
        let mut hessian = DMatrix::zeros(size, size);
        let mut plain = DMatrix::zeros(size, size);
        let count = self.patches();
        let mut by_patch = vec![DVector::zeros(size); count];
        let mut by_dyad = vec![DVector::zeros(size); count * count];
        let mut lever = vec![DVector::zeros(size); count];
        for p in &pairs {
            hessian += &p.row * p.row.transpose() * p.slope;
            plain += &p.row * p.row.transpose() * p.weight;
            let score = &p.row * (p.weight * p.residual);
            let [a, b] = [p.patches[0].min(p.patches[1]), p.patches[0].max(p.patches[1])];
            by_patch[a] += &score;
            lever[p.patches[0]] += &p.row * p.weight;
            if a != b {
                by_patch[b] += &score;
                by_dyad[a * count + b] += &score;
            }
        }
        let outer = |sum: DMatrix<f64>, g: &DVector<f64>| sum + g * g.transpose();
        let meat = by_patch.iter().fold(DMatrix::zeros(size, size), outer)
            - by_dyad.iter().fold(DMatrix::zeros(size, size), outer);
        // With few patches the sums are drawn towards zero by the fit itself.
        let used = by_patch.iter().filter(|g| g.norm() > 0.0).count().max(2) as f64;
        let small = used / (used - (size as f64).min(used - 1.0));
        let bread = bread(&hessian, &plain)?;
        let shown = positive(&(&bread * meat * &bread * small));
        // Surface that few views showed, as where half is hidden, errs more.
        let noise = self.evidence.noise * (LASTING[0] + LASTING[1] * self.hidden);
        let lasting = lever.iter().fold(DMatrix::zeros(size, size), outer) * noise.powi(2);
        let hidden = &bread * lasting * &bread;
        let common = (COMMON * noise).powi(2);
        Some(shown + hidden + self.common_part(motion, common))
    }

    /// What an error of variance `common` of one side against the other does: half of it to a plane, and over the
    /// extent of the thing to a direction.
    fn common_part(&self, motion: &Motion, common: f64) -> DMatrix<f64> {
        let tilts = motion.tilts().len();
        let size = tilts + motion.shifts().len();
        let arm = 0.25 * self.diagonal;
        let of = |i: usize| if i < tilts { common / (arm * arm) } else { common };
        let floor = |i: usize| if i < tilts { 1e-10 } else { 1e-14 };
        DMatrix::from_diagonal(&DVector::from_fn(size, |i, _| 0.25 * of(i) + floor(i)))
    }
}

/// Tukey's biweight: weight `(1 - u²)²` and slope of the score `(1 - u²)(1 - 5u²)`; nothing beyond the width.
fn pair(row: DVector<f64>, residual: f64, u: f64, trust: f64, patches: [usize; 2]) -> Option<Pair> {
    let rest = 1.0 - u * u;
    (rest > 0.0).then_some(Pair {
        row,
        residual,
        weight: trust * rest * rest,
        slope: trust * rest * (1.0 - 5.0 * u * u),
        patches,
    })
}

fn solve(pairs: &[Pair]) -> Option<DVector<f64>> {
    let size = pairs.first()?.row.len();
    if pairs.len() < 4 * size {
        return None;
    }
    let mut normal = DMatrix::zeros(size, size);
    let mut gradient = DVector::zeros(size);
    for p in pairs {
        normal += &p.row * p.row.transpose() * p.weight;
        gradient += &p.row * (p.weight * p.residual);
    }
    // Directions in which the shape slides on itself are left alone.
    for i in 0..size {
        normal[(i, i)] = normal[(i, i)] * 1.001 + 1e-12;
    }
    Some(normal.cholesky()?.solve(&-gradient))
}

/// The inverse of the curvature; where the weights' slopes leave none, that of plain least squares.
fn bread(hessian: &DMatrix<f64>, plain: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let ridge = |m: &DMatrix<f64>| m + DMatrix::from_diagonal(&(plain.diagonal() * 1e-6).add_scalar(1e-15));
    let curved = ridge(&(0.5 * (hessian + hessian.transpose())));
    let enough = curved
        .diagonal()
        .iter()
        .zip(plain.diagonal().iter())
        .all(|(h, p)| *h > 0.3 * p);
    let best = if enough { curved.cholesky() } else { None };
    Some(best.or_else(|| ridge(plain).cholesky())?.inverse())
}

/// The nearest matrix without negative variances.
fn positive(m: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = (0.5 * (m + m.transpose())).symmetric_eigen();
    let kept = eigen.eigenvalues.map(|v| v.max(0.0));
    &eigen.eigenvectors * DMatrix::from_diagonal(&kept) * eigen.eigenvectors.transpose()
}

/// Variance per component of a linear map of the unknowns, given by its columns.
pub(super) fn spread_of(covariance: &DMatrix<f64>, columns: &[Vector3<f64>]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let row = DVector::from_iterator(columns.len(), columns.iter().map(|c| c[k]));
        (row.transpose() * covariance * &row)[(0, 0)].max(0.0).sqrt()
    })
}
