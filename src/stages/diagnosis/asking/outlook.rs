//! What a touch that nobody has made yet should say of which cause is right.
//!
//! Under each cause that is still possible the reading of a touch is normal: its mean is that of the fitted model, its
//! covariance that of the noise, of what is new in every interaction, and of what the fit leaves open of its parameters.
//! A touch is worth the mutual information of cause and reading (Lindley 1956; between two causes of equal odds it grows
//! with the discrimination of Box and Hill 1967), by draws of the readings with fixed dice. Log odds are tempered as those
//! of a finding are.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::stages::diagnosis::family::Family;
use crate::stages::diagnosis::fit::{Fit, parameters};
use crate::stages::diagnosis::marginal::{Noise, Point, Tangent};
use crate::stages::diagnosis::named::TEMPERATURE;

/// Rounds in which the roots of a covariance have to be found.
const ROUNDS: usize = 1000;
/// Draws of a reading under each cause.
const DRAWS: usize = 24;

/// What one cause foretells of touches: the mean in units of the noise, freed of its correlation, and the columns along
/// which standard normal doubts move it.
#[derive(Clone, Debug, Default)]
pub(super) struct Outlook {
    mean: Vec<f64>,
    /// Doubts of the parameters, the same in all touches.
    shared: Vec<Vec<f64>>,
    /// Doubts of each touch alone.
    own: Vec<Vec<f64>>,
}

impl Outlook {
    /// Of one group of a family under a fit; `noise` is the same for all causes.
    pub fn of(family: &dyn Family, group: usize, fit: &Fit, noise: &Noise) -> Self {
        let point = Point {
            laws: &fit.laws,
            theta: &fit.theta,
        };
        let steps: Vec<f64> = parameters(family, &fit.laws).iter().map(|p| 1e-4 * p.sd).collect();
        let tangent = Tangent::flat(family, group, &point).sloped(family, &point, &steps);
        let linear = tangent.linear(family, noise);
        let scaled = |(column, tau): (&Vec<f64>, &f64)| column.iter().map(|x| x * tau).collect();
        Self {
            // Nothing was measured: what is left is the prediction, its sign changed.
            mean: linear.whitened.iter().map(|r| -r).collect(),
            shared: spread(&linear.jacobian, &fit.covariance),
            own: linear.effects.iter().zip(&noise.tau).map(scaled).collect(),
        }
    }

    /// Of these touches and one more.
    pub fn and(&self, other: &Self) -> Self {
        let (n, m) = (self.mean.len(), other.mean.len());
        let joined = |a: Option<&Vec<f64>>, b: Option<&Vec<f64>>| {
            let part = |x: Option<&Vec<f64>>, len: usize| x.map_or_else(|| vec![0.0; len], Clone::clone);
            [part(a, n), part(b, m)].concat()
        };
        let count = self.shared.len().max(other.shared.len());
        let own = self.own.iter().map(|c| joined(Some(c), None));
        Self {
            mean: [self.mean.as_slice(), &other.mean].concat(),
            shared: (0..count)
                .map(|k| joined(self.shared.get(k), other.shared.get(k)))
                .collect(),
            own: own.chain(other.own.iter().map(|c| joined(None, Some(c)))).collect(),
        }
    }
}

/// Columns whose outer products sum to `J C J'`.
fn spread(jacobian: &[Vec<f64>], covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let p = jacobian.len();
    let symmetric = 0.5 * (covariance + covariance.transpose());
    // What is not finite has no roots, and looking for them would never end.
    let finite = symmetric.iter().all(|x| x.is_finite());
    let Some(root) = finite
        .then(|| symmetric.try_symmetric_eigen(f64::EPSILON, ROUNDS))
        .flatten()
    else {
        return Vec::new();
    };
    let column = |k: usize| {
        let size = root.eigenvalues[k].max(0.0).sqrt();
        let n = jacobian.first().map_or(0, Vec::len);
        (0..n)
            .map(|i| size * (0..p).map(|j| jacobian[j][i] * root.eigenvectors[(j, k)]).sum::<f64>())
            .collect()
    };
    (0..p).map(column).collect()
}

/// A normal density with covariance `I + U U'`, by the matrix inversion lemma.
struct Predictive<'a> {
    mean: &'a [f64],
    columns: Vec<&'a Vec<f64>>,
    inner: Option<Cholesky<f64, Dyn>>,
    log_det: f64,
}

