//! What tilts tell of friction by the way down: twice a turn it differs where what rubs has a grain, once a turn where the support is not
//! where it is told to be.
//!
//! Every tilt gives its friction (static and kinetic, by the share that each tells); of the ways to go with the heading that which
//! explains most, by its marginal likelihood with the scatter integrated out (Schwarz 1978), is named.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix2};

use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Segmented};
use crate::math::weighted_linear;
use crate::stages::estimation::{SlidDown, slid_down};
use crate::twin::{Finding, Model};

/// Fewest tilts, and how far their headings have to be spread: the least variance of what friction may go with, which is a half where
/// they are all round.
const FEWEST: usize = 8;
const SPREAD: f64 = 0.1;
/// How far a body has to be turned from tilt to tilt for its own grain to be told from the table's, rad.
const TURNED: f64 = 0.3;
/// Log evidence over friction that is the same all round from which on it is named, nats, and the least share of friction.
const NAMED: f64 = 8.0;
const LEAST: f64 = 0.03;
/// Share by which friction is new in every tilt, at least.
const NEW: f64 = 0.01;
/// Largest probability that is stated, and the share of a slope's that is the table's: the rest is gravity's, which is the same data.
const SURE: f64 = 0.95;
const OF_TABLE: f64 = 0.53;
/// Odds below which a rival is not listed.
const NEGLIGIBLE: f64 = 0.02;

/// One tilt: friction over the usual, its heading in the frame of the support and in that of the body, rad.
struct Tilt {
    name: String,
    held_out: bool,
    share: f64,
    sd: f64,
    heading: f64,
    of_body: f64,
}

/// How friction may go with the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    Even,
    Table,
    Body,
    Slope,
}

impl Way {
    fn columns(self, tilt: &Tilt) -> Vec<f64> {
        let of = |angle: f64| vec![1.0, angle.cos(), angle.sin()];
        match self {
            Self::Even => vec![1.0],
            Self::Table => of(2.0 * tilt.heading),
            Self::Body => of(2.0 * tilt.of_body),
            Self::Slope => of(tilt.heading),
        }
    }
}

/// Friction by the heading, fitted.
struct Fitted {
    way: Way,
    values: DVector<f64>,
    sds: Vec<f64>,
    /// Log evidence, nats, but for what all ways share.
    evidence: f64,
}

impl Fitted {
    fn of(way: Way, tilts: &[&Tilt]) -> Option<Self> {
        let rows: Vec<Vec<f64>> = tilts.iter().map(|t| way.columns(t)).collect();
        let (n, p) = (rows.len(), rows.first()?.len());
        if n < p + 2 || !spread(&rows) {
            return None;
        }
        let a = DMatrix::from_fn(n, p, |i, j| rows[i][j]);
        let y = DVector::from_fn(n, |i, _| tilts[i].share);
        let weights = DVector::from_fn(n, |i, _| tilts[i].sd.hypot(NEW).powi(-2));
        let fit = weighted_linear(&a, &y, &weights)?;
        let left = fit.residuals.component_mul(&fit.residuals).dot(&weights);
        let variance = (left / (n - p) as f64).max(1.0);
        let sds = (0..p).map(|k| (variance * fit.covariance[(k, k)]).sqrt()).collect();
        // The scatter may be as small as it is known to be, and no smaller.
        let evidence = -0.5 * n as f64 * (left / n as f64).max(1.0).ln() - 0.5 * p as f64 * (n as f64).ln();
        Some(Self {
            way,
            values: fit.x,
            sds,
            evidence,
        })
    }

    fn foretold(&self, tilt: &Tilt) -> f64 {
        let columns = self.way.columns(tilt);
        columns.iter().zip(self.values.iter()).map(|(c, v)| c * v).sum()
    }
}

/// Whether rows of one and two numbers tell both of these.
fn spread(rows: &[Vec<f64>]) -> bool {
    let n = rows.len() as f64;
    let mean = |k: usize| rows.iter().map(|r| r[k]).sum::<f64>() / n;
    let varies = |a: usize, b: usize| {
        let (ma, mb) = (mean(a), mean(b));
        rows.iter().map(|r| (r[a] - ma) * (r[b] - mb)).sum::<f64>() / n
    };
    rows.first().is_none_or(|r| r.len() < 3) || {
        let own = Matrix2::new(varies(1, 1), varies(1, 2), varies(1, 2), varies(2, 2));
        own.symmetric_eigenvalues().min() > SPREAD
    }
}

