//! Faults of the sensors: some come before the noise of the reading, some after it.

use nalgebra::{Isometry3, Point3, Rotation3, Vector3};
use rand::Rng;
use rand_distr::StudentT;

use super::law::{Act, Effect};
use crate::base::{Pose, Seed, rng_for};
use crate::capture::{Interaction, Kind, PoseStream};
use crate::lab::Performance;

/// A fault. Forces in N, times in s, lengths in m.
#[derive(Clone, Copy, Debug)]
pub(in crate::lab) enum Fault {
    /// Along the way of the tool (in a press: down).
    Bias(f64),
    /// World axes.
    BiasWorld([f64; 2]),
    /// Forces read too large by this share.
    Gain(f64),
    /// Along the way of the tool, N/s.
    Drift(f64),
    /// Share of the force along the way that is read across it, and most of it back.
    Crosstalk(f64),
    /// Cut at this share of the largest force.
    Saturation(f64),
    /// Tracks come late.
    Delay(f64),
    /// Forces through this many poles, with this time in all.
    Lag(f64, u8),
    /// The clock of the force sensor runs fast by this share.
    ClockDrift(f64),
    /// Tracks are scaled by one plus this, and turned about the vertical, rad.
    Tracking(f64, f64),
    /// The tool is not where it is told.
    ToolOffset([f64; 2]),
    /// Forces are read too large by the first share of the cosine and the second of the sine of how far what is moved has turned.
    Lever([f64; 2]),
    /// Forces come in steps.
    Quantisation(f64),
    /// This share of all readings is far off.
    Outliers(f64),
    /// Outside the catalogue: what the arm does so many seconds after it touched strains the sensor by this force along its way.
    Reflex(f64, f64),
    /// Outside the catalogue: a cable that snags so many times a second, and tugs along the way with this force for a moment.
    Snags(f64, f64),
}

/// Seconds over which an arm's reflex sets in, and for which a cable tugs, at least and at most.
const SETS_IN: f64 = 0.08;
const TUGS: std::ops::Range<f64> = 0.06..0.15;
/// Least force of a touch, N.
const TOUCHED: f64 = 1e-3;

/// All faults of a capture.
#[derive(Clone, Debug, Default)]
pub(in crate::lab) struct Faults(Vec<Fault>);

/// The faults among the effects.
pub(in crate::lab) fn faults(effects: &[Effect]) -> Faults {
    let of = |effect: &Effect| match effect.act {
        Act::Fault(fault) => Some(fault),
        _ => None,
    };
    Faults(effects.iter().filter_map(of).collect())
}

impl Faults {
    /// What goes wrong before the noise.
    pub fn distort(&self, performances: &mut [Performance]) {
        for fault in &self.0 {
            let limit = match fault {
                Fault::Saturation(share) => share * largest(performances),
                _ => f64::INFINITY,
            };
            for performance in performances.iter_mut() {
                fault.distort(performance, limit);
            }
        }
    }

    /// What goes wrong after it. Each stream has its own dice.
    pub fn spoil(&self, interactions: &mut [Interaction], seed: Seed) {
        for interaction in interactions {
            for fault in &self.0 {
                fault.spoil(interaction, seed);
            }
        }
    }
}

/// The largest force that is felt in any push, pull or press but for the highest peaks, N.
fn largest(performances: &[Performance]) -> f64 {
    let one = |p: &Performance| {
        let mut sizes: Vec<f64> = p.force.iter().map(|f| f.amax()).filter(|f| *f > 0.0).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() * 97 / 100).copied().unwrap_or(0.0)
    };
    performances
        .iter()
        .filter(|p| p.kind != Kind::Lift)
        .map(one)
        .fold(0.0, f64::max)
}

/// Where the tool goes: down in a press, else to the farthest point of its path.
fn way(kind: Kind, places: &[Point3<f64>]) -> Vector3<f64> {
    let first = places.first().copied().unwrap_or_else(Point3::origin);
    if kind == Kind::Press {
        return -Vector3::z();
    }
    let away = |p: &Point3<f64>| p - first;
    let far = places
        .iter()
        .map(away)
        .max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    far.and_then(|v| v.try_normalize(1e-6)).unwrap_or_else(Vector3::x)
}

