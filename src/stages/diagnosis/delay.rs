//! Tracking that comes later, or earlier, than the tool: what is pushed then trails where the tool has it by its speed
//! times the delay, and is where it should be as soon as it stands still.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};

use super::compare::pairs;
pub use super::delay_of_hands::held_in;
use super::delay_of_hands::of_hands;
use super::late_paths::{delay, late};
use super::{Curve, Quantity, Trace};
use crate::base::Estimate;
use crate::math::{LinearFit, correlated_mean, mad_sd, median, robust_linear, t_tail};
use crate::twin::{CauseOdds, Evidence, Finding, Gain};

/// Fewest pushes that tell it.
const FEWEST: usize = 4;
/// Below this it may be the body that runs ahead of the blow, s.
pub(super) const LEAST: f64 = 8e-3;
/// Standard errors over the pushes from which on it is named.
pub(super) const CLEAR: f64 = 6.0;
/// Share of the error above the noise that it has to take away on touches that did not tell it.
const WORTH: f64 = 0.3;
/// By how much a body that yields and springs at the start of a push may seem late, s.
pub(super) const START: f64 = 3e-3;
/// Largest speed over the least from which on a delay is told from a length, and the most by which a tip gives, m.
const PACES: f64 = 1.5;
const GIVES: f64 = 1.5e-3;
/// Standard deviations from which on a tip is taken to give, and the sum of squares over that of what slides on up to which it does as well.
const GIVEN: f64 = 2.0;
const AS_WELL: f64 = 1.2;

/// One push: its name, when it began (s), its largest speed (m/s) and by how much what is tracked trails the tool (s).
pub(super) struct Late {
    pub name: String,
    pub time: f64,
    pub speed: f64,
    pub tau: f64,
}

/// What the pushes say together: `tau + rate (time − first) + coast speed`. A body that slides on after the tool has left
/// ends farther, and the surface that was found from its end lies too far: it seems late by its speed over `2 mu g`. A tip that gives
/// by a way makes it late by that over its speed instead.
struct Together {
    tau: (f64, f64),
    rate: Option<(f64, f64)>,
    /// Delays without what their speed explains, s, and the median absolute deviation of what is left, as a standard deviation.
    values: Vec<f64>,
    rest: f64,
    first: f64,
}

/// One regressor.
type Column = Box<dyn Fn(&Late) -> f64>;

impl Together {
    fn of(each: &[Late], drifts: bool) -> Option<Self> {
        let low = |of: &dyn Fn(&Late) -> f64| each.iter().map(of).reduce(f64::min);
        let high = |of: &dyn Fn(&Late) -> f64| each.iter().map(of).reduce(f64::max);
        let (first, span) = (low(&|e| e.time)?, high(&|e| e.time)? - low(&|e| e.time)?);
        let coasts = high(&|e| e.speed)? > 1.5 * low(&|e| e.speed)?;
        let mut columns: Vec<Column> = vec![Box::new(|_| 1.0)];
        if coasts {
            columns.push(Box::new(|e| e.speed));
        }
        if drifts && span > 0.0 {
            columns.push(Box::new(move |e| (e.time - first) / span));
        }
        let fitted = |columns: &[Column]| {
            let a = DMatrix::from_fn(each.len(), columns.len(), |i, k| columns[k](&each[i]));
            let b = DVector::from_iterator(each.len(), each.iter().map(|e| e.tau));
            robust_linear(&a, &b)
        };
        let mut fit = fitted(&columns)?;
        let mut given = false;
        if coasts {
            // A tip that gives, in the place of bodies that slide on, where that does as well.
            let coasting = std::mem::replace(&mut columns[1], Box::new(|e| 1.0 / e.speed));
            let left = |f: &LinearFit| f.residuals.norm_squared();
            let gives = |f: &LinearFit| (GIVEN * f.sd(1)..GIVES).contains(&f.x[1]) && left(f) < AS_WELL * left(&fit);
            match fitted(&columns).filter(gives) {
                Some(other) => (fit, given) = (other, true),
                None => columns[1] = coasting,
            }
        }
        let last = columns.len() - 1;
        let told = |k: usize| (fit.x[k], fit.sd(k).max(1e-4));
        let beside = if coasts { fit.x[1] } else { 0.0 };
        let other = |e: &Late| beside * if given { 1.0 / e.speed } else { e.speed };
        Some(Self {
            tau: told(0),
            rate: (drifts && span > 0.0).then(|| (fit.x[last] / span, told(last).1 / span)),
            values: each.iter().map(|e| e.tau - other(e)).collect(),
            rest: mad_sd(fit.residuals.as_slice())?,
            first,
        })
    }
}

