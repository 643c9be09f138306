//! A Gaussian process: Matérn 5/2 with a length for each parameter, a level, a scale and a noise, by marginal likelihood.
//!
//! Rasmussen and Williams (2006), equations 2.23 to 2.30 and 4.17.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A regression over points of any dimension.
#[derive(Clone, Debug)]
pub struct Process {
    points: Vec<Vec<f64>>,
    factor: Cholesky<f64, Dyn>,
    weights: DVector<f64>,
    level: f64,
    unit: f64,
    /// Logarithms of the lengths, of the scale and of the noise (standardised values).
    hyper: Vec<f64>,
}

/// Bounds of the logarithms: lengths, scale, noise; in units of the points and of the values' spread.
const LENGTH: (f64, f64) = (-2.5, 3.0);
const SCALE: (f64, f64) = (-2.0, 2.5);
const NOISE: (f64, f64) = (-7.0, 0.5);

fn matern(a: &[f64], b: &[f64], lengths: &[f64]) -> f64 {
    let squared: f64 = a
        .iter()
        .zip(b)
        .zip(lengths)
        .map(|((x, y), l)| ((x - y) / l.exp()).powi(2))
        .sum();
    let r = (5.0 * squared).sqrt();
    (1.0 + r + r * r / 3.0) * (-r).exp()
}

impl Process {
    /// Fits levels and lengths to values at points; `start` are the hyperparameters of an earlier fit. Nothing where there
    /// are fewer than two points or a value is not finite.
    pub fn fit(points: &[Vec<f64>], values: &[f64], start: Option<&[f64]>) -> Option<Self> {
        if points.len() < 2 || values.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let n = values.len() as f64;
        let level = values.iter().sum::<f64>() / n;
        let spread = (values.iter().map(|v| (v - level).powi(2)).sum::<f64>() / n).sqrt();
        let unit = spread.max(1e-9);
        let standard = DVector::from_iterator(values.len(), values.iter().map(|v| (v - level) / unit));
        let dimensions = points[0].len();
        let mut hyper = match start {
            Some(h) if h.len() == dimensions + 2 => h.to_vec(),
            _ => [vec![0.0; dimensions], vec![0.0, -3.0]].concat(),
        };
        let score =
            |h: &[f64]| Self::solve(points, &standard, h).map_or(f64::NEG_INFINITY, |(_, _, lml)| lml + prior(h));
        climb(&mut hyper, score);
        let (factor, weights, _) = Self::solve(points, &standard, &hyper)?;
        Some(Self {
            points: points.to_vec(),
            factor,
            weights,
            level,
            unit,
            hyper,
        })
    }

    /// Factor of the covariance, its product with the values, and the logarithm of the marginal likelihood.
    fn solve(
        points: &[Vec<f64>],
        values: &DVector<f64>,
        hyper: &[f64],
    ) -> Option<(Cholesky<f64, Dyn>, DVector<f64>, f64)> {
        let d = hyper.len() - 2;
        let (scale, noise) = ((2.0 * hyper[d]).exp(), (2.0 * hyper[d + 1]).exp());
        let n = points.len();
        let mut k = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let value = scale * matern(&points[i], &points[j], &hyper[..d]);
                k[(i, j)] = value;
                k[(j, i)] = value;
            }
            k[(i, i)] += noise + 1e-8;
        }
        let factor = Cholesky::new(k)?;
        let weights = factor.solve(values);
        let log_det: f64 = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        let lml = -0.5 * values.dot(&weights) - log_det - 0.5 * n as f64 * std::f64::consts::TAU.ln();
        lml.is_finite().then_some((factor, weights, lml))
    }

    /// Mean and standard deviation of the function (without its noise) at a point.
    pub fn predict(&self, at: &[f64]) -> (f64, f64) {
        let d = self.hyper.len() - 2;
        let scale = (2.0 * self.hyper[d]).exp();
        let k = DVector::from_iterator(
            self.points.len(),
            self.points.iter().map(|p| scale * matern(p, at, &self.hyper[..d])),
        );
        let mean = k.dot(&self.weights);
        let explained = self
            .factor
            .l_dirty()
            .solve_lower_triangular(&k)
            .map_or(0.0, |v| v.norm_squared());
        let variance = (scale - explained).max(1e-12);
        (self.level + self.unit * mean, self.unit * variance.sqrt())
    }

    /// The lengths (in units of the points), scale and noise (in units of the values).
    pub fn lengths(&self) -> (Vec<f64>, f64, f64) {
        let d = self.hyper.len() - 2;
        let exp = |h: &f64| h.exp();
        (
            self.hyper[..d].iter().map(exp).collect(),
            self.unit * self.hyper[d].exp(),
            self.unit * self.hyper[d + 1].exp(),
        )
    }

    /// What a later fit may start from.
    pub fn hyper(&self) -> &[f64] {
        &self.hyper
    }
}

/// A weak belief that keeps lengths from running away where the data say nothing of them.
fn prior(hyper: &[f64]) -> f64 {
    let d = hyper.len() - 2;
    let bell = |x: f64, middle: f64, sd: f64| -0.5 * ((x - middle) / sd).powi(2);
    hyper[..d].iter().map(|l| bell(*l, 0.7, 1.0)).sum::<f64>()
        + bell(hyper[d], 0.3, 1.0)
        + bell(hyper[d + 1], -3.0, 2.0)
}

/// Coordinate search within the bounds, with steps that shrink where nothing is gained.
fn climb(hyper: &mut [f64], score: impl Fn(&[f64]) -> f64) {
    let d = hyper.len() - 2;
    let bounds = |k: usize| {
        if k < d {
            LENGTH
        } else if k == d {
            SCALE
        } else {
            NOISE
        }
    };
    let mut best = score(hyper);
    let mut step = 0.8;
    while step > 0.05 {
        let before = best;
        for k in 0..hyper.len() {
            for direction in [1.0, -1.0] {
                let old = hyper[k];
                hyper[k] = (old + direction * step).clamp(bounds(k).0, bounds(k).1);
                let now = score(hyper);
                if now > best {
                    best = now;
                    break;
                }
                hyper[k] = old;
            }
        }
        if best - before < 1e-3 {
            step *= 0.5;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_interpolates_and_doubts_what_it_has_not_seen() {
        let points: Vec<Vec<f64>> = (0..12)
            .map(|i| vec![f64::from(i) * 0.25 - 1.5, f64::from(i * 7 % 12) * 0.25 - 1.5])
            .collect();
        let values: Vec<f64> = points.iter().map(|p| (2.0 * p[0]).sin()).collect();
        let process = Process::fit(&points, &values, None).expect("fits");
        let (mean, sd) = process.predict(&[0.1, 0.0]);
        assert!((mean - 0.2f64.sin()).abs() < 0.1, "{mean}");
        assert!(process.predict(&[6.0, 0.0]).1 > 3.0 * sd);
        // The second coordinate does nothing: its length is the longer one.
        let (lengths, _, _) = process.lengths();
        assert!(lengths[1] > 1.5 * lengths[0], "{lengths:?}");
    }
}
