//! The force sensor and the tracker: samples of a performance at their rates, with their noise.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::{NoiseSpec, Performance};
use crate::base::{Pose, Seed, rng_for};
use crate::capture::{Interaction, Noise, PoseStream, VectorStream, WrenchStream};

/// An arm knows where its tool is to this, m and rad (1 sd).
const TOOL_POSITION: f64 = 2e-5;
const TOOL_ROTATION: f64 = 2e-4;
/// What tells the slope of the support is good to this, rad (1 sd).
const INCLINE: f64 = 2e-4;

/// The noise that a capture states.
pub(super) fn stated(spec: &NoiseSpec) -> Noise {
    if !spec.stated {
        return Noise::default();
    }
    Noise {
        force: Some(spec.force),
        torque: Some(spec.torque),
        position: Some(spec.position),
        rotation: Some(spec.rotation),
    }
}

/// What is recorded of a performance that starts at `start` on the clock of the capture. Each stream has its own dice.
pub(super) fn record(performance: &Performance, spec: &NoiseSpec, start: f64, seed: Seed) -> Interaction {
    let p = performance;
    let dice = |stream: &str| rng_for(seed, &format!("interaction {}: {stream}", p.name));
    let force_samples = samples(&p.force_time, spec.force_rate);
    let track_samples = samples(&p.track_time, spec.track_rate);
    let force_clock: Vec<f64> = force_samples.iter().map(|s| on_clock(start, s.time)).collect();
    let track_clock: Vec<f64> = track_samples.iter().map(|s| on_clock(start, s.time)).collect();
    let felt = |values: &[Vector3<f64>], sd: f64, stream: &str| {
        let mut rng = dice(stream);
        let values: Vec<_> = force_samples
            .iter()
            .map(|s| s.vector(values) + normal(&mut rng) * sd)
            .collect();
        values
    };
    let tracks = p.tracks.iter().map(|(name, poses)| {
        let mut rng = dice(&format!("track {name}"));
        let stream = poses_seen(
            &track_samples,
            &track_clock,
            poses,
            [spec.position, spec.rotation],
            &mut rng,
        );
        (name.clone(), stream)
    });
    let has_tool = !p.force.is_empty() && p.tool.is_some();
    Interaction {
        name: p.name.clone(),
        kind: p.kind,
        action: None,
        tool_name: None,
        tool: p.tool.clone(),
        target: (!p.target.is_empty()).then(|| p.target.clone()),
        force: has_tool.then(|| WrenchStream {
            time: force_clock.clone(),
            force: felt(&p.force, spec.force, "force"),
            torque: (!p.torque.is_empty()).then(|| felt(&p.torque, spec.torque, "torque")),
        }),
        tool_path: (has_tool && !p.tool_pose.is_empty()).then(|| {
            let sd = [TOOL_POSITION, TOOL_ROTATION];
            poses_seen(&force_samples, &force_clock, &p.tool_pose, sd, &mut dice("tool path"))
        }),
        support_path: (!p.support_normal.is_empty()).then(|| {
            let mut rng = dice("support");
            let vectors: Vec<_> = p.support_normal.iter().map(|n| n.into_inner()).collect();
            let lean = |s: &Sample| UnitVector3::new_normalize(s.vector(&vectors) + normal(&mut rng) * INCLINE);
            VectorStream {
                time: track_clock.clone(),
                vector: track_samples.iter().map(lean).collect(),
            }
        }),
        tracks: tracks.collect(),
        frames: None,
        held_out: p.held_out,
    }
}

/// A moment of a uniform stream: between row `row` and the next one, `fraction` of the way.
struct Sample {
    time: f64,
    row: usize,
    fraction: f64,
}

impl Sample {
    fn vector(&self, rows: &[Vector3<f64>]) -> Vector3<f64> {
        let next = (self.row + 1).min(rows.len() - 1);
        rows[self.row].lerp(&rows[next], self.fraction)
    }

