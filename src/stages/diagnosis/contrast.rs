//! How far residuals differ between two parts of what was done, where those of one interaction err together.

use std::collections::BTreeSet;

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::math::{t_quantile, t_tail};

/// Mean residual of one interaction over a part of a covariate, in one direction of its motion.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    pub group: usize,
    /// 1 inside and 0 outside of a part, where on the covariate, from −1 to 1, or an angle, rad.
    pub at: f64,
    /// ½ or −½ by the direction of the motion, 0 where that is taken out of the residual already.
    pub direction: f64,
    pub mean: f64,
    /// How well it is known beside the others, 0 to 1.
    pub weight: f64,
}

/// A mean with its 95 % interval.
#[derive(Clone, Copy, Debug)]
pub struct Banded {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

impl Banded {
    /// Whether it is beyond doubt which sign it has.
    pub fn differs(&self) -> bool {
        self.low > 0.0 || self.high < 0.0
    }
}

/// Residuals inside and outside of a part, and how surely they differ.
#[derive(Clone, Copy, Debug)]
pub struct Contrast {
    pub inside: Banded,
    pub outside: Banded,
    pub t: f64,
    pub p_value: f64,
}

/// How residuals may go with a covariate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Basis {
    Line,
    /// A line that may bend.
    Bow,
    /// Once up and down over a turn.
    Wave,
}

impl Basis {
    fn count(self) -> usize {
        if self == Self::Line { 1 } else { 2 }
    }

    /// Its functions.
    fn at(self, at: f64) -> [f64; 2] {
        match self {
            Self::Line | Self::Bow => [at, at * at],
            Self::Wave => [at.cos(), at.sin()],
        }
    }
}

/// Interactions that either side needs at least, and those that a trend needs.
const FEWEST: usize = 3;
const TRENDS: usize = 5;
/// Variance of an interaction's level over that of one of its means, of which the likeliest is taken.
const RATIOS: [f64; 6] = [0.0, 0.3, 1.0, 3.0, 10.0, 30.0];

/// How far residuals inside of a part differ from those outside.
pub fn contrast(cells: &[Cell]) -> Option<Contrast> {
    let count = |inside: bool| {
        let own = cells.iter().filter(move |c| (c.at > 0.5) == inside);
        own.map(|c| c.group).collect::<BTreeSet<usize>>().len()
    };
    let (within, without) = (count(true), count(false));
    let fewer = within.min(without);
    if fewer < FEWEST {
        return None;
    }
    let Jackknifed { beta, each } = jackknifed(cells, Basis::Line)?;
    let banded = |of: &dyn Fn(&DVector<f64>) -> f64, interactions: usize| {
        let (value, reach) = (of(&beta), t_quantile(0.975, interactions as f64 - 1.0));
        let error = spread(&each, of);
        Banded {
            value,
            low: value - reach * error,
            high: value + reach * error,
        }
    };
    let t = beta[1] / spread(&each, &|b| b[1]).max(1e-12);
    // Interactions on the scarcer side are what the spread is known by.
    let degrees = fewer as f64 - 1.0;
    Some(Contrast {
        inside: banded(&|b| b[0] + b[1], within),
        outside: banded(&|b| b[0], without),
        t,
        p_value: (2.0 * t_tail(t.abs(), degrees)).min(1.0),
    })
}

/// The chance of residuals that go with a covariate so much.
pub fn trend(cells: &[Cell], basis: Basis) -> Option<f64> {
    let Jackknifed { beta, each } = jackknifed(cells, basis)?;
    let n = each.len() as f64;
    if each.len() < TRENDS {
        return None;
    }
    let t = beta[1] / spread(&each, &|b| b[1]).max(1e-12);
    if basis == Basis::Line {
        return Some((2.0 * t_tail(t.abs(), n - 2.0)).min(1.0));
    }
    // Hotelling's test of both numbers; the tail of F with two degrees over d is a power.
    let mean = each.iter().sum::<DVector<f64>>() / n;
    let covariance = DMatrix::from_fn(2, 2, |i, j| {
        let sum: f64 = each
            .iter()
            .map(|b| (b[i + 1] - mean[i + 1]) * (b[j + 1] - mean[j + 1]))
            .sum();
        (n - 1.0) / n * sum
    });
    let both = beta.rows(1, 2).into_owned();
    let square = both.dot(&Cholesky::new(covariance)?.solve(&both));
    let degrees = n - 3.0;
    let ratio = square * degrees / (2.0 * (n - 1.0));
    Some((1.0 + 2.0 * ratio / degrees).powf(-0.5 * degrees))
}

/// Correlation beyond which its spread between interactions is not believed to be smaller than this.
const EVEN: f64 = 0.1;

