//! Residuals laid out against a covariate, and the part of it where they stand out.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::Quantity;
use super::contrast::{Basis, Cell, Contrast, contrast, trend, trend_within};
use super::family::{Covariate, Family};
use super::fit::Fit;
use super::held_out::left;
use super::marginal::{Point, predict, weights};
use super::profile::Profiled;
use super::shows_in::{Cut, DIRECTION, FORETOLD, RATE, View};
use crate::math::quantile;

/// Values of an interaction by which a covariate is cut: long interactions do not decide where alone.
const EACH: usize = 16;
/// Shares of these values at which ends are cut off.
const ENDS: [f64; 6] = [0.08, 0.2, 0.35, 0.5, 0.65, 0.8];
/// Stretches between neighbouring cuts, and the most of them that one place has.
const STRETCHES: usize = 8;
const LONGEST: usize = 4;
/// Steps along a covariate by which a trend is told.
const STEPS: usize = 6;
/// Sectors of an angle by which a wave is told.
const SECTORS: usize = 16;

/// One interaction laid out against a covariate.
pub struct Laid {
    /// The covariate by sample, not a number where it is not defined.
    pub at: Vec<f64>,
    /// What the residual is multiplied by: the direction of the motion where it is taken along that, else 1.
    pub sign: Vec<f64>,
    /// That direction where it is not taken out of the residual, else 0.
    direction: Vec<i8>,
}

/// The part of a covariate that stands out most.
pub struct Found {
    pub part: [f64; 2],
    pub contrast: Contrast,
    /// With all parts that were tried.
    pub p_value: f64,
}

/// What a model leaves of one kind of channel, by interaction and sample.
pub struct Residuals<'a> {
    family: &'a dyn Family,
    pub quantity: Quantity,
    /// Not a number for samples of other kinds.
    left: Vec<Vec<f64>>,
    weights: Vec<Vec<f64>>,
    foretold: Vec<Vec<f64>>,
}

impl<'a> Residuals<'a> {
    pub fn of(family: &'a dyn Family, fit: &Fit, kind: usize, anew: bool) -> Self {
        let groups = 0..family.groups().len();
        let point = Point {
            laws: &fit.laws,
            theta: &fit.theta,
        };
        let none = vec![0.0; family.scatter().len()];
        let one = |g: usize| {
            let channels = family.groups()[g].channels.iter();
            let own = channels.flat_map(|c| std::iter::repeat_n(c.kind == kind, c.measured.len()));
            let rows = left(family, fit, g, anew).into_iter().zip(own);
            rows.map(|(e, own)| if own { e } else { f64::NAN }).collect()
        };
        Self {
            family,
            quantity: family.kinds().get(kind).map_or(Quantity::Force, |k| k.quantity),
            left: groups.clone().map(one).collect(),
            weights: groups.clone().map(|g| weights(family, g)).collect(),
            foretold: groups.map(|g| predict(family, g, &point, &none)).collect(),
        }
    }

    /// The covariates of an interaction, with those that are made for profiles alone.
    fn covariates(&self, group: usize, law: Option<(usize, &[f64])>) -> Vec<Covariate> {
        let size = self.foretold[group].iter().map(|f| f.abs()).collect();
        let mut all = self.family.covariates(group);
        all.extend(self.family.besides(group));
        all.extend(self.family.only_shown(group, law));
        all.push((FORETOLD, self.quantity.unit(), size));
        all
    }

