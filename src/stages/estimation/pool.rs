//! From several trials to one estimate.

use crate::base::Estimate;
use crate::math::random_effects_expecting;

/// How many trials the scatter that is expected from touch to touch counts for: it was learnt from other things.
pub(super) const EXPECTED_TRIALS: f64 = 6.0;

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
    let pooled = random_effects_expecting(&values, &sds, scatter * middle.abs(), EXPECTED_TRIALS)?;
    let sd = pooled.sd.hypot(common);
    let half = pooled.half95.hypot(1.96 * common);
    Some(
        Estimate::measured(pooled.mean, sd, unit, from, method).with_interval([pooled.mean - half, pooled.mean + half]),
    )
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
