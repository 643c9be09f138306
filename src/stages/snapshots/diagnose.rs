//! What the simulation gets wrong of the snapshots, as a diagnosis.

use std::collections::BTreeMap;

use super::effects::{Effect, Gaussian};
use super::report::{GroupResult, Snapshots, ThingResult};
use crate::twin::{BaseFit, CAUSES, DIAGNOSIS_FORMAT, Diagnosis, Evidence, Experiment, Verdict};

/// Odds at which chance alone may call a good simulation wrong, over all groups that are judged.
const FALSE_ALARM: f64 = 0.01;
/// Share of the squared displacements that may be left unexplained, however little the simulation is believed: intervals that
/// hold everything foretell nothing.
const UNEXPLAINED: f64 = 0.5;

impl Snapshots {
    /// Whether this interaction was studied here.
    pub fn covers(&self, interaction: &str) -> bool {
        let groups = self.things.iter().flat_map(|t| &t.groups);
        groups.flat_map(|g| &g.interactions).any(|name| name == interaction)
    }

    /// The divergences of every tool and action, judged on those that were held out, or on all where none was.
    pub fn diagnosis(&self) -> Diagnosis {
        let all: Vec<(&ThingResult, &GroupResult)> = self
            .things
            .iter()
            .flat_map(|t| t.groups.iter().map(move |g| (t, g)))
            .collect();
        let any_held_out = all.iter().any(|(_, g)| g.group.held_out);
        let judged: Vec<&GroupResult> = all
            .iter()
            .map(|(_, g)| *g)
            .filter(|g| g.group.held_out || !any_held_out)
            .collect();
        let worst = judged
            .iter()
            .map(|g| g.p_value)
            .filter(|p| p.is_finite())
            .fold(1.0, f64::min);
        let fit = base(&judged);
        let adequate = !judged.is_empty() && worst * judged.len() as f64 > FALSE_ALARM && fit.unexplained < UNEXPLAINED;
        Diagnosis {
            format: DIAGNOSIS_FORMAT.into(),
            base: BaseFit {
                tests: all.iter().map(|(thing, group)| evidence(thing, group)).collect(),
                held_out: judged
                    .iter()
                    .filter(|g| g.group.held_out)
                    .flat_map(|g| g.interactions.clone())
                    .collect(),
                ..fit
            },
            verdict: if adequate { Verdict::Adequate } else { Verdict::Unknown },
            findings: Vec::new(),
            experiments: self
                .things
                .iter()
                .flat_map(experiments)
                .chain([whole_touches()])
                .collect(),
            profiles: Vec::new(),
            budgets: Vec::new(),
            missed: Vec::new(),
            left: Vec::new(),
        }
    }
}

fn mean(effects: &[Effect]) -> Effect {
    effects.iter().sum::<Effect>() / effects.len().max(1) as f64
}

/// The error of the predicted mean displacements beside what the scatter of the trials leaves in a mean.
fn base(judged: &[&GroupResult]) -> BaseFit {
    if judged.is_empty() {
        return BaseFit::default();
    }
    let n = judged.len() as f64;
    let (mut error, mut floor, mut signal) = (0.0, 0.0, 0.0);
    for group in judged {
        let middle = mean(&group.measured);
        let count = group.measured.len() as f64;
        let scatter: f64 = group.measured.iter().map(|e| (e - middle).norm_squared()).sum();
        error += (middle - group.predicted_mean).norm_squared() / n;
        floor += scatter / ((count - 1.0).max(1.0) * count) / n;
        signal += middle.norm_squared() / n;
    }
    BaseFit {
        rmse: BTreeMap::from([("position".into(), error.sqrt())]),
        noise_floor: BTreeMap::from([("position".into(), floor.sqrt())]),
        unexplained: ((error - floor).max(0.0) / signal.max(1e-12)).min(1.0),
        ..BaseFit::default()
    }
}

fn evidence(thing: &ThingResult, group: &GroupResult) -> Evidence {
    let held = if group.group.held_out { ", held out" } else { "" };
    let [before, after] = group.divergence;
    let middle = mean(&group.measured);
    let [x, y] = group.interval;
    Evidence {
        residual: format!(
            "effect of {} with {} on {}{held}",
            group.group.action, group.group.tool, thing.name
        ),
        test: "Kullback-Leibler divergence of the measured from the simulated effects; p-value of the mean effect"
            .into(),
        statistic: after,
        p_value: group.p_value,
        words: format!(
            "{} of `{}` with `{}`{held}: {} trials moved it by ({:.1}, {:.1}) mm on the mean, predicted ({:.1}, {:.1}) mm; one trial \
             lies with 95 % in x {:.0} to {:.0} mm, y {:.0} to {:.0} mm. Divergence {after:.2} nats (before anything was \
             learnt {before:.2}; chance alone leaves about {:.2}), energy distance {:.1} mm ({:.1} mm)",
            group.group.action,
            thing.name,
            group.group.tool,
            group.measured.len(),
            1e3 * middle.x,
            1e3 * middle.y,
            1e3 * group.predicted_mean.x,
            1e3 * group.predicted_mean.y,
            1e3 * x[0],
            1e3 * x[1],
            1e3 * y[0],
            1e3 * y[1],
            Gaussian::chance(group.measured.len()),
            1e3 * group.energy[1],
            1e3 * group.energy[0],
        ),
    }
}

/// Where things stood before and after a touch names no cause: all of them need the touch itself.
fn whole_touches() -> Experiment {
    Experiment {
        words: "record whole touches, tool and things tracked and the tool's force read: snapshots name no cause"
            .into(),
        parts: CAUSES.map(str::to_owned).to_vec(),
        bits: None,
        touches: Vec::new(),
    }
}

/// What would fix what the snapshots left open.
fn experiments(thing: &ThingResult) -> Vec<Experiment> {
    let mut out = Vec::new();
    let ask = |words: String| Experiment {
        words,
        parts: Vec::new(),
        bits: None,
        touches: Vec::new(),
    };
    if !thing.weighed {
        out.push(ask(format!("lift `{}` once with a force sensor, or record the tool's force: its mass moves nothing that a snapshot shows", thing.name)));
    }
    if thing.tips {
        out.push(ask(format!(
            "strike `{}` lower or more slowly, so that it slides and does not tip: where it falls, its friction is not told",
            thing.name
        )));
    } else if !thing.fixed[0] {
        out.push(ask(format!(
            "tap `{}` quickly and stop short, so that it slides on by itself: the way it coasts tells its friction",
            thing.name
        )));
    }
    out
}
