//! Tracks that come later, or earlier, than the tool that holds what is tracked: they trail its path by its speed times the delay.
//!
//! Along the freedom of a joint `hand - child = tau q' + play sgn(q') + give load + c`, motion by motion: play and a grip that
//! gives are fitted beside it. A delay that grows from motion to motion is that of two clocks which run apart.

use nalgebra::{DMatrix, DVector};

use super::followed::{Followed, Reading, units};
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::math::{bayesian_linear, effective_samples, mad_sd, random_effects, weighted_linear};
use crate::twin::{Finding, Joint, JointKind, Model};

/// Fewest motions that have to tell, and readings of one.
const FEWEST: usize = 2;
const READINGS: usize = 20;
/// Standard deviations, and the least delay, s.
const CLEAR: f64 = 6.0;
const LEAST: f64 = 8e-3;
/// Scatter from motion to motion that is expected, s, and the most that there may be, as a share.
const SCATTER: f64 = 1e-3;
const ALIKE: f64 = 0.25;
/// Share of what hand and child are apart that the delay has to take away.
const WORTH: f64 = 0.5;
/// Fewest motions that tell a drift, how much it has to grow over them, s, and the share of their scatter that it has to explain.
const DRIFTS: (usize, f64, f64) = (4, 0.02, 0.6);
/// Standard deviations of what is fitted beside it, in units of what hand and child are apart by.
const OPEN: f64 = 3.0;

/// By how much the tracks of a capture come later than what the tool does.
pub(super) struct HandDelay {
    /// s, with its standard deviation: all along, or at the time `first`.
    seconds: (f64, f64),
    /// How much later it gets with every second, with its standard deviation, where it does.
    rate: Option<(f64, f64)>,
    first: f64,
    joint: String,
    turns: bool,
    from: Vec<String>,
    /// Root mean squares of what hand and child are apart, without and with it, rad or m.
    left: [f64; 2],
    held_out: Vec<String>,
}

/// What one motion says: the delay with its standard deviation, s.
fn one(led: &Followed) -> Option<(f64, f64)> {
    let r = &led.readings;
    if r.len() < READINGS {
        return None;
    }
    let apart = DVector::from_iterator(r.len(), r.iter().map(|r| r.hand - r.child));
    let fastest = r.iter().map(|r| r.hand_speed.abs()).fold(0.0, f64::max);
    let size = apart.iter().map(|x| x.abs()).fold(1e-9, f64::max);
    let columns: [fn(&Reading, f64, f64) -> f64; 4] = [
        |r, fastest, _| r.hand_speed / fastest,
        |r, fastest, _| (r.hand_speed / (0.1 * fastest)).clamp(-1.0, 1.0),
        |r, _, load| r.load / load,
        |_, _, _| 1.0,
    ];
    let a = DMatrix::from_fn(r.len(), 4, |i, k| columns[k](&r[i], fastest.max(1e-9), led.load));
    let open = DVector::from_element(4, OPEN * size);
    let (mut noise, mut memory) = (0.1 * size, 1.0);
    let mut found = None;
    for _ in 0..6 {
        let weights = DVector::from_element(r.len(), 1.0 / (memory * noise * noise));
        let fit = bayesian_linear(&a, &apart, &weights, &DVector::zeros(4), &open)?;
        noise = mad_sd(fit.residuals.as_slice())?.max(1e-4 * size);
        memory = (r.len() as f64 / effective_samples(fit.residuals.as_slice())).max(1.0);
        found = Some((fit.x[0] / fastest, fit.sd(0) / fastest));
    }
    found
}

/// Root mean square of what a delay, by the time a motion begins, leaves of how far hand and child are apart.
fn rms(all: &[&Followed], tau: &dyn Fn(f64) -> f64) -> f64 {
    let (mut square, mut count) = (0.0, 0.0);
    for led in all {
        let tau = tau(led.began);
        let left: Vec<f64> = led
            .readings
            .iter()
            .map(|r| r.hand - r.child - tau * r.hand_speed)
            .collect();
        let mean = left.iter().sum::<f64>() / left.len().max(1) as f64;
        square += left.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        count += left.len() as f64;
    }
    (square / f64::max(count, 1.0)).sqrt()
}

