//! Hidden effects in what is pressed: forces beyond the linear spring.

/// A law of pressing with its state. `share`s are of the spring's own stiffness.
#[derive(Clone, Debug)]
pub(in crate::lab) enum ElasticLaw {
    /// Grows with the square of the depth (share at 6 mm).
    Hardening { share: f64 },
    /// A second spring from a depth on, m.
    SecondStage { share: f64, depth: f64 },
    /// `k u (u/4 mm)^h`.
    PowerLaw { exponent: f64 },
    /// `k T u'`.
    Damping { seconds: f64 },
    /// Two relaxation times (s).
    Relaxation {
        share: f64,
        seconds: [f64; 2],
        state: [f64; 2],
    },
    /// What has been pressed beyond `depth` stays down by this share.
    PlasticSet { share: f64, depth: f64, deepest: f64 },
    /// Eight bristles that slip one after another (Iwan 1966).
    Hysteresis { force: f64, reach: f64, state: [f64; 8] },
    /// A bristle with the friction of a guide.
    Guide { force: f64, state: f64 },
    /// Softer where it has been before (Mullins).
    Softening { share: f64, deepest: f64 },
    /// A notch.
    Snap { force: f64, depth: f64, width: f64 },
    /// At first touch.
    Preload { force: f64 },
    /// Share a second, s.
    Drift { rate: f64, clock: f64 },
    /// Pulls until it tears off.
    Adhesion { force: f64, touched: bool },
    /// Outside the catalogue: ribs, periodic in depth.
    Ribs { force: f64, pitch: f64 },
}

impl ElasticLaw {
    /// Sets the memory at the beginning of a press: time on the clock (s) and the deepest press before it (m).
    pub fn begin(&mut self, start: f64, before: f64) {
        match self {
            Self::PlasticSet { deepest, .. } | Self::Softening { deepest, .. } => *deepest = before,
            Self::Drift { clock, .. } => *clock = start,
            _ => {}
        }
    }

    /// Whether it pulls as well.
    pub fn pulls(&self) -> bool {
        matches!(self, Self::Adhesion { .. })
    }

    /// The force (N) beyond `k u` at the depth `u` (m; negative above the face) and the rate `du`; advances the state.
    pub fn force(&mut self, u: f64, du: f64, k: f64, dt: f64) -> f64 {
        if let Self::Adhesion { force, touched } = self {
            *touched = (*touched || u > 1e-3) && u > -1e-3;
            return if *touched {
                -*force * (-u.abs() / 2e-4).exp()
            } else {
                0.0
            };
        }
        if u <= 0.0 {
            return 0.0;
        }
        match self {
            Self::Hardening { share } => k * u * *share * (u / 0.006).powi(2),
            Self::SecondStage { share, depth } => k * *share * (u - *depth).max(0.0),
            Self::PowerLaw { exponent } => k * u * ((u / 0.004).powf(*exponent) - 1.0),
            Self::Damping { seconds } => k * *seconds * du,
            Self::Relaxation { share, seconds, state } => {
                for (x, tau) in state.iter_mut().zip(seconds) {
                    *x += dt * (0.5 * *share * k * du - *x / *tau);
                }
                state[0] + state[1]
            }
            Self::PlasticSet { share, depth, deepest } => {
                *deepest = deepest.max(u);
                -k * *share * (*deepest - *depth).max(0.0)
            }
            Self::Hysteresis { force, reach, state } => {
                let (mut sum, mut most) = (0.0, 0.0);
                for (i, x) in state.iter_mut().enumerate() {
                    let limit = *reach * (i as f64 + 0.5) / 4.0;
                    *x = (*x + du * dt).clamp(-limit, limit);
                    sum += *x;
                    most += limit;
                }
                *force * sum / most
            }
            Self::Guide { force, state } => {
                *state = (*state + du * dt / 5e-5).clamp(-1.0, 1.0);
                *force * *state
            }
            Self::Softening { share, deepest } => {
                *deepest = deepest.max(u);
                -k * u * *share * ((*deepest - u) / 0.003).tanh()
            }
            Self::Snap { force, depth, width } => -*force / ((u - *depth) / *width).cosh().powi(2),
            Self::Preload { force } => *force * (u / 2e-5).min(1.0),
            Self::Drift { rate, clock } => k * u * *rate * *clock,
            Self::Ribs { force, pitch } => *force * (std::f64::consts::TAU * u / *pitch).sin(),
            Self::Adhesion { .. } => 0.0,
        }
    }
}