/// The chance that residuals within interactions go with a covariate so alike in all of them, whatever the interactions
/// differ in: correlations do not depend on how large the effect is in each.
pub fn trend_within(cells: &[Cell]) -> Option<f64> {
    let groups: BTreeSet<usize> = cells.iter().map(|c| c.group).collect();
    let own = |g: &usize| {
        let own: Vec<&Cell> = cells.iter().filter(|c| c.group == *g).collect();
        correlation(&own)
    };
    let each: Vec<f64> = groups.iter().filter_map(own).collect();
    let n = each.len() as f64;
    if each.len() < TRENDS {
        return None;
    }
    let mean = each.iter().sum::<f64>() / n;
    let spread = (each.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let t = mean / (spread.max(EVEN) / n.sqrt());
    Some((2.0 * t_tail(t.abs(), n - 1.0)).min(1.0))
}

/// Correlation of means with the covariate within each direction of one interaction; nothing where either hardly varies.
fn correlation(own: &[&Cell]) -> Option<f64> {
    let (mut xx, mut xy, mut yy, mut steps) = (0.0, 0.0, 0.0, 0);
    for side in [-1, 0, 1] {
        let row: Vec<&&Cell> = own
            .iter()
            .filter(|c| (2.0 * c.direction).round() as i32 == side)
            .collect();
        let total: f64 = row.iter().map(|c| c.weight).sum();
        let mean = |of: &dyn Fn(&Cell) -> f64| row.iter().map(|c| c.weight * of(c)).sum::<f64>() / total.max(1e-12);
        let (mx, my) = (mean(&|c| c.at), mean(&|c| c.mean));
        for c in &row {
            xx += c.weight * (c.at - mx).powi(2);
            xy += c.weight * (c.at - mx) * (c.mean - my);
            yy += c.weight * (c.mean - my).powi(2);
        }
        steps = steps.max(row.len());
    }
    (steps >= FEWEST && xx > 1e-12 && yy > 0.0).then(|| xy / (xx * yy).sqrt())
}

/// Numbers of all interactions, and with each of them left out.
struct Jackknifed {
    beta: DVector<f64>,
    each: Vec<DVector<f64>>,
}

/// A fit with a level of its own in every interaction, and again without one interaction at a time.
///
/// The ratio of variances decides only how well cells are weighed against each other: the jackknife over interactions holds
/// whatever it is, also where an interaction's samples err together in a way that the model does not have.
fn jackknifed(cells: &[Cell], basis: Basis) -> Option<Jackknifed> {
    let all: Vec<usize> = cells
        .iter()
        .map(|c| c.group)
        .collect::<BTreeSet<usize>>()
        .into_iter()
        .collect();
    let fits = RATIOS
        .iter()
        .filter_map(|r| Some((*r, fitted(cells, &all, basis, *r)?)));
    let (ratio, whole) = fits.max_by(|a, b| a.1.log_likelihood.total_cmp(&b.1.log_likelihood))?;
    let without = |g: &usize| {
        let rest: Vec<usize> = all.iter().copied().filter(|o| o != g).collect();
        Some(fitted(cells, &rest, basis, ratio)?.beta)
    };
    let each: Option<Vec<DVector<f64>>> = all.iter().map(without).collect();
    Some(Jackknifed {
        beta: whole.beta,
        each: each?,
    })
}

/// Standard deviation of a number by leaving out one interaction at a time.
fn spread(each: &[DVector<f64>], of: &dyn Fn(&DVector<f64>) -> f64) -> f64 {
    let n = each.len() as f64;
    let mean = each.iter().map(of).sum::<f64>() / n;
    let sum: f64 = each.iter().map(|b| (of(b) - mean).powi(2)).sum();
    ((n - 1.0) / n * sum).sqrt()
}

/// Level, functions of the covariate, and what the direction adds.
struct Fitted {
    beta: DVector<f64>,
    log_likelihood: f64,
}

fn fitted(cells: &[Cell], groups: &[usize], basis: Basis, ratio: f64) -> Option<Fitted> {
    let both = [-1.0, 1.0].iter().all(|s| cells.iter().any(|c| c.direction * s > 0.0));
    let (order, p) = (basis.count(), basis.count() + if both { 2 } else { 1 });
    let row = |c: &Cell| {
        DVector::from_fn(p, |k, _| match k {
            0 => 1.0,
            k if k <= order => basis.at(c.at)[k - 1],
            _ => c.direction,
        })
    };
    let (mut h, mut b) = (DMatrix::zeros(p, p), DVector::zeros(p));
    let (mut yy, mut log_det, mut count) = (0.0, 0.0, 0.0);
    for g in groups {
        let own: Vec<&Cell> = cells.iter().filter(|c| c.group == *g).collect();
        let total: f64 = own.iter().map(|c| c.weight).sum();
        // The inverse of a diagonal with a level in common (Sherman and Morrison).
        let shared = ratio / (1.0 + ratio * total);
        let (mut sx, mut sy) = (DVector::zeros(p), 0.0);
        for c in &own {
            let x = row(c);
            h += &x * x.transpose() * c.weight;
            b += &x * (c.weight * c.mean);
            yy += c.weight * c.mean * c.mean;
            sx += &x * c.weight;
            sy += c.weight * c.mean;
            log_det -= c.weight.ln();
        }
        h -= &sx * sx.transpose() * shared;
        b -= &sx * (shared * sy);
        yy -= shared * sy * sy;
        log_det += (1.0 + ratio * total).ln();
        count += own.len() as f64;
    }
    let beta = Cholesky::new(h)?.solve(&b);
    let square = (yy - beta.dot(&b)).max(1e-300) / count;
    beta.iter().all(|x| x.is_finite()).then(|| Fitted {
        log_likelihood: -0.5 * (count * square.ln() + log_det),
        beta,
    })
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;
    use crate::base::{Seed, rng_for};

    /// Means of interactions to and fro, each with a level of its own, of which the inside is off by `step`.
    fn cells(step: f64, level: f64, seed: u64) -> Vec<Cell> {
        let mut dice = rng_for(Seed(seed), "contrast");
        let mut free = move || (0..12).map(|_| dice.random_range(-0.5..0.5)).sum::<f64>();
        let mut all = Vec::new();
        for group in 0..8 {
            let own = level * free();
            for (at, direction) in [(0.0, -0.5), (0.0, 0.5), (1.0, -0.5), (1.0, 0.5)] {
                let mean = own + 3.0 * direction + at * step + 0.1 * free();
                all.push(Cell {
                    group,
                    at,
                    direction,
                    mean,
                    weight: 1.0,
                });
            }
        }
        all
    }

    /// Means along a covariate that rise by `step` each, the more the later the interaction.
    fn rows(step: f64, seed: u64) -> Vec<Cell> {
        let mut dice = rng_for(Seed(seed), "rows");
        let mut cell = |group: usize, k: usize| Cell {
            group,
            at: k as f64,
            direction: 0.0,
            mean: step * (group + 1) as f64 * k as f64 + dice.random_range(-0.2..0.2),
            weight: 1.0,
        };
        (0..8)
            .flat_map(|g| (0..5).map(move |k| (g, k)))
            .map(|(g, k)| cell(g, k))
            .collect()
    }

    #[test]
    fn what_interactions_differ_in_does_not_hide_what_each_of_them_shows() {
        let told = contrast(&cells(0.3, 1.0, 5)).expect("enough interactions");
        assert!(told.p_value < 1e-3, "{told:?}");
        assert!((told.inside.value - told.outside.value - 0.3).abs() < 0.1, "{told:?}");
    }

    #[test]
    fn chance_is_not_called_significant_more_often_than_it_says() {
        let all = || (0..200).map(|seed| cells(0.0, 1.0, seed));
        let apart = all().filter(|c| contrast(c).is_some_and(|c| c.p_value < 0.05)).count();
        let goes = all()
            .filter(|c| trend(c, Basis::Line).is_some_and(|p| p < 0.05))
            .count();
        assert!(
            (2..=20).contains(&apart) && (2..=20).contains(&goes),
            "{apart} and {goes} of 200"
        );
    }

    #[test]
    fn what_rises_within_all_interactions_is_told_however_unlike_they_are() {
        let found = (0..200).filter(|seed| trend_within(&rows(0.0, *seed)).is_some_and(|p| p < 0.05));
        let count = found.count();
        assert!((1..=20).contains(&count), "{count} of 200");
        assert!(trend_within(&rows(0.2, 5)).is_some_and(|p| p < 1e-4));
    }

    #[test]
    fn two_interactions_on_a_side_tell_nothing() {
        let few: Vec<Cell> = cells(0.3, 0.0, 5)
            .into_iter()
            .filter(|c| c.at < 0.5 || c.group < 2)
            .collect();
        assert!(contrast(&few).is_none());
    }

    /// A line and a bow along a covariate, each interaction with a level of its own.
    #[test]
    fn a_bow_is_no_line_and_goes_with_the_covariate_all_the_same() {
        let mut cells = Vec::new();
        for group in 0..8 {
            for k in 0..5 {
                let at = 0.5 * f64::from(k) - 1.0;
                let wobble = 0.05 * f64::from((7 * k + 3 * group as i32) % 5 - 2);
                cells.push(Cell {
                    group,
                    at,
                    direction: 0.0,
                    mean: 0.2 * group as f64 + at * at + wobble,
                    weight: 1.0,
                });
            }
        }
        let [line, bow] = [Basis::Line, Basis::Bow].map(|basis| trend(&cells, basis).expect("enough interactions"));
        assert!(line > 0.01 && bow < 1e-6, "{line} {bow}");
    }
}