/// How often the delay is read anew from tracks that were put right by it: readings are means over a while.
const ROUNDS: usize = 2;

/// The delay that the joint tells which tells it best.
pub(super) fn hand_delay(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<HandDelay> {
    let mut late = best(capture, segmented, model)?;
    for _ in 0..ROUNDS {
        let righted = late.undone(capture);
        let joint = model.twin.joints().find(|j| j.name == late.joint)?;
        let each = righted.interactions.iter().filter(|i| !i.held_out);
        let each: Vec<(f64, (f64, f64))> = each
            .filter_map(|i| Followed::of(i, segmented, model, joint))
            .filter_map(|led| Some((led.began, one(&led)?)))
            .collect();
        if let Some(rate) = &mut late.rate {
            let more = Drift::of(&each, late.first)?;
            late.seconds = (late.seconds.0 + more.seconds.0, more.seconds.1);
            *rate = (rate.0 + more.rate.0, more.rate.1);
        } else {
            let (values, sds): (Vec<f64>, Vec<f64>) = each.into_iter().map(|e| e.1).unzip();
            let more = random_effects(&values, &sds, SCATTER)?;
            late.seconds = (late.seconds.0 + more.mean, more.sd);
        }
    }
    Some(late)
}

/// Delays of several motions as a straight line against the times at which they began.
struct Drift {
    seconds: (f64, f64),
    rate: (f64, f64),
    /// Standard deviation of what it leaves, beside that of the delays themselves, s.
    left: [f64; 2],
}

impl Drift {
    fn of(each: &[(f64, (f64, f64))], first: f64) -> Option<Self> {
        let n = each.len();
        if n < 3 {
            return None;
        }
        let a = DMatrix::from_fn(n, 2, |i, k| if k == 0 { 1.0 } else { each[i].0 - first });
        let b = DVector::from_iterator(n, each.iter().map(|e| e.1.0));
        let weights = DVector::from_iterator(n, each.iter().map(|e| (e.1.1.powi(2) + SCATTER * SCATTER).recip()));
        let fit = weighted_linear(&a, &b, &weights)?;
        let squares: f64 = fit.residuals.iter().zip(&weights).map(|(r, w)| r * r * w).sum();
        let scale = (squares / (n - 2) as f64).max(1.0).sqrt();
        let number = |k: usize| (fit.x[k], fit.covariance[(k, k)].sqrt() * scale);
        let (of, all) = (|i: usize| each[i].1.0, weights.sum());
        let mean = (0..n).map(|i| weights[i] * of(i)).sum::<f64>() / all;
        let before = (0..n).map(|i| weights[i] * (of(i) - mean).powi(2)).sum::<f64>();
        Some(Self {
            seconds: number(0),
            rate: number(1),
            left: [before, squares].map(|sum| (sum / all).sqrt()),
        })
    }

    /// Whether it is one beyond doubt, over motions that began so far apart, s.
    fn clear(&self, motions: usize, span: f64) -> bool {
        let (rate, sd) = self.rate;
        motions >= DRIFTS.0
            && (rate * span).abs() > DRIFTS.1
            && rate.abs() > CLEAR * sd
            && self.left[1] < (1.0 - DRIFTS.2) * self.left[0]
    }
}

/// Whether hands and what they hold were followed so often that a delay between them would show, and that its drift would.
pub(super) fn tells_hand_delay(capture: &Capture, segmented: &[Segmented], model: &Model) -> [bool; 2] {
    let fitted = || capture.interactions.iter().filter(|i| !i.held_out);
    let told = |joint: &Joint| {
        let each = fitted().filter_map(|i| one(&Followed::of(i, segmented, model, joint)?));
        each.count()
    };
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let most = model.twin.joints().filter(kinds).map(told).max().unwrap_or(0);
    [FEWEST, DRIFTS.0].map(|few| most >= few)
}

fn best(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<HandDelay> {
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let joints = model.twin.joints().filter(kinds);
    let found = joints.filter_map(|joint| {
        let each = capture
            .interactions
            .iter()
            .filter_map(|i| Followed::of(i, segmented, model, joint));
        of_joint(joint, &each.collect::<Vec<Followed>>())
    });
    found.min_by(|a, b| a.seconds.1.total_cmp(&b.seconds.1))
}

fn of_joint(joint: &Joint, all: &[Followed]) -> Option<HandDelay> {
    let fitted: Vec<(&Followed, (f64, f64))> = all
        .iter()
        .filter(|l| !l.held_out)
        .filter_map(|l| Some((l, one(l)?)))
        .collect();
    if fitted.len() < FEWEST {
        return None;
    }
    let begun: Vec<(f64, (f64, f64))> = fitted.iter().map(|f| (f.0.began, f.1)).collect();
    let first = begun.iter().map(|b| b.0).reduce(f64::min)?;
    let span = begun.iter().map(|b| b.0 - first).fold(0.0, f64::max);
    let drift = Drift::of(&begun, first).filter(|d| d.clear(begun.len(), span));
    let (values, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|f| f.1).unzip();
    let pooled = random_effects(&values, &sds, SCATTER)?;
    let seconds = drift.as_ref().map_or((pooled.mean, pooled.sd), |d| d.seconds);
    let rate = drift.as_ref().map(|d| d.rate);
    let held: Vec<&Followed> = all.iter().filter(|l| l.held_out).collect();
    let judged: Vec<&Followed> = if held.is_empty() {
        fitted.iter().map(|f| f.0).collect()
    } else {
        held.clone()
    };
    let tau = |t: f64| seconds.0 + rate.map_or(0.0, |r| r.0) * (t - first);
    let left = [rms(&judged, &|_| 0.0), rms(&judged, &tau)];
    let clear = pooled.mean.abs() > CLEAR * pooled.sd && pooled.mean.abs() > LEAST;
    let alike = pooled.between < ALIKE * pooled.mean.abs();
    (drift.is_some() || clear && alike)
        .then_some(())
        .filter(|()| left[1] < (1.0 - WORTH) * left[0])?;
    Some(HandDelay {
        seconds,
        rate,
        first,
        joint: joint.name.clone(),
        turns: joint.kind == JointKind::Revolute,
        from: fitted.iter().map(|f| f.0.interaction.clone()).collect(),
        left,
        held_out: held.iter().map(|l| l.interaction.clone()).collect(),
    })
}

impl HandDelay {
    /// The capture with every track on the clock of the tool.
    pub fn undone(&self, capture: &Capture) -> Capture {
        let mut out = capture.clone();
        for track in out.interactions.iter_mut().flat_map(|i| i.tracks.values_mut()) {
            let rate = self.rate.map_or(0.0, |r| r.0);
            let late = |t: f64| self.seconds.0 + rate * (t - self.first);
            track.time.iter_mut().for_each(|t| *t -= late(*t));
        }
        out
    }

    /// What it is called.
    pub fn cause(&self) -> &'static str {
        if self.rate.is_some() {
            "clock-drift"
        } else {
            "time-delay"
        }
    }

    /// As `diagnosis.json` says it.
    pub fn finding(&self) -> Finding {
        let (quantity, unit) = units(self.turns);
        let (value, sd) = self.rate.unwrap_or(self.seconds);
        let (name, of) = if self.rate.is_some() { ("e", "1") } else { ("tau", "s") };
        let side = if value > 0.0 { "behind" } else { "ahead of" };
        let at = &self.joint;
        let words = if self.rate.is_some() {
            let fast = 6e4 * value.abs();
            format!("what is tracked at {at} falls {fast:.1} ms a minute {side} the tool that holds it")
        } else {
            let late = 1e3 * value.abs();
            format!("what is tracked at {at} is {late:.0} ms {side} the tool that holds it")
        };
        let told = Told {
            cause: self.cause(),
            place: "sensor",
            probability: 0.95,
            rivals: &[],
            parameter: (
                name,
                Estimate::measured(value, sd, of, self.from.clone(), "way of hand and joint"),
            ),
            residual: "way of the hand",
            statistic: value.abs() / sd,
            words,
            gain: gain(quantity, unit, self.left, self.held_out.clone()),
        };
        told.finding()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand to and fro at changing speed, on dry friction with a spring, that what is tracked follows `tau` later; in a grip
    /// that gives by `give` under the friction.
    fn motion(tau: f64, give: f64) -> Followed {
        let way = |t: f64| 0.2 * (0.9 * t).sin() + 0.05 * (2.3 * t).cos();
        let speed = |t: f64| 0.18 * (0.9 * t).cos() - 0.115 * (2.3 * t).sin();
        let load = |t: f64| 4.0 * speed(t).signum() + 20.0 * way(t);
        let one = |i: u32| {
            let t = 0.04 * f64::from(i);
            let ripple = 1e-4 * (f64::from(i * 37 % 11) - 5.0) / 5.0;
            Reading {
                hand: way(t),
                child: way(t - tau) - give * load(t) / 4.0 + ripple,
                hand_speed: speed(t),
                child_speed: speed(t - tau),
                load: load(t),
            }
        };
        Followed {
            interaction: "pull".into(),
            held_out: false,
            began: 0.0,
            lever: 1.0,
            load: 4.0,
            first: nalgebra::Vector3::zeros(),
            readings: (0..300).map(one).collect(),
        }
    }

    /// One way only, from rest to rest.
    fn one_way(tau: f64) -> Followed {
        let smooth = |u: f64| u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
        let way = |t: f64| 0.3 * smooth((t / 1.5).clamp(0.0, 1.0));
        let speed = |t: f64| (way(t + 1e-4) - way(t - 1e-4)) / 2e-4;
        let mut out = motion(0.0, 0.0);
        for (i, r) in out.readings.iter_mut().enumerate() {
            let t = 0.04 * i as f64 - 0.5;
            let ripple = 1e-4 * ((i * 37 % 11) as f64 - 5.0) / 5.0;
            (r.hand, r.child) = (way(t), way(t - tau) + ripple);
            (r.hand_speed, r.child_speed, r.load) = (speed(t), speed(t - tau), 2.0 * (speed(t) / 0.01).clamp(0.0, 1.0));
        }
        out.readings.truncate(65);
        out
    }

    #[test]
    fn a_motion_one_way_tells_a_delay_as_well() {
        for tau in [0.05, 0.0] {
            let (said, sd) = one(&one_way(tau)).expect("a delay");
            assert!((said - tau).abs() < 4e-3 && sd < 4e-3, "{said} ± {sd} for {tau}");
        }
    }

    #[test]
    fn a_delay_is_told_from_a_grip_that_gives() {
        for tau in [0.06, -0.03] {
            let (said, sd) = one(&motion(tau, 2e-3)).expect("a delay");
            assert!((said - tau).abs() < 3e-3 && sd < 2e-3, "{said} ± {sd} for {tau}");
        }
        let (none, _) = one(&motion(0.0, 4e-3)).expect("readings");
        assert!(none.abs() < 2e-3, "{none}");
    }

    #[test]
    fn delays_that_grow_are_two_clocks() {
        let late = |rate: f64| -> Vec<(f64, (f64, f64))> {
            let own = |k: u32| 1e-3 * (f64::from(k * 7 % 5) - 2.0);
            let at = |k: u32| 5.0 + 15.0 * f64::from(k);
            (0..6).map(|k| (at(k), (rate * (at(k) - 5.0) + own(k), 1e-3))).collect()
        };
        let drift = Drift::of(&late(1.5e-3), 5.0).expect("a line");
        assert!(drift.clear(6, 75.0) && (drift.rate.0 / 1.5e-3 - 1.0).abs() < 0.05);
        assert!(!Drift::of(&late(0.0), 5.0).expect("a line").clear(6, 75.0));
    }
}
