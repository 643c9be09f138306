//! Presses as they were read: force and travel of the tool, and where it met the surface.

use nalgebra::Point3;

use super::predict::Scene;
use super::presses::{BIN, Moment, PARTS};
use crate::capture::ToolShape;
use crate::math::{freed, interpolate, median};
use crate::stages::estimation::{action_of, support_normal};

/// One press as it was read.
pub(super) struct Read {
    pub interaction: String,
    pub held_out: bool,
    pub target: String,
    pub at: Point3<f64>,
    /// How far the tool's surface is below its origin, m.
    pub below: f64,
    pub stiffness: f64,
    pub time: Vec<f64>,
    pub force: Vec<f64>,
    pub travel: Vec<f64>,
    /// The same in the parts of each sample.
    pub parts: Vec<[f64; PARTS]>,
    /// What the travel may be off by, m.
    pub wanders: f64,
    pub noise: f64,
    /// Travel at which the tool met the surface, m, and the force that told it, N.
    pub contact: f64,
    pub told_by: f64,
}

/// How near to the surface, m, and by how much its depth changes within it, where a sample is taken in parts.
const MEETS: f64 = 4e-4;
const PASSES: f64 = 5e-5;
/// Force, in standard deviations, below which nothing is felt.
const FREE: f64 = 1.5;
/// Seconds of one sample where the surface is looked for.
pub(super) const FINE: f64 = 0.008;

impl Read {
    pub fn of(scene: &Scene) -> Option<Self> {
        let action = action_of(scene.capture, scene.interaction, scene.segmented, scene.model)?;
        let link = scene.model.twin.link(&action.target)?;
        let stiffness = link.stiffness.as_ref()?.value;
        let up = support_normal(scene.capture, scene.model);
        let (time, force, noise) = scene.raw_force(BIN)?;
        let force: Vec<f64> = force.iter().map(|f| -f.dot(&up)).collect();
        let path = scene.interaction.tool_path.as_ref()?;
        let seen: Vec<f64> = path.position.iter().map(|p| -p.coords.dot(&up)).collect();
        // Noise of the path times the stiffness would be noise of what is foretold, which every law that smooths makes less.
        let freed = freed(&action.tool.time, &seen);
        let wanders = freed.as_ref().map_or(0.0, |f| f.left);
        let down = freed.map_or(seen, |f| f.values);
        // The mean over each sample's time, as for the force.
        let travel = time
            .iter()
            .map(|t| {
                let each = (-4..=4).map(|k| interpolate(&action.tool.time, &down, t + BIN / 9.0 * f64::from(k)));
                let known: Vec<f64> = each.flatten().collect();
                known.iter().sum::<f64>() / known.len().max(1) as f64
            })
            .collect();
        let within = |t: f64, k: usize| {
            let t = t + BIN * ((k as f64 + 0.5) / PARTS as f64 - 0.5);
            interpolate(&path.time, &down, t).unwrap_or(f64::NAN)
        };
        let parts = time.iter().map(|t| std::array::from_fn(|k| within(*t, k))).collect();
        let deepest = (0..down.len()).max_by(|a, b| down[*a].total_cmp(&down[*b]))?;
        let (fine, felt, fine_noise) = scene.raw_force(FINE)?;
        let felt: Vec<f64> = felt.iter().map(|f| -f.dot(&up)).collect();
        let rises = rise(&felt, fine_noise?)?;
        let at = |i: usize| interpolate(&path.time, &down, fine[i]);
        // Where nothing was felt yet it had not met the surface.
        let told_at = at(rises.felt)?;
        let contact = (told_at - rises.force / stiffness).max(at(rises.free).unwrap_or(f64::NEG_INFINITY));
        Some(Self {
            interaction: scene.interaction.name.clone(),
            held_out: scene.interaction.held_out,
            target: action.target.clone(),
            at: action.tool.position[deepest],
            below: scene.interaction.tool.as_ref().map_or(0.0, |t| below(&t.shape)),
            stiffness,
            time,
            force,
            travel,
            parts,
            wanders,
            noise: noise?,
            contact,
            told_by: (stiffness * (told_at - contact)).max(0.0),
        })
    }
}

impl Read {
    /// Its moments, from `zero` (s) on, with the force of each, N: those near the surface and in it.
    pub fn moments(&self, zero: f64) -> (Vec<Moment>, Vec<f64>) {
        let n = self.time.len();
        let rate = |i: usize| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(n - 1));
            (self.travel[b] - self.travel[a]) / (self.time[b] - self.time[a]).max(1e-6)
        };
        let moment = |i: usize| Moment {
            time: self.time[i] - zero,
            step: if i > 0 { self.time[i] - self.time[i - 1] } else { 0.0 },
            depth: self.travel[i] - self.contact,
            rate: rate(i),
            parts: meeting(self.parts[i].map(|p| p - self.contact)),
        };
        let near = (0..n).map(|i| (moment(i), self.force[i]));
        near.filter(|(m, _)| m.depth.is_finite() && m.depth > -0.02).unzip()
    }
}

/// How far the surface of a tool that stands upright is below its origin, m.
fn below(shape: &ToolShape) -> f64 {
    match shape {
        ToolShape::Sphere { radius } => *radius,
        ToolShape::Box { half } => half.z,
        ToolShape::Cylinder { half_height, .. } => *half_height,
        ToolShape::Mesh(_) => 0.0,
    }
}

/// Depths in parts of a sample near the surface.
fn meeting(parts: [f64; PARTS]) -> Option<[f64; PARTS]> {
    let (low, high) = parts
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    (low < MEETS && high > -MEETS && high - low > PASSES && parts.iter().all(|p| p.is_finite())).then_some(parts)
}

/// Where a force begins to rise for good.
struct Rise {
    /// The first sample that is felt, and the last that surely is not.
    felt: usize,
    free: usize,
    /// What it is there above the tare, N.
    force: f64,
}

fn rise(force: &[f64], noise: f64) -> Option<Rise> {
    let peak = force.iter().copied().fold(0.0, f64::max);
    let rest: Vec<f64> = force.iter().take_while(|f| **f < 0.3 * peak).copied().collect();
    let tare = median(&rest[..rest.len().div_ceil(2)]).unwrap_or(0.0);
    let floor = (5.0 * noise).max(0.01 * peak);
    let felt = |i: &usize| (0..4).all(|k| force.get(i + k).is_some_and(|f| f - tare > floor));
    let i = (0..force.len()).find(felt)?;
    let free = (0..i).rev().find(|k| force[*k] - tare < FREE * noise).unwrap_or(0);
    Some(Rise {
        felt: i,
        free: free.saturating_sub(1),
        // A force that jumps up has met the surface there; what is more than the floor is not traced back.
        force: (force[i] - tare).min(2.0 * floor),
    })
}
