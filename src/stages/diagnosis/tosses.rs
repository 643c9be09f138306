//! Tosses as the ladder of laws sees them: flights, short windows about contacts, and where the body came to lie.
//!
//! The windows are so short that what is measured is linear in all that is sought: each number has its column, simulated
//! once at the conditions of the twin, and every law is a combination of them.

use std::collections::BTreeMap;

use super::family::{Active, Channel, ChannelKind, Family, Group, Scatter, Sheet};
use super::fit::Fit;
use super::named::head_start;
use super::toss_laws::{IMPACT, TossLaw, base, movable, toss_laws};
use super::{Quantity, Trace};
use crate::capture::Capture;
use crate::math::{median, t_tail};
use crate::stages::estimation::{Conditions, Sought, Subject, TossRow, TossScene, conditions_of, tossed_subjects};
use crate::twin::{Evidence, Model};

/// Kinds of channels: place and turn in flight, place and turn about contacts, height and slope at rest.
const KINDS: usize = 6;
const REST: usize = 4;
/// Windows whose mean square is worse than the typical one by this factor count less: something happened there that no
/// law is about.
const ODD: f64 = 4.0;

/// What differs from toss to toss: name of the number, spread before the data are seen, its floor.
const SCATTER: [(&str, f64, f64); 7] = [
    ("gravity", 5e-3, 5e-4),
    ("gravity-tilt-x", 5e-3, 5e-4),
    ("gravity-tilt-y", 5e-3, 5e-4),
    ("friction", 0.02, 4e-3),
    ("restitution", 0.05, 0.01),
    ("lying", 2e-4, 3e-5),
    ("rise", 3e-4, 5e-5),
];

/// All tosses of one body.
pub struct Tosses {
    /// What is thrown.
    pub subject: Subject,
    sheet: Sheet,
    laws: Vec<TossLaw>,
    sought: Vec<Sought>,
    /// The conditions at which the columns were simulated.
    at: Conditions,
    /// By group, then by number: all channels one after the other.
    columns: Vec<Vec<Vec<f64>>>,
}

/// Tosses of every body that is thrown.
pub fn of_all_bodies(capture: &Capture, model: &Model) -> Vec<Tosses> {
    let all = tossed_subjects(capture, model, true);
    all.into_iter().filter_map(|s| Tosses::new(s, model)).collect()
}

/// Samples of one group while they are gathered.
#[derive(Default)]
struct Gathered {
    channels: [Option<Channel>; KINDS],
    columns: [Vec<Vec<f64>>; KINDS],
}

impl Tosses {
    fn new(subject: Subject, model: &Model) -> Option<Self> {
        let at = conditions_of(&model.twin, &subject);
        let sought = movable(subject.second.is_some());
        let mut subject = subject;
        subject.study.cut(&at, true);
        subject.study.settle(&at);
        let (rows, _) = subject.study.rows(&at, &sought);
        let joint = subject.second.as_ref().map(|s| s.1.clone());
        let laws = toss_laws(&subject.root, joint.as_deref(), subject.carved);
        let level = subject.study.level;
        let kind = |quantity, sigma| ChannelKind {
            quantity,
            sigma,
            jitter: 0.0,
        };
        let sheet = Sheet {
            groups: Vec::new(),
            kinds: vec![
                kind(Quantity::Flight, level.place),
                kind(Quantity::Rotation, level.turn),
                kind(Quantity::Position, level.place),
                kind(Quantity::Rotation, level.turn),
                kind(Quantity::Position, level.place.max(5e-5)),
                kind(Quantity::Rotation, level.turn),
            ],
            base: base(joint.is_some(), subject.carved),
            scatter: SCATTER.map(scatter).to_vec(),
            laws: laws.iter().map(|l| l.law.clone()).collect(),
        };
        let mut out = Self {
            subject,
            sheet,
            laws,
            sought,
            at,
            columns: Vec::new(),
        };
        out.gather(&rows);
        (out.sheet.groups.iter().any(|g| !g.held_out)).then_some(out)
    }

