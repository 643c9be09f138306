//! Presses as they were read: force and travel of the tool, and where it met the surface.

use nalgebra::Point3;

use super::predict::Scene;
use super::press_moment::Moment;
use super::presses::{BIN, PARTS};
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

/// How near to the surface, m, and by how much its depth changes within it, where a sample is taken in parts; by how much it does where
/// any is; and by how much its step is another than the one before where the tool turns within it: what is dry or remembers does, too.
const MEETS: f64 = 4e-4;
const PASSES: f64 = 5e-5;
const FAR: f64 = 2e-4;
/// Force, in standard deviations, below which nothing is felt.
const FREE: f64 = 1.5;
/// A step of the force at first contact over the noise of a reading, and over how much it grows in one reading after it.
const STEP_SEEN: f64 = 8.0;
const STEP_OVER: f64 = 2.0;
/// Fewest samples before first touch that tell a tare.
const RESTS: usize = 6;
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
        let known = (0..down.len()).filter(|k| down[*k].is_finite());
        let deepest = known.max_by(|a, b| down[*a].total_cmp(&down[*b]))?;
        let (fine, felt, fine_noise) = scene.raw_force(FINE)?;
        let felt: Vec<f64> = felt.iter().map(|f| -f.dot(&up)).collect();
        let tare = scene.segmented.and_then(|s| s.force_tare).map(|t| -t.dot(&up));
        let rises = rise(&felt, fine_noise?, tare)?;
        let at = |i: usize| interpolate(&path.time, &down, fine[i]);
        let raw = scene.interaction.force.as_ref()?;
        let readings = raw.time.iter().zip(&raw.force).map(|(t, f)| (*t, -f.dot(&up)));
        let around = [fine[rises.free.unwrap_or(0)] - FINE, fine[rises.felt] + 2.0 * FINE];
        let window: Vec<(f64, f64)> = readings.filter(|(t, _)| (around[0]..=around[1]).contains(t)).collect();
        let (told_at, contact) = match stepped(&window).and_then(|t| interpolate(&path.time, &down, t)) {
            Some(there) => (there, there),
            // Where nothing was felt yet it had not met the surface.
            None => {
                let (told, free) = (at(rises.felt)?, rises.free.and_then(at).unwrap_or(f64::NEG_INFINITY));
                (told, (told - rises.force / stiffness).max(free))
            }
        };
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
        // How much more it goes on after a sample than it did before.
        let turns = |i: usize| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(n - 1));
            (self.travel[a] + self.travel[b] - 2.0 * self.travel[i]).abs()
        };
        let moment = |i: usize| Moment {
            time: self.time[i] - zero,
            step: if i > 0 { self.time[i] - self.time[i - 1] } else { 0.0 },
            depth: self.travel[i] - self.contact,
            rate: rate(i),
            parts: in_parts(self.parts[i].map(|p| p - self.contact), turns(i)),
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

/// Depths in parts of a sample that meets the surface, goes far within it or turns there.
fn in_parts(parts: [f64; PARTS], turns: f64) -> Option<[f64; PARTS]> {
    let (low, high) = parts
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let passes = high - low > if low < MEETS { PASSES } else { FAR };
    (high > -MEETS && (passes || turns > PASSES) && parts.iter().all(|p| p.is_finite())).then_some(parts)
}

/// Where a force begins to rise for good.
struct Rise {
    /// The first sample that is felt, and the last that surely is not, where one was read.
    felt: usize,
    free: Option<usize>,
    /// What it is there above the tare, N.
    force: f64,
}

/// When a force steps up from one reading (s, N) to the next, s: what is met so is met there, whatever its stiffness.
fn stepped(readings: &[(f64, f64)]) -> Option<f64> {
    const BEFORE: usize = 3;
    const AFTER: usize = 5;
    let each = (BEFORE..readings.len().saturating_sub(AFTER)).filter_map(|j| {
        let before = &readings[..j];
        let tare = before.iter().map(|r| r.1).sum::<f64>() / j as f64;
        let noise = (before.iter().map(|r| (r.1 - tare).powi(2)).sum::<f64>() / (j - 1) as f64).sqrt();
        // The reading of the step itself may be of a part of it.
        let (start, after) = (readings[j].0, &readings[j + 1..=j + AFTER]);
        let [t, f] =
            [|r: &(f64, f64)| r.0, |r: &(f64, f64)| r.1].map(|of| after.iter().map(of).sum::<f64>() / AFTER as f64);
        let spread: f64 = after.iter().map(|r| (r.0 - t).powi(2)).sum();
        let slope = after.iter().map(|r| (r.0 - t) * (r.1 - f)).sum::<f64>() / spread.max(1e-12);
        let step = f - slope * (t - start) - tare;
        let gap = (readings[j + 1].0 - start).max(1e-6);
        let sudden = step > STEP_SEEN * noise && step > STEP_OVER * slope.abs() * gap;
        (sudden && readings[j].1 - tare > 0.5 * step && readings[j - 1].1 - tare < 0.5 * step)
            .then(|| (step, 0.5 * (start + readings[j - 1].0)))
    });
    each.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, t)| t)
}

