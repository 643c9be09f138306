//! Each interaction to be played again in the scene: what was measured, what the twin has happen, and the force.

use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Map, Value, json};

use super::pack::{base64, short};
use crate::base::Pose;
use crate::capture::{Capture, Interaction, PoseStream, Segmented, ToolShape, WrenchStream};
use crate::pipeline::Run;
use crate::stages::diagnosis::Trace;

/// Rows that a path keeps.
const MOST_ROWS: usize = 120;
/// A thing that goes less far, m, and turns less, rad, than this is not replayed.
const STILL: f64 = 1e-3;
const STILL_TURN: f64 = 0.02;

/// A row of a path: s, m, and a turn where it is known.
struct Row {
    time: f64,
    at: Vector3<f64>,
    turn: Option<UnitQuaternion<f64>>,
}

/// All that the capture's own tracks allow, in the order of the traces. Everything is world; times are s as recorded.
pub fn data(capture: &Capture, run: &Run) -> Vec<Value> {
    let of = |trace: &Trace| {
        let interaction = capture.interactions.iter().find(|i| i.name == trace.interaction)?;
        let segmented = run.segmented.iter().find(|s| s.interaction == trace.interaction);
        replay(interaction, segmented, trace)
    };
    run.traces.iter().filter_map(of).collect()
}

fn replay(interaction: &Interaction, segmented: Option<&Segmented>, trace: &Trace) -> Option<Value> {
    let measured = paths(interaction.tracks.iter().map(|(name, s)| (name, rows_of(s))));
    let predicted = paths(trace.paths.iter().map(|(name, p)| (name, posed(&p.time, &p.poses))));
    if measured.is_empty() && predicted.is_empty() {
        return None;
    }
    let tool = interaction.tool_path.as_ref().map(rows_of).and_then(|r| packed(&r));
    let tare = segmented.and_then(|s| s.force_tare).unwrap_or_else(Vector3::zeros);
    let force = interaction.force.as_ref().and_then(|f| packed(&force_rows(f, &tare)));
    let radius = interaction.tool.as_ref().and_then(|t| match t.shape {
        ToolShape::Sphere { radius } | ToolShape::Cylinder { radius, .. } => Some(short(radius)),
        ToolShape::Box { .. } | ToolShape::Mesh(_) => None,
    });
    Some(json!({
        "name": interaction.name,
        "kind": interaction.kind.name(),
        "held_out": trace.held_out,
        "measured": measured,
        "predicted": predicted,
        "tool": tool,
        "tool_radius": radius,
        "force": force,
    }))
}

/// The paths of what moves, by name.
fn paths<'a>(all: impl Iterator<Item = (&'a String, Vec<Row>)>) -> Map<String, Value> {
    all.filter(|(_, rows)| moves(rows))
        .filter_map(|(name, rows)| Some((name.clone(), packed(&rows)?)))
        .collect()
}

fn moves(rows: &[Row]) -> bool {
    let Some(first) = rows.first() else { return false };
    rows.iter().any(|r| {
        let turned = first.turn.zip(r.turn).map_or(0.0, |(a, b)| a.angle_to(&b));
        (r.at - first.at).norm() > STILL || turned > STILL_TURN
    })
}

fn rows_of(stream: &PoseStream) -> Vec<Row> {
    let all = stream.time.iter().zip(&stream.position).zip(&stream.rotation);
    all.map(|((time, at), turn)| Row {
        time: *time,
        at: at.coords,
        turn: *turn,
    })
    .filter(Row::is_read)
    .collect()
}

fn posed(time: &[f64], poses: &[Pose]) -> Vec<Row> {
    let all = time.iter().zip(poses);
    all.map(|(time, pose)| Row {
        time: *time,
        at: pose.0.translation.vector,
        turn: Some(pose.0.rotation),
    })
    .filter(Row::is_read)
    .collect()
}

impl Row {
    fn is_read(&self) -> bool {
        self.time.is_finite() && self.at.iter().all(|x| x.is_finite())
    }
}

