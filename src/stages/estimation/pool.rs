//! From several trials to one estimate.

use crate::base::Estimate;
use crate::math::random_effects_marginal;

/// Doubt of the scatter that is expected from touch to touch (1 sd of its logarithm): it was learnt from other things, and may
/// be half as much or twice as much here.
pub(super) const REPEATS: f64 = 0.45;

/// A measured scalar from repeated trials, with the scatter between them; `scatter` is the share expected
/// before any is seen, `common` a standard deviation that all trials share.
pub(super) fn pooled(
    trials: &[(f64, f64)],
    scatter: f64,
    common: f64,
    unit: &str,
    from: Vec<String>,
    method: &str,
) -> Option<Estimate> {
    let (values, sds): (Vec<f64>, Vec<f64>) = trials.iter().copied().unzip();
    let middle = crate::math::median(&values)?;
    let pooled = random_effects_marginal(&values, &sds, scatter * middle.abs(), REPEATS)?;
    let sd = pooled.sd.hypot(common);
    let ci95 = pooled
        .ci95
        .map(|end| pooled.mean + (end - pooled.mean).signum() * (end - pooled.mean).hypot(1.96 * common));
    Some(Estimate::measured(pooled.mean, sd, unit, from, method).with_interval(ci95))
}

/// A positive quantity with relative standard deviation `relative`: the interval is that of a log-normal.
pub(super) fn positive(value: f64, relative: f64, unit: &str, from: Vec<String>, method: &str) -> Estimate {
    let factor = (1.96 * relative).exp();
    Estimate::measured(value, value * relative, unit, from, method).with_interval([value / factor, value * factor])
}

/// Standard deviation of an estimate relative to its value; 0 where it is exact.
pub(super) fn relative_sd(estimate: &Estimate) -> f64 {
    let half = estimate.ci95.map_or(0.0, |[low, high]| (high - low) / (2.0 * 1.96));
    half.max(estimate.sd.unwrap_or(0.0)) / estimate.value.abs().max(1e-300)
}