/// The delay of the tracking behind the tool as a finding, one and the same or growing with time, from paths along the
/// motion of pushes; nothing where it is not clear or does not foretell pushes that were not fitted.
///
/// What a hand holds goes where the hand goes: where hands tell it at several speeds, fingers that slip and give do not count.
pub fn delay_finding(traces: &[Trace], by_hand: &BTreeSet<String>) -> Option<Finding> {
    let (held, fitted): (Vec<&Trace>, Vec<&Trace>) = traces.iter().partition(|t| t.held_out);
    // One delay a push: bodies that are pushed together are seen by the same camera.
    let of = |t: &&Trace| {
        let (curve, (tau, speed)) = along(t).into_iter().find_map(|c| Some((c.clone(), delay(&c)?)))?;
        let time = *curve.time.first()?;
        Some(Late {
            name: t.interaction.clone(),
            time,
            speed,
            tau,
        })
    };
    let each: Vec<Late> = fitted.iter().filter_map(of).collect();
    if each.len() < FEWEST {
        return None;
    }
    let judged = if held.is_empty() { &fitted } else { &held };
    let sealed = !held.is_empty();
    let hands = || {
        of_hands(
            each.iter().filter(|e| by_hand.contains(&e.name)).collect(),
            judged,
            sealed,
        )
    };
    clock_drift(&each, judged, sealed)
        .or_else(hands)
        .or_else(|| constant(&each, judged, sealed))
}

/// Whether the speeds of touches differ so much that a time is told from a way.
pub(super) fn paced(each: &[&Late]) -> bool {
    let slowest = each.iter().map(|e| e.speed).fold(f64::INFINITY, f64::min);
    each.iter().any(|e| e.speed > PACES * slowest)
}

pub(super) fn behind(tau: f64) -> String {
    let side = if tau > 0.0 { "behind" } else { "ahead of" };
    format!(
        "what is tracked is {:.0} ms {side} the tool that moves it",
        1e3 * tau.abs()
    )
}

/// Whether enough pushes were foretold along their way for a delay to show.
pub fn tells_delay(traces: &[Trace]) -> bool {
    let fitted = traces.iter().filter(|t| !t.held_out);
    let told = fitted.filter(|t| along(t).iter().any(|c| delay(c).is_some()));
    told.count() >= FEWEST
}

/// Adds a delay to what was found, less what it feigns: to a camera that is early a body slides before the force is there, as on
/// bristles. A finger that gives way puts what it pushes behind: where one was found, that is no camera that is late.
pub fn take_up(findings: &mut Vec<Finding>, delay: Option<Finding>) {
    let early = |f: &Finding| f.parameters.get("tau").is_some_and(|tau| tau.value < 0.0);
    let gives = findings.iter().any(|f| f.cause == "contact-law");
    let delay = delay.filter(|f| early(f) || !gives || f.cause != "time-delay");
    if delay.as_ref().is_some_and(early) {
        findings.retain(|f| f.cause != "presliding");
    }
    findings.extend(delay);
}

fn along(trace: &Trace) -> Vec<Curve> {
    let own = trace.curves.iter();
    own.filter(|c| c.quantity == Quantity::Position && c.label.contains("along the motion"))
        .cloned()
        .collect()
}

fn constant(each: &[Late], judged: &[&Trace], sealed: bool) -> Option<Finding> {
    let all = Together::of(each, false)?;
    let (mean, scatter) = all.tau;
    // A push that went another way than foretold says nothing of time: most of them count.
    let against = all.values.iter().filter(|d| **d * mean < 0.0).count();
    let every: Vec<&Late> = each.iter().collect();
    if mean.abs() < LEAST || mean.abs() < CLEAR * scatter || 5 * against > each.len() || is_a_way(&every) {
        return None;
    }
    let told = Told {
        cause: "time-delay",
        name: "tau",
        unit: "s",
        value: (mean, scatter.hypot(START)),
        statistic: mean / scatter,
        words: behind(mean),
    };
    let mut finding = told.finding(&every, gain(judged, sealed, &|_| mean)?)?;
    // At one speed what is late by a time is behind by a length as well, as at the end of a tip that gives.
    let fastest = each.iter().map(|e| e.speed).fold(0.0, f64::max);
    if !paced(&every) && mean > 0.0 && mean * fastest < GIVES {
        finding.probability = 0.5;
        finding.alternatives = vec![CauseOdds {
            cause: "contact-law".into(),
            probability: 0.4,
        }];
    }
    Some(finding)
}

