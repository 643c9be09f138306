//! Noise at rest of a recorded stream, robustly and without a model of the motion.

use nalgebra::{UnitQuaternion, Vector3};

use super::inspection::NoiseAtRest;

/// Fewest and most steps of a stretch that is looked at.
const STRETCH: (usize, usize) = (20, 200);
/// Makes the median absolute deviation a standard deviation where noise is normal (Rousseeuw and Croux 1993, section 1).
const NORMAL: f64 = 1.4826;
/// Stretches up to this many times the quietest are taken for the same noise.
const ABOUT_AS_QUIET: f64 = 1.5;

/// Differences from row to row.
pub(super) fn steps(values: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    values.windows(2).map(|w| w[1] - w[0]).collect()
}

/// Rotations from row to row as rotation vectors, rad; NaN where an orientation is missing.
pub(super) fn rotation_steps(rotations: &[Option<UnitQuaternion<f64>>]) -> Vec<Vector3<f64>> {
    let step = |w: &[Option<UnitQuaternion<f64>>]| match (w[0], w[1]) {
        (Some(a), Some(b)) => (a.inverse() * b).scaled_axis(),
        _ => Vector3::repeat(f64::NAN),
    };
    rotations.windows(2).map(step).collect()
}

/// One standard deviation per axis at rest: of each stretch (a tenth of the stream) the median absolute first
/// difference, divided by √2 since a difference of two readings has twice the variance; then the middle one of the
/// stretches that are about as quiet as the quietest, since the least of many noisy figures is too small.
/// Nothing for streams of fewer than 20 steps, nor where a reading does not change at all.
pub(super) fn noise_at_rest(quantity: &'static str, unit: &'static str, steps: &[Vector3<f64>]) -> Option<NoiseAtRest> {
    let there: Vec<Vector3<f64>> = steps
        .iter()
        .filter(|v| v.iter().all(|x| x.is_finite()))
        .copied()
        .collect();
    let length = (there.len() / 10).clamp(STRETCH.0, STRETCH.1);
    let spread = |stretch: &[Vector3<f64>]| {
        let mut sizes: Vec<f64> = stretch.iter().flat_map(|v| v.iter().map(|x| x.abs())).collect();
        sizes.sort_by(f64::total_cmp);
        NORMAL * sizes[sizes.len() / 2] / std::f64::consts::SQRT_2
    };
    let mut spreads: Vec<f64> = there.windows(length).step_by((length / 4).max(1)).map(spread).collect();
    spreads.sort_by(f64::total_cmp);
    let quietest = *spreads.first()?;
    let quiet = spreads.partition_point(|s| *s <= ABOUT_AS_QUIET * quietest);
    let sd = spreads[quiet / 2];
    (sd > 0.0).then_some(NoiseAtRest { quantity, sd, unit })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::{Seed, rng_for};
    use rand_distr::{Distribution, Normal};

    #[test]
    fn noise_is_recovered_from_the_rest_before_a_push() {
        let mut rng = rng_for(Seed(3), "noise");
        let normal = Normal::new(0.0, 0.05).expect("a distribution");
        let value = |i: usize, rng: &mut _| {
            let push = if i > 400 {
                3.0 * ((i - 400) as f64 * 0.2).sin()
            } else {
                0.0
            };
            Vector3::from_fn(|k, _| normal.sample(rng) + if k == 0 { push } else { 0.0 })
        };
        let values: Vec<Vector3<f64>> = (0..1500).map(|i| value(i, &mut rng)).collect();
        let noise = noise_at_rest("force", "N", &steps(&values)).expect("noise");
        assert!((noise.sd / 0.05 - 1.0).abs() < 0.1, "{}", noise.sd);
    }
}
