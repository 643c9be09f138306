//! Weighing: what the tool carries while the body hangs free.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

use super::evidence::{Tare, mean_wrench, motion_at, tare_of, tool_at};
use super::facts::subject;
use crate::capture::{Interaction, PhaseKind, PoseStream, Segmented};
use crate::math::{bayesian_linear, correlated_mean, local_quadratic, mean_rotation};

/// One weighing.
#[derive(Clone, Debug)]
pub(super) struct Weighing {
    pub interaction: String,
    /// Mass of all that hung on the tool, kg, and its standard deviation.
    pub mass: f64,
    pub sd: f64,
    /// What else rose with the target.
    pub along: Vec<String>,
    /// Equations for the centre of mass in the target's link frame: `rows · com = right`, each of unit weight.
    pub moments: Vec<(Vector3<f64>, f64)>,
}

/// The quiet stretch at the top: off the support, the tool (nearly) at rest, or else all of the time aloft.
pub(super) struct Aloft {
    pub start: f64,
    pub end: f64,
}

pub(super) fn height(interaction: &Interaction, up: &Vector3<f64>, track: &str) -> (Vec<f64>, Vec<f64>) {
    let stream = interaction.tracks.get(track).or(interaction.tool_path.as_ref());
    stream.map_or((Vec::new(), Vec::new()), |s| {
        (s.time.clone(), s.position.iter().map(|p| p.coords.dot(up)).collect())
    })
}

/// From when to when `target` hangs on the tool.
pub(super) fn aloft(
    interaction: &Interaction,
    segmented: &Segmented,
    up: &Vector3<f64>,
    target: &str,
) -> Option<Aloft> {
    let (time, height) = height(interaction, up, target);
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let before = time.partition_point(|t| *t < slide.start).max(1);
    let ground = crate::math::median(&height[..before])?;
    let end = slide.end;
    let raised: Vec<usize> = (0..time.len())
        .filter(|&i| time[i] > slide.start && time[i] < end && height[i] - ground > 5e-3)
        .collect();
    let still = |i: usize| {
        local_quadratic(&time, &height, time[i], 0.1)
            .is_some_and(|f| f.velocity.abs() < 4e-3 && f.acceleration.abs() < 0.08)
    };
    let quiet: Vec<usize> = raised.iter().copied().filter(|&i| still(i)).collect();
    let (first, last) = (quiet.first().or(raised.first())?, quiet.last().or(raised.last())?);
    let margin = if quiet.is_empty() { 0.0 } else { 0.05 };
    let stretch = Aloft {
        start: time[*first] + margin,
        end: time[*last],
    };
    (stretch.end - stretch.start > 0.1).then_some(stretch)
}

/// Weighs what hangs on the tool: force against gravity, corrected for the tool's acceleration. `gain_sd` is the doubt of
/// the sensor's scale, a share.
pub(super) fn weigh(
    interaction: &Interaction,
    segmented: &Segmented,
    target: &str,
    gravity: &Vector3<f64>,
    gain_sd: f64,
) -> Option<Weighing> {
    let stream = interaction.force.as_ref()?;
    let g = gravity.norm();
    let up = -gravity / g;
    let stretch = aloft(interaction, segmented, &up, target)?;
    let tare = tare_of(interaction, segmented);
    let (time, height) = height(interaction, &up, target);
    let carried: Vec<f64> = (0..stream.time.len())
        .filter(|&i| stream.time[i] >= stretch.start && stretch.end >= stream.time[i])
        .map(|i| {
            let a = local_quadratic(&time, &height, stream.time[i], 0.12).map_or(0.0, |f| f.acceleration);
            (stream.force[i] - tare.force).dot(&up) / (g + if a.abs() > 0.15 { a } else { 0.0 })
        })
        .collect();
    let mean = correlated_mean(&carried)?;
    let tare_sd = (segmented.force_noise.unwrap_or(0.0) / 10.0).hypot(segmented.tare_doubt);
    let untared = if segmented.force_tare.is_none() {
        0.02 * mean.mean.abs()
    } else {
        0.0
    };
    let gain = gain_sd * mean.mean.abs();
    let sd = (mean.sd.powi(2) + (tare_sd / g).powi(2) + untared.powi(2) + gain.powi(2)).sqrt();
    if mean.mean < 3.0 * sd {
        return None;
    }
    Some(Weighing {
        interaction: interaction.name.clone(),
        mass: mean.mean,
        sd,
        along: risen(interaction, target, &up, &stretch),
        moments: moments(
            interaction,
            target,
            &(mean.mean * gravity),
            &stretch,
            &tare,
            segmented.force_noise.unwrap_or(0.0),
        ),
    })
}