/// `told` is what is read without a touch, where that is known; of a press that touches at first it is all that tells it.
fn rise(force: &[f64], noise: f64, told: Option<f64>) -> Option<Rise> {
    let peak = force.iter().copied().fold(0.0, f64::max);
    let rest: Vec<f64> = force.iter().take_while(|f| **f < 0.3 * peak).copied().collect();
    let floor = (5.0 * noise).max(0.01 * peak);
    let begins = |tare: f64| {
        let felt = |i: &usize| (0..4).all(|k| force.get(i + k).is_some_and(|f| f - tare > floor));
        (0..force.len()).find(felt)
    };
    let before = median(&rest[..rest.len().div_ceil(2)]).unwrap_or(0.0);
    // What rises slowly from the first reading on is no rest.
    let touching = told.filter(|tare| before > tare + noise || begins(*tare).is_some_and(|i| i < RESTS));
    let tare = touching.unwrap_or(before);
    let i = begins(tare)?;
    let free = (0..i).rev().find(|k| force[*k] - tare < FREE * noise);
    Some(Rise {
        felt: i,
        free: if touching.is_some() {
            free
        } else {
            Some(free.unwrap_or(0).saturating_sub(1))
        },
        // A force that jumps up has met the surface there; what is more than the floor is not traced back.
        force: (force[i] - tare).min(2.0 * floor),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_met_where_it_is_read_and_a_ramp_is_none() {
        let read = |force: &dyn Fn(f64) -> f64| {
            let one = |k: u32| {
                let t = 0.002 * f64::from(k);
                (t, force(t) + 0.02 * (f64::from(k * 7 % 5) - 2.0))
            };
            (0..20).map(one).collect::<Vec<(f64, f64)>>()
        };
        let ramp = |t: f64| 70.0 * (t - 0.019).max(0.0);
        let step = |t: f64| if t > 0.019 { 3.0 + ramp(t) } else { 0.0 };
        let told = stepped(&read(&step)).expect("a step");
        assert!((told - 0.019).abs() < 1e-3, "{told}");
        assert!(stepped(&read(&ramp)).is_none());
        assert!(stepped(&read(&|_| 0.0)).is_none());
    }

    #[test]
    fn a_press_that_touches_at_first_is_traced_back_by_the_tare_that_is_known() {
        let wobble = |k: usize| 0.01 * ((k * 7 % 5) as f64 - 2.0);
        let force = |begun: usize| -> Vec<f64> {
            let load = |k: usize| if k < begun { 0.0 } else { 0.1 * (k - begun + 3) as f64 };
            (0..100).map(|k| 0.2 + load(k) + wobble(k)).collect()
        };
        let touching = rise(&force(0), 0.01, Some(0.2)).expect("a rise");
        assert!(touching.felt < 2 && touching.free.is_none());
        let usual = rise(&force(40), 0.01, Some(0.2)).expect("a rise");
        assert!(usual.felt == 40 && usual.free.is_some_and(|f| f < 40));
    }

    #[test]
    fn samples_are_taken_in_parts_where_they_meet_go_far_or_turn() {
        let parts = |from: f64, to: f64| std::array::from_fn(|k| from + (to - from) * k as f64 / (PARTS - 1) as f64);
        assert!(in_parts(parts(-1e-4, 1e-4), 0.0).is_some());
        assert!(in_parts(parts(2e-3, 2.1e-3), 0.0).is_none());
        assert!(in_parts(parts(2e-3, 2.5e-3), 0.0).is_some());
        assert!(in_parts(parts(2e-3, 2.1e-3), 1e-4).is_some());
        assert!(in_parts(parts(-3e-3, -2e-3), 1e-3).is_none());
    }
}