/// Whether what is tracked is off by one way at all speeds rather than by one time.
pub(super) fn is_a_way(each: &[&Late]) -> bool {
    let unlike = |of: &dyn Fn(&Late) -> f64| {
        let mean = each.iter().map(|e| of(e)).sum::<f64>() / each.len() as f64;
        each.iter().map(|e| (of(e) / mean - 1.0).powi(2)).sum::<f64>()
    };
    paced(each) && unlike(&|e| e.tau * e.speed) < unlike(&|e| e.tau)
}

/// The delay grows with time: the clocks of tool and tracking run apart.
fn clock_drift(each: &[Late], judged: &[&Trace], sealed: bool) -> Option<Finding> {
    let all = Together::of(each, true)?;
    let (rate, sd) = all.rate?;
    let span = each.iter().map(|e| e.time - all.first).fold(0.0, f64::max);
    let middle = median(&all.values)?;
    let before = mad_sd(&all.values.iter().map(|v| v - middle).collect::<Vec<_>>())?;
    let grown = (rate * span).abs();
    if each.len() < 2 * FEWEST - 2 || grown < 2.0 * LEAST || rate.abs() < CLEAR * sd || all.rest > 0.4 * before {
        return None;
    }
    let told = Told {
        cause: "clock-drift",
        name: "e",
        unit: "1",
        value: (rate, sd),
        statistic: rate / sd,
        words: format!(
            "what is tracked falls {:.1} ms a minute behind the tool that moves it",
            6e4 * rate
        ),
    };
    told.finding(
        &each.iter().collect::<Vec<_>>(),
        gain(judged, sealed, &|t| all.tau.0 + rate * (t - all.first))?,
    )
}

/// A number that the delays tell.
pub(super) struct Told {
    pub cause: &'static str,
    pub name: &'static str,
    pub unit: &'static str,
    pub value: (f64, f64),
    pub statistic: f64,
    pub words: String,
}

impl Told {
    pub fn finding(self, each: &[&Late], gain: Gain) -> Option<Finding> {
        let from: Vec<String> = each.iter().map(|e| e.name.clone()).collect();
        let degrees = each.len() as f64 - 1.0;
        let value = Estimate::measured(self.value.0, self.value.1, self.unit, from, "path-against-speed");
        Some(Finding {
            leader: None,
            priors: BTreeMap::new(),
            cause: self.cause.into(),
            place: "sensor".into(),
            probability: 0.9,
            alternatives: Vec::new(),
            evidence: vec![Evidence {
                residual: "position along the motion, against speed".into(),
                test: "robust regression over pushes, Student's t".into(),
                statistic: self.statistic,
                p_value: (2.0 * t_tail(self.statistic.abs(), degrees)).min(1.0),
                words: self.words,
            }],
            parameters: BTreeMap::from([(self.name.into(), value)]),
            gain,
        })
    }
}

/// What knowing the delay (s, by the time at which a push begins) gains; nothing where that is too little.
pub(super) fn gain(judged: &[&Trace], sealed: bool, by: &dyn Fn(f64) -> f64) -> Option<Gain> {
    let curves: Vec<Curve> = judged.iter().flat_map(|t| along(t)).collect();
    let moved: Vec<Curve> = curves
        .iter()
        .filter_map(|c| Some(late(c, by(*c.time.first()?))))
        .collect();
    let (rmse_before, noise) = error(&curves)?;
    let (rmse_after, _) = error(&moved)?;
    let above = |x: f64| (x * x - noise * noise).max(0.0);
    let reduction = 1.0 - (above(rmse_after) / above(rmse_before).max(1e-30)).sqrt();
    let names = if sealed { judged } else { &[] };
    (reduction > WORTH).then(|| Gain {
        quantity: Quantity::Position.name().into(),
        rmse_before,
        rmse_after,
        unit: Quantity::Position.unit().into(),
        held_out: names.iter().map(|t| t.interaction.clone()).collect(),
        reduction,
        ..Gain::default()
    })
}

