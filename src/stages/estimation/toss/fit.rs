//! The fit of what a toss depends on to all windows together: robust Gauss-Newton, intervals from the scatter between tosses.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::conditions::{Body, Conditions};
use super::local::{Level, Toss, noise_level};
use super::sought::Sought;
use super::windows::{Scene, Simulated, Window, cut, residual, settle, start_columns, unevenness};
use crate::math::median;

/// All windows of a body's tosses.
#[derive(Clone, Debug)]
pub struct Study {
    /// What is thrown.
    pub body: Body,
    /// The tosses.
    pub tosses: Vec<Toss>,
    /// The windows of those that may be used to fit.
    pub windows: Vec<Window>,
    /// Noise of the tracks.
    pub level: Level,
}

/// What became of a fit.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The best conditions.
    pub at: Conditions,
    /// Covariance of what was sought.
    pub covariance: DMatrix<f64>,
    /// Tosses that had a say.
    pub tosses: usize,
    /// Typical misfit of flights, of contacts and of rests, in units of the noise.
    pub misfit: [f64; 3],
}

/// Windows about contacts in all, and in one toss at most.
const WINDOWS: usize = 240;
const EACH: usize = 9;
const ROUNDS: usize = 10;
/// Gain of the objective below which the fit stands, nats.
const ENOUGH: f64 = 0.2;

/// For every flight an orthonormal basis of what its start could explain.
pub type Open = Vec<Option<DMatrix<f64>>>;

/// Residuals of a window with their slopes, what its start explains taken out.
#[derive(Clone, Debug)]
pub struct Row {
    /// How many of its numbers its start explains.
    pub explained: usize,
    /// In units of the noise.
    pub residual: DVector<f64>,
    /// One column for each number that is sought.
    pub slopes: DMatrix<f64>,
}

impl Row {
    fn new(residual: DVector<f64>, slopes: DMatrix<f64>, open: Option<&DMatrix<f64>>) -> Self {
        let Some(q) = open else {
            let explained = 0;
            return Self {
                explained,
                residual,
                slopes,
            };
        };
        Self {
            explained: q.ncols(),
            residual: &residual - q * (q.transpose() * &residual),
            slopes: &slopes - q * (q.transpose() * &slopes),
        }
    }
}

impl Study {
    /// Cuts the tosses into windows; those that were held out too where `held_out` says so.
    pub fn new(body: Body, tosses: Vec<Toss>, at: &Conditions, noise: [Option<f64>; 2], held_out: bool) -> Self {
        let mut level = noise_level(&tosses);
        level.place = noise[0].map_or(level.place, |n| n.max(1e-6));
        level.turn = noise[1].map_or(level.turn, |n| n.max(1e-5));
        level.angle = level.angle.max(level.turn);
        let (thrown, land) = body.thrown(at);
        level.uneven = unevenness(&tosses, &thrown, &land).unwrap_or(level.uneven);
        let windows = Vec::new();
        let mut out = Self {
            body,
            tosses,
            windows,
            level,
        };
        out.cut(at, held_out);
        out
    }

    /// Cuts the windows anew, as a body under these conditions flies and touches.
    pub fn cut(&mut self, at: &Conditions, held_out: bool) {
        let used = self.tosses.iter().filter(|t| !t.held_out).count().max(1);
        let most = (WINDOWS / used).clamp(2, EACH);
        let cut = |(i, toss)| cut(i, toss, &self.body, at, &self.level, most);
        let fitted = self.tosses.iter().enumerate().filter(|(_, t)| held_out || !t.held_out);
        self.windows = fitted.collect::<Vec<_>>().into_par_iter().flat_map_iter(cut).collect();
    }

    /// Fits, cuts the windows as the fit has the body touch, and fits again.
    pub fn fit_twice(&mut self, start: &Conditions, sought: &[Sought]) -> Option<Fitted> {
        let first = self.fit(start, sought)?;
        self.cut(&first.at, false);
        self.fit(&first.at, sought)
    }

    /// Residuals of all windows.
    pub fn residuals(&self, at: &Conditions) -> Vec<Vec<f64>> {
        let by = Simulated::new(&self.body, at, &self.level);
        let one = |w: &Window| residual(w, &self.tosses[w.toss], &by);
        self.windows.par_iter().map(one).collect()
    }

