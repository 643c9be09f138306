//! Presses under which the pressed thing as a whole gives way: what it stands on is no rigid support.

use nalgebra::Vector3;

use super::predict::Scene;
use super::told::{Told, gain};
use crate::base::Estimate;
use crate::capture::{Capture, Interaction, Kind, Segmented};
use crate::math::{interpolate, median, random_effects};
use crate::stages::estimation::{action_of, support_normal};
use crate::twin::{Finding, Model};

/// Seconds of one sample.
const BIN: f64 = 0.05;
/// Way down that counts, m.
const SINKS: f64 = 5e-5;
/// Share of the tool's way from which on the thing rides on its spring, which the plain model has.
const RIDES: f64 = 0.85;
/// Neighbouring samples that err alike.
const ALIKE: f64 = 5.0;
/// Share of the largest force from which on it is pressed hard.
const HARD: f64 = 0.3;
/// Standard deviations from a rigid support; scatter of the compliance from press to press, as a share.
const CLEAR: f64 = 5.0;
const SCATTER: f64 = 0.03;
/// Fewest presses.
const FEWEST: usize = 2;

/// One press.
struct Sunk {
    interaction: String,
    held_out: bool,
    /// m/N, with its standard deviation.
    compliance: (f64, f64),
    /// Its way down over that of the tool while it is pressed hard.
    line: [f64; 3],
    /// Force into the support, N, beside the way down, m.
    rows: Vec<[f64; 2]>,
}

/// Curves of springs that what a support gives unevenly may make, and the log evidence, nats, from which on they are the springs'.
const CURVES: [&str; 3] = ["power-law-stiffness", "hardening-stiffness", "second-stage"];
const OWN: f64 = 30.0;

/// Where the support gives, a spring that is a little bent is what is left of how the support does.
pub fn without_what_sinks(findings: &mut Vec<Finding>) {
    if findings.iter().all(|f| f.cause != "support-compliance") {
        return;
    }
    let slight = |f: &Finding| {
        let mut tests = f.evidence.iter().filter(|e| e.test.starts_with("log evidence"));
        tests.any(|e| e.statistic < OWN)
    };
    findings.retain(|f| !CURVES.contains(&f.cause.as_str()) || !slight(f));
}

/// Supports that give, by the bodies that were pressed on them.
pub fn sinking_findings(capture: &Capture, segmented: &[Segmented], model: &Model) -> Vec<Finding> {
    let up = support_normal(capture, model).into_inner();
    let names: Vec<&str> = model.twin.links().map(|(_, l)| l.name.as_str()).collect();
    let one = |name: &str| {
        let presses = capture.interactions.iter().filter(|i| i.kind == Kind::Press);
        let all: Vec<Sunk> = presses
            .filter_map(|i| {
                let segmented = segmented.iter().find(|s| s.interaction == i.name);
                let scene = Scene {
                    capture,
                    interaction: i,
                    segmented,
                    model,
                };
                sunk(&scene, i, name, &up)
            })
            .collect();
        told(&all, name)
    };
    names.into_iter().filter_map(one).collect()
}

/// Whether things were pressed with force and track so often that a support that gives would show.
pub fn tells_sinking(capture: &Capture, segmented: &[Segmented], model: &Model) -> bool {
    let told = |i: &&Interaction| {
        let segmented = segmented.iter().find(|s| s.interaction == i.name);
        let followed = action_of(capture, i, segmented, model).is_some_and(|a| i.tracks.contains_key(&a.target));
        i.kind == Kind::Press && i.force.is_some() && followed
    };
    capture.interactions.iter().filter(told).count() >= FEWEST
}

fn sunk(scene: &Scene, interaction: &Interaction, name: &str, up: &Vector3<f64>) -> Option<Sunk> {
    let action = action_of(scene.capture, interaction, scene.segmented, scene.model)?;
    let track = interaction.tracks.get(name).filter(|_| action.target == name)?;
    let (time, force, noise) = scene.raw_force(BIN)?;
    let force: Vec<f64> = force.iter().map(|f| -f.dot(up)).collect();
    let peak = force.iter().copied().fold(0.0, f64::max);
    let floor = (5.0 * noise?).max(0.03 * peak);
    let onset = force.iter().position(|f| *f > floor)?;
    let height: Vec<f64> = track.position.iter().map(|p| p.coords.dot(up)).collect();
    let before: Vec<f64> = (0..track.len())
        .filter(|i| track.time[*i] < time[onset] - BIN && height[*i].is_finite())
        .map(|i| height[i])
        .collect();
    let level = median(&before).filter(|_| before.len() > 4)?;
    // The mean over each sample's time, as for the force.
    let down = |t: f64| {
        let near = (0..track.len()).filter(|i| (track.time[*i] - t).abs() < 0.5 * BIN && height[*i].is_finite());
        let each: Vec<f64> = near.map(|i| level - height[i]).collect();
        (!each.is_empty()).then(|| each.iter().sum::<f64>() / each.len() as f64)
    };
    let rows: Vec<[f64; 2]> = (0..time.len())
        .filter_map(|i| Some([force[i], down(time[i])?]))
        .collect();
    let squares: f64 = rows.iter().map(|r| r[0] * r[0]).sum();
    let slope = rows.iter().map(|r| r[0] * r[1]).sum::<f64>() / squares.max(1e-12);
    let left = rows.iter().map(|r| (r[1] - slope * r[0]).powi(2)).sum::<f64>() / rows.len().max(1) as f64;
    let sd = (ALIKE * left / squares.max(1e-12)).sqrt();
    if slope * peak < SINKS {
        return None;
    }
    let tool: Vec<f64> = action.tool.position.iter().map(|p| -p.coords.dot(up)).collect();
    // How far the thing goes for each step of the tool while it is pressed hard: one that is held back at first rides all the same.
    let hard: Vec<[f64; 2]> = (0..time.len())
        .filter(|i| force[*i] > HARD * peak)
        .filter_map(|i| Some([interpolate(&action.tool.time, &tool, time[i])?, down(time[i])?]))
        .collect();
    Some(Sunk {
        interaction: interaction.name.clone(),
        held_out: interaction.held_out,
        compliance: (slope, sd),
        line: sums(&hard),
        rows,
    })
}

