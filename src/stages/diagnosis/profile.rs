//! Where the plain model is wrong: what is left of its force against each thing that it might depend on, in words.

use super::family::Family;
use super::fit::Fit;
use super::marginal::{Point, predict};
use crate::math::{quantile, t_tail};
use crate::twin::Evidence;

/// Mean of what is left of each interaction at the low and the high end of a covariate.
struct Ends {
    name: &'static str,
    unit: &'static str,
    middle: f64,
    low: f64,
    high: f64,
    t: f64,
    degrees: f64,
}

/// The covariate that parts the plain model's errors best, as evidence.
pub fn profile(family: &dyn Family, plain: &Fit) -> Option<Evidence> {
    let count = family.covariates(*plain.groups.first()?).len();
    let ends = (0..count).filter_map(|k| ends(family, plain, k));
    let best = ends.max_by(|a, b| a.t.abs().total_cmp(&b.t.abs()))?;
    let side = |x: f64| if x > 0.0 { "too low" } else { "too high" };
    let quantity = family.kinds().first()?.quantity;
    // Two digits of the larger one, at least two decimals.
    let digits = (1.0 - best.low.abs().max(best.high.abs()).max(1e-9).log10().floor()).clamp(2.0, 6.0) as usize;
    let words = format!(
        "below {:.3} {unit} of {} the predicted {what} is {:.digits$} {si} {} and above it {:.digits$} {si} {}",
        best.middle,
        best.name,
        best.low.abs(),
        side(best.low),
        best.high.abs(),
        side(best.high),
        unit = best.unit,
        what = quantity.name(),
        si = quantity.unit(),
    );
    Some(Evidence {
        residual: format!("force against {}", best.name),
        test: "difference of the ends, over interactions".into(),
        statistic: best.t,
        p_value: (2.0 * t_tail(best.t.abs(), best.degrees)).min(1.0),
        words,
    })
}

/// Which covariate parts the errors of a model best.
pub fn parting(family: &dyn Family, fit: &Fit) -> Option<usize> {
    let count = family.covariates(*fit.groups.first()?).len();
    let each = (0..count).filter_map(|k| Some((k, ends(family, fit, k)?.t.abs())));
    each.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}

fn ends(family: &dyn Family, plain: &Fit, k: usize) -> Option<Ends> {
    let none = vec![0.0; family.scatter().len()];
    let mut rows: Vec<(f64, f64)> = Vec::new();
    let (mut name, mut unit) = ("", "");
    for g in &plain.groups {
        let point = Point {
            laws: &plain.laws,
            theta: &plain.theta,
        };
        let predicted = predict(family, *g, &point, &none);
        let measured = family.groups()[*g].channels.iter().flat_map(|c| c.measured.iter());
        let covariates = family.covariates(*g);
        let (of, si, values) = covariates.get(k)?;
        (name, unit) = (*of, *si);
        let each = measured.zip(&predicted).zip(values).filter(|(_, v)| v.is_finite());
        let (mut sum, mut at, mut n) = (0.0, 0.0, 0.0);
        for ((m, p), v) in each {
            (sum, at, n) = (sum + m - p, at + v, n + 1.0);
        }
        if n > 0.0 {
            rows.push((at / n, sum / n));
        }
    }
    let places: Vec<f64> = rows.iter().map(|r| r.0).collect();
    let middle = quantile(&places, 0.5)?;
    let of = |high: bool| {
        rows.iter()
            .filter(|r| (r.0 > middle) == high)
            .map(|r| r.1)
            .collect::<Vec<f64>>()
    };
    let (low, high) = (of(false), of(true));
    if low.len() < 2 || high.len() < 2 {
        return None;
    }
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (a, b) = (mean(&low), mean(&high));
    let spread = |x: &[f64], m: f64| x.iter().map(|v| (v - m).powi(2)).sum::<f64>();
    let degrees = (low.len() + high.len() - 2) as f64;
    let pooled = (spread(&low, a) + spread(&high, b)) / degrees;
    let error = (pooled * (1.0 / low.len() as f64 + 1.0 / high.len() as f64))
        .sqrt()
        .max(1e-9);
    Some(Ends {
        name,
        unit,
        middle,
        low: a,
        high: b,
        t: (b - a) / error,
        degrees,
    })
}