/// What a hand read while something hung on it.
#[derive(Clone, Copy, Debug)]
pub struct Hung {
    /// Mean less the tare, N, world axes.
    pub force: Vector3<f64>,
    /// Standard deviation of each component, N.
    pub sd: f64,
    /// World-from-tool.
    pub rotation: Option<UnitQuaternion<f64>>,
}

/// What was read across and along the weight of what was lifted; nothing of a lift that began with a load and no tare.
pub fn hung(interaction: &Interaction, segmented: &Segmented, gravity: &Vector3<f64>) -> Option<Hung> {
    held(interaction, segmented, gravity, &segmented.force_tare?)
}

/// The same as it was read, with whatever the sensor reads of nothing.
pub fn hung_untared(interaction: &Interaction, segmented: &Segmented, gravity: &Vector3<f64>) -> Option<Hung> {
    held(interaction, segmented, gravity, &Vector3::zeros())
}

fn held(interaction: &Interaction, segmented: &Segmented, gravity: &Vector3<f64>, tare: &Vector3<f64>) -> Option<Hung> {
    let stream = interaction.force.as_ref()?;
    let target = subject(interaction, segmented)?;
    let up = -gravity.try_normalize(1e-9)?;
    let stretch = aloft(interaction, segmented, &up, target)?;
    let first = stream.time.partition_point(|t| *t < stretch.start);
    let last = stream.time.partition_point(|t| *t <= stretch.end);
    let along = |k: usize| correlated_mean(&stream.force[first..last].iter().map(|f| f[k]).collect::<Vec<_>>());
    let means = [along(0)?, along(1)?, along(2)?];
    let scatter = means.iter().map(|m| m.sd).fold(0.0, f64::max);
    let path = interaction.tool_path.as_ref();
    let path = path.filter(|p| !p.is_empty());
    let rotation = path.and_then(|p| p.rotation[p.time.partition_point(|t| *t < stretch.start).min(p.len() - 1)]);
    Some(Hung {
        force: Vector3::from_fn(|k, _| means[k].mean) - tare,
        sd: scatter
            .hypot(segmented.force_noise.unwrap_or(0.0) / 10.0)
            .hypot(segmented.tare_doubt),
        rotation,
    })
}

/// The other tracks that rose by at least half as much as the target.
fn risen(interaction: &Interaction, target: &str, up: &Vector3<f64>, stretch: &Aloft) -> Vec<String> {
    let rise = |name: &str| {
        let (time, height) = height(interaction, up, name);
        let level = |from: f64, to: f64| {
            let rows: Vec<f64> = time
                .iter()
                .zip(&height)
                .filter(|(t, _)| **t >= from && **t <= to)
                .map(|r| *r.1)
                .collect();
            crate::math::median(&rows)
        };
        let start = time.first().copied().unwrap_or(0.0);
        Some(level(stretch.start, stretch.end)? - level(start, start + 0.1)?)
    };
    let own = rise(target).unwrap_or(f64::INFINITY);
    interaction
        .tracks
        .keys()
        .filter(|name| *name != target && rise(name).is_some_and(|r| r > 0.5 * own))
        .cloned()
        .collect()
}

/// Turn while it hangs, rad, below which it counts as not turning.
const STEADY: f64 = 0.02;
/// Spin, rad/s, up to which a block counts as still, and the part of the weight by which the force may differ from it.
const STILL: (f64, f64) = (0.1, 0.02);
/// Half a block, s, and readings of the track within that, at least.
const HALF: f64 = 0.05;
const FEWEST: f64 = 2.5;
/// Doubt of all of a lift's moments, as the arm at which the weight would make it, m: the tool and the frame of the body are
/// not known better to each other.
const ARM: f64 = 2e-4;
/// How much less a block counts in which the body moved, where there is no other.
const MOVING: f64 = 10.0;

/// One stretch aloft: torque with its count of readings, the tool, and where the body is.
struct Hanging {
    torque: (Vector3<f64>, usize),
    tool: Point3<f64>,
    pose: Isometry3<f64>,
    /// It is not sped up: the force is the weight.
    even: bool,
    /// Spin in it and at its ends, rad/s.
    spin: f64,
}

