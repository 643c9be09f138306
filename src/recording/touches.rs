//! Each touch: the motion as measured and as predicted, the tool on its way, what it felt.

use nalgebra::Vector3;
use re_sdk_types::archetypes::{
    Arrows3D, Boxes3D, Clear, Cylinders3D, LineStrips3D, Points3D, Scalars, SeriesLines, Transform3D,
};

use super::clock::{Moment, Span};
use super::scene::{HIDDEN, MEASURED, ORANGE, PREDICTED, place, quaternion};
use super::stream::Stream;
use crate::base::{Pose, Result};
use crate::capture::{Capture, Interaction, PoseStream, Tool, ToolShape, WrenchStream};
use crate::pipeline::Run;
use crate::stages::diagnosis::Path;

/// The length of the arrow of the largest force of the capture, m.
const LONGEST: f64 = 0.15;
/// A thing that goes less far than this leaves no line, m.
const STILL: f64 = 1e-3;
/// How long after its last reading a touch is taken from the scene, s.
const LINGER: f64 = 0.5;
/// The colours of what was measured, and of forces.
const GREY: [u8; 3] = [120, 130, 140];
const FORCE: [u8; 3] = [40, 120, 220];
const AXES: [(&str, [u8; 3]); 3] = [("x", [220, 60, 60]), ("y", [60, 160, 60]), ("z", [60, 90, 220])];

/// All touches, in the order of the capture.
pub(super) fn log(stream: &mut Stream, capture: &Capture, run: &Run, spans: &[Option<Span>]) -> Result<()> {
    for (name, unit) in [("force", "N"), ("torque", "N·m")] {
        let lines = SeriesLines::new()
            .with_names(AXES.map(|(axis, _)| format!("{axis}, {unit}")))
            .with_colors(AXES.map(|(_, color)| color));
        stream.still(&["tool", name], &lines)?;
    }
    let scale = LONGEST / largest_force(capture).max(1e-9);
    for (interaction, span) in capture.interactions.iter().zip(spans) {
        let Some(span) = span else { continue };
        let trace = run.traces.iter().find(|t| t.interaction == interaction.name);
        let segmented = run.segmented.iter().find(|s| s.interaction == interaction.name);
        for (name, track) in &interaction.tracks {
            measured(stream, span, name, track)?;
        }
        for (name, path) in trace.iter().flat_map(|t| &t.paths) {
            predicted(stream, span, name, path)?;
        }
        tool(stream, span, interaction)?;
        if let Some(force) = &interaction.force {
            let tare = segmented.and_then(|s| s.force_tare).unwrap_or_else(Vector3::zeros);
            arrows(stream, span, interaction, force, (tare, scale))?;
            readings(stream, span, "force", &force.time, &force.force)?;
            if let Some(torque) = &force.torque {
                readings(stream, span, "torque", &force.time, torque)?;
            }
        }
        let end = Moment {
            played: span.at(span.end).played + LINGER,
            recorded: span.end,
        };
        stream.at(&["world", "touch"], end, &Clear::recursive())?;
    }
    Ok(())
}

/// The largest force that was read, N.
fn largest_force(capture: &Capture) -> f64 {
    let streams = capture.interactions.iter().filter_map(|i| i.force.as_ref());
    let sizes = streams.flat_map(|s| &s.force).map(Vector3::norm);
    sizes.filter(|f| f.is_finite()).fold(0.0, f64::max)
}

/// The rows of a stream that were read, as moments and places, with the turn where it was read.
fn motion(span: &Span, track: &PoseStream) -> (Vec<Moment>, Transform3D, Vec<[f32; 3]>) {
    let mut turn = None;
    let (mut moments, mut places, mut turns) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..track.len() {
        let at = track.position[i];
        if !at.coords.iter().all(|x| x.is_finite()) || !span.holds(track.time[i]) {
            continue;
        }
        turn = track.rotation[i].or(turn);
        moments.push(span.at(track.time[i]));
        places.push(place(&at.coords));
        turns.extend(turn.as_ref().map(quaternion));
    }
    let moved = Transform3D::update_fields().with_many_translation(places.iter().copied());
    let moved = if turns.len() == places.len() {
        moved.with_many_quaternion(turns)
    } else {
        moved
    };
    (moments, moved, places)
}

fn measured(stream: &mut Stream, span: &Span, name: &str, track: &PoseStream) -> Result<()> {
    let (moments, moved, places) = motion(span, track);
    stream.rows(&["world", MEASURED, name], &moments, moved.columns_of_unit_batches())?;
    line(stream, span, &["world", "touch", "way", MEASURED, name], places, GREY)
}

