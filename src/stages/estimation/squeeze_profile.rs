//! Intervals of a press's relaxation and hardening by their profiles: the likelihood of a time constant beside a spring is not a
//! parabola.

use super::squeeze::{Course, Found, UNKNOWN, deviations, fit, loose};
use crate::math::profile_ends;

/// Half of the 95 % interval of a normal distribution, in standard deviations.
const Z95: f64 = 1.959_964;

/// The 95 % interval of unknown `k` of a fit; that of its standard deviation where the profile could not be had.
pub(super) fn ends(course: &Course, found: &Found, prior: &[f64; UNKNOWN], k: usize) -> [f64; 2] {
    let (Found { fit: best, x, free }, loose) = (found, loose(course));
    let sd = deviations(best, free, &loose)[k];
    let half = Z95 * sd;
    let row = (0..k).filter(|i| free[*i]).count();
    // Residuals that remember and miss count for less, in the rise as in the standard deviation.
    let less = (sd / best.sd(row)).powi(2);
    let mut held = *free;
    held[k] = false;
    let mut from = *x;
    let profile = profile_ends(x[k], half, best.cost, 0.5 * Z95 * Z95 * less, |value| {
        from[k] = value;
        let least = fit(course, &held, prior, &from)?;
        from = least.x;
        Some(least.fit.cost + 0.5 * ((value - prior[k]) / loose[k]).powi(2))
    });
    profile.unwrap_or([x[k] - half, x[k] + half])
}