/// The body at one time; `None` where something was not read.
fn hanging(
    interaction: &Interaction,
    track: &PoseStream,
    tare: &Tare,
    weight: &Vector3<f64>,
    noise: f64,
    (t, half): (f64, f64),
) -> Option<Hanging> {
    let wrench = mean_wrench(interaction.force.as_ref()?, t - half, t + half, tare)?;
    let spin = |at: f64| motion_at(track, at, half).map_or(f64::INFINITY, |m| m.spin.norm());
    let fastest = spin(t).max(spin(t - half)).max(spin(t + half));
    let apart = (wrench.force + weight).norm() - 3.0 * noise / (wrench.rows as f64).sqrt();
    Some(Hanging {
        torque: (wrench.torque?, wrench.rows),
        tool: tool_at(interaction.tool_path.as_ref()?, t)?,
        pose: motion_at(track, t, half)?.pose,
        even: apart < STILL.1 * weight.norm(),
        spin: fastest,
    })
}

/// Torque balance about the tool's origin, `T = m g × (com - tool)`, over blocks of 0.1 s (longer where the track is read seldom) in which the body hangs still: three
/// equations each for the centre of mass in the link frame. What moves needs torque for that too.
fn moments(
    interaction: &Interaction,
    target: &str,
    weight: &Vector3<f64>,
    stretch: &Aloft,
    tare: &Tare,
    force_noise: f64,
) -> Vec<(Vector3<f64>, f64)> {
    let torques = interaction.force.as_ref().and_then(|f| f.torque.as_ref());
    let (Some(torques), Some(track)) = (torques, interaction.tracks.get(target)) else {
        return Vec::new();
    };
    let noise = torque_noise(torques).max(1e-6);
    let lasts = track.time.last().zip(track.time.first()).map_or(0.0, |(b, a)| b - a);
    let half = HALF.max(FEWEST * lasts / track.len().max(2) as f64);
    let count = ((stretch.end - stretch.start) / (2.0 * half)) as usize;
    let times = (0..count).map(|k| stretch.start + (2 * k + 1) as f64 * half);
    let mut blocks: Vec<Hanging> = times
        .filter_map(|t| hanging(interaction, track, tare, weight, force_noise, (t, half)))
        .collect();
    let hangs_level = |blocks: &[Hanging]| {
        let turns: Vec<UnitQuaternion<f64>> = blocks.iter().map(|b| b.pose.rotation).collect();
        mean_rotation(&turns).filter(|mean| turns.iter().all(|q| q.angle_to(mean) < STEADY))
    };
    let level = hangs_level(&blocks).is_some();
    let still = |b: &Hanging| b.even && (level || b.spin < STILL.0);
    let trust = if blocks.iter().any(still) {
        blocks.retain(still);
        1.0
    } else {
        MOVING
    };
    // Where it does not turn, one turn serves all blocks: turns that differ by noise alone would seem to show how high the
    // centre of mass lies.
    let mean = hangs_level(&blocks);
    let shared = ARM * weight.norm() * (blocks.len() as f64).sqrt();
    let mut rows = Vec::new();
    for block in blocks {
        let (torque, count) = block.torque;
        let sd = trust * shared.hypot(noise / (count as f64).sqrt());
        let cross: Matrix3<f64> = weight.cross_matrix();
        let a = cross * mean.unwrap_or(block.pose.rotation).to_rotation_matrix().into_inner();
        let b = torque - cross * (block.pose.translation.vector - block.tool.coords);
        rows.extend((0..3).map(|k| (a.row(k).transpose() / sd, b[k] / sd)));
    }
    rows
}

fn torque_noise(torques: &[Vector3<f64>]) -> f64 {
    let differences: Vec<f64> = torques.windows(2).map(|w| w[1].x - w[0].x).collect();
    crate::math::mad_sd(&differences).map_or(0.0, |sd| sd / std::f64::consts::SQRT_2)
}

/// The centre of mass in the link frame from moment equations and a prior (the shape's centroid).
pub(super) fn centre_of_mass(
    moments: &[(Vector3<f64>, f64)],
    prior: &Point3<f64>,
    prior_sd: &Vector3<f64>,
) -> Option<([f64; 3], [f64; 3])> {
    let a = DMatrix::from_fn(moments.len(), 3, |i, j| moments[i].0[j]);
    let b = DVector::from_iterator(moments.len(), moments.iter().map(|m| m.1));
    let weights = DVector::from_element(moments.len(), 1.0);
    let mean = DVector::from_column_slice(prior.coords.as_slice());
    let sd = DVector::from_column_slice(prior_sd.as_slice());
    let fit = bayesian_linear(&a, &b, &weights, &mean, &sd)?;
    let degrees = (moments.len() as f64 - 2.0).max(1.0);
    let excess = (fit.residuals.norm_squared() / degrees).max(1.0).sqrt();
    // The pose of the link frame itself is known to a fraction of a millimetre only.
    let component = |i: usize| (fit.sd(i) * excess).max(ARM).min(prior_sd[i].max(ARM));
    Some(([0, 1, 2].map(|i| fit.x[i]), [0, 1, 2].map(component)))
}