    fn gather(&mut self, rows: &[TossRow]) {
        let study = &self.subject.study;
        let typical = [TossScene::Flight, TossScene::Contact, TossScene::Rest].map(|scene| {
            let own = rows.iter().zip(&study.windows).filter(|(_, w)| w.scene == scene);
            median(&own.map(|(r, _)| mean_square(r)).collect::<Vec<f64>>()).unwrap_or(1.0)
        });
        let mut all: BTreeMap<usize, Gathered> = BTreeMap::new();
        let width = if study.body.second.is_some() { 7 } else { 6 };
        for (row, window) in rows.iter().zip(&study.windows) {
            let to = all.entry(window.toss).or_default();
            let own = typical[window.scene as usize].max(1e-9);
            let odd = (mean_square(row) / ODD - own).max(0.0).sqrt();
            match window.scene {
                TossScene::Rest => {
                    to.add(row, REST, &[0], self.sheet.kinds[REST].sigma, 0.0);
                    for k in 1..row.residual.len() {
                        to.add(row, REST + 1, &[k], self.sheet.kinds[REST + 1].sigma, 0.0);
                    }
                }
                scene => {
                    let first = if scene == TossScene::Flight { 0 } else { 2 };
                    for c in 0..width {
                        let kind = first + usize::from(c >= 3);
                        let mut picked: Vec<usize> = (c..row.residual.len()).step_by(width).collect();
                        if scene == TossScene::Contact {
                            // What is left of a contact is the error of the model, the same over the whole window.
                            picked.drain(..picked.len().saturating_sub(1));
                        }
                        to.add(row, kind, &picked, self.sheet.kinds[kind].sigma, odd);
                    }
                }
            }
        }
        for (toss, gathered) in all {
            let toss = &study.tosses[toss];
            let mut columns = vec![Vec::new(); self.sought.len()];
            let mut channels = Vec::new();
            for (channel, own) in gathered.channels.into_iter().zip(gathered.columns) {
                let Some(channel) = channel else { continue };
                for (all, own) in columns.iter_mut().zip(own) {
                    all.extend(own);
                }
                channels.push(channel);
            }
            self.sheet.groups.push(Group {
                name: toss.name.clone(),
                held_out: toss.held_out,
                channels,
            });
            self.columns.push(columns);
        }
    }

    fn number(&self, name: &str) -> Option<usize> {
        self.sought.iter().position(|s| s.name == name)
    }

    /// The value of every number under base parameters and laws.
    fn numbers(&self, base: &[f64], active: &[Active]) -> Vec<f64> {
        let mut out = vec![0.0; self.sought.len()];
        for (parameter, value) in self.sheet.base.iter().zip(base) {
            let Some(k) = self.number(parameter.name) else { continue };
            out[k] += *value;
            // Where the support is raised, a body lies higher.
            if let Some(k) = self.number("lying").filter(|_| parameter.name == "rise") {
                out[k] += *value;
            }
        }
        for a in active {
            let Some(own) = self.laws.get(a.law.form) else { continue };
            for (moves, value) in own.moves.iter().zip(a.values) {
                for (name, factor) in moves {
                    if let Some(k) = self.number(name) {
                        out[k] += factor * value;
                    }
                }
            }
        }
        out
    }

    /// The conditions that a fit comes to.
    fn conditions(&self, fit: &Fit) -> Conditions {
        let (base, mut rest) = fit.theta.split_at(self.sheet.base.len());
        let mut active = Vec::new();
        for law in &fit.laws {
            let law = &self.sheet.laws[*law];
            let (values, others) = rest.split_at(law.parameters.len());
            active.push(Active { law, values });
            rest = others;
        }
        let mut out = self.at;
        for (s, value) in self.sought.iter().zip(self.numbers(base, &active)) {
            let excess = s.name.starts_with("excess");
            if !excess || value != 0.0 {
                (s.set)(&mut out, value);
            }
        }
        out
    }

