//! A tilting table: the body holds until `tan(angle) = mu_s`, then slides with `mu_k`.

use super::Simulator;

/// A body on a support that turns: it holds until the slope reaches the static coefficient, then slides with the kinetic one
/// (Tanaka et al., "haptic vision", eqs. 3 and 4).
#[derive(Clone, Copy, Debug)]
pub struct Tilted {
    /// Static and kinetic coefficient.
    pub friction: [f64; 2],
}

/// Gravity along and against the support over time.
#[derive(Clone, Debug)]
pub struct Slope {
    /// s.
    pub time: Vec<f64>,
    /// Along the support, m/s².
    pub along: Vec<f64>,
    /// Against it, m/s².
    pub normal: Vec<f64>,
}

impl Slope {
    /// Both at `t`, linear between rows, constant beyond.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let after = self.time.partition_point(|x| *x <= t);
        let (i, j) = (after.saturating_sub(1), after.min(self.time.len() - 1));
        let span = self.time[j] - self.time[i];
        let share = if span > 0.0 {
            ((t - self.time[i]) / span).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let read = |v: &[f64]| v[i] + (v[j] - v[i]) * share;
        (read(&self.along), read(&self.normal))
    }

    /// When `along / normal` first exceeds `mu`, s.
    pub fn reaches(&self, mu: f64) -> Option<f64> {
        let i = (0..self.time.len()).find(|&i| self.along[i] > mu * self.normal[i])?;
        let j = i.checked_sub(1)?;
        let excess = |k: usize| self.along[k] - mu * self.normal[k];
        Some(self.time[j] + (self.time[i] - self.time[j]) * -excess(j) / (excess(i) - excess(j)))
    }
}

impl Tilted {
    /// The distance slid at each time, m.
    pub fn slid(&self, slope: &Slope, times: &[f64]) -> Vec<f64> {
        match slope.reaches(self.friction[0]) {
            Some(start) => self.simulate(&(0.0, 0.0), slope, start, times),
            None => vec![0.0; times.len()],
        }
    }
}

impl Simulator for Tilted {
    type Drive = Slope;
    /// Distance slid, m, and speed, m/s.
    type State = (f64, f64);
    type Seen = f64;

    const STEP: f64 = 2e-3;

    fn advance(&self, (s, v): &(f64, f64), slope: &Slope, t: f64, h: f64) -> (f64, f64) {
        let pull = |t: f64| {
            let (along, normal) = slope.at(t);
            along - self.friction[1] * normal
        };
        // Trapezoid in the acceleration, exact for a linear ramp up to O(h³).
        let (now, next) = (pull(t), pull(t + h));
        let way = s + v * h + h * h * (2.0 * now + next) / 6.0;
        (way, (v + 0.5 * h * (now + next)).max(0.0))
    }

    fn seen(&self, state: &(f64, f64)) -> f64 {
        state.0
    }
}

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
    let slope = Slope {
        time: time.to_vec(),
        along: angle.iter().map(|a| gravity * a.sin()).collect(),
        normal: angle.iter().map(|a| gravity * a.cos()).collect(),
    };
    let tilted = Tilted {
        friction: [mu_static, mu_kinetic],
    };
    let onset = angle.iter().position(|a| a.tan() > mu_static);
    let slid = match onset {
        // Steep from the first moment on: it slides at once.
        Some(0) => tilted.simulate(&(0.0, 0.0), &slope, time[0], time),
        _ => tilted.slid(&slope, time),
    };
    TiltOutcome { onset, slid }
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

    #[test]
    fn halving_the_step_changes_little() {
        let time: Vec<f64> = (0..=200).map(|i| f64::from(i) * 1e-2).collect();
        let slope = Slope {
            along: time.iter().map(|t| 9.81 * (0.3 + 0.1 * t).sin()).collect(),
            normal: time.iter().map(|t| 9.81 * (0.3 + 0.1 * t).cos()).collect(),
            time: time.clone(),
        };
        let tilted = Tilted { friction: [0.3, 0.28] };
        let error = tilted.solver_error(&(0.0, 0.0), &slope, &time, Tilted::STEP, |a, b| (a - b).abs());
        assert!(error < 1e-5, "{error}");
    }
}