/// The mean force on the body over equal spans, without the tare, N.
fn force_rows(stream: &WrenchStream, tare: &Vector3<f64>) -> Vec<Row> {
    let (Some(first), Some(last)) = (stream.time.first(), stream.time.last()) else {
        return Vec::new();
    };
    let span = (last - first) / MOST_ROWS as f64;
    let mean = |k: usize| {
        let from = stream.time.partition_point(|t| *t < first + k as f64 * span);
        let to = stream.time.partition_point(|t| *t < first + (k + 1) as f64 * span);
        let read: Vec<&Vector3<f64>> = stream.force[from..to]
            .iter()
            .filter(|f| f.iter().all(|x| x.is_finite()))
            .collect();
        let sum: Vector3<f64> = read.iter().copied().sum();
        (!read.is_empty()).then(|| Row {
            time: first + (k as f64 + 0.5) * span,
            at: sum / read.len() as f64 - tare,
            turn: None,
        })
    };
    (0..MOST_ROWS).filter_map(mean).collect()
}

/// At most [`MOST_ROWS`] rows, evenly taken. Times and places are counts of 1/65535 of their spans, turns of 1/32767.
fn packed(rows: &[Row]) -> Option<Value> {
    let kept = rows.len().min(MOST_ROWS);
    let pick = |k: usize| if kept > 1 { k * (rows.len() - 1) / (kept - 1) } else { 0 };
    let rows: Vec<&Row> = (0..kept).map(|k| &rows[pick(k)]).collect();
    let (first, last) = (rows.first()?, rows.last()?);
    let time = (first.time, last.time - first.time);
    let (low, high) = rows
        .iter()
        .fold((first.at, first.at), |(l, h), r| (l.inf(&r.at), h.sup(&r.at)));
    let span = high - low;
    let count = |x: f64, low: f64, span: f64| {
        let share = if span > 0.0 { (x - low) / span } else { 0.0 };
        ((share * 65535.0).round() as u16).to_le_bytes()
    };
    let times: Vec<u8> = rows.iter().flat_map(|r| count(r.time, time.0, time.1)).collect();
    let places = rows.iter().flat_map(|r| {
        (0..3)
            .flat_map(|k| count(r.at[k], low[k], span[k]))
            .collect::<Vec<u8>>()
    });
    let turns: Option<Vec<UnitQuaternion<f64>>> = rows.iter().map(|r| r.turn).collect();
    let short_ints = |q: &UnitQuaternion<f64>| {
        let coords: [f64; 4] = q.coords.into();
        coords.map(|x| ((x * 32767.0).round() as i16).to_le_bytes())
    };
    let turns = turns.map(|all| base64(all.iter().flat_map(short_ints).collect::<Vec<_>>().as_flattened()));
    Some(json!({
        "start": short(time.0),
        "lasts": short(time.1),
        "times": base64(&times),
        "low": low.map(short).as_slice(),
        "span": span.map(short).as_slice(),
        "places": base64(&places.collect::<Vec<u8>>()),
        "turns": turns,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(time: f64, x: f64) -> Row {
        Row {
            time,
            at: Vector3::new(x, 0.0, 0.0),
            turn: Some(UnitQuaternion::identity()),
        }
    }

    #[test]
    fn a_long_path_is_thinned_and_keeps_its_ends() {
        let rows: Vec<Row> = (0..1000).map(|i| row(f64::from(i), f64::from(i))).collect();
        let value = packed(&rows).expect("a path");
        assert_eq!(value["lasts"], 999.0);
        assert_eq!(value["span"], json!([999.0, 0.0, 0.0]));
        let times = value["times"].as_str().expect("text");
        assert!(times.starts_with("AAA") && times.len() == MOST_ROWS * 2 * 4 / 3);
    }

    #[test]
    fn what_stays_is_left_out() {
        assert!(!moves(&[row(0.0, 0.0), row(1.0, 5e-4)]));
        assert!(moves(&[row(0.0, 0.0), row(1.0, 5e-3)]));
        assert!(!moves(&[]));
    }
}
