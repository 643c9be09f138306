//! Whether what tracks was knocked, or the table with all on it: a thing that no touch ever moved is found elsewhere from one
//! interaction on, and the others are where the same motion takes them.
//!
//! A hand that puts things back between touches moves each by a motion of its own, but lifts none off the table.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::capture::{Capture, Interaction, PoseStream};
use crate::math::{mad_sd, median};
use crate::twin::{Evidence, Finding};

/// Readings at either end of a track that tell where a thing rests.
const READINGS: usize = 12;
/// Least jump, m, and standard deviations of a rest from which on it counts; those within which things have jumped as one.
const JUMP: (f64, f64) = (1e-3, 8.0);
const AS_ONE: f64 = 5.0;
/// How far a touch moves what it moves, m.
const MOVED: f64 = 5e-3;
/// Least jump of the height of all, m.
const RISES: f64 = 5e-4;
/// Noise of an angle that is thought of where a track does not tell it, rad.
const ANGLE: f64 = 2e-3;

/// Where a thing rests, and how well that is known: m, rad.
struct Rest {
    pose: Isometry3<f64>,
    place_sd: f64,
    angle_sd: f64,
}

impl Rest {
    /// From the first readings of a track, or from its last ones.
    fn of(track: &PoseStream, last: bool) -> Option<Self> {
        let known = |i: &usize| track.rotation[*i].is_some() && track.position[*i].iter().all(|x| x.is_finite());
        let mut rows: Vec<usize> = (0..track.len()).filter(known).collect();
        if last {
            rows.reverse();
        }
        rows.truncate(READINGS);
        let axis = |k: usize| rows.iter().map(|i| track.position[*i][k]).collect::<Vec<f64>>();
        let first = track.rotation[*rows.first().filter(|_| rows.len() == READINGS)?]?;
        let turns: Vec<Vector3<f64>> = rows
            .iter()
            .filter_map(|i| Some((first.inverse() * track.rotation[*i]?).scaled_axis()))
            .collect();
        let turn = |k: usize| turns.iter().map(|t| t[k]).collect::<Vec<f64>>();
        let each = [0, 1, 2];
        let place = each.map(|k| median(&axis(k)).unwrap_or(0.0));
        let angle = each.map(|k| median(&turn(k)).unwrap_or(0.0));
        let spread = |of: &dyn Fn(usize) -> Vec<f64>| each.iter().filter_map(|k| mad_sd(&of(*k))).fold(0.0, f64::max);
        let told = 1.25 / (READINGS as f64).sqrt();
        Some(Self {
            pose: Isometry3::from_parts(
                Point3::from(place).into(),
                first * UnitQuaternion::from_scaled_axis(Vector3::from(angle)),
            ),
            place_sd: (told * spread(&axis)).max(5e-5),
            angle_sd: told * spread(&turn).max(ANGLE),
        })
    }
}

/// What a knock feigns: places that are read beside where they are.
const FEIGNED: [&str; 2] = ["contact-point-offset", "tracking-error"];

/// That all that is tracked jumped as one between two interactions, though one of the things was never moved by a touch. What the places
/// before and after it were named for has no name then.
pub(super) fn knocked(capture: &Capture, findings: &mut Vec<Finding>) -> Option<Evidence> {
    let names: Vec<&str> = capture.bodies.iter().map(|b| b.name.as_str()).collect();
    let up = capture.support.as_ref().map(|s| s.normal.into_inner());
    let up = up.or_else(|| (-capture.gravity).try_normalize(1e-9))?;
    let knock = told(&names, &up, &capture.interactions)?;
    findings.retain(|f| !FEIGNED.contains(&f.cause.as_str()));
    Some(knock)
}

fn told(names: &[&str], up: &Vector3<f64>, interactions: &[Interaction]) -> Option<Evidence> {
    let untouched: Vec<&&str> = names.iter().filter(|name| stays(interactions, name)).collect();
    // What stands on a support that is tilted goes with it.
    let level = |pair: &&[Interaction]| pair.iter().all(|i| i.support_path.is_none());
    let pairs = interactions.windows(2).filter(level);
    pairs
        .filter_map(|pair| untouched.iter().find_map(|name| jumped([&pair[0], &pair[1]], name, up)))
        .max_by(|a, b| a.statistic.total_cmp(&b.statistic))
}

/// Whether no touch is of a thing, and it rests at the end of each interaction where it did at the beginning.
fn stays(interactions: &[Interaction], name: &str) -> bool {
    let targeted = |i: &Interaction| i.target.as_deref().is_some_and(|t| t.split('/').next() == Some(name));
    let rests = |i: &Interaction| {
        let Some(track) = i.tracks.get(name) else { return true };
        let ends = Rest::of(track, false).zip(Rest::of(track, true));
        ends.is_some_and(|(a, b)| {
            let gone = (b.pose.translation.vector - a.pose.translation.vector).norm();
            gone < JUMP.0.max(JUMP.1 * a.place_sd.hypot(b.place_sd))
        })
    };
    // What rides on a thing that is touched stands as long as that does.
    let stood_by = |i: &Interaction| {
        let moved = |track: &PoseStream| {
            Rest::of(track, false)
                .zip(Rest::of(track, true))
                .is_some_and(|(a, b)| (b.pose.translation.vector - a.pose.translation.vector).norm() > MOVED)
        };
        i.tracks.contains_key(name) && i.tracks.iter().any(|(other, track)| other != name && moved(track))
    };
    !interactions.iter().any(targeted) && interactions.iter().all(rests) && interactions.iter().any(stood_by)
}