/// Root mean square error, and the noise; offsets that every push has anew are left in.
fn error(curves: &[Curve]) -> Option<(f64, f64)> {
    let squares: Vec<f64> = curves.iter().flat_map(pairs).map(|(m, p)| (m - p).powi(2)).collect();
    let noise: Vec<f64> = curves.iter().filter_map(|c| c.noise).collect();
    let level = noise.iter().map(|n| n * n).sum::<f64>() / noise.len().max(1) as f64;
    Some((correlated_mean(&squares)?.mean.sqrt(), level.sqrt()))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn push(name: &str, speed: f64, tau: f64, held_out: bool) -> Trace {
        let way = |t: f64| speed * (t - 0.5).clamp(0.0, 1.0);
        let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.01).collect();
        // A surface that was missed, and a ripple in the place of noise.
        let seen = |t: &f64| 1.004 * way(t - tau) + 1e-4 * (t * 37.0).sin();
        Trace {
            interaction: name.into(),
            held_out,
            curves: vec![Curve {
                label: "tin: along the motion".into(),
                quantity: Quantity::Position,
                measured: time.iter().map(seen).collect(),
                predicted: time.iter().map(|t| way(*t)).collect(),
                time,
                noise: Some(1e-4),
            }],
            ..Trace::default()
        }
    }

    fn told(traces: &[Trace]) -> Option<Finding> {
        delay_finding(traces, &BTreeSet::new())
    }

    fn pushes(tau: f64) -> Vec<Trace> {
        let all = [0.02, 0.04, 0.08, 0.03, 0.06, 0.05].into_iter().enumerate();
        all.map(|(i, v)| push(&format!("push-{i}"), v, tau, i > 4)).collect()
    }

    #[test]
    fn a_tip_that_gives_is_no_camera_that_is_late() {
        let speeds = [0.03, 0.03, 0.06, 0.06, 0.12, 0.25, 0.25, 0.03];
        let of = |way: f64, tau: f64| -> Vec<Trace> {
            let each = speeds.iter().enumerate();
            each.map(|(i, v)| push(&format!("p{i}"), *v, tau + way / v, i == 7))
                .collect()
        };
        assert!(told(&of(2e-4, 4e-3)).is_none());
        let late = told(&of(2e-4, 2e-2)).expect("a delay");
        assert!((late.parameters["tau"].value - 2e-2).abs() < 3e-3, "{late:?}");
    }

    #[test]
    fn a_late_camera_is_told_by_how_much() {
        for tau in [0.03, -0.02] {
            let found = told(&pushes(tau)).expect("a delay");
            let said = found.parameters["tau"].value;
            assert!((said - tau).abs() < 2e-3, "{said} for {tau}");
            assert!(found.gain.reduction > 0.5, "{:?}", found.gain);
        }
    }

    #[test]
    fn a_way_is_no_delay() {
        let behind = |(i, v): (usize, f64)| push(&format!("push-{i}"), v, 6e-4 / v, i > 4);
        let all = [0.02, 0.04, 0.08, 0.03, 0.06, 0.05].into_iter().enumerate();
        assert!(told(&all.map(behind).collect::<Vec<_>>()).is_none());
    }

    #[test]
    fn clocks_that_run_apart_are_told_by_their_rate() {
        let at = |k: usize| {
            let mut trace = push(
                &format!("push-{k}"),
                [0.02, 0.05, 0.03, 0.08][k % 4],
                4e-4 * 20.0 * k as f64,
                k > 7,
            );
            trace.curves[0].time.iter_mut().for_each(|t| *t += 20.0 * k as f64);
            trace
        };
        let found = told(&(0..10).map(at).collect::<Vec<_>>()).expect("a drift");
        let said = found.parameters["e"].value;
        assert!(
            found.cause == "clock-drift" && (said / 4e-4 - 1.0).abs() < 0.1,
            "{said}"
        );
    }

    #[test]
    fn an_honest_camera_is_not_accused() {
        assert!(told(&pushes(0.0)).is_none() && told(&pushes(0.004)).is_none());
        assert!(told(&pushes(0.03)[..3]).is_none());
    }
}