    fn open(&self, at: &Conditions, residuals: &[Vec<f64>]) -> Open {
        let by = Simulated::new(&self.body, at, &self.level);
        let one = |(w, r): (&Window, &Vec<f64>)| {
            let columns = || start_columns(w, &self.tosses[w.toss], &by, r);
            (w.scene == Scene::Flight).then(|| columns().qr().q())
        };
        self.windows.par_iter().zip(residuals).map(one).collect()
    }

    /// Residuals of all windows with their slopes.
    pub fn rows(&self, at: &Conditions, sought: &[Sought]) -> (Vec<Row>, Open) {
        let here = self.residuals(at);
        let open = self.open(at, &here);
        let others: Vec<Vec<Vec<f64>>> = sought
            .iter()
            .map(|s| {
                let mut there = *at;
                (s.set)(&mut there, (s.get)(at) + s.step);
                self.residuals(&there)
            })
            .collect();
        let one = |(w, r): (usize, Vec<f64>)| {
            let slopes = DMatrix::from_fn(r.len(), sought.len(), |i, k| (others[k][w][i] - r[i]) / sought[k].step);
            Row::new(DVector::from_vec(r), slopes, open[w].as_ref())
        };
        (here.into_iter().enumerate().map(one).collect(), open)
    }

    /// The same with slopes that are known from nearby.
    fn again(&self, at: &Conditions, rows: Vec<Row>) -> (Vec<Row>, Open) {
        let here = self.residuals(at);
        let open = self.open(at, &here);
        let each = here.into_iter().zip(rows).zip(&open);
        let rows = each
            .map(|((r, row), q)| Row::new(DVector::from_vec(r), row.slopes, q.as_ref()))
            .collect();
        (rows, open)
    }

    /// Mean square of each window's residuals, what its start explains left out.
    fn squares(&self, at: &Conditions, open: &Open) -> Vec<f64> {
        let all = self.residuals(at);
        let one = |(r, q): (Vec<f64>, &Option<DMatrix<f64>>)| {
            let r = DVector::from_vec(r);
            match q {
                Some(q) => square(&(&r - q * (q.transpose() * &r)), q.ncols()),
                None => square(&r, 0),
            }
        };
        all.into_iter().zip(open).map(one).collect()
    }

    /// Typical mean square of flights, of contacts and of rests.
    fn typical(&self, squares: &[f64]) -> [f64; 3] {
        [Scene::Flight, Scene::Contact, Scene::Rest].map(|scene| {
            let own = squares.iter().zip(&self.windows).filter(|(_, w)| w.scene == scene);
            median(&own.map(|(s, _)| *s).collect::<Vec<f64>>())
                .unwrap_or(1.0)
                .max(0.1)
        })
    }

    /// Cauchy's cost over windows, with the prior.
    fn cost(&self, at: &Conditions, squares: &[f64], typical: [f64; 3], sought: &[Sought]) -> f64 {
        let each = squares.iter().zip(&self.windows).map(|(s, w)| {
            let scale = typical[w.scene as usize];
            0.5 * dof(w) * (1.0 + s / scale).ln()
        });
        let prior = sought
            .iter()
            .map(|s| 0.5 * (((s.get)(at) - s.prior.0) / s.prior.1).powi(2));
        each.sum::<f64>() + prior.sum::<f64>()
    }

    /// Flights start where they fit best.
    pub fn settle(&mut self, at: &Conditions) {
        let by = Simulated::new(&self.body, at, &self.level);
        let tosses = &self.tosses;
        let flights = self.windows.par_iter_mut().filter(|w| w.scene == Scene::Flight);
        flights.for_each(|w| settle(w, &tosses[w.toss], &by));
    }

