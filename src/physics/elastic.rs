//! The law of a pressed spot: spring, hardening, viscous damping, relaxation, never a pull.
//!
//! `F = max(0, k u (1 + a u) + c u' + q)`, `q' = s k u' - q / tau` (Kelvin-Voigt with the standard linear solid beside
//! it), `u` the indentation past the first contact. Every extension is nested: at amplitude 0 it is the spring.

/// What is known of the spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticLaw {
    /// k, N/m.
    pub stiffness: f64,
    /// a, 1/m; negative softens.
    pub hardening: f64,
    /// c, N·s/m.
    pub damping: f64,
    /// s, share of the stiffness that relaxes.
    pub relaxing: f64,
    /// tau, s.
    pub relaxation_time: f64,
}

impl ElasticLaw {
    /// A plain spring.
    pub fn spring(stiffness: f64) -> Self {
        Self {
            stiffness,
            hardening: 0.0,
            damping: 0.0,
            relaxing: 0.0,
            relaxation_time: 0.5,
        }
    }

    /// Force at each time (s), for indentation (m, negative before contact) and its rate (m/s).
    pub fn force(&self, time: &[f64], depth: &[f64], rate: &[f64]) -> Vec<f64> {
        let mut q = 0.0;
        (0..time.len())
            .map(|i| {
                let touching = depth[i] > 0.0;
                if i > 0 {
                    // Exact for a constant rate over the step, which is what was pressed in it: that at its end would miss where
                    // in it the touch or the halt lies.
                    let step = time[i] - time[i - 1];
                    let decay = (-step / self.relaxation_time).exp();
                    let pressed = (depth[i].max(0.0) - depth[i - 1].max(0.0)) / step.max(1e-9);
                    q = q * decay + self.relaxing * self.stiffness * pressed * self.relaxation_time * (1.0 - decay);
                }
                let spring = self.stiffness * depth[i] * (1.0 + self.hardening * depth[i]);
                if touching {
                    (spring + self.damping * rate[i] + q).max(0.0)
                } else {
                    0.0
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_that_halts_between_two_readings_relaxes_as_one_that_halts_at_one() {
        let law = ElasticLaw {
            relaxing: 0.4,
            relaxation_time: 0.05,
            ..ElasticLaw::spring(1000.0)
        };
        let at_end = |halt: f64| {
            let time: Vec<f64> = (0..60).map(|i| f64::from(i) * 2e-3).collect();
            let depth: Vec<f64> = time.iter().map(|t| 0.02 * t.min(halt) - 0.0001).collect();
            let rate: Vec<f64> = time.iter().map(|t| if *t < halt { 0.02 } else { 0.0 }).collect();
            law.force(&time, &depth, &rate)[59] - 1000.0 * depth[59]
        };
        // Halted so long before: what is left falls as the exponential of that time, but for what began with the touch.
        let (early, between) = (at_end(0.060), at_end(0.0611));
        let expected =
            0.4 * 1000.0 * 0.02 * 0.05 * ((-(0.118f64 - 0.0611) / 0.05).exp() - (-(0.118f64 - 0.005) / 0.05).exp());
        assert!(
            (between / expected - 1.0).abs() < 2e-3 && between > early,
            "{between} {expected} {early}"
        );
    }

    #[test]
    fn a_hold_relaxes_to_the_spring_alone() {
        let law = ElasticLaw {
            relaxing: 0.4,
            relaxation_time: 0.2,
            ..ElasticLaw::spring(1000.0)
        };
        let time: Vec<f64> = (0..3000).map(|i| f64::from(i) * 1e-3).collect();
        let depth: Vec<f64> = time.iter().map(|t| 0.01 * t.min(0.5)).collect();
        let rate: Vec<f64> = time.iter().map(|t| if *t <= 0.5 { 0.01 } else { 0.0 }).collect();
        let force = law.force(&time, &depth, &rate);
        let peak = 5.0 + 0.4 * 1000.0 * 0.01 * 0.2 * (1.0 - (-2.5f64).exp());
        assert!((force[500] - peak).abs() < 5e-3, "{}", force[500]);
        assert!((force[2999] - 5.0).abs() < 1e-3);
    }
}
