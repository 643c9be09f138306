//! Streams read between their samples: interpolation and local quadratic fits with derivatives.

use nalgebra::{DMatrix, DVector};

use super::weighted_linear;

/// The value at `t` by linear interpolation over finite samples; `None` outside their span.
pub fn interpolate(times: &[f64], values: &[f64], t: f64) -> Option<f64> {
    let at = times.partition_point(|x| *x <= t);
    let before = (0..at).rev().find(|&i| values[i].is_finite())?;
    if times[before] == t {
        return Some(values[before]);
    }
    let after = (at..times.len()).find(|&i| values[i].is_finite())?;
    let share = (t - times[before]) / (times[after] - times[before]).max(f64::MIN_POSITIVE);
    Some(values[before] + share * (values[after] - values[before]))
}

/// Value, velocity and acceleration at one time from a parabola through the samples around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFit {
    /// The value.
    pub value: f64,
    /// First derivative.
    pub velocity: f64,
    /// Second derivative.
    pub acceleration: f64,
    /// Standard deviations of the three for unit sample noise.
    pub gain: [f64; 3],
}

/// A parabola through the finite samples within `half` of `t` (a Savitzky-Golay filter for any spacing);
/// `None` with fewer than four of them.
pub fn local_quadratic(times: &[f64], values: &[f64], t: f64, half: f64) -> Option<LocalFit> {
    let from = times.partition_point(|x| *x < t - half);
    let to = times.partition_point(|x| *x <= t + half);
    let used: Vec<usize> = (from..to).filter(|&i| values[i].is_finite()).collect();
    if used.len() < 4 {
        return None;
    }
    let scale = half.max(1e-12);
    let a = DMatrix::from_fn(used.len(), 3, |i, j| ((times[used[i]] - t) / scale).powi(j as i32));
    let b = DVector::from_iterator(used.len(), used.iter().map(|&i| values[i]));
    let fit = weighted_linear(&a, &b, &DVector::from_element(used.len(), 1.0))?;
    Some(LocalFit {
        value: fit.x[0],
        velocity: fit.x[1] / scale,
        acceleration: 2.0 * fit.x[2] / (scale * scale),
        gain: [fit.sd(0), fit.sd(1) / scale, 2.0 * fit.sd(2) / (scale * scale)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_bridged_and_ends_are_not_guessed() {
        let times = [0.0, 1.0, 2.0, 3.0];
        let values = [0.0, f64::NAN, 4.0, 6.0];
        assert_eq!(interpolate(&times, &values, 1.0), Some(2.0));
        assert_eq!(interpolate(&times, &values, 3.5), None);
    }

    #[test]
    fn a_parabola_gives_its_derivatives() {
        let times: Vec<f64> = (0..50).map(|i| 0.01 * i as f64).collect();
        let values: Vec<f64> = times.iter().map(|t| 1.0 + 2.0 * t + 1.5 * t * t).collect();
        let fit = local_quadratic(&times, &values, 0.2, 0.1).expect("enough");
        assert!((fit.velocity - 2.6).abs() < 1e-9 && (fit.acceleration - 3.0).abs() < 1e-6);
    }
}
