//! Presses as the ladder of laws sees them: force into the support against how far the tool went in, sample by sample.

use nalgebra::Point3;

use super::Quantity;
use super::family::{Active, Channel, ChannelKind, Family, Group, Parameter, Scatter, Sheet};
use super::predict::Scene;
use super::press_laws::{Memory, press_laws};
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::{interpolate, median};
use crate::stages::estimation::{action_of, support_normal};
use crate::twin::Model;

/// Seconds of one sample.
const BIN: f64 = 0.05;
/// What the plain spring leaves open of the force, as a share of it.
const EVEN: f64 = 0.01;
/// Presses closer than this are at the same spot, m.
const SPOT: f64 = 0.006;

/// One moment of a press.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Seconds since the capture began.
    pub time: f64,
    /// Seconds since the sample before.
    pub step: f64,
    /// How far the tool is below where it first met the surface, m; negative above.
    pub depth: f64,
    /// How fast that grows, m/s.
    pub rate: f64,
}

/// All presses of one capture.
pub struct Presses {
    sheet: Sheet,
    moments: Vec<Vec<Moment>>,
    /// Which log stiffness scales a group.
    spots: Vec<usize>,
    /// Stiffness of each spot in the twin, N/m.
    stiffness: Vec<f64>,
    /// Deepest earlier press at the same spot, m.
    past: Vec<f64>,
    /// Deepest press of all, m.
    pub deepest: f64,
    /// Largest force of all, N.
    pub largest: f64,
}

/// One press as it was read.
struct Read {
    interaction: String,
    held_out: bool,
    target: String,
    at: Point3<f64>,
    stiffness: f64,
    time: Vec<f64>,
    force: Vec<f64>,
    travel: Vec<f64>,
    noise: f64,
}

impl Read {
    fn of(scene: &Scene) -> Option<Self> {
        let action = action_of(scene.capture, scene.interaction, scene.segmented, scene.model)?;
        let link = scene.model.twin.link(&action.target)?;
        let stiffness = link.stiffness.as_ref()?.value;
        let up = support_normal(scene.capture, scene.model);
        let (time, force, noise) = scene.raw_force(BIN)?;
        let force: Vec<f64> = force.iter().map(|f| -f.dot(&up)).collect();
        let down: Vec<f64> = action.tool.position.iter().map(|p| -p.coords.dot(&up)).collect();
        // The mean over each sample's time, as for the force.
        let travel = time
            .iter()
            .map(|t| {
                let each = (-4..=4).map(|k| interpolate(&action.tool.time, &down, t + BIN / 9.0 * f64::from(k)));
                let known: Vec<f64> = each.flatten().collect();
                known.iter().sum::<f64>() / known.len().max(1) as f64
            })
            .collect();
        let deepest = (0..down.len()).max_by(|a, b| down[*a].total_cmp(&down[*b]))?;
        Some(Self {
            interaction: scene.interaction.name.clone(),
            held_out: scene.interaction.held_out,
            target: action.target.clone(),
            at: action.tool.position[deepest],
            stiffness,
            time,
            force,
            travel,
            noise: noise?,
        })
    }

    /// Travel at which the force began to rise, m.
    fn contact(&self) -> Option<f64> {
        let peak = self.force.iter().copied().fold(0.0, f64::max);
        let rest: Vec<f64> = self.force.iter().take_while(|f| **f < 0.3 * peak).copied().collect();
        let tare = median(&rest[..rest.len().div_ceil(2)]).unwrap_or(0.0);
        let floor = (5.0 * self.noise).max(0.01 * peak);
        let felt = |i: &usize| (0..3).all(|k| self.force.get(i + k).is_some_and(|f| f - tare > floor));
        let i = (0..self.force.len()).find(felt)?;
        Some(self.travel[i] - (self.force[i] - tare) / self.stiffness)
    }
}

