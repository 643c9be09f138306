//! A tilting table: the body holds until `tan(angle) = mu_s`, then slides with `mu_k`.

/// What a tilt comes to.
#[derive(Clone, Debug, Default)]
pub struct TiltOutcome {
    /// Index of the sample at which it begins to slide.
    pub onset: Option<usize>,
    /// Displacement down the slope at each time, m.
    pub slid: Vec<f64>,
}

/// Slope angle (rad) over time in, displacement out: `s'' = g (sin a - mu_k cos a)` after the onset.
pub fn predict_tilt(time: &[f64], angle: &[f64], mu_static: f64, mu_kinetic: f64, gravity: f64) -> TiltOutcome {
    let mut out = TiltOutcome {
        onset: None,
        slid: Vec::with_capacity(time.len()),
    };
    let (mut s, mut v) = (0.0, 0.0f64);
    for i in 0..time.len() {
        if out.onset.is_none() && angle[i].tan() > mu_static {
            out.onset = Some(i);
        }
        if out.onset.is_some() && i > 0 {
            let dt = time[i] - time[i - 1];
            let pull = gravity * (angle[i].sin() - mu_kinetic * angle[i].cos());
            let before = v;
            v = (v + pull * dt).max(0.0);
            s += 0.5 * (before + v) * dt;
        }
        out.slid.push(s);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_slope_gives_a_parabola() {
        let time: Vec<f64> = (0..=1000).map(|i| f64::from(i) * 1e-3).collect();
        let angle = vec![0.4; time.len()];
        let out = predict_tilt(&time, &angle, 0.3, 0.25, 9.81);
        let exact = 0.5 * 9.81 * (0.4f64.sin() - 0.25 * 0.4f64.cos());
        assert!((out.slid[1000] / exact - 1.0).abs() < 1e-3);
    }
}