/// How friction goes with the way down, where the tilts of a body show it.
pub(super) fn tilt_findings(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    named: &[Finding],
) -> Vec<Finding> {
    let known = ["anisotropic-friction", "support-tilt", "gravity-error"];
    if named.iter().any(|f| known.contains(&f.cause.as_str())) {
        return Vec::new();
    }
    let links = model.twin.links().map(|(_, link)| link.name.as_str());
    let each = links.filter_map(|name| {
        let (usual, all) = tilts(&slid_down(capture, segmented, model, name));
        told((name, usual), &all)
    });
    each.collect()
}

/// The usual friction, and all tilts over it.
fn tilts(slid: &[SlidDown]) -> (f64, Vec<Tilt>) {
    let fitted = || slid.iter().filter(|s| !s.held_out);
    let usual = |of: &dyn Fn(&SlidDown) -> (f64, f64)| {
        let (sum, weight) = fitted().fold((0.0, 0.0), |(s, w), t| {
            let (mu, sd) = of(t);
            (s + mu * sd.powi(-2), w + sd.powi(-2))
        });
        sum / weight
    };
    let [holds, slides] = [usual(&|s| s.static_), usual(&|s| s.kinetic)];
    let one = |s: &SlidDown| {
        let each = [(s.static_, holds), (s.kinetic, slides)].map(|((mu, sd), usual)| (mu / usual, sd / usual));
        let weight: f64 = each.iter().map(|(_, sd)| sd.powi(-2)).sum();
        Tilt {
            name: s.name.clone(),
            held_out: s.held_out,
            share: each.iter().map(|(share, sd)| share * sd.powi(-2)).sum::<f64>() / weight,
            // Both are of one slide.
            sd: each.iter().map(|e| e.1).fold(f64::INFINITY, f64::min),
            heading: s.heading,
            of_body: s.heading - s.turn,
        }
    };
    (0.5 * (holds + slides), slid.iter().map(one).collect())
}

fn told(body: (&str, f64), all: &[Tilt]) -> Option<Finding> {
    let fitted: Vec<&Tilt> = all.iter().filter(|t| !t.held_out).collect();
    if fitted.len() < FEWEST {
        return None;
    }
    let turns = |t: &&Tilt| t.heading - t.of_body;
    let turned = fitted.iter().map(turns).any(|t| {
        let apart = t - turns(&fitted[0]);
        apart.sin().atan2(apart.cos()).abs() > TURNED
    });
    let even = Fitted::of(Way::Even, &fitted)?;
    let ways = [Way::Table, Way::Slope, Way::Body].into_iter();
    let ways = ways.filter(|way| *way != Way::Body || turned);
    let mut all_ways: Vec<Fitted> = ways.filter_map(|way| Fitted::of(way, &fitted)).collect();
    all_ways.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let best = all_ways.first()?;
    let [a, b] = [best.values[1] / best.values[0], best.values[2] / best.values[0]];
    if best.evidence - even.evidence < NAMED || a.hypot(b) < LEAST {
        return None;
    }
    let weight = |f: &Fitted| (f.evidence - best.evidence).exp();
    let whole: f64 = all_ways.iter().map(weight).sum();
    let odds = |slope: bool| {
        let own = all_ways.iter().filter(|f| (f.way == Way::Slope) == slope);
        SURE * own.map(weight).sum::<f64>() / whole
    };
    let causes = [
        ("anisotropic-friction", odds(false)),
        ("support-tilt", OF_TABLE * odds(true)),
        ("gravity-error", (1.0 - OF_TABLE) * odds(true)),
    ];
    Some(finding(body, all, (best, best.evidence - even.evidence), &causes))
}

