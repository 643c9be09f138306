//! What was recorded of a fast push, as it is followed as a whole ([`super::shoved`]).

use nalgebra::{UnitQuaternion, Vector2, Vector3};

use super::action::rest_pose;
use super::coast::Shape;
use super::evidence::{Tare, mean_wrench, tare_of, tool_at};
use super::face::Face;
use super::facts::Ground;
use super::push::Plane;
use crate::capture::{Interaction, PhaseKind, Segmented, WrenchStream};
use crate::math::{median, quantile};
use crate::physics::Shove;

/// Least speed at which a body coasts a millimetre and more once it is let go, m/s.
const FAST: f64 = 0.1;
/// Rows of the track that are compared at most.
const MOST: usize = 300;
/// Time after the last motion that is compared, s.
const REST: f64 = 0.08;
/// What exceeds this many times the usual force of the push is a blow; time after it until its force is forgotten, s.
const BLOW: f64 = 2.5;
const AFTER: f64 = 0.012;
/// Readings, at 500 a second or fewer, from which on the impulse of a blow is known.
const OFTEN: f64 = 4.0;
/// Time before the touch that is compared, s: what stands there has no speed.
const STANDS: f64 = 0.03;

/// What was recorded of one fast push, in the plane of the support.
pub(super) struct Run {
    pub shoves: Vec<Shove>,
    pub time: Vec<f64>,
    pub position: Vec<Vector2<f64>>,
    pub heading: Vec<f64>,
    /// From the tracked point to the centroid at the start, m.
    pub centre: Vector2<f64>,
    pub noise: (f64, f64),
    /// World-from-link turn at the start, and the heading at which the link's own plane axes are those of the plane.
    pub home: UnitQuaternion<f64>,
    pub aligned: f64,
    /// Along the support's normal, m/s².
    pub gravity: f64,
}

/// A push as it was recorded, from rest on, before the finger touched, or from the sliding on; nothing where it was not fast, or where what
/// is wanted is not in it.
pub(super) fn run_of(
    interaction: &Interaction,
    segmented: &Segmented,
    link: &str,
    ground: &Ground,
    shape: &Shape,
    face: Option<&Face>,
    from_rest: bool,
) -> Option<Run> {
    let track = interaction.tracks.get(link).filter(|t| !t.is_snapshot_pair())?;
    let (stream, tool) = (interaction.force.as_ref()?, interaction.tool_path.as_ref()?);
    // A hand twists what it holds: without its torque nobody knows by how much.
    if stream.torque.is_none() && interaction.tool.as_ref().is_some_and(|t| t.grip) {
        return None;
    }
    let plane = &ground.plane;
    if plane.flat(&ground.gravity).norm() > 0.02 * ground.gravity.norm() {
        return None;
    }
    let rest = segmented.phases.first().filter(|p| p.kind == PhaseKind::Rest)?;
    let home = rest_pose(track, (rest.start, rest.end))?.0;
    let tare = tare_of(interaction, segmented);
    let from = begins(stream, segmented, &tare, plane, from_rest)?;
    let origin = plane.flat(&home.translation.vector);
    let heading = |i: usize| {
        let turn: Vector3<f64> = (track.rotation[i]? * home.rotation.inverse()).scaled_axis();
        Some(turn.dot(&plane.normal))
    };
    let noise = (
        segmented.position_noise.unwrap_or(3e-4).max(2e-5),
        segmented.rotation_noise.unwrap_or(3e-3).max(2e-4),
    );
    let rows: Vec<Row> = (0..track.len())
        .filter(|&i| track.time[i] >= from && track.position[i].coords.iter().all(|x| x.is_finite()))
        .filter_map(|i| Some((track.time[i], plane.flat(&track.position[i].coords), heading(i)?)))
        .collect();
    let (rows, until) = until_it_stands(rows, noise.0)?;
    if stream.misses(from, until) {
        return None;
    }
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let half = 0.5 / rate.min(500.0);
    let shove = |&t: &f64| {
        let wrench = mean_wrench(stream, t - half, t + half, &tare)?;
        let finger = tool_at(tool, t)?;
        let row = track.time.partition_point(|x| *x < t).min(track.len() - 1);
        // Without torque the force acts where finger and face touch.
        let touch = match (wrench.torque, face, track.pose(row)) {
            (None, Some(face), Some(pose)) => face.touch(&pose.0, &finger).unwrap_or_default(),
            _ => Vector3::zeros(),
        };
        Some(Shove {
            time: t,
            force: plane.flat(&wrench.force),
            at: plane.flat(&(finger + touch).coords).into(),
            moment: wrench.torque.map_or(0.0, |m| m.dot(&plane.normal)),
            height: (finger - ground.point).dot(&plane.normal).max(0.0),
            lift: wrench.force.dot(&plane.normal),
        })
    };
    let inside = stream.time.iter().filter(|t| **t >= from && **t <= until);
    Some(Run {
        shoves: inside.filter_map(shove).collect(),
        time: rows.iter().map(|r| r.0).collect(),
        position: rows.iter().map(|r| r.1).collect(),
        heading: rows.iter().map(|r| r.2).collect(),
        centre: plane.flat(&(home * shape.centre).coords) - origin,
        noise,
        home: home.rotation,
        aligned: {
            let own = plane.flat(&(home.rotation * Plane::of(home.rotation.inverse() * plane.normal).x));
            -own.y.atan2(own.x)
        },
        gravity: -ground.gravity.dot(&plane.normal),
    })
}