    /// How much better the hinge's friction and damping foretell its angle than an ideal hinge does, on tosses that were
    /// held out, else on all.
    pub fn hinge(&self) -> Option<Evidence> {
        self.subject.second.as_ref()?;
        let ideal = Conditions {
            hinge_friction: 0.0,
            hinge_damping: 0.0,
            ..self.at
        };
        let all = !self.subject.study.tosses.iter().any(|t| t.held_out);
        let squares = |at: &Conditions| {
            let mut study = self.subject.study.clone();
            study
                .windows
                .retain(|w| w.scene != TossScene::Rest && (all || study.tosses[w.toss].held_out));
            study.settle(at);
            let (rows, _) = study.rows(at, &[]);
            let mut sums: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
            for (row, window) in rows.iter().zip(&study.windows) {
                let sum = sums.entry(window.toss).or_default();
                for r in row.residual.iter().skip(6).step_by(7) {
                    *sum = (sum.0 + r * r, sum.1 + 1.0);
                }
            }
            sums.into_values()
                .map(|(s, n)| (s / n.max(1.0)).sqrt())
                .collect::<Vec<f64>>()
        };
        let (with, without) = (squares(&self.at), squares(&ideal));
        let n = with.len() as f64;
        let gains: Vec<f64> = with.iter().zip(&without).map(|(a, b)| (b / a).ln()).collect();
        let mean = gains.iter().sum::<f64>() / n;
        let sd = (gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt();
        let statistic = mean / (sd / n.sqrt()).max(1e-12);
        let which = if all { "all" } else { "held-out" };
        let words = format!(
            "over {n} {which} tosses the hinge's angle is foretold {:.1} % {} with its friction and damping than with an \
             ideal hinge (geometric mean over tosses; {} of them better)",
            100.0 * (1.0 - (-mean.abs()).exp()),
            if mean >= 0.0 { "better" } else { "worse" },
            gains.iter().filter(|g| **g > 0.0).count(),
        );
        Some(Evidence {
            residual: format!("angle of the hinge of {}", self.subject.root),
            test: "paired t over tosses, logarithm of the ratio of errors".into(),
            statistic,
            p_value: t_tail(statistic, (n - 1.0).max(1.0)),
            words,
        })
    }

    /// Measured against foretold under a fit, toss by toss.
    pub fn traces(&self, fit: &Fit) -> Vec<Trace> {
        super::toss_curves::traces(&self.subject, &self.conditions(fit))
    }
}

fn mean_square(row: &TossRow) -> f64 {
    row.residual.norm_squared() / row.residual.len().max(1) as f64
}

fn scatter((_, tau, floor): (&str, f64, f64)) -> Scatter {
    Scatter {
        tau,
        counts: 3.0,
        floor,
        nuisance: false,
        step: tau,
    }
}

impl Gathered {
    /// Some of a window's rows as one run of a channel; residuals are foretold less measured, in units of `sigma`.
    fn add(&mut self, row: &TossRow, kind: usize, picked: &[usize], sigma: f64, aside: f64) {
        let channel = self.channels[kind].get_or_insert_with(|| Channel {
            kind,
            measured: Vec::new(),
            starts: Vec::new(),
            change: Vec::new(),
            aside: Vec::new(),
        });
        let columns = &mut self.columns[kind];
        columns.resize(row.slopes.ncols(), Vec::new());
        for (k, i) in picked.iter().enumerate() {
            channel.measured.push(-row.residual[*i] * sigma);
            channel.starts.push(k == 0);
            channel.change.push(0.0);
            channel.aside.push(aside * sigma);
            for (n, column) in columns.iter_mut().enumerate() {
                column.push(row.slopes[(*i, n)] * sigma);
            }
        }
    }
}

impl Family for Tosses {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let columns = &self.columns[group];
        let mut moved = self.numbers(base, active);
        for (s, m) in self.sought.iter().zip(&mut moved) {
            *m -= (s.get)(&self.at);
        }
        for ((name, _, _), effect) in SCATTER.iter().zip(scatter) {
            if let Some(k) = self.number(name) {
                moved[k] += effect;
            }
        }
        let n = columns.first().map_or(0, Vec::len);
        let mut out = vec![0.0; n];
        for (column, by) in columns.iter().zip(&moved).filter(|(_, by)| **by != 0.0) {
            for (o, c) in out.iter_mut().zip(column) {
                *o += c * by;
            }
        }
        out
    }

    fn covariates(&self, _group: usize) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        Vec::new()
    }

    fn negligible(&self, law: usize, values: &[f64]) -> bool {
        let inertia = self.sheet.laws[law].cause == "nonuniform-density";
        inertia && values.iter().all(|v| v.abs() < IMPACT)
    }

    fn head_start(&self, law: usize) -> f64 {
        head_start(&self.sheet.laws[law])
    }

    fn about(&self, law: usize) -> usize {
        if self.laws[law].flies { 0 } else { 2 }
    }
}