impl Fault {
    fn distort(&self, p: &mut Performance, limit: f64) {
        match *self {
            Fault::Gain(gain) if p.kind != Kind::Lift => {
                p.force.iter_mut().chain(&mut p.torque).for_each(|f| *f *= 1.0 + gain);
            }
            Fault::Crosstalk(share) => {
                let places: Vec<Point3<f64>> = p.tool_pose.iter().map(|t| t.0.translation.vector.into()).collect();
                let along = way(p.kind, &places);
                let across = if p.kind == Kind::Press {
                    Vector3::x()
                } else {
                    Vector3::z().cross(&along)
                };
                for f in &mut p.force {
                    *f += across * (share * f.dot(&along)) - along * (0.6 * share * f.dot(&across));
                }
            }
            Fault::Saturation(_) if p.kind != Kind::Lift => {
                p.force.iter_mut().for_each(|f| *f = f.map(|x| x.clamp(-limit, limit)));
            }
            Fault::Delay(seconds) if seconds != 0.0 => {
                for poses in p.tracks.values_mut() {
                    *poses = late(poses, &p.track_time, seconds);
                }
            }
            Fault::Lag(seconds, poles) if seconds > 0.0 => {
                let step = p.force_time.get(1).copied().unwrap_or(0.0) - p.force_time.first().copied().unwrap_or(0.0);
                let follow = 1.0 - (-step * f64::from(poles) / seconds).exp();
                for _ in 0..poles {
                    for stream in [&mut p.force, &mut p.torque] {
                        for i in 1..stream.len() {
                            let before = stream[i - 1];
                            stream[i] = before + (stream[i] - before) * follow;
                        }
                    }
                }
            }
            Fault::Tracking(scale, angle) if scale != 0.0 || angle != 0.0 => {
                let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
                for pose in p.tracks.values_mut().flatten() {
                    pose.0.translation.vector = turn * pose.0.translation.vector * (1.0 + scale);
                }
            }
            Fault::Lever([cos, sin]) => {
                let angles = turned(p);
                for (k, t) in p.force_time.iter().enumerate() {
                    let next = p.track_time.partition_point(|x| x < t);
                    let angle = angles
                        .get(next.min(angles.len().saturating_sub(1)))
                        .copied()
                        .unwrap_or(0.0);
                    let share = cos * angle.cos() + sin * angle.sin();
                    p.force[k] *= 1.0 + share;
                    p.torque[k] *= 1.0 + share;
                }
            }
            Fault::Reflex(after, force) => {
                let places: Vec<Point3<f64>> = p.tool_pose.iter().map(|t| t.0.translation.vector.into()).collect();
                let along = way(p.kind, &places);
                let touched = |f: &Vector3<f64>| f.norm() > TOUCHED;
                let Some(first) = p.force.iter().position(touched) else {
                    return;
                };
                let begun = p.force_time[first] + after;
                for (f, t) in p.force.iter_mut().zip(&p.force_time).filter(|(f, _)| touched(f)) {
                    *f += along * (force * ((t - begun) / SETS_IN).clamp(0.0, 1.0));
                }
            }
            Fault::ToolOffset([x, y]) => {
                for pose in &mut p.tool_pose {
                    pose.0.translation.vector += Vector3::new(x, y, 0.0);
                }
            }
            _ => {}
        }
    }