/// Time, place and heading.
type Row = (f64, Vector2<f64>, f64);

/// The rows until it stands, and when that is, s; nothing where it was not fast.
fn until_it_stands(mut rows: Vec<Row>, noise: f64) -> Option<(Vec<Row>, f64)> {
    let last = rows.last()?.1;
    let stands = rows.iter().rposition(|r| (r.1 - last).norm() > 4.0 * noise)?;
    let until = rows[stands].0 + REST;
    rows.retain(|r| r.0 <= until);
    let speeds: Vec<f64> = rows
        .windows(4)
        .map(|w| (w[3].1 - w[0].1).norm() / (w[3].0 - w[0].0).max(1e-6))
        .collect();
    if rows.len() < 12 || quantile(&speeds, 0.95)? < FAST {
        return None;
    }
    let step = rows.len().div_ceil(MOST);
    Some((rows.into_iter().step_by(step).collect(), until))
}

/// From when on it is followed, s.
fn begins(stream: &WrenchStream, segmented: &Segmented, tare: &Tare, plane: &Plane, from_rest: bool) -> Option<f64> {
    let first = |kind| segmented.of(kind).map(|p| p.start).reduce(f64::min);
    let onset = first(PhaseKind::Slide)?;
    let from = after_blows(stream, tare, plane, onset)?;
    if !from_rest {
        return Some(from);
    }
    (from <= onset).then_some(onset.min(first(PhaseKind::Stick).unwrap_or(onset)) - STANDS)
}

/// When the last blow is over, s: the force that is usual in contact is exceeded no more.
fn after_blows(stream: &WrenchStream, tare: &Tare, plane: &Plane, onset: f64) -> Option<f64> {
    let size = |i: usize| plane.flat(&(stream.force[i] - tare.force)).norm();
    let rows: Vec<usize> = (0..stream.time.len()).filter(|&i| size(i).is_finite()).collect();
    let strong = rows.iter().map(|i| size(*i)).fold(0.0, f64::max);
    let touching: Vec<f64> = rows
        .iter()
        .map(|i| size(*i))
        .filter(|f| *f > 0.05 * strong.min(10.0))
        .collect();
    let usual = median(&touching)?;
    let rate = (stream.time.len() as f64 - 1.0) / (stream.time.last()? - stream.time.first()?);
    let mut end = onset;
    for blow in rows.chunk_by(|a, b| (size(*a) > BLOW * usual) == (size(*b) > BLOW * usual)) {
        let span = stream.time[blow[blow.len() - 1]] - stream.time[blow[0]];
        // One that is read often enough tells its impulse.
        if size(blow[0]) > BLOW * usual && span * rate.min(500.0) < OFTEN {
            end = end.max(stream.time[blow[blow.len() - 1]] + AFTER);
        }
    }
    Some(end)
}
