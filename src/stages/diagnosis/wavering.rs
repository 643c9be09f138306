//! Drags whose force wavers while the hand goes on evenly: what is dragged slides along one line at one speed, under one load, so that any
//! law of the catalogue that has no place, way or time of its own holds it level.
//!
//! How far friction is known takes up what one drag needs more than another; within one there is nothing that it could take up.

use super::sensor::taken_out;
use super::tares::before_the_touch;
use super::{Curve, Quantity, Trace};
use crate::capture::{Capture, Kind};
use crate::math::{local_quadratic, quantile};
use crate::twin::{Evidence, Finding, Model};

/// Seconds over which readings are averaged, those after a start and before a stop in which nothing is judged, and the fewest that are left.
const MEAN: f64 = 0.1;
const ENDS: f64 = 0.2;
const LASTS: f64 = 0.6;
/// Share of its highest speed from which on a hand goes on evenly.
const EVENLY: f64 = 0.8;
/// Share of the force, and standard deviations of such a mean, by which the force of a drag wavers: of gripped things that slid on an even
/// table the force wavered by 0.2 to 1.6 %.
const WAVERS: (f64, f64) = (0.03, 5.0);
/// Fewest drags, and the share of them that has to waver.
const DRAGS: usize = 3;
const SHARE: f64 = 0.6;

/// That the force of most drags wavers, where nothing was named that acts on what is touched.
pub(super) fn wavering(
    (capture, model): (&Capture, &Model),
    traces: &[Trace],
    findings: &[Finding],
) -> Option<Evidence> {
    if !findings.iter().all(|f| taken_out(f) || before_the_touch(f)) {
        return None;
    }
    let of = |trace: &Trace| {
        let interaction = capture.interactions.iter().find(|i| i.name == trace.interaction)?;
        let held = interaction.kind == Kind::Pull && interaction.tool.as_ref().is_some_and(|t| t.grip);
        let only = interaction
            .tracks
            .keys()
            .next()
            .filter(|_| interaction.tracks.len() == 1);
        let body = model.twin.body_of(interaction.target.as_ref().or(only)?)?;
        let path = interaction
            .tool_path
            .as_ref()
            .filter(|_| held && body.links.len() == 1)?;
        let force = trace.curves.iter().find(|c| c.quantity == Quantity::Force)?;
        let ways: [Vec<f64>; 3] = [0, 1, 2].map(|k| path.position.iter().map(|p| p[k]).collect());
        let speed = |t: f64| {
            let along = |k: usize| local_quadratic(&path.time, &ways[k], t, MEAN).map(|f| f.velocity);
            Some(along(0)?.hypot(along(1)?).hypot(along(2)?))
        };
        share_of(force, &speed)
    };
    told(&traces.iter().filter_map(of).collect::<Vec<_>>())
}

