//! Location and scale that a few wild samples cannot move.

/// The finite samples in ascending order.
fn sorted(samples: &[f64]) -> Vec<f64> {
    let mut finite: Vec<f64> = samples.iter().copied().filter(|x| x.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite
}

/// The `p`-quantile (0 to 1) of the finite samples by linear interpolation; `None` where there are none.
pub fn quantile(samples: &[f64], p: f64) -> Option<f64> {
    let sorted = sorted(samples);
    let last = sorted.len().checked_sub(1)?;
    let place = p.clamp(0.0, 1.0) * last as f64;
    let low = place.floor() as usize;
    let high = place.ceil() as usize;
    Some(sorted[low] + (place - low as f64) * (sorted[high] - sorted[low]))
}

/// The median of the finite samples.
pub fn median(samples: &[f64]) -> Option<f64> {
    quantile(samples, 0.5)
}

/// Standard deviation from the median absolute deviation (times 1.4826, right for a normal distribution).
pub fn mad_sd(samples: &[f64]) -> Option<f64> {
    let centre = median(samples)?;
    let deviations: Vec<f64> = samples.iter().map(|x| (x - centre).abs()).collect();
    Some(1.482_602_218_505_602 * median(&deviations)?)
}

/// Mean of the finite samples without the share `trim` (0 to 0.5) at either end.
pub fn trimmed_mean(samples: &[f64], trim: f64) -> Option<f64> {
    let sorted = sorted(samples);
    let cut = (trim.clamp(0.0, 0.49) * sorted.len() as f64).floor() as usize;
    let kept = sorted.get(cut..sorted.len() - cut)?;
    (!kept.is_empty()).then(|| kept.iter().sum::<f64>() / kept.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wild_and_missing_samples_do_not_move_the_middle() {
        let samples = [1.0, 2.0, 3.0, 4.0, 1e9, f64::NAN];
        assert_eq!(median(&samples), Some(3.0));
        assert_eq!(trimmed_mean(&samples, 0.2), Some(3.0));
        assert!((mad_sd(&samples).expect("samples") - 1.4826).abs() < 1e-3);
        assert_eq!(median(&[f64::NAN]), None);
    }
}
