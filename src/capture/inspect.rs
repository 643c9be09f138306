//! Looks at a capture as recorded: rates, gaps, noise at rest, forces, how far things moved. It estimates nothing.

use std::collections::BTreeSet;

use nalgebra::Vector3;

use super::inspect_missing::{doubts, missing};
use super::inspect_noise::{noise_at_rest, rotation_steps, steps};
use super::inspect_views::summarise_views;
use super::inspection::{Inspection, InteractionSummary, Motion, NoiseAtRest, StreamSummary};
use super::{Capture, Interaction, PoseStream, Tool, ToolShape, WrenchStream};

/// A step of more than this many median steps counts as a gap.
const GAP: f64 = 5.0;

/// What `capture` holds, how good its recordings are, and what they cannot tell.
pub fn inspect(capture: &Capture) -> Inspection {
    let interactions: Vec<InteractionSummary> = capture.interactions.iter().map(interaction).collect();
    Inspection {
        name: capture.name.clone(),
        digest: capture.digest.clone(),
        views: summarise_views(capture),
        bodies: body_names(capture),
        missing: missing(capture),
        doubts: doubts(capture, &interactions),
        interactions,
    }
}

/// Every body or link that is listed, tracked or aimed at; of a body whose links are named, the links.
pub(super) fn body_names(capture: &Capture) -> Vec<String> {
    let tracked = capture
        .interactions
        .iter()
        .flat_map(|x| x.tracks.keys().chain(&x.target));
    let all: BTreeSet<&String> = capture.bodies.iter().map(|b| &b.name).chain(tracked).collect();
    let whole = |name: &&String| !all.iter().any(|other| is_link_of(other, name));
    all.iter().copied().filter(whole).cloned().collect()
}

/// True for `body/link` of `body`.
pub(super) fn is_link_of(link: &str, body: &str) -> bool {
    link.split_once('/').is_some_and(|(of, _)| of == body)
}

fn interaction(x: &Interaction) -> InteractionSummary {
    let mut streams = Vec::new();
    streams.extend(x.force.as_ref().map(force_stream));
    streams.extend(x.tool_path.as_ref().map(|s| pose_stream("tool_path".into(), s)));
    streams.extend(
        x.support_path
            .as_ref()
            .map(|s| stream("support_path".into(), &s.time, 0, Vec::new())),
    );
    streams.extend(
        x.tracks
            .iter()
            .map(|(name, s)| pose_stream(format!("tracks.{name}"), s)),
    );
    let start = streams.iter().map(|s| s.span[0]).fold(f64::INFINITY, f64::min);
    let end = streams.iter().map(|s| s.span[1]).fold(f64::NEG_INFINITY, f64::max);
    let largest = |vectors: &[Vector3<f64>]| {
        vectors
            .iter()
            .map(|v| v.norm())
            .filter(|n| n.is_finite())
            .reduce(f64::max)
    };
    let torque = x.force.as_ref().and_then(|s| s.torque.as_deref());
    InteractionSummary {
        name: x.name.clone(),
        kind: x.kind.name(),
        target: x.target.clone(),
        action: x.action.clone(),
        tool: x.tool.as_ref().map(tool_in_words),
        held_out: x.held_out,
        duration: (end - start).max(0.0),
        streams,
        peak_force: x.force.as_ref().and_then(|s| largest(&s.force)),
        peak_torque: torque.and_then(largest),
        largest_tilt_deg: largest_tilt(x),
        moved: x.tracks.iter().filter_map(|(name, s)| motion(name, s)).collect(),
        frames: x.frames.as_ref().map_or(0, |f| f.time.len()),
    }
}

fn largest_tilt(x: &Interaction) -> Option<f64> {
    let vectors = &x.support_path.as_ref()?.vector;
    let first = vectors.first()?;
    vectors.iter().map(|v| first.angle(v).to_degrees()).reduce(f64::max)
}

