//! What shows that a thing runs on a rail, where a tool that does not hold it but shoved it: wherever it was shoved it never turned.
//!
//! What is free and shoved `e` beside the middle of its friction turns by `e / (e² + c²)` of its way (Lynch 1992), `c` a length that
//! is less than its size. Of shoves at two places one at least is beside the middle by half of what is between them.

use nalgebra::{UnitQuaternion, Vector3};

use super::coupling::Placement;
use super::pair::Pair;
use super::rail::LINES;
use crate::capture::{Interaction, Kind};
use crate::math::{interpolate, median};

/// Fewest shoves.
const FEWEST: usize = 3;
/// Least turn that what is free would have made, rad, and the part of it that a rail may let through.
const TURNS: f64 = 0.012;
const LETS: f64 = 0.2;
/// Cosine of the angle by which the lines of two shoves may differ.
const ALIKE: f64 = 0.98;

/// A shove along a line.
struct Shove {
    line: Vector3<f64>,
    /// Length of the way, m.
    way: f64,
    /// From the child to the tool, half way.
    tool: Vector3<f64>,
    /// By how much the child turned against the parent, rad.
    turned: f64,
}

fn shove(pair: &Pair, k: usize, up: &Vector3<f64>) -> Option<Shove> {
    let run = pair.runs[k];
    let free = run.tool.as_ref().is_some_and(|t| !t.grip && !t.pin);
    if run.kind != Kind::Push || !free || run.target.as_deref() != Some(&pair.child) {
        return None;
    }
    let (track, path) = (run.tracks.get(&pair.child)?, run.tool_path.as_ref()?);
    let seen: Vec<usize> = (0..track.len()).filter(|i| track.position[*i].x.is_finite()).collect();
    let from = track.position[*seen.first()?];
    let farthest = *seen.iter().max_by(|a, b| {
        let off = |i: usize| (track.position[i] - from).norm();
        off(**a).total_cmp(&off(**b))
    })?;
    let gone = track.position[farthest] - from;
    let way = gone.norm();
    let half = *seen.iter().find(|i| (track.position[**i] - from).norm() > 0.5 * way)?;
    let tool = |axis: usize| {
        let own: Vec<f64> = path.position.iter().map(|p| p[axis]).collect();
        interpolate(&path.time, &own, track.time[half])
    };
    let tool = Vector3::new(tool(0)?, tool(1)?, tool(2)?);
    // What it turned by in the end: single readings have their noise.
    let own: Vec<UnitQuaternion<f64>> = pair.of_run(k).filter_map(|s| s.rotation).collect();
    let first = own.first()?.inverse();
    let quarter = (own.len() / 4).max(1);
    let turn = |part: &[UnitQuaternion<f64>]| {
        median(
            &part
                .iter()
                .map(|q| (q * first).scaled_axis().dot(up))
                .collect::<Vec<f64>>(),
        )
    };
    let turned = turn(&own[own.len() - quarter..])? - turn(&own[..quarter])?;
    Some(Shove {
        line: gone / way.max(1e-9),
        way,
        tool: tool - track.position[half].coords,
        turned: turned.abs(),
    })
    .filter(|s| s.way > LINES.1)
}

/// The shove farthest from the middle of all, where all went along one line and none turned it as it would what is free.
pub(super) fn never_turns<'a>(pair: &Pair<'a>, placement: &Placement) -> Option<&'a Interaction> {
    let lifted = (0..pair.runs.len()).any(|k| pair.runs[k].kind == Kind::Lift && pair.moved(k));
    let all: Vec<(usize, Shove)> = (0..pair.runs.len())
        .filter_map(|k| Some((k, shove(pair, k, &placement.up)?)))
        .collect();
    let line = all.first().filter(|_| all.len() >= FEWEST && !lifted)?.1.line;
    if all.iter().any(|(_, s)| s.line.dot(&line).abs() < ALIKE) {
        return None;
    }
    let side = placement.up.cross(&line).try_normalize(1e-9)?;
    let at = |s: &Shove| s.tool.dot(&side);
    let (low, high) = all
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, s)| {
            (low.min(at(s)), high.max(at(s)))
        });
    let middle = 0.5 * (low + high);
    // Of those at either end one is as far from the middle of its friction as this, wherever that is.
    let free = |s: &Shove| {
        let beside = (at(s) - middle).abs();
        s.way * beside / (beside * beside + placement.size * placement.size)
    };
    let ends = |end: f64| {
        all.iter()
            .filter(move |(_, s)| (at(s) - end).abs() < 0.1 * (high - low))
    };
    let tells = |end: f64| {
        let most = ends(end).map(|(_, s)| free(s)).fold(0.0, f64::max);
        most > TURNS && all.iter().all(|(_, s)| s.turned < LETS * most)
    };
    let farthest = all.iter().max_by(|a, b| free(&a.1).total_cmp(&free(&b.1)))?;
    (tells(low) && tells(high)).then(|| pair.runs[farthest.0])
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::super::tests::{capture, interaction, shares, stream, turn};
    use super::*;
    use crate::capture::{Tool, ToolShape, TrackNoise};

    /// Shoves of 8 cm along x, each at its own place beside the middle; what is free turns as far as it does.
    fn shoved(at: &[f64], free: bool) -> bool {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let noise = TrackNoise {
            position: 2e-4,
            rotation: 2e-3,
        };
        let one = |(k, at): (usize, &f64)| {
            let along = shares(200);
            let by = if free { 0.08 * at / (at * at + 0.05 * 0.05) } else { 0.0 };
            let poses: Vec<Isometry3<f64>> = along
                .iter()
                .map(|s| Isometry3::from_parts((Vector3::x() * (0.08 * s)).into(), turn(Vector3::z(), -by * s)))
                .collect();
            let still = vec![Isometry3::identity(); along.len()];
            let tracks = vec![
                ("drawer", stream(&poses, noise, &mut rng)),
                ("case", stream(&still, noise, &mut rng)),
            ];
            let mut run = interaction(&format!("push-{k}"), "drawer", Vector3::x() * 0.08, tracks);
            run.tool = Some(Tool {
                shape: ToolShape::Sphere { radius: 0.01 },
                grip: false,
                pin: false,
            });
            let path = run.tool_path.iter_mut().flat_map(|p| &mut p.position);
            path.for_each(|p| *p += Vector3::new(-0.06, *at, 0.0));
            run
        };
        let capture = capture(at.iter().enumerate().map(one).collect(), true);
        let pair = Pair::between(&capture, "case", "drawer").expect("both are tracked");
        let placement = Placement {
            parent_mesh: None,
            child_mesh: None,
            parent_centre: Vector3::zeros(),
            child_centre: Vector3::zeros(),
            size: 0.2,
            up: Vector3::z(),
            table: Some(0.0),
        };
        never_turns(&pair, &placement).is_some()
    }

    #[test]
    fn what_never_turns_wherever_it_is_shoved_runs_on_a_rail() {
        let both = [-0.05, 0.01, 0.06, 0.04];
        assert!(shoved(&both, false) && !shoved(&both, true));
        // Shoved through one point all the time it may be free, and that point its middle.
        assert!(!shoved(&[0.01, 0.011, 0.0095, 0.01], false));
    }
}