impl Presses {
    /// What a capture has of them; nothing where none was measured.
    pub fn new(capture: &Capture, segmented: &[Segmented], model: &Model) -> Option<Self> {
        let mut reads: Vec<Read> = Vec::new();
        for interaction in capture.interactions.iter().filter(|i| i.kind == Kind::Press) {
            let cut = segmented.iter().find(|s| s.interaction == interaction.name);
            reads.extend(Read::of(&Scene {
                capture,
                interaction,
                segmented: cut,
                model,
            }));
        }
        reads.sort_by(|a, b| a.time[0].total_cmp(&b.time[0]));
        let begin = |i: &Interaction| i.force.as_ref().and_then(|f| f.time.first().copied());
        let zero = capture
            .interactions
            .iter()
            .filter_map(begin)
            .fold(f64::INFINITY, f64::min);
        let mut out = Self {
            sheet: Sheet {
                scatter: vec![
                    Scatter {
                        tau: 5e-5,
                        counts: 4.0,
                        floor: 5e-6,
                        nuisance: true,
                        step: 1e-7,
                    },
                    Scatter {
                        tau: 0.003,
                        counts: 10.0,
                        floor: 0.003,
                        nuisance: true,
                        step: 1e-4,
                    },
                    Scatter {
                        tau: 0.01,
                        counts: 10.0,
                        floor: 0.002,
                        nuisance: false,
                        step: 1e-4,
                    },
                ],
                ..Sheet::default()
            },
            moments: Vec::new(),
            spots: Vec::new(),
            stiffness: Vec::new(),
            past: Vec::new(),
            deepest: 0.0,
            largest: 0.0,
        };
        let mut known: Vec<(String, Point3<f64>, f64)> = Vec::new();
        let mut noise = Vec::new();
        for read in &reads {
            let Some(contact) = read.contact() else { continue };
            out.add(read, contact, zero, &mut known);
            noise.push(read.noise);
        }
        let sigma = median(&noise)?.max(1e-4);
        out.sheet.kinds = vec![ChannelKind {
            quantity: Quantity::Force,
            sigma,
            jitter: 0.12,
        }];
        out.sheet.base = out
            .stiffness
            .iter()
            .map(|_| Parameter::amplitude("log_stiffness", "1", 0.5))
            .collect();
        // Path and force of the tool are read by different instruments.
        out.sheet.base.push(Parameter::amplitude("delay", "s", 0.003));
        out.sheet.laws = press_laws(&out);
        Some(out)
    }

    fn add(&mut self, read: &Read, contact: f64, zero: f64, known: &mut Vec<(String, Point3<f64>, f64)>) {
        let n = read.time.len();
        let rate = |i: usize| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(n - 1));
            (read.travel[b] - read.travel[a]) / (read.time[b] - read.time[a]).max(1e-6)
        };
        let all = (0..n).map(|i| Moment {
            time: read.time[i] - zero,
            step: if i > 0 { read.time[i] - read.time[i - 1] } else { 0.0 },
            depth: read.travel[i] - contact,
            rate: rate(i),
        });
        let moments: Vec<Moment> = all.filter(|m| m.depth.is_finite() && m.depth > -0.02).collect();
        let force: Vec<f64> = (0..n)
            .filter(|i| (read.travel[*i] - contact) > -0.02)
            .map(|i| read.force[i])
            .collect();
        let reached = moments.iter().map(|m| m.depth).fold(0.0, f64::max);
        let spot = known
            .iter()
            .position(|k| k.0 == read.target && (k.1.xy() - read.at.xy()).norm() < SPOT);
        let spot = spot.unwrap_or_else(|| {
            known.push((read.target.clone(), read.at, 0.0));
            self.stiffness.push(read.stiffness);
            known.len() - 1
        });
        self.past.push(known[spot].2);
        known[spot].2 = known[spot].2.max(reached);
        self.deepest = self.deepest.max(reached);
        self.largest = force.iter().copied().fold(self.largest, f64::max);
        let starts: Vec<bool> = (0..moments.len())
            .map(|i| i == 0 || moments[i].step > 1.5 * BIN)
            .collect();
        let change = (0..force.len())
            .map(|i| if starts[i] { 0.0 } else { force[i] - force[i - 1] })
            .collect();
        let aside = force.iter().map(|f| EVEN * f.abs()).collect();
        let channel = Channel {
            kind: 0,
            measured: force,
            starts,
            change,
            aside,
        };
        self.sheet.groups.push(Group {
            name: read.interaction.clone(),
            held_out: read.held_out,
            channels: vec![channel],
        });
        self.moments.push(moments);
        self.spots.push(spot);
    }
}

impl Family for Presses {
    fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    fn predict(&self, group: usize, base: &[f64], active: &[Active], scatter: &[f64]) -> Vec<f64> {
        let spot = self.spots[group];
        let stiffness = self.stiffness[spot] * (base[spot] + scatter[2]).exp();
        let mut memory = Memory::new(stiffness, self.deepest, self.past[group]);
        let read = self.moments[group]
            .iter()
            .map(|m| memory.force(m, scatter[0] + base[self.stiffness.len()] * m.rate, active));
        read.map(|f| f + scatter[1]).collect()
    }

    fn covariates(&self, group: usize) -> Vec<(&'static str, &'static str, Vec<f64>)> {
        let of = |value: &dyn Fn(&Moment) -> f64| {
            let each = self.moments[group]
                .iter()
                .map(|m| if m.depth > 0.0 { value(m) } else { f64::NAN });
            each.collect::<Vec<f64>>()
        };
        vec![
            ("depth", "m", of(&|m| m.depth)),
            ("rate of the press", "m/s", of(&|m| m.rate)),
            ("time since the capture began", "s", of(&|m| m.time)),
        ]
    }
}