fn tool_in_words(tool: &Tool) -> String {
    let shape = match &tool.shape {
        ToolShape::Sphere { radius } => format!("sphere of radius {:.1} mm", 1e3 * radius),
        ToolShape::Box { half } => format!(
            "box of {:.1} x {:.1} x {:.1} mm",
            2e3 * half.x,
            2e3 * half.y,
            2e3 * half.z
        ),
        ToolShape::Cylinder { radius, half_height } => {
            format!(
                "cylinder of radius {:.1} mm, height {:.1} mm",
                1e3 * radius,
                2e3 * half_height
            )
        }
        ToolShape::Mesh(_) => "mesh tool".into(),
    };
    let holds = if tool.grip {
        ", grips"
    } else if tool.pin {
        ", pivots"
    } else {
        ""
    };
    format!("{shape}{holds}")
}

fn force_stream(s: &WrenchStream) -> StreamSummary {
    let gone = s.force.iter().filter(|f| f.iter().all(|x| x.is_nan())).count();
    let mut noise: Vec<NoiseAtRest> = noise_at_rest("force", "N", &steps(&s.force)).into_iter().collect();
    noise.extend(
        s.torque
            .as_ref()
            .and_then(|t| noise_at_rest("torque", "N·m", &steps(t))),
    );
    stream("force".into(), &s.time, gone, noise)
}

fn pose_stream(name: String, s: &PoseStream) -> StreamSummary {
    let positions: Vec<Vector3<f64>> = s.position.iter().map(|p| p.coords).collect();
    let gone = positions.iter().filter(|p| p.x.is_nan()).count();
    let mut noise: Vec<NoiseAtRest> = noise_at_rest("position", "m", &steps(&positions)).into_iter().collect();
    noise.extend(noise_at_rest("rotation", "rad", &rotation_steps(&s.rotation)));
    stream(name, &s.time, gone, noise)
}

fn stream(name: String, time: &[f64], missing_rows: usize, noise: Vec<NoiseAtRest>) -> StreamSummary {
    let step = median_step(time);
    let gap = |w: &[f64]| {
        step.is_some_and(|step| w[1] - w[0] > GAP * step)
            .then(|| [w[0], w[1] - w[0]])
    };
    StreamSummary {
        name,
        rows: time.len(),
        span: [
            time.first().copied().unwrap_or(0.0),
            time.last().copied().unwrap_or(0.0),
        ],
        rate: step.map(|step| 1.0 / step),
        missing_rows,
        gaps: time.windows(2).filter_map(gap).collect(),
        noise,
    }
}

/// The median of the steps of a clock that goes on, s; none for fewer than three rows.
fn median_step(time: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).filter(|dt| *dt > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    if time.len() > 2 {
        steps.get(steps.len() / 2).copied()
    } else {
        None
    }
}

fn motion(name: &str, s: &PoseStream) -> Option<Motion> {
    let seen: Vec<usize> = (0..s.len()).filter(|i| s.position[*i].x.is_finite()).collect();
    let (first, last) = (*seen.first()?, *seen.last()?);
    let from = |i: usize| (s.position[i] - s.position[first]).norm();
    let start = s.rotation[first];
    let turned = |i: &usize| Some(start?.angle_to(s.rotation[*i].as_ref()?).to_degrees());
    Some(Motion {
        body: name.to_owned(),
        farthest: seen.iter().map(|i| from(*i)).fold(0.0, f64::max),
        net: from(last),
        turned_deg: seen.iter().filter_map(turned).reduce(f64::max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_gaps_and_motion_are_as_recorded() {
        let mut time: Vec<f64> = (0..50).map(|i| f64::from(i) * 0.01).collect();
        time.extend((0..50).map(|i| 1.0 + f64::from(i) * 0.01));
        let summary = stream("force".into(), &time, 0, Vec::new());
        assert!((summary.rate.expect("a rate") - 100.0).abs() < 1e-6);
        assert_eq!(summary.gaps.len(), 1);
        assert!((summary.gaps[0][1] - 0.51).abs() < 1e-9);
        let pair = PoseStream {
            time: vec![0.0, 1.0],
            position: vec![[0.0, 0.0, 0.0].into(), [0.3, 0.4, 0.0].into()],
            rotation: vec![None, None],
        };
        let moved = motion("box", &pair).expect("moved");
        assert!((moved.net - 0.5).abs() < 1e-12 && moved.turned_deg.is_none());
        assert_eq!(pose_stream("t".into(), &pair).rate, None);
    }
}