fn jumped([before, after]: [&Interaction; 2], name: &str, up: &Vector3<f64>) -> Option<Evidence> {
    let ends = |name: &str| Rest::of(before.tracks.get(name)?, true).zip(Rest::of(after.tracks.get(name)?, false));
    let (a, b) = ends(name)?;
    let motion = b.pose * a.pose.inverse();
    let gone = (b.pose.translation.vector - a.pose.translation.vector).norm();
    let sd = a.place_sd.hypot(b.place_sd);
    if gone < JUMP.0.max(JUMP.1 * sd) {
        return None;
    }
    let rose = (b.pose.translation.vector - a.pose.translation.vector).dot(up);
    let as_one = |other: &String| {
        let (c, d) = ends(other)?;
        let away = (c.pose.translation.vector - a.pose.translation.vector).norm();
        let lever = a.angle_sd.hypot(b.angle_sd) * away;
        let rest = sd.hypot(c.place_sd).hypot(d.place_sd);
        let foretold = motion * c.pose;
        let off = (foretold.translation.vector - d.pose.translation.vector).norm();
        let turned = foretold.rotation.angle_to(&d.pose.rotation);
        let went = (d.pose.translation.vector - c.pose.translation.vector).norm();
        let allowed = AS_ONE * rest.hypot(lever);
        let angle = AS_ONE * a.angle_sd.hypot(b.angle_sd).hypot(c.angle_sd).hypot(d.angle_sd);
        let other_rose = (d.pose.translation.vector - c.pose.translation.vector).dot(up);
        let lifted = rose.abs() > RISES.max(JUMP.1 * sd) && (other_rose - rose).abs() < AS_ONE * rest.hypot(lever);
        Some(lifted || off < allowed && turned < angle && went > 2.0 * off)
    };
    let others = before.tracks.keys().filter(|n| n.as_str() != name);
    let told: Vec<bool> = others.map(|other| as_one(other).unwrap_or(false)).collect();
    (!told.is_empty() && told.iter().all(|t| *t)).then(|| Evidence {
        residual: format!("where things rest, between {} and {}", before.name, after.name),
        test: "one motion of all that is tracked, of which one thing is never touched".into(),
        statistic: gone / sd,
        p_value: 0.0,
        words: format!(
            "between {} and {} all that is tracked jumps together, {name} by {:.1} mm and {:.1} degrees: what tracks was moved, or the table",
            before.name,
            after.name,
            1e3 * gone,
            motion.rotation.angle().to_degrees()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two things, of which the box is pushed by 20 mm each time; from the third push on all is seen moved by `knock`, and before it
    /// the box is put back by `put` m.
    fn pushes([knock, rise]: [f64; 2], put: f64) -> Vec<Interaction> {
        let at = |x: f64, y: f64, z: f64| {
            let wobble = |i: usize| 1e-4 * (((i * 37) % 7) as f64 / 3.0 - 1.0);
            let place = |i: usize| Point3::new(x + wobble(i), y - wobble(i + 3), 0.02 + z + wobble(i + 5));
            (0..30).map(place).collect::<Vec<_>>()
        };
        let track = |from: Vec<Point3<f64>>, to: Vec<Point3<f64>>| PoseStream {
            time: (0..60).map(|i| 0.02 * f64::from(i)).collect(),
            position: [from, to].concat(),
            rotation: vec![Some(UnitQuaternion::identity()); 60],
        };
        let one = |k: u32| {
            let seen = if k >= 2 { [knock, 0.5 * knock, rise] } else { [0.0; 3] };
            let x = 0.02 * f64::from(k) - if k >= 2 { put } else { 0.0 };
            let tracks = [
                (
                    "box",
                    track(
                        at(x + seen[0], seen[1], seen[2]),
                        at(x + 0.02 + seen[0], seen[1], seen[2]),
                    ),
                ),
                (
                    "post",
                    track(
                        at(0.2 + seen[0], 0.1 + seen[1], seen[2]),
                        at(0.2 + seen[0], 0.1 + seen[1], seen[2]),
                    ),
                ),
            ];
            Interaction {
                name: format!("push-{k}"),
                target: Some("box".into()),
                tracks: tracks.into_iter().map(|(n, t)| (n.to_owned(), t)).collect(),
                kind: crate::capture::Kind::Push,
                held_out: false,
                tool: None,
                force: None,
                tool_path: None,
                support_path: None,
                action: None,
                tool_name: None,
                frames: None,
            }
        };
        (0..4).map(one).collect()
    }

    #[test]
    fn a_knock_moves_all_as_one_and_a_hand_does_not() {
        let told = |knock: [f64; 2], put: f64| told(&["box", "post"], &Vector3::z(), &pushes(knock, put));
        let found = told([4e-3, 0.0], 0.0).expect("a knock");
        assert!(found.words.contains("between push-1 and push-2"), "{}", found.words);
        assert!(told([0.0; 2], 0.0).is_none());
        // Nothing but the box is put back.
        assert!(told([0.0; 2], 0.03).is_none());
        // All is seen elsewhere, but the box was put back as well: who moved what is open, unless both are seen off the table.
        assert!(told([4e-3, 0.0], 0.03).is_none() && told([4e-3, 1.2e-3], 0.03).is_some());
    }
}
