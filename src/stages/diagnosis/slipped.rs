//! Whether what tracks slipped on what is tracked: from one reading to the next a body is elsewhere, though the tool that moves it goes on
//! evenly and feels the same.
//!
//! A thing that springs ahead of a finger leaves it, and one that sticks and slips takes its force away; a marker that was knocked does
//! neither.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::capture::{Capture, Interaction, PoseStream};
use crate::math::{interpolate, median, weighted_linear};
use crate::twin::Evidence;

/// Readings on each side of a jump, and the longest gap between the two, in steps.
const SIDE: usize = 8;
const GAP: f64 = 2.5;
/// Standard deviations, and the least jump, m.
const CLEAR: f64 = 8.0;
const LEAST: f64 = 6e-4;
/// How many times farther it jumps than the tool goes from one reading to the next, and by how much the tool's speed may vary about it.
const AHEAD: f64 = 3.0;
const EVENLY: f64 = 0.3;
/// Seconds before and after it over which the force is averaged, and the share of it that is felt still.
const FELT: f64 = 0.04;
const STILL: f64 = 0.85;
/// Noises of the force from which on something is felt.
const TOUCHES: f64 = 6.0;

/// A jump of one track.
struct Jump {
    time: f64,
    /// m.
    size: f64,
    /// Standard deviations.
    statistic: f64,
}

/// What slipped, as the clearest of all jumps tells it.
pub(super) fn slipped(capture: &Capture) -> Option<Evidence> {
    let all = capture.interactions.iter().flat_map(|interaction| {
        let tracks = interaction.tracks.iter();
        tracks.filter_map(move |(name, track)| Some((interaction, name, jump(interaction, track)?)))
    });
    let (interaction, name, jump) = all.max_by(|a, b| a.2.statistic.total_cmp(&b.2.statistic))?;
    Some(Evidence {
        residual: format!("track of {name} in {}", interaction.name),
        test: "jump from one reading to the next over its noise".into(),
        statistic: jump.statistic,
        p_value: (-0.5 * jump.statistic * jump.statistic).exp(),
        words: format!(
            "what tracks {name} jumps by {:.1} mm at {:.2} s, while the tool goes on evenly and feels the same: it slipped on the body",
            1e3 * jump.size,
            jump.time
        ),
    })
}

fn jump(interaction: &Interaction, track: &PoseStream) -> Option<Jump> {
    let step = median(&track.time.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>())?;
    let known: Vec<usize> = (0..track.len())
        .filter(|i| track.position[*i].iter().all(|x| x.is_finite()))
        .collect();
    let touched = touch_of(interaction)?;
    let at = |k: usize| {
        let before = &known[k - SIDE..k];
        let after = &known[k..k + SIDE];
        if (track.position[known[k]] - track.position[known[k - 1]]).norm() < 0.5 * LEAST {
            return None;
        }
        let [last, first] = [track.time[*before.last()?], track.time[*after.first()?]];
        if first - last > GAP * step
            || track.time[after[SIDE - 1]] - track.time[before[0]] > 2.0 * GAP * SIDE as f64 * step
        {
            return None;
        }
        let time = 0.5 * (first + last);
        let [(here, own), (there, other)] = [before, after]
            .map(|rows| ends(track, rows, time))
            .map(Option::unwrap_or_default);
        let size = (there - here).norm();
        let jump = Jump {
            time,
            size,
            statistic: size / own.hypot(other).max(1e-6),
        };
        (jump.size > LEAST && jump.statistic > CLEAR).then_some((jump, first - last))
    };
    let found = (SIDE..known.len().saturating_sub(SIDE)).filter_map(at);
    let goes_on = |(jump, gap): &(Jump, f64)| {
        touched(jump.time, SIDE as f64 * step).is_some_and(|speed| jump.size > AHEAD * speed * gap)
    };
    let all = found.filter(goes_on).map(|f| f.0);
    all.max_by(|a, b| a.statistic.total_cmp(&b.statistic))
}

/// Where a straight line through some readings is at a time, m, with its standard deviation along any axis.
fn ends(track: &PoseStream, rows: &[usize], time: f64) -> Option<(Vector3<f64>, f64)> {
    let line = DMatrix::from_fn(
        rows.len(),
        2,
        |i, k| if k == 0 { 1.0 } else { track.time[rows[i]] - time },
    );
    let weights = DVector::from_element(rows.len(), 1.0);
    let (mut place, mut square) = (Vector3::zeros(), 0.0);
    for k in 0..3 {
        let values = DVector::from_iterator(rows.len(), rows.iter().map(|i| track.position[*i][k]));
        let fit = weighted_linear(&line, &values, &weights)?;
        let noise = fit.residuals.norm_squared() / (rows.len() - 2) as f64;
        place[k] = fit.x[0];
        square += fit.covariance[(0, 0)] * noise;
    }
    Some((place, square.sqrt()))
}