    fn spoil(&self, interaction: &mut Interaction, seed: Seed) {
        let along = way(
            interaction.kind,
            interaction
                .tool_path
                .as_ref()
                .map_or(&[], |path| path.position.as_slice()),
        );
        let dice = |stream: &str| rng_for(seed, &format!("outliers {}: {stream}", interaction.name));
        let (mut force_dice, name) = (dice("force"), interaction.name.clone());
        let mut snag_dice = rng_for(seed, &format!("snags {name}"));
        let mut tug_dice = rng_for(seed, &format!("tugs {name}"));
        if let Some(wrench) = &mut interaction.force {
            match *self {
                Fault::Bias(force) => wrench.force.iter_mut().for_each(|f| *f += along * force),
                Fault::BiasWorld([x, y]) => wrench.force.iter_mut().for_each(|f| *f += Vector3::new(x, y, 0.0)),
                Fault::Drift(rate) => {
                    for (f, t) in wrench.force.iter_mut().zip(&wrench.time) {
                        *f += along * (rate * t);
                    }
                }
                Fault::Quantisation(step) if step > 0.0 => {
                    wrench
                        .force
                        .iter_mut()
                        .for_each(|f| *f = f.map(|x| (x / step).round() * step));
                }
                Fault::Outliers(share) => wrench
                    .force
                    .iter_mut()
                    .for_each(|f| *f += stray(&mut force_dice, share, 0.3)),
                Fault::ClockDrift(rate) => wrench.time.iter_mut().for_each(|t| *t *= 1.0 + rate),
                Fault::Snags(rate, force) => {
                    let mut wait = || -(1.0 - snag_dice.random::<f64>()).ln() / rate;
                    let (mut next, mut until) = (wait(), 0.0);
                    for (f, t) in wrench.force.iter_mut().zip(&wrench.time) {
                        if *t >= next {
                            until = next + TUGS.start + (TUGS.end - TUGS.start) * tug_dice.random::<f64>();
                            next = until + wait();
                        }
                        if *t < until {
                            *f += along * force;
                        }
                    }
                }
                _ => {}
            }
        }
        if let (Fault::ClockDrift(rate), Some(path)) = (self, &mut interaction.tool_path) {
            path.time.iter_mut().for_each(|t| *t *= 1.0 + rate);
        }
        if let Fault::Outliers(share) = *self {
            for (body, track) in &mut interaction.tracks {
                scatter(
                    track,
                    share,
                    &mut rng_for(seed, &format!("outliers {name}: track {body}")),
                );
            }
        }
    }
}

/// How far what turned most has turned since the beginning, rad, at every reading of the tracks.
fn turned(p: &Performance) -> Vec<f64> {
    let turns = |poses: &Vec<Pose>| -> Vec<Vector3<f64>> {
        let first = poses.first().map_or_else(Isometry3::identity, |pose| pose.0);
        let turn = |pose: &Pose| (pose.0.rotation * first.rotation.inverse()).scaled_axis();
        poses.iter().map(turn).collect()
    };
    let farthest = |way: &[Vector3<f64>]| {
        way.iter()
            .copied()
            .fold(Vector3::zeros(), |a, b| if b.norm() > a.norm() { b } else { a })
    };
    let all = p.tracks.values().map(turns);
    let most = all.max_by(|a, b| farthest(a).norm().total_cmp(&farthest(b).norm()));
    let way = most.unwrap_or_default();
    let axis = farthest(&way).try_normalize(1e-9).unwrap_or_else(Vector3::z);
    // About the same axis whichever way it went.
    let axis = if axis[axis.iamax()] < 0.0 { -axis } else { axis };
    way.iter().map(|turn| turn.dot(&axis)).collect()
}

/// Poses of a uniform stream as they were some seconds before.
fn late(poses: &[Pose], time: &[f64], seconds: f64) -> Vec<Pose> {
    let at = |t: f64| {
        let next = time.partition_point(|x| *x < t).clamp(1, poses.len() - 1);
        let (a, b) = (poses[next - 1].0, poses[next].0);
        let share = ((t - time[next - 1]) / (time[next] - time[next - 1])).clamp(0.0, 1.0);
        Pose(Isometry3::from_parts(
            a.translation.vector.lerp(&b.translation.vector, share).into(),
            a.rotation.nlerp(&b.rotation, share),
        ))
    };
    if poses.len() < 2 {
        return poses.to_vec();
    }
    time.iter().map(|t| at(t - seconds)).collect()
}

fn stray(rng: &mut impl Rng, share: f64, size: f64) -> Vector3<f64> {
    if rng.random::<f64>() >= share {
        return Vector3::zeros();
    }
    let heavy = StudentT::new(2.5).ok();
    Vector3::from_fn(|_, _| heavy.map_or(0.0, |t| size * rng.sample(t)))
}

fn scatter(track: &mut PoseStream, share: f64, rng: &mut impl Rng) {
    track.position.iter_mut().for_each(|p| *p += stray(rng, share, 0.004));
}
