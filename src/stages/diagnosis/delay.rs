//! Tracking that comes later, or earlier, than the tool: what is pushed then trails where the tool has it by its speed
//! times the delay, and is where it should be as soon as it stands still.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::compare::pairs;
use super::{Curve, Quantity, Trace};
use crate::base::Estimate;
use crate::math::{correlated_mean, interpolate, mad_sd, median, t_tail, weighted_linear};
use crate::twin::{Evidence, Finding, Gain};

/// Fewest pushes that tell it.
const FEWEST: usize = 4;
/// Below this it may be the body that runs ahead of the blow, s.
const LEAST: f64 = 8e-3;
/// Standard errors over the pushes from which on it is named.
const CLEAR: f64 = 6.0;
/// Share of the error above the noise that it has to take away on touches that did not tell it.
const WORTH: f64 = 0.3;
/// By how much a body that yields and springs at the start of a push may seem late, s.
const START: f64 = 3e-3;
/// Standard error of a median over that of a mean.
const MEDIAN: f64 = 1.25;
/// Span over which a predicted path is differentiated, s.
const SPAN: f64 = 0.02;

/// The delay of the tracking behind the tool as a finding, from paths along the motion of pushes; nothing where it is not
/// clear or does not foretell pushes that were not fitted.
pub fn delay_finding(traces: &[Trace]) -> Option<Finding> {
    let along = |t: &Trace| -> Vec<Curve> {
        let own = t.curves.iter();
        own.filter(|c| c.quantity == Quantity::Position && c.label.contains("along the motion"))
            .cloned()
            .collect()
    };
    let (held, fitted): (Vec<&Trace>, Vec<&Trace>) = traces.iter().partition(|t| t.held_out);
    // One delay a push: bodies that are pushed together are seen by the same camera.
    let of = |t: &&Trace| Some((t.interaction.clone(), along(t).iter().filter_map(delay).next()?));
    let each: Vec<(String, f64)> = fitted.iter().filter_map(of).collect();
    if each.len() < FEWEST {
        return None;
    }
    let n = each.len() as f64;
    let values: Vec<f64> = each.iter().map(|d| d.1).collect();
    // A push that went another way than foretold says nothing of time: the middle of them counts.
    let mean = median(&values)?;
    let scatter = MEDIAN * (mad_sd(&values)? / n.sqrt()).max(1e-4);
    let against = values.iter().filter(|d| **d * mean < 0.0).count();
    if mean.abs() < LEAST || mean.abs() < CLEAR * scatter || 5 * against > each.len() {
        return None;
    }
    let sd = scatter.hypot(START);
    let judged = if held.is_empty() { &fitted } else { &held };
    let curves: Vec<Curve> = judged.iter().flat_map(|t| along(t)).collect();
    let (before, noise) = error(&curves, 0.0)?;
    let (after, _) = error(&curves, mean)?;
    let above = |x: f64| (x * x - noise * noise).max(0.0);
    let reduction = 1.0 - (above(after) / above(before).max(1e-30)).sqrt();
    if reduction < WORTH {
        return None;
    }
    let from: Vec<String> = each.into_iter().map(|d| d.0).collect();
    let side = if mean > 0.0 { "behind" } else { "ahead of" };
    Some(Finding {
        cause: "time-delay".into(),
        place: "sensor".into(),
        probability: 0.9,
        alternatives: Vec::new(),
        evidence: vec![Evidence {
            residual: "position along the motion, against speed".into(),
            test: "median over pushes, Student's t".into(),
            statistic: mean / scatter,
            p_value: (2.0 * t_tail((mean / scatter).abs(), n - 1.0)).min(1.0),
            words: format!(
                "what is tracked is {:.0} ms {side} the tool that moves it",
                1e3 * mean.abs()
            ),
        }],
        parameters: BTreeMap::from([(
            "tau".into(),
            Estimate::measured(mean, sd, "s", from, "path-against-speed"),
        )]),
        gain: Gain {
            quantity: Quantity::Position.name().into(),
            rmse_before: before,
            rmse_after: after,
            unit: Quantity::Position.unit().into(),
            held_out: held.iter().map(|t| t.interaction.clone()).collect(),
            reduction,
        },
    })
}