fn predicted(stream: &mut Stream, span: &Span, name: &str, path: &Path) -> Result<()> {
    let all = path.time.iter().zip(&path.poses);
    let rows: Vec<(&f64, &Pose)> = all.filter(|(time, _)| span.holds(**time)).collect();
    let moments: Vec<Moment> = rows.iter().map(|(time, _)| span.at(**time)).collect();
    let places: Vec<[f32; 3]> = rows.iter().map(|(_, p)| place(&p.0.translation.vector)).collect();
    let moved = Transform3D::update_fields()
        .with_many_translation(places.iter().copied())
        .with_many_quaternion(rows.iter().map(|(_, p)| quaternion(&p.0.rotation)))
        .with_many_scale(rows.iter().map(|_| 1.0_f32));
    stream.rows(&["world", PREDICTED, name], &moments, moved.columns_of_unit_batches())?;
    line(
        stream,
        span,
        &["world", "touch", "way", PREDICTED, name],
        places,
        ORANGE,
    )?;
    let Some(last) = moments.last() else { return Ok(()) };
    let gone = Moment {
        played: last.played + LINGER,
        recorded: last.recorded,
    };
    stream.at(
        &["world", PREDICTED, name],
        gone,
        &Transform3D::update_fields().with_scale(HIDDEN),
    )
}

/// The whole way of what moves, from the start of the touch.
fn line(stream: &mut Stream, span: &Span, at: &[&str], places: Vec<[f32; 3]>, color: [u8; 3]) -> Result<()> {
    let Some(first) = places.first().copied() else {
        return Ok(());
    };
    let far = |p: &[f32; 3]| (0..3).any(|k| f64::from(p[k] - first[k]).abs() > STILL);
    if !places.iter().any(far) {
        return Ok(());
    }
    let strip = LineStrips3D::new([places])
        .with_colors([color])
        .with_radii([0.0008_f32]);
    stream.at(at, span.at(span.start), &strip)
}

fn tool(stream: &mut Stream, span: &Span, interaction: &Interaction) -> Result<()> {
    let Some(path) = &interaction.tool_path else {
        return Ok(());
    };
    let (moments, moved, places) = motion(span, path);
    stream.rows(&["world", "touch", "tool"], &moments, moved.columns_of_unit_batches())?;
    if let (Some(first), Some(shape)) = (moments.first(), &interaction.tool) {
        body(stream, *first, shape)?;
    }
    line(stream, span, &["world", "touch", "way", "tool"], places, FORCE)
}

/// The shape of the tool, in its own frame; a mesh is drawn as a point of 5 mm.
fn body(stream: &mut Stream, moment: Moment, tool: &Tool) -> Result<()> {
    let at: &[&str] = &["world", "touch", "tool"];
    let ball = |radius: f64| {
        Points3D::new([[0.0_f32; 3]])
            .with_radii([radius as f32])
            .with_colors([FORCE])
    };
    match &tool.shape {
        ToolShape::Sphere { radius } => stream.at(at, moment, &ball(*radius)),
        ToolShape::Box { half } => stream.at(
            at,
            moment,
            &Boxes3D::from_half_sizes([place(half)]).with_colors([FORCE]),
        ),
        ToolShape::Cylinder { radius, half_height } => {
            let drawn = Cylinders3D::from_lengths_and_radii([2.0 * *half_height as f32], [*radius as f32]);
            stream.at(at, moment, &drawn.with_colors([FORCE]))
        }
        ToolShape::Mesh(_) => stream.at(at, moment, &ball(0.005)),
    }
}

/// The force on the body without the tare, from where the tool was; none where the tool's place is not known.
fn arrows(
    stream: &mut Stream,
    span: &Span,
    interaction: &Interaction,
    force: &WrenchStream,
    (tare, scale): (Vector3<f64>, f64),
) -> Result<()> {
    let Some(path) = &interaction.tool_path else {
        return Ok(());
    };
    let (mut moments, mut origins, mut vectors) = (Vec::new(), Vec::new(), Vec::new());
    for (time, felt) in force.time.iter().zip(&force.force) {
        let row = path.time.partition_point(|t| t <= time).saturating_sub(1);
        let Some(at) = path.position.get(row) else { continue };
        if felt.iter().chain(at.coords.iter()).all(|x| x.is_finite()) && span.holds(*time) {
            moments.push(span.at(*time));
            origins.push(place(&at.coords));
            vectors.push(place(&((felt - tare) * scale)));
        }
    }
    let drawn = Arrows3D::from_vectors(vectors).with_origins(origins);
    stream.rows(&["world", "touch", "force"], &moments, drawn.columns_of_unit_batches())?;
    let Some(first) = moments.first() else { return Ok(()) };
    let look = Arrows3D::update_fields().with_colors([FORCE]).with_radii([0.0015_f32]);
    stream.at(&["world", "touch", "force"], *first, &look)
}

/// Each component as recorded, the tare in it.
fn readings(stream: &mut Stream, span: &Span, name: &str, time: &[f64], all: &[Vector3<f64>]) -> Result<()> {
    let read: Vec<(Moment, &Vector3<f64>)> = time
        .iter()
        .zip(all)
        .filter(|(t, v)| span.holds(**t) && v.iter().all(|x| x.is_finite()))
        .map(|(t, v)| (span.at(*t), v))
        .collect();
    let moments: Vec<Moment> = read.iter().map(|(m, _)| *m).collect();
    let values = Scalars::new(read.iter().flat_map(|(_, v)| [v.x, v.y, v.z]));
    let columns = values.columns(std::iter::repeat_n(AXES.len(), read.len()));
    stream.rows(&["tool", name], &moments, columns)
}
