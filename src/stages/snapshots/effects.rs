//! What a tool's action did, as a distribution: a Gaussian with full covariance, and the samples themselves.

use nalgebra::{Matrix2, Vector2};

/// Displacements on the support, m.
pub type Effect = Vector2<f64>;

/// A normal distribution in the plane of the support.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// m.
    pub mean: Effect,
    /// m².
    pub covariance: Matrix2<f64>,
}

impl Gaussian {
    /// The moments of samples; `floor` (m) is the spread below which none is believed: it keeps the covariance of few
    /// or equal samples proper. Nothing without samples.
    pub fn of(samples: &[Effect], floor: f64) -> Option<Self> {
        if samples.is_empty() {
            return None;
        }
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<Effect>() / n;
        let scatter: Matrix2<f64> = samples.iter().map(|s| (s - mean) * (s - mean).transpose()).sum();
        let covariance = scatter / (n - 1.0).max(1.0) + Matrix2::identity() * floor * floor;
        Some(Self { mean, covariance })
    }

    /// Kullback-Leibler divergence of `self` from `model`, `D(self ‖ model)`, nats (Lima et al. 2019, equation 1).
    pub fn divergence(&self, model: &Self) -> f64 {
        let Some(inverse) = model.covariance.try_inverse() else {
            return f64::INFINITY;
        };
        let apart = model.mean - self.mean;
        let ratio = model.covariance.determinant() / self.covariance.determinant();
        0.5 * (ratio.ln() - 2.0 + (inverse * self.covariance).trace() + apart.dot(&(inverse * apart)))
    }

    /// The divergence that is expected of a Gaussian of `count` samples from the one that they were drawn of: chance alone leaves it.
    /// Infinite below three samples, which span no ellipse.
    pub fn chance(count: usize) -> f64 {
        use statrs::function::gamma::digamma;
        if count < 3 {
            return f64::INFINITY;
        }
        let n = count as f64;
        let log_det = digamma(0.5 * (n - 1.0)) + digamma(0.5 * (n - 2.0)) + 2.0 * (2.0 / (n - 1.0)).ln();
        1.0 / n - 0.5 * log_det
    }

    /// Logarithm of the density at a point, m⁻².
    pub fn log_density(&self, at: &Effect) -> f64 {
        -std::f64::consts::TAU.ln() - 0.5 * self.covariance.determinant().ln() - 0.5 * self.distance2(at)
    }

    /// Squared Mahalanobis distance of a point.
    pub fn distance2(&self, at: &Effect) -> f64 {
        let apart = at - self.mean;
        self.covariance
            .try_inverse()
            .map_or(f64::INFINITY, |i| apart.dot(&(i * apart)))
    }
}

/// Energy distance of two samples, m (Székely and Rizzo 2013): `2 E|X-Y| - E|X-X'| - E|Y-Y'|`, unbiased, so that it may be
/// slightly below 0 for equal distributions. It needs no density and sees what two moments do not.
pub fn energy_distance(a: &[Effect], b: &[Effect]) -> f64 {
    if a.len() < 2 || b.len() < 2 {
        return f64::NAN;
    }
    let between: f64 = a.iter().map(|x| b.iter().map(|y| (x - y).norm()).sum::<f64>()).sum();
    let within = |s: &[Effect]| {
        let sum: f64 = s
            .iter()
            .enumerate()
            .map(|(i, x)| s[..i].iter().map(|y| (x - y).norm()).sum::<f64>())
            .sum();
        2.0 * sum / (s.len() * (s.len() - 1)) as f64
    };
    2.0 * between / (a.len() * b.len()) as f64 - within(a) - within(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_divergence_is_that_of_the_textbook() {
        let at = |x: f64, s: f64| Gaussian {
            mean: Vector2::new(x, 0.0),
            covariance: Matrix2::identity() * s * s,
        };
        assert!(at(0.1, 0.02).divergence(&at(0.1, 0.02)).abs() < 1e-12);
        // Shifted by two standard deviations: half their square.
        assert!((at(0.0, 0.02).divergence(&at(0.04, 0.02)) - 2.0).abs() < 1e-12);
        // Twice as wide in both axes: ln 4 - 1 + 1/4.
        let wider = at(0.0, 0.02).divergence(&at(0.0, 0.04));
        assert!((wider - (4f64.ln() - 1.0 + 0.25)).abs() < 1e-12);
    }

    #[test]
    fn chance_alone_leaves_what_draws_from_the_truth_show() {
        let truth = Gaussian {
            mean: Effect::zeros(),
            covariance: Matrix2::identity(),
        };
        let mut rng = crate::base::rng_for(crate::base::Seed(1), "chance");
        let mut one = || {
            let of = rand_distr::StandardNormal;
            let samples: Vec<Effect> = (0..10)
                .map(|_| Vector2::new(rand::Rng::sample(&mut rng, of), rand::Rng::sample(&mut rng, of)))
                .collect();
            Gaussian::of(&samples, 0.0).map_or(0.0, |g| g.divergence(&truth))
        };
        let mean = (0..4000).map(|_| one()).sum::<f64>() / 4000.0;
        assert!(
            (mean / Gaussian::chance(10) - 1.0).abs() < 0.05,
            "{mean} for {}",
            Gaussian::chance(10)
        );
    }

    #[test]
    fn the_energy_distance_tells_two_heaps_from_one() {
        let ring = |r: f64| -> Vec<Effect> {
            (0..40)
                .map(|k| r * Vector2::new((f64::from(k)).cos(), (f64::from(k)).sin()))
                .collect()
        };
        assert!(energy_distance(&ring(0.1), &ring(0.1)).abs() < 0.01);
        let heaps: Vec<Effect> = (0..40)
            .map(|k| Vector2::new(if k % 2 == 0 { 0.1 } else { -0.1 }, 0.0))
            .collect();
        let blob: Vec<Effect> = (0..40).map(|_| Vector2::zeros()).collect();
        assert!(energy_distance(&heaps, &blob) > 0.05);
    }
}