    /// Residuals against one covariate; nothing where the family does not have it.
    pub fn profiled(&self, view: View, law: Option<(usize, &[f64])>) -> Option<Profiled> {
        let mut unit = "";
        let mut laid = Vec::new();
        for g in 0..self.family.groups().len() {
            let all = self.covariates(g, law);
            let of = |name: &str| all.iter().find(|c| c.0 == name);
            let own = of(view.covariate)?;
            unit = own.1;
            let direction: Vec<i8> = match of(DIRECTION).or_else(|| of(RATE)) {
                Some(towards) => towards.2.iter().map(|v| signum(*v)).collect(),
                None => vec![0; own.2.len()],
            };
            let sign = direction.iter().map(|d| if view.along { f64::from(*d) } else { 1.0 });
            let taken = view.along || view.covariate == RATE;
            let folded = |v: &f64| match view.cut {
                // From half a sector before nought on: what stands out at nought is no end of it.
                Cut::Sector(period) => (v + period / 8.0).rem_euclid(period) - period / 8.0,
                _ => *v,
            };
            laid.push(Laid {
                at: own.2.iter().map(folded).collect(),
                sign: sign.collect(),
                direction: if taken { vec![0; own.2.len()] } else { direction },
            });
        }
        let found = self.found(view, &laid, unit);
        Some(Profiled {
            view,
            unit,
            laid,
            found,
        })
    }

    /// The part that stands out most, as surely as it does by itself or as residuals go with the covariate at all.
    fn found(&self, view: View, laid: &[Laid], unit: &str) -> Option<Found> {
        let all = spaced(laid);
        let parts = parts(view, &all, unit);
        let tries = parts.len() as f64;
        let contrasted = |part: [f64; 2]| {
            let side = |at: f64| usize::from((part[0]..part[1]).contains(&at));
            Some((part, contrast(&self.cells(laid, &side, &[0.0, 1.0]))?))
        };
        let each: Vec<([f64; 2], Contrast)> = parts.into_iter().filter_map(contrasted).collect();
        let surest = each.iter().map(|(_, c)| c.p_value).fold(1.0, f64::min);
        let alone = tries * surest;
        // Of what grows along all of a covariate most is said by a cut between where it is too low and where it is too high.
        let told = |c: &Contrast| match view.cut {
            Cut::Ends => usize::from(c.inside.differs()) + usize::from(c.outside.differs()),
            _ => 0,
        };
        let order = |a: &Contrast, b: &Contrast| told(b).cmp(&told(a)).then(a.p_value.total_cmp(&b.p_value));
        let (part, contrast) = each.into_iter().min_by(|a, b| order(&a.1, &b.1))?;
        let p_value = match view.cut {
            Cut::Sector(period) => 2.0 * alone.min(self.wave(laid, period)),
            Cut::Ends => 2.0 * alone.min(self.trend(laid, &all, Basis::Line)),
            Cut::Stretch => 2.0 * alone.min(self.trend(laid, &all, Basis::Bow)),
        };
        Some(Found {
            part,
            contrast,
            p_value: p_value.min(1.0),
        })
    }

    /// The chance of such a trend along a covariate's values, along their ranks, or within interactions, all tried.
    fn trend(&self, laid: &[Laid], all: &[f64], basis: Basis) -> f64 {
        let edge = |k: usize| quantile(all, k as f64 / STEPS as f64);
        let edges: Vec<f64> = (1..STEPS).filter_map(edge).collect();
        let step = |at: f64| edges.iter().filter(|e| at >= **e).count();
        let (Some(low), Some(high)) = (quantile(all, 0.02), quantile(all, 0.98)) else {
            return 1.0;
        };
        let rank = |k: usize| 2.0 * k as f64 / (STEPS as f64 - 1.0) - 1.0;
        let middle = |k: usize| {
            let own: Vec<f64> = all.iter().copied().filter(|v| step(*v) == k).collect();
            let middle = quantile(&own, 0.5).unwrap_or(low).clamp(low, high);
            2.0 * (middle - low) / (high - low).max(1e-12) - 1.0
        };
        let ranks: Vec<f64> = (0..STEPS).map(rank).collect();
        let middles: Vec<f64> = (0..STEPS).map(middle).collect();
        let ranked = self.cells(laid, &step, &ranks);
        let within = (basis == Basis::Line).then(|| trend_within(&ranked)).flatten();
        let along = [ranked, self.cells(laid, &step, &middles)].map(|cells| trend(&cells, basis));
        let each = along.into_iter().chain([within]);
        3.0 * each.flatten().fold(1.0, f64::min)
    }

