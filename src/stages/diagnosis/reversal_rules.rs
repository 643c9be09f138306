//! Rules by which a force turns round where a hand turns back, over a way, after a time, with the speed; and what they leave of a turn.

use nalgebra::{DMatrix, DVector};

use super::reversals::Drag;
use crate::math::bayesian_linear;

/// The least and the longest way, m, and time, s, that is told.
pub(super) const WAYS: [f64; 2] = [2e-5, 4e-3];
pub(super) const TIMES: [f64; 2] = [8e-3, 0.2];
/// Share of the force at which it counts as up: a way or a time of bristles is told as that of ones that bend in proportion.
const UP: f64 = 0.8;
/// Steps of a size from one that is tried to the next.
pub(super) const STEP: f64 = 1.12;

/// How the force turns round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rule {
    /// Over a way that falls off as an exponential, m; in proportion, m.
    Bending,
    Springing,
    /// By so many seconds later (or earlier) than the hand.
    Late,
    /// Through a pole, s.
    Lagging,
    /// With the speed, up to one, m/s.
    Slow,
}

pub(super) const RULES: [Rule; 5] = [Rule::Bending, Rule::Springing, Rule::Late, Rule::Lagging, Rule::Slow];

impl Rule {
    /// Sizes that are tried.
    pub fn sizes(self) -> Vec<f64> {
        let from_to = |low: f64, high: f64| -> Vec<f64> {
            let steps = ((high / low).ln() / STEP.ln()) as i32;
            (0..=steps).map(|k| low * STEP.powi(k)).collect()
        };
        match self {
            Self::Bending | Self::Springing => from_to(0.5 * WAYS[0], 2.0 * WAYS[1]),
            Self::Late => {
                let late = from_to(2e-3, TIMES[1]);
                late.iter().map(|t| -t).chain(late.iter().copied()).collect()
            }
            Self::Lagging => from_to(2e-3, 2.0 * TIMES[1]),
            Self::Slow => from_to(1e-4, 0.05),
        }
    }

    /// The share of friction, with its sign, at every moment of a drag.
    pub fn share(self, drag: &Drag, size: f64) -> Vec<f64> {
        let mut out = vec![0.0; drag.moments.len()];
        let mut begun = 0.0;
        for (k, s) in drag.stretches.iter().enumerate() {
            let turn = drag.moments[s.from].way;
            let mut last: f64 = begun;
            let own = || drag.moments[s.from..s.to].iter();
            for (m, out) in own().zip(&mut out[s.from..s.to]) {
                let gone = (s.sign * (m.way - turn)).max(0.0);
                let since = m.time - s.goes;
                last = match self {
                    Self::Bending => s.sign + (begun - s.sign) * (-gone / size).exp(),
                    Self::Springing => (begun + s.sign * gone / size).clamp(-1.0, 1.0),
                    Self::Late => begun + (s.sign - begun) * (0.5 + 0.5 * (since - size) / drag.step).clamp(0.0, 1.0),
                    Self::Lagging => s.sign + (begun - s.sign) * (-since.max(0.0) / size).exp(),
                    Self::Slow => (m.speed / size).tanh(),
                };
                *out = last;
            }
            begun = if self == Self::Late { s.sign } else { last };
            // An early clock tells of the next turn already.
            if self == Self::Late && size < 0.0 {
                let next = drag.stretches.get(k + 1);
                next.iter().for_each(|n| {
                    for (m, out) in own().zip(&mut out[s.from..s.to]) {
                        let turned = (0.5 + 0.5 * (m.time - n.goes - size) / drag.step).clamp(0.0, 1.0);
                        *out += (n.sign - *out) * turned;
                    }
                });
            }
        }
        out
    }

    /// Way or time at which it would be up in full, told by when most of it is.
    pub fn whole(self, size: f64) -> f64 {
        match self {
            Self::Bending => -size * (1.0 - UP).ln() / UP,
            _ => size,
        }
    }
}

/// What it is called, where it has a name.
pub(super) fn cause(rule: Rule) -> Option<&'static str> {
    match rule {
        Rule::Bending | Rule::Springing => Some("presliding"),
        Rule::Late => Some("time-delay"),
        Rule::Lagging => Some("sensor-lag"),
        Rule::Slow => None,
    }
}

/// What the plain model leaves open of the force, as a share of its level, and of the mass.
const EVEN: f64 = 0.01;
const HEAVIER: f64 = 0.3;

/// A turn of a drag.
pub(super) struct Turn<'a> {
    pub drag: &'a Drag,
    pub stretch: usize,
}

impl Turn<'_> {
    /// What is left of the force about it, N, by the share of friction at each moment.
    pub fn left(&self, share: &[f64]) -> Option<Vec<f64>> {
        let rows: Vec<usize> = self.drag.about(self.stretch).collect();
        let moments = &self.drag.moments;
        let force = DVector::from_iterator(
            rows.len(),
            rows.iter()
                .map(|i| moments[*i].force - self.drag.mass * moments[*i].acceleration),
        );
        let size = force.amax().max(1e-9);
        let columns = DMatrix::from_fn(rows.len(), 3, |i, k| match k {
            0 => share[rows[i]],
            1 => 1.0,
            _ => self.drag.mass * moments[rows[i]].acceleration,
        });
        let weights = DVector::from_element(rows.len(), (EVEN * size).hypot(self.drag.noise).powi(-2));
        let open = DVector::from_column_slice(&[3.0 * size, 3.0 * size, HEAVIER]);
        let fit = bayesian_linear(&columns, &force, &weights, &DVector::zeros(3), &open)?;
        Some(fit.residuals.iter().copied().collect())
    }

    /// What the plain model leaves open of it, N.
    pub fn open(&self) -> f64 {
        let forces = self.drag.about(self.stretch).map(|i| self.drag.moments[i].force);
        let [low, high] = forces.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], f| [l.min(f), h.max(f)]);
        EVEN * 0.5 * (high - low)
    }
}