/// Standard deviation of the force about what is foretold, over the usual force, where the hand goes on evenly; and whether that is beyond
/// the noise.
fn share_of(curve: &Curve, speed: &dyn Fn(f64) -> Option<f64>) -> Option<(f64, bool)> {
    let rows: Vec<[f64; 3]> = (0..curve.time.len())
        .map(|i| {
            [
                curve.time[i],
                curve.measured[i] - curve.predicted[i],
                curve.predicted[i],
            ]
        })
        .filter(|r| r.iter().all(|x| x.is_finite()))
        .collect();
    let (first, last) = (rows.first()?[0], rows.last()?[0]);
    let blocks = ((last - first) / MEAN) as usize;
    let means: Vec<(f64, [f64; 3])> = (0..blocks)
        .filter_map(|k| {
            let from = first + k as f64 * MEAN;
            let own: Vec<&[f64; 3]> = rows.iter().filter(|r| (from..from + MEAN).contains(&r[0])).collect();
            let n = own.len() as f64;
            let mean = |of: usize| own.iter().map(|r| r[of]).sum::<f64>() / n;
            let middle = from + 0.5 * MEAN;
            (own.len() > 1).then(|| (middle, [mean(1), mean(2), n]))
        })
        .collect();
    let speeds: Vec<f64> = means.iter().map(|m| speed(m.0).unwrap_or(0.0)).collect();
    let fastest = speeds.iter().copied().fold(0.0, f64::max);
    let slow: Vec<f64> = (0..means.len())
        .filter(|k| speeds[*k] < EVENLY * fastest)
        .map(|k| means[k].0)
        .chain([first, last])
        .collect();
    let even: Vec<[f64; 3]> = means
        .iter()
        .filter(|m| slow.iter().all(|s| (s - m.0).abs() > ENDS))
        .map(|m| m.1)
        .collect();
    let n = even.len() as f64;
    if n * MEAN < LASTS {
        return None;
    }
    // To and fro the force has another sign, and what is foretold jumps with it.
    let of = |sign: f64| even.iter().filter(move |m| m[1] * sign > 0.0);
    let squares = |sign: f64| {
        let count = of(sign).count().max(1) as f64;
        let mean = of(sign).map(|m| m[0]).sum::<f64>() / count;
        of(sign).map(|m| (m[0] - mean).powi(2)).sum::<f64>()
    };
    let sd = ((squares(1.0) + squares(-1.0)) / n).sqrt();
    let usual = even.iter().map(|m| m[1].abs()).sum::<f64>() / n;
    let readings = even.iter().map(|m| m[2]).sum::<f64>() / n;
    Some((sd / usual.max(1e-9), sd > WAVERS.1 * curve.noise? / readings.sqrt()))
}

fn told(shares: &[(f64, bool)]) -> Option<Evidence> {
    let wavers = |s: &&(f64, bool)| s.1 && s.0 > WAVERS.0;
    let count = shares.iter().filter(wavers).count();
    let usual = quantile(&shares.iter().map(|s| s.0).collect::<Vec<f64>>(), 0.5)?;
    (shares.len() >= DRAGS && count as f64 >= SHARE * shares.len() as f64).then(|| Evidence {
        residual: "force of drags".into(),
        test: "standard deviation of the force while the hand goes on evenly, as a share of it".into(),
        statistic: usual,
        p_value: 0.0,
        words: format!(
            "while the hand goes on evenly the force wavers by {:.0} % of itself, in {count} of {} drags: friction comes and goes, for which \
             no cause that was tried accounts",
            100.0 * usual,
            shares.len()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drag of four seconds at 100 Hz of 2 N that wavers.
    fn drag(wavers: impl Fn(f64) -> f64) -> Curve {
        let time: Vec<f64> = (0..400).map(|i| 0.01 * f64::from(i)).collect();
        let noise = |i: usize| 0.03 * (((i * 37) % 13) as f64 / 6.0 - 1.0);
        Curve {
            label: "force along the motion".into(),
            quantity: Quantity::Force,
            measured: time
                .iter()
                .enumerate()
                .map(|(i, t)| 2.1 + wavers(*t) + noise(i))
                .collect(),
            predicted: vec![2.0; time.len()],
            time,
            noise: Some(0.02),
        }
    }

    #[test]
    fn friction_that_comes_and_goes_is_told_and_one_that_is_off_is_not() {
        let even = |_: f64| Some(0.05);
        let comes_and_goes = |t: f64| {
            if ((t / 1.3) as u32).is_multiple_of(2) {
                0.0
            } else {
                -0.3
            }
        };
        let of = |wavers: &dyn Fn(f64) -> f64| share_of(&drag(wavers), &even).expect("a drag");
        let shaken = of(&comes_and_goes);
        assert!(told(&[shaken; 4]).is_some() && told(&[shaken; 2]).is_none());
        assert!(told(&[of(&|_| 0.0); 4]).is_none() && told(&[of(&|_| 0.3); 4]).is_none());
        // Where the hand stops nothing is judged.
        let stops = |t: f64| Some(if t < 2.0 { 0.05 } else { 0.01 });
        assert!(
            share_of(&drag(|t| if t < 2.1 { 0.0 } else { 0.5 }), &stops)
                .expect("a drag")
                .0
                < 0.02
        );
    }
}