    /// The chance of such a wave over an angle that comes round after `period`.
    fn wave(&self, laid: &[Laid], period: f64) -> f64 {
        let side = |at: f64| (at.rem_euclid(period) / period * SECTORS as f64) as usize % SECTORS;
        let middle = |k: usize| (k as f64 + 0.5) / SECTORS as f64 * 2.0 * PI;
        let middles: Vec<f64> = (0..SECTORS).map(middle).collect();
        trend(&self.cells(laid, &side, &middles), Basis::Wave).unwrap_or(1.0)
    }

    /// Means of each interaction in each direction on each side of a covariate, which stand at `sides`.
    fn cells(&self, laid: &[Laid], side: &dyn Fn(f64) -> usize, sides: &[f64]) -> Vec<Cell> {
        let mut cells = Vec::new();
        for (group, laid) in laid.iter().enumerate() {
            let mut sums: BTreeMap<(usize, i8), (f64, f64)> = BTreeMap::new();
            let rows = self.left[group].iter().zip(&self.weights[group]).zip(&laid.at);
            for (i, ((left, w), at)) in rows.enumerate() {
                if left.is_finite() && at.is_finite() {
                    let sum = sums.entry((side(*at), laid.direction[i])).or_default();
                    *sum = (sum.0 + w * w * left * laid.sign[i], sum.1 + w * w);
                }
            }
            for ((side, direction), (sum, total)) in sums.into_iter().filter(|(_, s)| s.1 > 0.0) {
                cells.push(Cell {
                    group,
                    at: sides[side],
                    direction: 0.5 * f64::from(direction),
                    mean: sum / total,
                    // Samples of one stretch err alike: many of them are not worth many times one.
                    weight: total / (total + 2.0),
                });
            }
        }
        cells
    }
}

fn signum(v: f64) -> i8 {
    i8::from(v > 0.0) - i8::from(v < 0.0)
}

/// As many values of a covariate of each interaction.
fn spaced(laid: &[Laid]) -> Vec<f64> {
    let mut all: Vec<f64> = Vec::new();
    for one in laid {
        let known: Vec<f64> = one.at.iter().copied().filter(|v| v.is_finite()).collect();
        all.extend((0..EACH).filter_map(|k| quantile(&known, (k as f64 + 0.5) / EACH as f64)));
    }
    all
}

/// The parts of a covariate that are tried. Round numbers are easier to keep in mind, and no worse to cut at.
fn parts(view: View, all: &[f64], unit: &str) -> Vec<[f64; 2]> {
    let at = |share: f64| quantile(all, share).map(|v| rounded(v, unit));
    let (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
    match view.cut {
        Cut::Ends => {
            let mut cuts: Vec<f64> = ENDS.iter().filter_map(|s| at(*s)).collect();
            cuts.dedup();
            cuts.into_iter().map(|c| [c, high]).collect()
        }
        Cut::Stretch => {
            let inner = (1..STRETCHES).filter_map(|k| at(k as f64 / STRETCHES as f64));
            let mut cuts: Vec<f64> = std::iter::once(low).chain(inner).collect();
            cuts.push(high);
            cuts.dedup();
            let from = (0..cuts.len()).flat_map(|i| (1..=LONGEST).map(move |n| (i, i + n)));
            let within = from.filter(|(_, j)| *j < cuts.len());
            within.map(|(i, j)| [cuts[i], cuts[j]]).collect()
        }
        Cut::Sector(period) => {
            let start = |k: usize| (k as f64 - 0.5) * period / 4.0;
            let quarters = (0..4).map(|k| [start(k), start(k + 1)]);
            let halves = (0..3).map(|k| [start(k), start(k + 2)]);
            quarters.chain(halves).collect()
        }
    }
}

/// Two digits, in degrees where it is an angle.
fn rounded(value: f64, unit: &str) -> f64 {
    let factor = if unit.starts_with("rad") { 180.0 / PI } else { 1.0 };
    let shown = factor * value;
    if shown == 0.0 || !shown.is_finite() {
        return value;
    }
    let step = 10f64.powf(shown.abs().log10().floor() - 1.0);
    (shown / step).round() * step / factor
}
