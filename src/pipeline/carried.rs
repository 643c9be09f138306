//! What a given model has beyond plain numbers, beside what a capture tells: an effect that it carries is not lacking, and its numbers are
//! those beside its effects.

use super::Options;
use super::diagnose::diagnose;
use super::extend::{extend, held};
use crate::base::{Notices, Result};
use crate::capture::{Capture, Segmented, SensorFaults};
use crate::stages::diagnosis;
use crate::twin::{Compared, Effect, Finding, Joint, Model, SUPPORT, Twin, effects_compared, efforts_compared};

/// Whether the model has a number for it, or carries it as an effect.
pub(super) fn carries(model: &Twin, finding: &Finding) -> bool {
    let same = |e: &Effect| e.cause == finding.cause && e.place == finding.place;
    let mut joints = model.joints().filter(|j| j.name == finding.place);
    let effect = model.effects.iter().any(same) || joints.any(|j| of_joint(j).contains(&finding.cause.as_str()));
    effect || held(model, finding)
}

/// Whether it carries an effect on what slides there: forces that were foretold without it then tell no friction.
pub(super) fn rubs_otherwise(model: &Twin, name: &str) -> bool {
    model.effects.iter().any(|e| e.place == name || e.place == SUPPORT)
}

/// The causes that a joint has a place for, and has.
fn of_joint(joint: &Joint) -> Vec<&'static str> {
    let e = &joint.effects;
    let notch = |latch: bool| e.detents.iter().any(|d| d.latch == latch);
    let all = [
        ("joint-stiction", e.static_excess.is_some()),
        ("detent", notch(false)),
        ("latch", notch(true)),
        ("joint-coupling", e.coupling.is_some()),
        ("backlash", e.backlash.is_some()),
    ];
    all.into_iter()
        .filter(|(_, has)| *has)
        .map(|(cause, _)| cause)
        .collect()
}

fn causes_of(model: &Twin) -> Vec<String> {
    let own = model.effects.iter().map(|e| e.cause.clone());
    let of_joints = model.joints().flat_map(of_joint).map(str::to_owned);
    own.chain(of_joints).collect()
}

/// What the capture tells beside the effects that a model carries: what was fitted without the model, and what was fitted on its shapes
/// and joints.
pub(super) struct Beside {
    pub fresh: Twin,
    pub refit: Twin,
    findings: Vec<Finding>,
}

impl Beside {
    /// Tries the causes that the `model` carries and no others, so that numbers are laid beside numbers of the same laws.
    pub fn of(
        model: &Twin,
        (raw, fresh): (&Capture, &Model),
        (capture, segmented, refit): (&Capture, &[Segmented], &Model),
        (faults, options): (&SensorFaults, &Options),
    ) -> Result<Self> {
        let (mut fresh, mut refit) = (fresh.clone(), refit.clone());
        let mut findings = Vec::new();
        let causes = causes_of(model);
        if !causes.is_empty() {
            let mut options = options.clone();
            options.diagnosis.causes = Some(causes);
            let quiet = &mut Notices::default();
            let whole = diagnose(raw, &fresh, &options, quiet)?;
            extend(&mut fresh, &whole.diagnosis, &whole.levels);
            let on_its = diagnosis::diagnose(capture, segmented, &refit, faults, &options.diagnosis, quiet)?;
            extend(&mut refit, &on_its.diagnosis, &on_its.levels);
            findings = on_its.diagnosis.findings;
        }
        Ok(Self {
            fresh: fresh.twin,
            refit: refit.twin,
            findings,
        })
    }

    /// Of joints that carry effects, friction, damping and spring beside these, in the place of those that are so without any; and the
    /// numbers of all effects that were found as well.
    pub fn tell(&self, model: &Twin, numbers: &mut Vec<Compared>) {
        let tried = |name: &str| self.findings.iter().any(|f| f.place == name);
        for joint in model.joints().filter(|j| tried(&j.name)) {
            let Some(found) = self.refit.joints().find(|j| j.name == joint.name) else {
                continue;
            };
            numbers.retain(|n| n.about != joint.name || !of_loads(&n.quantity));
            numbers.extend(efforts_compared(joint, found));
        }
        numbers.extend(effects_compared(&model.effects, &self.findings));
    }
}

/// Whether the number of a joint is one that its loads tell.
fn of_loads(quantity: &str) -> bool {
    ["friction", "damping", "stiffness"]
        .iter()
        .any(|q| quantity.starts_with(q))
}
