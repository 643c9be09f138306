//! Round bodies that roll on: what slows them, against rolling for ever.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector3};

use super::told::{Told, gain};
use super::{Curve, Quantity, Trace};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::math::{LinearFit, bayesian_linear};
use crate::stages::estimation::{Rolled, rolled, support_normal};
use crate::twin::{Finding, Model};

/// Fewest ways that were fitted.
const FEWEST: usize = 2;
/// Scatter of what slows a body from way to way, as a share.
const SCATTER: f64 = 0.05;
/// Standard deviations from none, and log evidence over that of none, nats, from which on it is named.
const CLEAR: f64 = 5.0;
const EVIDENT: f64 = 5.0;
/// Slowing that counts, as a share of what a slope of one would give: a hard ball on a hard table loses hardly less; and where it is told
/// beyond doubt, in standard deviations.
const LEAST: [f64; 2] = [1e-3, 4e-4];
const BEYOND_DOUBT: f64 = 12.0;
/// Largest probability that is stated.
const SUREST: f64 = 0.98;
/// Prior standard deviations: of a constant slowing (m/s²), of one per speed (1/s), and of a slope (rad).
const PRIORS: [f64; 3] = [0.3, 1.0, 0.05];

/// What may slow a body that rolls.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Slows {
    Rolling,
    Viscous,
    Slope,
}

impl Slows {
    const ALL: [Self; 3] = [Self::Rolling, Self::Viscous, Self::Slope];

    fn cause(self) -> &'static str {
        match self {
            Self::Rolling => "rolling-resistance",
            Self::Viscous => "viscous-friction",
            Self::Slope => "support-tilt",
        }
    }

    /// Slowing for each unit of its parameters, m/s², and their prior standard deviations.
    fn row(self, way: &Rolled, plane: &[Vector3<f64>; 2], gravity: f64) -> Vec<(f64, f64)> {
        match self {
            Self::Rolling => vec![(1.0, PRIORS[0])],
            Self::Viscous => vec![(way.speed, PRIORS[1])],
            Self::Slope => plane
                .iter()
                .map(|axis| (gravity / way.inert * axis.dot(&way.heading), PRIORS[2]))
                .collect(),
        }
    }
}

/// What one explanation makes of all ways.
struct Fitted {
    slows: Slows,
    fit: LinearFit,
    /// Over rolling for ever, nats.
    evidence: f64,
    statistic: f64,
}

impl Fitted {
    /// What it makes a body lose of speed a second, m/s².
    fn slowing(&self, way: &Rolled, plane: &[Vector3<f64>; 2], gravity: f64) -> f64 {
        let row = self.slows.row(way, plane, gravity);
        row.iter().zip(self.fit.x.iter()).map(|((a, _), x)| a * x).sum()
    }
}

/// The ways on which bodies rolled freely, as the plain and the extended model foretell them, and the findings.
#[derive(Default)]
pub struct Rolls {
    pub findings: Vec<Finding>,
    pub plain: Vec<Trace>,
    pub full: Vec<Trace>,
}

/// What slows the bodies that roll.
pub fn rolls(capture: &Capture, segmented: &[Segmented], model: &Model) -> Rolls {
    let normal = support_normal(capture, model).into_inner();
    let seed = if normal.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let x = (seed - normal * normal.dot(&seed)).normalize();
    let plane = [x, normal.cross(&x)];
    let gravity = capture.gravity.norm();
    let mut by_link: BTreeMap<String, Vec<Rolled>> = BTreeMap::new();
    for way in rolled(capture, segmented, model) {
        by_link.entry(way.link.clone()).or_default().push(way);
    }
    let mut out = Rolls::default();
    for (link, ways) in by_link {
        let named = named(&ways, &plane, gravity);
        let slowing = |way: &Rolled| named.first().map_or(0.0, |best| best.slowing(way, &plane, gravity));
        out.plain.extend(ways.iter().map(|w| trace(w, &|_| 0.0)));
        out.full.extend(ways.iter().map(|w| trace(w, &slowing)));
        let mass = model.twin.link(&link).and_then(|l| l.mass.as_ref()).map(|m| m.value);
        out.findings.extend(finding(&link, &ways, &named, mass, &slowing));
    }
    out
}

/// The explanations that stand, the likeliest first; empty where nothing slows the body.
fn named(ways: &[Rolled], plane: &[Vector3<f64>; 2], gravity: f64) -> Vec<Fitted> {
    let fitted: Vec<&Rolled> = ways.iter().filter(|w| !w.held_out).collect();
    if fitted.len() < FEWEST {
        return Vec::new();
    }
    let mut all: Vec<Fitted> = Slows::ALL
        .into_iter()
        .filter_map(|s| explain(s, &fitted, plane, gravity))
        .collect();
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let worth = |best: &Fitted| {
        let slowed = fitted
            .iter()
            .map(|w| (best.slowing(w, plane, gravity) * w.inert / gravity).powi(2));
        let sure = best.slows == Slows::Rolling && best.statistic > BEYOND_DOUBT;
        let least = LEAST[usize::from(sure)];
        (slowed.sum::<f64>() / fitted.len() as f64).sqrt() > least
    };
    let clear = all
        .first()
        .is_some_and(|b| b.evidence > EVIDENT && b.statistic > CLEAR && worth(b));
    if clear { all } else { Vec::new() }
}

