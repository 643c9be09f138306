//! Motions of a joint by the path of the tool that holds its child, where that is known more finely than the child's track: the
//! acceleration of a smooth motion shows in a short span.

use super::motion_reads::{BIN, Read, STANDS, short_span, usual_speed};
use crate::capture::{Interaction, Segmented};
use crate::math::{median, quantile};
use crate::stages::estimation::{JointLoad, joint_loads_by_tool, leading_noise};
use crate::twin::{Joint, JointKind, Model};

/// How far path and track may be apart, standard deviations of the track and as a share of the range: a tool that slips or gives tells
/// nothing of the child.
const APART: (f64, f64) = (2.0, 0.01);

/// Half the span of a speed, as a share of the time that the motion takes from end to end: a shorter one makes slow accelerations noise.
const SHARE: f64 = 0.05;

/// The same motion by the path of the tool that holds the child; `None` where none does, or where it does not go with the child.
pub(super) fn led(
    read: &Read,
    (interaction, cut): (&Interaction, &Segmented),
    joint: &Joint,
    model: &Model,
) -> Option<Read> {
    let noise = leading_noise(interaction, cut, joint, model).filter(|n| n.is_finite())?;
    let path = interaction.tool_path.as_ref()?;
    let lever = match joint.kind {
        JointKind::Prismatic => 1.0,
        _ => median(&read.loads.iter().map(|l| l.lever).collect::<Vec<f64>>())?.max(1e-6),
    };
    let jitter = noise / lever;
    let calm = short_span(&path.time, &read.loads, jitter)?;
    let half = calm.max(SHARE * range(&read.loads) / usual_speed(&read.loads)?);
    let longest = read.halves.iter().copied().fold(0.0, f64::max);
    if half >= longest {
        return None;
    }
    let mut loads = joint_loads_by_tool(interaction, cut, joint, model, ([BIN, longest, STANDS], half))?;
    for l in &mut loads {
        // Of noise along the freedom, as by a track.
        l.speed_gain *= lever;
    }
    goes_with(&read.loads, &loads, read.jitter).then(|| Read {
        halves: vec![half; loads.len()],
        loads,
        jitter,
        interaction: read.interaction.clone(),
        ..*read
    })
}

/// From the lowest to the highest position.
fn range(loads: &[JointLoad]) -> f64 {
    let ends = loads.iter().map(|l| l.position);
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), q| (a.min(q), b.max(q)));
    (high - low).max(0.0)
}

/// Whether positions by a track and by a path differ by noise, but for where they are counted from and for a delay.
fn goes_with(track: &[JointLoad], path: &[JointLoad], noise: f64) -> bool {
    let both: Vec<(f64, f64)> = track
        .iter()
        .filter_map(|t| {
            let same = path.iter().find(|p| (p.time - t.time).abs() < 1e-6)?;
            Some((t.position - same.position, same.speed))
        })
        .collect();
    let Some(middle) = median(&both.iter().map(|b| b.0).collect::<Vec<f64>>()) else {
        return false;
    };
    let square: f64 = both.iter().map(|b| b.1 * b.1).sum();
    let late = both.iter().map(|b| (b.0 - middle) * b.1).sum::<f64>() / square.max(1e-12);
    let apart: Vec<f64> = both.iter().map(|b| (b.0 - middle - late * b.1).abs()).collect();
    quantile(&apart, 0.8).is_some_and(|a| a < APART.0 * noise + APART.1 * range(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_is_late_goes_with_a_track_and_one_that_slips_does_not() {
        let moved = |place: &dyn Fn(f64) -> f64| {
            let one = |i: u32| {
                let t = BIN * f64::from(i);
                JointLoad {
                    time: t,
                    load: 1.0,
                    lever: 0.3,
                    aside: [0.0; 2],
                    way: nalgebra::Vector3::y(),
                    position: place(t),
                    speed: (place(t + 1e-3) - place(t - 1e-3)) / 2e-3,
                    speed_gain: 8.0,
                    acceleration: 0.0,
                }
            };
            (0..50).map(one).collect::<Vec<JointLoad>>()
        };
        let goes = |t: f64| 0.5 * (1.0 - (1.6 * t).cos());
        let track = moved(&goes);
        assert!(goes_with(&track, &moved(&|t| goes(t - 0.02)), 1e-3));
        assert!(!goes_with(&track, &moved(&|t| 0.9 * goes(t)), 1e-3));
    }
}