/// Sums of squares and products of the second about its mean over the first about its, and of the second: of a line.
fn sums(rows: &[[f64; 2]]) -> [f64; 3] {
    let n = rows.len().max(1) as f64;
    let mean = |k: usize| rows.iter().map(|r| r[k]).sum::<f64>() / n;
    let (mx, my) = (mean(0), mean(1));
    let sum = |f: &dyn Fn(&[f64; 2]) -> f64| rows.iter().map(f).sum::<f64>();
    [
        sum(&|r| (r[0] - mx).powi(2)),
        sum(&|r| (r[0] - mx) * (r[1] - my)),
        sum(&|r| (r[1] - my).powi(2)),
    ]
}

/// Slope of all lines together, and its standard deviation.
fn shared_slope(all: &[&Sunk]) -> (f64, f64) {
    let sum = |k: usize| all.iter().map(|s| s.line[k]).sum::<f64>();
    let [xx, xy, yy] = [sum(0).max(1e-12), sum(1), sum(2)];
    let count: usize = all.iter().map(|s| s.rows.len()).sum();
    let left = (yy - xy * xy / xx).max(0.0) / count.max(1) as f64;
    (xy / xx, (ALIKE * left / xx).sqrt())
}

fn told(all: &[Sunk], name: &str) -> Option<Finding> {
    let fitted: Vec<&Sunk> = all.iter().filter(|s| !s.held_out).collect();
    if fitted.len() < FEWEST {
        return None;
    }
    let (values, sds): (Vec<f64>, Vec<f64>) = fitted.iter().map(|s| s.compliance).unzip();
    let pooled = random_effects(&values, &sds, SCATTER * median(&values)?.abs())?;
    let (share, doubt) = shared_slope(&fitted);
    let statistic = pooled.mean / pooled.sd;
    if statistic < CLEAR || share + 3.0 * doubt > RIDES {
        return None;
    }
    let from: Vec<String> = fitted.iter().map(|s| s.interaction.clone()).collect();
    let held: Vec<&Sunk> = all.iter().filter(|s| s.held_out).collect();
    let judged = if held.is_empty() { &fitted } else { &held };
    let rms = |compliance: f64| {
        let rows = || judged.iter().flat_map(|s| &s.rows);
        let squares: f64 = rows().map(|[f, y]| (y - compliance * f).powi(2)).sum();
        (squares / rows().count().max(1) as f64).sqrt()
    };
    let told = Told {
        cause: "support-compliance",
        place: "support",
        probability: 0.95,
        rivals: &[],
        parameter: (
            "compliance",
            Estimate::measured(
                pooled.mean,
                pooled.sd,
                "m/N",
                from,
                "way of the track over the force of presses",
            ),
        ),
        residual: "way down",
        statistic,
        words: format!(
            "{name} as a whole goes down by {:.0} µm for each newton that presses it",
            1e6 * pooled.mean
        ),
        gain: gain(
            "position",
            "m",
            [rms(0.0), rms(pooled.mean)],
            held.iter().map(|s| s.interaction.clone()).collect(),
        ),
    };
    Some(told.finding())
}

#[cfg(test)]
mod tests {
    use super::super::told::one_named;
    use super::*;
    use crate::twin::Gain;

    #[test]
    fn a_spring_that_is_slightly_bent_is_how_its_support_gives() {
        let curved = |statistic: f64| {
            let mut finding = one_named("hardening-stiffness", Gain::default());
            finding.evidence[0].test = "log evidence over the plain model, nats".into();
            finding.evidence[0].statistic = statistic;
            finding
        };
        let left = |mut findings: Vec<Finding>| {
            without_what_sinks(&mut findings);
            findings.len()
        };
        let gives = || one_named("support-compliance", Gain::default());
        assert_eq!(left(vec![gives(), curved(12.0)]), 1);
        assert_eq!(left(vec![gives(), curved(200.0)]), 2);
        assert_eq!(left(vec![curved(12.0)]), 1);
    }
}