/// The speed of the tool about a time, m/s, if it goes evenly and feels the same before and after; nothing of what has no tool or force.
fn touch_of(interaction: &Interaction) -> Option<impl Fn(f64, f64) -> Option<f64> + '_> {
    let (path, force) = (interaction.tool_path.as_ref()?, interaction.force.as_ref()?);
    let places: Vec<Vec<f64>> = (0..3).map(|k| path.position.iter().map(|p| p[k]).collect()).collect();
    let place = move |t: f64| -> Option<Vector3<f64>> {
        let [x, y, z] = [0, 1, 2].map(|k: usize| interpolate(&path.time, &places[k], t));
        Some(Vector3::new(x?, y?, z?))
    };
    let finite: Vec<(f64, Vector3<f64>)> = force
        .time
        .iter()
        .zip(&force.force)
        .filter(|(_, f)| f.iter().all(|x| x.is_finite()))
        .map(|(t, f)| (*t, *f))
        .collect();
    let free = finite.iter().take(10).map(|f| f.1).sum::<Vector3<f64>>() / 10.0;
    let noise = median(
        &finite
            .windows(2)
            .map(|w| (w[1].1 - w[0].1).norm())
            .collect::<Vec<f64>>(),
    )?;
    let felt = move |from: f64, to: f64| {
        let own = finite.iter().filter(|f| (from..to).contains(&f.0));
        let (sum, n) = own.fold((Vector3::zeros(), 0.0), |(s, n), f| (s + f.1 - free, n + 1.0));
        (n > 2.0).then(|| (sum / n).norm())
    };
    Some(move |t: f64, half: f64| {
        let speeds = [-1.0, -0.5, 0.0, 0.5]
            .map(|k| Some((place(t + 0.5 * (k + 1.0) * half)? - place(t + 0.5 * k * half)?).norm() / (0.5 * half)));
        let speeds: Vec<f64> = speeds.into_iter().flatten().collect();
        let [low, high] = speeds
            .iter()
            .fold([f64::INFINITY, 0.0_f64], |[l, h], v| [l.min(*v), h.max(*v)]);
        let (before, after) = (
            felt(t - 2.0 * FELT, t - 0.25 * FELT)?,
            felt(t + 0.25 * FELT, t + 2.0 * FELT)?,
        );
        let same = after > STILL * before && before > STILL * after && before > TOUCHES * noise;
        (speeds.len() == 4 && same && high - low < EVENLY * high).then_some(high)
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nalgebra::{Point3, UnitQuaternion};

    use super::*;
    use crate::capture::{Kind, Tool, ToolShape, WrenchStream};

    /// A finger that pushes at 30 mm/s from 0.5 s on; what it moves jumps by `size` at 1.5 s, and its force is `after` then, N.
    fn push(size: f64, after: f64) -> Interaction {
        let path = |rows: usize, step: f64, jump: f64, noise: f64| {
            let time: Vec<f64> = (0..rows).map(|i| step * i as f64).collect();
            let place = |(i, t): (usize, &f64)| {
                let wobble = noise * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
                Point3::new(
                    0.03 * (t - 0.5).max(0.0) + if *t > 1.5 { jump } else { 0.0 } + wobble,
                    wobble,
                    0.0,
                )
            };
            PoseStream {
                position: time.iter().enumerate().map(place).collect(),
                rotation: vec![Some(UnitQuaternion::identity()); rows],
                time,
            }
        };
        let time: Vec<f64> = (0..600).map(|i| 4e-3 * f64::from(i)).collect();
        let force = |(i, t): (usize, &f64)| {
            let level = if *t < 0.5 {
                0.0
            } else if *t < 1.5 {
                2.0
            } else {
                after
            };
            Vector3::new(level + 0.02 * ((i * 7919 % 101) as f64 / 50.0 - 1.0), 0.0, 0.0)
        };
        Interaction {
            name: "push".into(),
            kind: Kind::Push,
            action: None,
            tool_name: None,
            target: Some("box".into()),
            support_path: None,
            frames: None,
            held_out: false,
            tool: Some(Tool {
                shape: ToolShape::Sphere { radius: 0.01 },
                grip: false,
                pin: false,
            }),
            force: Some(WrenchStream {
                force: time.iter().enumerate().map(force).collect(),
                time,
                torque: None,
            }),
            tool_path: Some(path(600, 4e-3, 0.0, 1e-5)),
            tracks: BTreeMap::from([("box".to_owned(), path(240, 0.01, size, 2e-4))]),
        }
    }

    #[test]
    fn a_marker_that_slips_is_told_from_a_thing_that_springs_ahead() {
        let jumps = |size: f64, after: f64| {
            let push = push(size, after);
            jump(&push, &push.tracks["box"])
        };
        let found = jumps(4e-3, 2.0).expect("a jump");
        assert!((found.time - 1.5).abs() < 0.02 && (found.size - 4e-3).abs() < 1e-3);
        assert!(jumps(4e-3, 0.5).is_none());
        assert!(jumps(0.0, 2.0).is_none());
    }
}