/// Seconds by which one path trails its prediction: regression of what is left on the predicted speed and, for what the
/// tool missed of the surface, on the way.
fn delay(curve: &Curve) -> Option<f64> {
    let speed = |t: f64| {
        let (a, b) = (later(curve, t, -SPAN)?, later(curve, t, SPAN)?);
        Some((a - b) / (2.0 * SPAN))
    };
    let rows: Vec<(f64, f64, f64)> = (0..curve.time.len())
        .filter_map(|i| {
            let (m, p) = (*curve.measured.get(i)?, *curve.predicted.get(i)?);
            (m.is_finite() && p.is_finite()).then_some((m - p, speed(curve.time[i])?, p))
        })
        .collect();
    let top = rows.iter().map(|r| r.1.abs()).fold(0.0, f64::max);
    let way = rows.iter().map(|r| r.2.abs()).fold(0.0, f64::max);
    // Standing before and after is what tells a delay from a surface that was missed.
    let standing = rows.iter().filter(|r| r.1.abs() < 0.1 * top).count();
    if rows.len() < 20 || standing < 10 || rows.len() - standing < 5 || top < 5e-3 || way < 0.01 {
        return None;
    }
    let a = DMatrix::from_fn(rows.len(), 2, |i, k| if k == 0 { -rows[i].1 } else { rows[i].2 / way });
    let b = DVector::from_iterator(rows.len(), rows.iter().map(|r| r.0));
    let fit = weighted_linear(&a, &b, &DVector::from_element(rows.len(), 1.0))?;
    fit.x[0].is_finite().then_some(fit.x[0])
}

/// The prediction `by` seconds earlier.
fn later(curve: &Curve, t: f64, by: f64) -> Option<f64> {
    let (first, last) = (curve.time.first()?, curve.time.last()?);
    interpolate(&curve.time, &curve.predicted, (t - by).clamp(*first, *last)).filter(|p| p.is_finite())
}

/// Root mean square error with every prediction `by` seconds late, and the noise; offsets that every push has anew are
/// left in.
fn error(curves: &[Curve], by: f64) -> Option<(f64, f64)> {
    let (mut squares, mut noise) = (Vec::new(), Vec::new());
    for curve in curves {
        let mut moved = curve.clone();
        moved.predicted = curve
            .time
            .iter()
            .map(|t| later(curve, *t, by).unwrap_or(f64::NAN))
            .collect();
        squares.extend(pairs(&moved).map(|(m, p)| (m - p).powi(2)));
        noise.extend(curve.noise);
    }
    let level = noise.iter().map(|n| n * n).sum::<f64>() / noise.len().max(1) as f64;
    Some((correlated_mean(&squares)?.mean.sqrt(), level.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(name: &str, speed: f64, tau: f64, held_out: bool) -> Trace {
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

    fn pushes(tau: f64) -> Vec<Trace> {
        let all = [0.02, 0.04, 0.08, 0.03, 0.06, 0.05].into_iter().enumerate();
        all.map(|(i, v)| push(&format!("push-{i}"), v, tau, i > 4)).collect()
    }

    #[test]
    fn a_late_camera_is_told_by_how_much() {
        for tau in [0.03, -0.02] {
            let found = delay_finding(&pushes(tau)).expect("a delay");
            let said = found.parameters["tau"].value;
            assert!((said - tau).abs() < 2e-3, "{said} for {tau}");
            assert!(found.gain.reduction > 0.5, "{:?}", found.gain);
        }
    }

    #[test]
    fn an_honest_camera_is_not_accused() {
        assert!(delay_finding(&pushes(0.0)).is_none() && delay_finding(&pushes(0.004)).is_none());
        assert!(delay_finding(&pushes(0.03)[..3]).is_none());
    }
}