/// Linear in its parameters: the evidence is exact.
fn explain(slows: Slows, ways: &[&Rolled], plane: &[Vector3<f64>; 2], gravity: f64) -> Option<Fitted> {
    let rows: Vec<Vec<(f64, f64)>> = ways.iter().map(|w| slows.row(w, plane, gravity)).collect();
    let n = rows[0].len();
    let matrix = DMatrix::from_fn(ways.len(), n, |i, j| rows[i][j].0);
    let right = DVector::from_iterator(ways.len(), ways.iter().map(|w| w.slowing.0));
    let doubt = |w: &&Rolled| w.slowing.1.hypot(SCATTER * w.slowing.0);
    let weights = DVector::from_iterator(ways.len(), ways.iter().map(|w| doubt(w).powi(-2)));
    let sds = DVector::from_iterator(n, rows[0].iter().map(|r| r.1));
    let fit = bayesian_linear(&matrix, &right, &weights, &DVector::zeros(n), &sds)?;
    let misfit = |left: &DVector<f64>| left.iter().zip(weights.iter()).map(|(r, w)| r * r * w).sum::<f64>();
    let prior: f64 = fit.x.iter().zip(sds.iter()).map(|(x, s)| (x / s).powi(2)).sum();
    let room = 0.5 * fit.covariance.determinant().max(1e-300).ln() - sds.iter().map(|s| s.ln()).sum::<f64>();
    let away = (fit.x.transpose() * fit.covariance.clone().try_inverse()? * &fit.x)[0];
    Some(Fitted {
        slows,
        evidence: 0.5 * (misfit(&right) - misfit(&fit.residuals) - prior) + room,
        statistic: away.max(0.0).sqrt(),
        fit,
    })
}

/// The error over all ways that count.
fn rms(ways: &[&Rolled], slowing: &dyn Fn(&Rolled) -> f64) -> f64 {
    let errors = |w: &&Rolled| {
        let path = w.foretold(slowing(w));
        let left = path.into_iter().zip(w.way.clone()).filter(|(p, _)| p.is_finite());
        left.map(|(p, m)| (p - m).powi(2)).collect::<Vec<f64>>()
    };
    let all: Vec<f64> = ways.iter().flat_map(errors).collect();
    (all.iter().sum::<f64>() / all.len().max(1) as f64).sqrt()
}

fn finding(
    link: &str,
    ways: &[Rolled],
    named: &[Fitted],
    mass: Option<f64>,
    slowing: &dyn Fn(&Rolled) -> f64,
) -> Option<Finding> {
    let best = named.first()?;
    let total: f64 = named.iter().map(|f| (f.evidence - best.evidence).exp()).sum();
    let odds = |f: &Fitted| ((f.evidence - best.evidence).exp() / total).min(SUREST);
    let rivals: Vec<(&str, f64)> = named[1..]
        .iter()
        .map(|f| (f.slows.cause(), odds(f)))
        .filter(|r| r.1 > 0.02)
        .collect();
    let fitted: Vec<&Rolled> = ways.iter().filter(|w| !w.held_out).collect();
    let held: Vec<&Rolled> = ways.iter().filter(|w| w.held_out).collect();
    let judged = if held.is_empty() { &fitted } else { &held };
    let from: Vec<String> = fitted.iter().map(|w| w.interaction.clone()).collect();
    let way = fitted.first()?;
    let value = best.fit.x[0];
    let sd = |k: usize| best.fit.sd(k).hypot(Rolled::OPEN * best.fit.x[k]);
    let method = "ways on which it rolled freely";
    let measured = |by: f64, unit: &str| Estimate::measured(value * by, sd(0) * by, unit, from.clone(), method);
    let (parameter, words) = match (best.slows, mass) {
        (Slows::Rolling, _) => {
            let words = format!("rolling on, it loses {value:.3} m/s of speed a second, however fast it is");
            (("k_r", measured(way.length, "m")), words)
        }
        (Slows::Viscous, Some(m)) => {
            let words = "rolling on, it loses speed as it has it".to_owned();
            (("b", measured(m * way.inert, "N*s/m")), words)
        }
        (Slows::Viscous, None) => (
            ("rate", measured(1.0, "1/s")),
            "rolling on, it loses speed as it has it".to_owned(),
        ),
        (Slows::Slope, _) => {
            let words = "rolling on, it is slowed one way and hastened the other".to_owned();
            (("tx", measured(1.0, "rad")), words)
        }
    };
    let told = Told {
        cause: best.slows.cause(),
        place: link,
        probability: odds(best),
        rivals: &rivals,
        parameter,
        residual: "way",
        statistic: best.statistic,
        words,
        gain: gain(
            "position",
            "m",
            [rms(judged, &|_| 0.0), rms(judged, slowing)],
            held.iter().map(|w| w.interaction.clone()).collect(),
        ),
    };
    let mut finding = told.finding();
    if best.slows == Slows::Slope {
        let across = Estimate::measured(best.fit.x[1], sd(1), "rad", from, method);
        finding.parameters.insert("ty".into(), across);
    }
    Some(finding)
}

fn trace(way: &Rolled, slowing: &dyn Fn(&Rolled) -> f64) -> Trace {
    Trace {
        interaction: way.interaction.clone(),
        held_out: way.held_out,
        remark: Some("it rolls on as the first third of its way has it".into()),
        curves: vec![Curve {
            label: format!("{}: way on which it rolls freely", way.link),
            quantity: Quantity::Position,
            time: way.time.clone(),
            measured: way.way.clone(),
            predicted: way.foretold(slowing(way)),
            noise: Some(way.noise),
        }],
        ..Trace::default()
    }
}
