//! How the force rings after the tool has met a body: a damped oscillation of the tool's tip against the body's mass.

use crate::math::median;

/// Seconds of one sample, and over which it is looked at.
pub const BIN: f64 = 0.004;
const LASTS: f64 = 0.4;
/// Rates that are tried, rad/s (a slower swing is the body's own, unless it swings as slowly on the tool: down to this share of
/// that), and times in which it dies down to a third, s.
const RATES: [f64; 2] = [60.0, 700.0];
const SOFT: (f64, f64) = (0.75, 25.0);
const STEPS: usize = 36;
const DECAYS: [f64; 5] = [0.01, 0.02, 0.04, 0.08, 0.16];
/// Time in which what does not ring changes, s.
const SLOW: f64 = 0.1;
/// Below this share of the force the tool and the body had parted.
const PARTED: f64 = 0.1;
/// The ringing has to take away so much of the squares.
const HEARD: f64 = 0.4;
/// Moments of a bin over which it is averaged.
const MOMENTS: usize = 8;

/// A damped oscillation.
#[derive(Clone, Copy, Debug)]
pub struct Ringing {
    /// N, at the beginning.
    pub size: f64,
    /// rad/s.
    rate: f64,
    /// s.
    pub decay: f64,
}

impl Ringing {
    /// That of one push, from the force along it (N) from `onset` to the end (s), of a body that should swing on the tool at the
    /// rate `swings` (rad/s); nothing where the tool and the body part, so that it is no oscillation.
    pub fn of(time: &[f64], force: &[f64], [onset, end]: [f64; 2], swings: f64) -> Option<Self> {
        let steady: Vec<f64> = (0..time.len())
            .filter(|i| time[*i] > 0.5 * (onset + end) && time[*i] < end)
            .map(|i| force[i])
            .collect();
        let level = median(&steady)?;
        let until = (onset + LASTS).min(0.5 * (onset + end));
        let rows: Vec<[f64; 2]> = (0..time.len())
            .filter(|i| time[*i] > onset && time[*i] < until && force[*i].is_finite())
            .map(|i| [time[i] - onset, force[i] - level])
            .collect();
        let parted = rows.iter().any(|[t, y]| *t > 2.0 * BIN && *y < (PARTED - 1.0) * level);
        if parted || rows.len() < 12 {
            return None;
        }
        let slow = |t: f64| [(-t / SLOW).exp(), 1.0];
        let without = left(&rows, &|t| slow(t).to_vec()).map(|l| l.0)?;
        let slowest = (SOFT.0 * swings).max(SOFT.1).min(RATES[0]);
        let mut best: Option<(f64, Self)> = None;
        for k in 0..STEPS {
            let rate = slowest * (RATES[1] / slowest).powf(k as f64 / (STEPS - 1) as f64);
            for decay in DECAYS {
                let columns = |t: f64| {
                    let fades = (-t / decay).exp();
                    let [a, b] = slow(t);
                    vec![a, b, fades * (rate * t).cos(), fades * (rate * t).sin()]
                };
                let Some((squares, values)) = left(&rows, &columns) else {
                    continue;
                };
                if best.as_ref().is_none_or(|b| squares < b.0) {
                    let size = values[2].hypot(values[3]);
                    best = Some((squares, Self { size, rate, decay }));
                }
            }
        }
        best.map(|(squares, ringing)| {
            if squares < (1.0 - HEARD) * without {
                ringing
            } else {
                Self { size: 0.0, ..ringing }
            }
        })
    }

    /// The middle of several, each with the speed (m/s) of what it came from: of one that came from a speed of 1 m/s.
    pub fn usual(all: &[(Self, f64)]) -> Option<Self> {
        let heard: Vec<&(Self, f64)> = all.iter().filter(|(r, v)| r.size > 0.0 && *v > 0.0).collect();
        let of = |value: &dyn Fn(&(Self, f64)) -> f64| median(&heard.iter().map(|r| value(r)).collect::<Vec<f64>>());
        Some(Self {
            size: of(&|(r, v)| r.size / v)?,
            rate: of(&|(r, _)| r.rate)?,
            decay: of(&|(r, _)| r.decay)?,
        })
    }

    /// As many times as large.
    pub fn times(self, factor: f64) -> Self {
        Self {
            size: self.size * factor,
            ..self
        }
    }

    /// What is left of it `since` seconds after the beginning, N.
    pub fn envelope(&self, since: f64) -> f64 {
        self.size * (-since.max(0.0) / self.decay).exp()
    }

    /// Its two phases `since` seconds after the beginning, N, averaged over a bin of `span` seconds.
    pub fn phases(&self, since: f64, span: f64) -> [f64; 2] {
        let mut out = [0.0; 2];
        for k in 0..MOMENTS {
            let t = since + span * ((k as f64 + 0.5) / MOMENTS as f64 - 0.5);
            if t > 0.0 {
                let size = self.envelope(t) / MOMENTS as f64;
                out[0] += size * (self.rate * t).cos();
                out[1] += size * (self.rate * t).sin();
            }
        }
        out
    }
}

/// Sum of squares that these columns leave, and their coefficients.
fn left(rows: &[[f64; 2]], columns: &dyn Fn(f64) -> Vec<f64>) -> Option<(f64, Vec<f64>)> {
    let each: Vec<Vec<f64>> = rows.iter().map(|r| columns(r[0])).collect();
    let n = each.first()?.len();
    let a = nalgebra::DMatrix::from_fn(rows.len(), n, |i, j| each[i][j]);
    let y = nalgebra::DVector::from_fn(rows.len(), |i, _| rows[i][1]);
    let normal = a.tr_mul(&a) + nalgebra::DMatrix::identity(n, n) * 1e-9;
    let x = nalgebra::Cholesky::new(normal)?.solve(&a.tr_mul(&y));
    Some(((y - a * &x).norm_squared(), x.iter().copied().collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ringing_is_found_beside_a_slow_swing() {
        let time: Vec<f64> = (0..500).map(|i| f64::from(i) * BIN).collect();
        let force = |t: &f64| {
            let ring = 1.5 * (-t / 0.05).exp() * (120.0 * t + 0.4).sin();
            2.0 + ring + 0.2 * (-t / 0.5).exp() * (22.0 * t).sin()
        };
        let force: Vec<f64> = time.iter().map(force).collect();
        let found = Ringing::of(&time, &force, [0.0, 2.0], 500.0).expect("a ringing");
        assert!(
            (found.rate - 120.0).abs() < 10.0 && (found.size - 1.5).abs() < 0.4,
            "{found:?}"
        );
    }

    #[test]
    fn most_pushes_tell_how_it_rings() {
        let one = |speed: f64, decay: f64| {
            let ringing = Ringing {
                size: 30.0 * speed,
                rate: 50.0,
                decay,
            };
            (ringing, speed)
        };
        let all = [one(0.03, 0.04), one(0.06, 0.04), one(0.3, 0.01)];
        let usual = Ringing::usual(&all).expect("three").times(0.3);
        assert!((usual.size - 9.0).abs() < 1e-9 && (usual.decay - 0.04).abs() < 1e-9);
        assert!(Ringing::usual(&[]).is_none());
    }

    #[test]
    fn a_tool_that_bounces_off_does_not_ring() {
        let time: Vec<f64> = (0..500).map(|i| f64::from(i) * BIN).collect();
        let force: Vec<f64> = time
            .iter()
            .map(|t| (2.0 + 4.0 * (-t / 0.1).exp() * (60.0 * t).sin()).max(0.0))
            .collect();
        assert!(Ringing::of(&time, &force, [0.0, 2.0], 500.0).is_none());
    }
}
