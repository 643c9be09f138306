//! Pushed things that all turn to the same side of what was foretold, whichever way they were pushed.
//!
//! What a shape, a centre of mass or a slope leads astray turns one way when it is pushed from one side and the other way from the other.
//! What turns to the left of every push is steered by something that has a hand: a nap that was brushed round, or a tool that is
//! off to one side of where it is said to be.

use nalgebra::Vector3;

use super::compare::pairs;
use super::{Quantity, Trace};
use crate::capture::{Capture, Interaction, Kind};
use crate::twin::{Evidence, Finding};

/// Fewest pushes, and the mean of their directions, as a share, from which on they do not come from all sides.
const FEWEST: usize = 6;
/// How many of them have to tell it each by itself.
const TELL: usize = 4;
const ALL_ROUND: f64 = 0.7;
/// Least mean turn beyond what was foretold, rad, and how many standard deviations it has to be from nought.
const LEAST: f64 = 0.02;
const CLEAR: f64 = 6.0;
/// Last share of what was seen of a push whose mean is where it ended.
const END: f64 = 0.1;
/// Causes that turn a thing to one side of all pushes.
const TURN: [&str; 5] = [
    "com-offset",
    "nonuniform-density",
    "contact-point-offset",
    "tracking-error",
    "time-delay",
];

/// How much farther to the left than foretold one push ended, rad, with what is not known of that.
struct Swerve {
    turn: f64,
    sd: f64,
}

/// That all pushes end to one side of what was foretold, beside what was found.
pub(super) fn swerves(capture: &Capture, traces: &[Trace], findings: &[Finding]) -> Option<Evidence> {
    if findings.iter().any(|f| TURN.contains(&f.cause.as_str())) {
        return None;
    }
    let pushes = capture.interactions.iter().filter(|i| {
        let free = i.tool.as_ref().is_some_and(|t| !t.grip && !t.pin);
        i.kind == Kind::Push && free
    });
    let read = pushes.filter_map(|i| {
        let trace = traces.iter().find(|t| t.interaction == i.name)?;
        Some((swerve(trace)?, way(i)?))
    });
    let (turns, ways): (Vec<Swerve>, Vec<Vector3<f64>>) = read.unzip();
    let mean_way = ways.iter().sum::<Vector3<f64>>() / ways.len().max(1) as f64;
    if turns.len() < FEWEST || mean_way.norm() > ALL_ROUND {
        return None;
    }
    let (mean, sd) = common(&turns)?;
    let side = if mean > 0.0 { "left" } else { "right" };
    Some(Evidence {
        residual: "heading over pushes from several sides".into(),
        test: "mean turn beyond what was foretold, standard deviations".into(),
        statistic: (mean / sd).abs(),
        p_value: (-0.5 * (mean / sd).powi(2)).exp(),
        words: format!(
            "pushed from several sides, it turned to the {side} of what was foretold in all of {} pushes, by {:.1} degrees on the average: \
             something steers it, of which the catalogue knows nothing, or the tool is off to one side",
            turns.len(),
            mean.abs().to_degrees()
        ),
    })
}

/// What all of them turn by, where it is clear that they do, and its standard deviation.
fn common(turns: &[Swerve]) -> Option<(f64, f64)> {
    let weight = |t: &Swerve| t.sd.powi(-2);
    let total: f64 = turns.iter().map(weight).sum();
    let mean = turns.iter().map(|t| weight(t) * t.turn).sum::<f64>() / total;
    let left: f64 = turns.iter().map(|t| weight(t) * (t.turn - mean).powi(2)).sum();
    let sd = ((left / (turns.len() as f64 - 1.0)).max(1.0) / total).sqrt();
    let told = |t: &&Swerve| t.turn.abs() > 2.0 * t.sd;
    let (with, against): (Vec<&Swerve>, Vec<&Swerve>) = turns.iter().filter(told).partition(|t| t.turn * mean > 0.0);
    (mean.abs() > LEAST.max(CLEAR * sd) && with.len() >= TELL && against.is_empty()).then_some((mean, sd))
}

/// How one push ended.
fn swerve(trace: &Trace) -> Option<Swerve> {
    let heading = |c: &super::Curve| c.quantity == Quantity::Rotation;
    let index = trace.curves.iter().position(heading)?;
    let curve = &trace.curves[index];
    let errors: Vec<f64> = pairs(curve).map(|(m, p)| m - p).collect();
    let end = &errors[errors.len() - (END * errors.len() as f64).ceil() as usize..];
    let doubt = trace.doubt.get(index).and_then(|d| d.last()).copied();
    let doubt = doubt.filter(|d| d.is_finite()).unwrap_or(0.0);
    let noise = curve.noise? / (end.len() as f64).sqrt();
    (!end.is_empty()).then(|| Swerve {
        turn: end.iter().sum::<f64>() / end.len() as f64,
        sd: noise.hypot(doubt),
    })
}

/// The direction of a push.
fn way(interaction: &Interaction) -> Option<Vector3<f64>> {
    let path = &interaction.tool_path.as_ref()?.position;
    (path.last()? - path.first()?).try_normalize(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(turn: impl Fn(i32) -> f64) -> bool {
        let turns: Vec<Swerve> = (0..8)
            .map(|k| Swerve {
                turn: turn(k),
                sd: 0.004,
            })
            .collect();
        common(&turns).is_some()
    }

    #[test]
    fn one_push_that_is_known_well_is_not_all_of_them() {
        let known = |k: i32| if k == 0 { 0.0025 } else { 0.3 };
        let turns: Vec<Swerve> = (0..6)
            .map(|k| Swerve {
                turn: 0.07,
                sd: known(k),
            })
            .collect();
        assert!(common(&turns).is_none());
    }

    #[test]
    fn what_turns_left_of_every_push_is_steered_and_what_turns_either_way_is_not() {
        let scatter = |k: i32| 0.008 * (7.3 * f64::from(k)).sin();
        assert!(told(|k| 0.07 + scatter(k)));
        assert!(told(|k| -0.05 + scatter(k)));
        assert!(!told(|k| if k % 2 == 0 { 0.07 } else { -0.07 }));
        // One that is far off is of that push alone.
        assert!(!told(|k| if k == 3 { 0.4 } else { 0.0 }));
        assert!(!told(|k| 0.004 + scatter(k)));
    }
}
