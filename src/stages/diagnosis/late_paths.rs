//! By how much what is tracked of a push trails the path that was foretold, and such a path made late.

use nalgebra::{DMatrix, DVector};

use super::Curve;
use crate::math::{interpolate, weighted_linear};

/// Span over which a predicted path is differentiated, s.
const SPAN: f64 = 0.02;

/// Seconds by which one path trails its prediction, and its largest speed, m/s: regression of what is left on the predicted
/// speed and, for what the tool missed of the surface, on the way.
pub fn delay(curve: &Curve) -> Option<(f64, f64)> {
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
    fit.x[0].is_finite().then_some((fit.x[0], top))
}

/// The prediction `by` seconds earlier.
fn later(curve: &Curve, t: f64, by: f64) -> Option<f64> {
    let (first, last) = (curve.time.first()?, curve.time.last()?);
    interpolate(&curve.time, &curve.predicted, (t - by).clamp(*first, *last)).filter(|p| p.is_finite())
}

/// A curve whose predictions are `by` seconds late.
pub fn late(curve: &Curve, by: f64) -> Curve {
    let at = |t: &f64| later(curve, *t, by).unwrap_or(f64::NAN);
    Curve {
        predicted: curve.time.iter().map(at).collect(),
        ..curve.clone()
    }
}