    /// Fits what is sought from `start`; nothing where no toss has a window.
    pub fn fit(&mut self, start: &Conditions, sought: &[Sought]) -> Option<Fitted> {
        if self.windows.is_empty() {
            return None;
        }
        let mut at = *start;
        let mut last = None;
        let mut slopes: Option<Vec<Row>> = None;
        for round in 0..ROUNDS {
            self.settle(&at);
            // Windows are short: slopes hold for a few steps.
            let (rows, open) = match slopes.take().filter(|_| round % 3 != 0) {
                Some(known) if round > 1 => self.again(&at, known),
                _ => self.rows(&at, sought),
            };
            let squares: Vec<f64> = rows.iter().map(|r| square(&r.residual, r.explained)).collect();
            let typical = self.typical(&squares);
            let normal = self.normal(&rows, &squares, typical, &at, sought);
            let inverse = nalgebra::Cholesky::new(normal.information.clone())?.inverse();
            let step = &inverse * &normal.gradient;
            last = Some((normal, inverse, typical));
            let before = self.cost(&at, &squares, typical, sought);
            let mut gained = 0.0;
            for share in [1.0, 0.4, 0.15] {
                let mut tried = at;
                for (k, s) in sought.iter().enumerate() {
                    (s.set)(&mut tried, ((s.get)(&at) + share * step[k]).clamp(s.range.0, s.range.1));
                }
                let cost = self.cost(&tried, &self.squares(&tried, &open), typical, sought);
                if cost < before {
                    (gained, at) = (before - cost, tried);
                    break;
                }
            }
            slopes = Some(rows);
            if gained < ENOUGH {
                break;
            }
        }
        let (normal, inverse, typical) = last?;
        Some(Fitted {
            at,
            covariance: normal.spread(&inverse),
            tosses: normal.gradients.len(),
            misfit: typical.map(f64::sqrt),
        })
    }

    fn normal(&self, rows: &[Row], squares: &[f64], typical: [f64; 3], at: &Conditions, sought: &[Sought]) -> Normal {
        let m = sought.len();
        let mut information = DMatrix::zeros(m, m);
        let mut gradients: Vec<(usize, DVector<f64>)> = Vec::new();
        for ((row, square), window) in rows.iter().zip(squares).zip(&self.windows) {
            let scale = typical[window.scene as usize];
            let weight = dof(window) / row.residual.len().max(1) as f64 / (scale + square);
            information += row.slopes.transpose() * &row.slopes * weight;
            let own = row.slopes.transpose() * &row.residual * (-weight);
            match gradients.last_mut().filter(|(toss, _)| *toss == window.toss) {
                Some((_, sum)) => *sum += own,
                None => gradients.push((window.toss, own)),
            }
        }
        let mut gradient: DVector<f64> = DVector::zeros(m);
        for (_, own) in &gradients {
            gradient += own;
        }
        for (k, s) in sought.iter().enumerate() {
            information[(k, k)] += s.prior.1.powi(-2);
            gradient[k] -= ((s.get)(at) - s.prior.0) / s.prior.1.powi(2);
        }
        Normal {
            information,
            gradient,
            gradients: gradients.into_iter().map(|g| g.1).collect(),
        }
    }
}

/// Mean square of residuals of which a start explains some.
fn square(residual: &DVector<f64>, explained: usize) -> f64 {
    residual.norm_squared() / residual.len().saturating_sub(explained).max(1) as f64
}

/// How many independent numbers a window stands for: a flight a tenth of its rows' (errors of tracking last), a contact
/// the six of its outcome, a rest its height.
fn dof(window: &Window) -> f64 {
    match window.scene {
        Scene::Flight => 0.6 * (window.to - window.from) as f64,
        Scene::Contact => 6.0,
        Scene::Rest => 1.0,
    }
}

struct Normal {
    information: DMatrix<f64>,
    gradient: DVector<f64>,
    /// By toss.
    gradients: Vec<DVector<f64>>,
}

impl Normal {
    /// Sandwich over tosses (Huber 1967; White 1982) about the posterior: windows of one toss share its errors, and the
    /// model is not exact. Never tighter than the curvature says.
    fn spread(&self, inverse: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.gradients.len() as f64;
        let m = self.gradient.len();
        let mut meat = DMatrix::zeros(m, m);
        let mean = self.gradients.iter().sum::<DVector<f64>>() / n;
        for g in &self.gradients {
            let off = g - &mean;
            meat += &off * off.transpose();
        }
        let sandwich = inverse * meat * inverse * (n / (n - 1.0).max(1.0));
        let mut out = sandwich.clone();
        for k in 0..m {
            let least = inverse[(k, k)];
            if out[(k, k)] < least {
                let grow = (least / out[(k, k)].max(1e-300)).sqrt();
                for j in 0..m {
                    out[(k, j)] *= grow;
                    out[(j, k)] *= grow;
                }
            }
        }
        out
    }
}