    fn pose(&self, rows: &[Pose]) -> Pose {
        let next = (self.row + 1).min(rows.len() - 1);
        let (a, b) = (rows[self.row].0, rows[next].0);
        Pose(Isometry3::from_parts(
            Translation3::from(a.translation.vector.lerp(&b.translation.vector, self.fraction)),
            a.rotation.nlerp(&b.rotation, self.fraction),
        ))
    }
}

/// Moments at `rate` from the first to the last of the increasing times `rows`.
fn samples(rows: &[f64], rate: f64) -> Vec<Sample> {
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else {
        return Vec::new();
    };
    let count = ((last - first) * rate + 1e-9).floor() as usize + 1;
    (0..count)
        .map(|k| {
            let time = (first + k as f64 / rate).min(*last);
            let row = rows.partition_point(|t| *t <= time).saturating_sub(1);
            let gap = rows.get(row + 1).map_or(0.0, |next| next - rows[row]);
            let fraction = if gap > 0.0 { (time - rows[row]) / gap } else { 0.0 };
            Sample { time, row, fraction }
        })
        .collect()
}

/// Seconds on the clock of the capture, to the microsecond.
fn on_clock(start: f64, time: f64) -> f64 {
    ((start + time) * 1e6).round() / 1e6
}

fn normal(rng: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.sample(StandardNormal))
}

/// Poses as a tracker sees them, with noise `[position, rotation]`; the rotation errs by a small rotation vector.
fn poses_seen(samples: &[Sample], clock: &[f64], poses: &[Pose], sd: [f64; 2], rng: &mut ChaCha8Rng) -> PoseStream {
    let mut stream = PoseStream {
        time: clock.to_vec(),
        ..PoseStream::default()
    };
    for sample in samples {
        let pose = sample.pose(poses);
        let error = UnitQuaternion::from_scaled_axis(normal(rng) * sd[1]);
        stream
            .position
            .push(Point3::from(pose.translation.vector + normal(rng) * sd[0]));
        stream.rotation.push(Some(error * pose.rotation));
    }
    stream
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::capture::Kind;

    fn sliding() -> Performance {
        let time: Vec<f64> = (0..=4000).map(|k| k as f64 * 1e-3).collect();
        let poses: Vec<Pose> = time
            .iter()
            .map(|t| Pose(Isometry3::new(Vector3::x() * 0.1 * *t, Vector3::z() * 0.2 * *t)))
            .collect();
        Performance {
            name: "slide".into(),
            kind: Kind::Hold,
            target: String::new(),
            held_out: false,
            tool: None,
            force_time: Vec::new(),
            force: Vec::new(),
            torque: Vec::new(),
            tool_pose: Vec::new(),
            track_time: time,
            tracks: BTreeMap::from([("box".to_owned(), poses)]),
            support_normal: Vec::new(),
        }
    }

    #[test]
    fn a_track_has_its_rate_its_clock_and_the_stated_noise() {
        let spec = NoiseSpec::default();
        let interaction = record(&sliding(), &spec, 7.0, Seed(3));
        assert!(interaction.force.is_none() && interaction.target.is_none());
        let track = &interaction.tracks["box"];
        assert_eq!(track.len(), 481);
        assert_eq!((track.time[0], track.time[480]), (7.0, 11.0));
        let errors = |k: usize| {
            let t = track.time[k] - 7.0;
            let turned = track.rotation[k].expect("a rotation").scaled_axis().z - 0.2 * t;
            [track.position[k].x - 0.1 * t, turned]
        };
        for (which, sd) in [(0, spec.position), (1, spec.rotation)] {
            let mean_square = (0..481).map(|k| errors(k)[which].powi(2)).sum::<f64>() / 481.0;
            assert!(
                (mean_square.sqrt() / sd - 1.0).abs() < 0.12,
                "{} for {sd}",
                mean_square.sqrt()
            );
        }
    }
}