impl<'a> Predictive<'a> {
    fn new(outlook: &'a Outlook) -> Self {
        let columns: Vec<&Vec<f64>> = outlook.shared.iter().chain(&outlook.own).collect();
        let q = columns.len();
        let mut m = DMatrix::identity(q, q);
        for i in 0..q {
            for j in i..q {
                let dot: f64 = columns[i].iter().zip(columns[j]).map(|(a, b)| a * b).sum();
                m[(i, j)] += dot;
                if i != j {
                    m[(j, i)] += dot;
                }
            }
        }
        let inner = Cholesky::new(m);
        Self {
            log_det: inner.as_ref().map_or(0.0, |c| {
                2.0 * c.l().diagonal().iter().map(|x: &f64| x.ln()).sum::<f64>()
            }),
            mean: &outlook.mean,
            columns,
            inner,
        }
    }

    fn draw(&self, dice: &mut ChaCha8Rng) -> Vec<f64> {
        let mut normal = || -> f64 { StandardNormal.sample(dice) };
        let mut y: Vec<f64> = self.mean.iter().map(|m| m + normal()).collect();
        for column in &self.columns {
            let size = normal();
            y.iter_mut().zip(*column).for_each(|(y, c)| *y += size * c);
        }
        y
    }

    /// Without the constant.
    fn log_density(&self, y: &[f64]) -> f64 {
        let r: Vec<f64> = y.iter().zip(self.mean).map(|(y, m)| y - m).collect();
        let square: f64 = r.iter().map(|x| x * x).sum();
        let through = DVector::from_iterator(
            self.columns.len(),
            self.columns.iter().map(|c| c.iter().zip(&r).map(|(a, b)| a * b).sum()),
        );
        let explained = self.inner.as_ref().map_or(0.0, |c| through.dot(&c.solve(&through)));
        -0.5 * (square - explained + self.log_det)
    }
}

/// Entropy of these odds, bits.
pub(super) fn entropy(odds: &[f64]) -> f64 {
    let part = |p: &f64| if *p > 0.0 { -p * p.log2() } else { 0.0 };
    odds.iter().map(part).sum()
}

/// Expected fall of the entropy of the cause, bits; `odds` sum to one.
pub(super) fn information(outlooks: &[Outlook], odds: &[f64], dice: &mut ChaCha8Rng) -> f64 {
    let each: Vec<Predictive> = outlooks.iter().map(Predictive::new).collect();
    let mut left = 0.0;
    for (one, p) in each.iter().zip(odds) {
        for _ in 0..DRAWS {
            let y = one.draw(dice);
            let logs: Vec<f64> = each.iter().map(|e| e.log_density(&y) / TEMPERATURE).collect();
            let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let weights: Vec<f64> = logs.iter().zip(odds).map(|(l, p)| p * (l - top).exp()).collect();
            let total: f64 = weights.iter().sum();
            let after: Vec<f64> = weights.iter().map(|w| w / total.max(1e-300)).collect();
            left += p * entropy(&after) / DRAWS as f64;
        }
    }
    (entropy(odds) - left).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, rng_for};

    fn reading(mean: f64, doubt: f64) -> Outlook {
        Outlook {
            mean: vec![mean; 4],
            shared: vec![vec![doubt; 4]],
            own: Vec::new(),
        }
    }

    fn bits(outlooks: &[Outlook]) -> f64 {
        information(outlooks, &[0.5, 0.5], &mut rng_for(Seed(1), "test"))
    }

    #[test]
    fn a_touch_is_worth_what_it_parts() {
        let alike = [reading(1.0, 0.0), reading(1.0, 0.0)];
        let apart = [reading(0.0, 0.0), reading(10.0, 0.0)];
        assert!(bits(&alike) < 1e-9);
        assert!(bits(&apart) > 0.99);
    }

    #[test]
    fn doubt_of_parameters_hides_a_difference_until_a_second_touch_shows_them() {
        let (a, b) = (reading(0.0, 20.0), reading(4.0, 20.0));
        assert!(bits(&[a.clone(), b.clone()]) < 0.2);
        // The same doubt moves a touch of which both foretell the same: together they leave the difference.
        let (c, d) = (reading(0.0, 20.0), reading(0.0, 20.0));
        assert!(bits(&[a.and(&c), b.and(&d)]) > 0.8);
    }

    #[test]
    fn the_inversion_lemma_gives_the_density_of_a_small_case() {
        let o = Outlook {
            mean: vec![0.0, 0.0],
            shared: vec![vec![1.0, 2.0]],
            own: vec![vec![0.5, 0.0]],
        };
        // Covariance [[1 + 1 + 0.25, 2], [2, 1 + 4]], determinant 7.25.
        let y = [1.0, -1.0];
        let square = (5.0 * y[0] * y[0] - 2.0 * 2.0 * y[0] * y[1] + 2.25 * y[1] * y[1]) / 7.25;
        let expected = -0.5 * (square + 7.25f64.ln());
        assert!((Predictive::new(&o).log_density(&y) - expected).abs() < 1e-12);
    }
}