fn finding(
    (body, usual): (&str, f64),
    all: &[Tilt],
    (best, worth): (&Fitted, f64),
    causes: &[(&'static str, f64)],
) -> Finding {
    let slope = best.way == Way::Slope;
    // What friction seems to hold more on the way up of a slope is the slope, whose tangent it goes with.
    let (times, unit) = if slope {
        (usual / (1.0 + usual * usual), "rad")
    } else {
        (1.0, "1")
    };
    let cause = if slope { "support-tilt" } else { "anisotropic-friction" };
    let own = causes.iter().find(|c| c.0 == cause).map_or(0.0, |c| c.1);
    let rivals: Vec<(&str, f64)> = causes
        .iter()
        .copied()
        .filter(|c| c.0 != cause && c.1 > NEGLIGIBLE)
        .collect();
    let from: Vec<String> = all.iter().filter(|t| !t.held_out).map(|t| t.name.clone()).collect();
    let number = |k: usize| {
        let per = times / best.values[0];
        Estimate::measured(best.values[k] * per, best.sds[k] * per, unit, from.clone(), "tilts")
    };
    let [first, second] = if slope { ["tx", "ty"] } else { ["ac", "as"] };
    let size = best.values[1].hypot(best.values[2]) / best.values[0];
    let words = match best.way {
        Way::Slope => format!(
            "of friction {:.1} % goes with the way down, once a turn: the support leans",
            100.0 * size
        ),
        Way::Body => format!(
            "friction differs by {:.1} % with the direction across {body}",
            200.0 * size
        ),
        _ => format!(
            "friction differs by {:.1} % with the direction across the support",
            200.0 * size
        ),
    };
    let mut finding = Told {
        cause,
        place: if best.way == Way::Body { body } else { "support" },
        probability: own,
        rivals: &rivals,
        parameter: (first, number(1)),
        residual: "friction against the way down",
        statistic: (2.0 * worth).sqrt(),
        words,
        gain: judged(all, best.way),
    }
    .finding();
    finding
        .parameters
        .extend(BTreeMap::from([(second.to_owned(), number(2))]));
    finding
}

/// Error of each tilt's friction, as a share, when it is foretold from the others: all round the same, and by its heading.
fn judged(all: &[Tilt], way: Way) -> crate::twin::Gain {
    let held = all.iter().any(|t| t.held_out);
    let judges = || all.iter().filter(|t| t.held_out || !held);
    let error = |way: Way| {
        let squares: f64 = judges()
            .map(|one| {
                let others: Vec<&Tilt> = all.iter().filter(|t| !t.held_out && t.name != one.name).collect();
                Fitted::of(way, &others).map_or(0.0, |f| (one.share - f.foretold(one)).powi(2))
            })
            .sum();
        (squares / judges().count().max(1) as f64).sqrt()
    };
    let names = all.iter().filter(|t| t.held_out).map(|t| t.name.clone()).collect();
    gain("friction", "1", [error(Way::Even), error(way)], names)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten tilts all round, friction by this share of the usual, that differ by a hundredth besides; the body turned by `turn` each time.
    fn all(share: impl Fn(f64, f64) -> f64, turn: f64) -> Vec<Tilt> {
        let one = |k: u32| {
            let heading = 0.63 * f64::from(k) - 3.0;
            let of_body = heading - turn * f64::from(k);
            let new = 0.008 * (f64::from((k * 7) % 10) / 4.5 - 1.0);
            Tilt {
                name: format!("tilt-{k}"),
                held_out: k == 9,
                share: share(heading, of_body) + new,
                sd: 0.01,
                heading,
                of_body,
            }
        };
        (0..10).map(one).collect()
    }

    #[test]
    fn a_grain_a_lean_and_nothing_are_told_apart() {
        let grain = |angle: f64| 1.0 + 0.15 * (2.0 * angle).cos();
        let table = told(("box", 1.0), &all(|h, _| grain(h), 1.1)).expect("a grain");
        assert_eq!(
            (table.cause.as_str(), table.place.as_str()),
            ("anisotropic-friction", "support")
        );
        assert!((table.parameters["ac"].value - 0.15).abs() < 0.02 && table.gain.reduction > 0.7);
        let body = told(("box", 1.0), &all(|_, b| grain(b), 1.1)).expect("a grain");
        assert_eq!(body.place, "box");
        let leans = told(("box", 1.0), &all(|h, _| 1.0 - 0.1 * h.sin(), 0.0)).expect("a lean");
        assert_eq!((leans.cause.as_str(), leans.alternatives.len()), ("support-tilt", 1));
        assert!((leans.parameters["ty"].value + 0.05).abs() < 0.01);
        assert!(told(("box", 1.0), &all(|_, _| 1.0, 1.1)).is_none());
        // Two headings across each other tell no slope from a grain.
        let across = |k: usize| {
            if k.is_multiple_of(2) {
                0.0
            } else {
                std::f64::consts::FRAC_PI_2
            }
        };
        let two: Vec<Tilt> = (0..)
            .map(across)
            .zip(all(|_, _| 1.0, 0.0))
            .map(|(heading, t)| Tilt {
                heading,
                of_body: heading,
                share: t.share * grain(heading),
                ..t
            })
            .collect();
        assert!(told(("box", 1.0), &two).is_none());
    }
}
