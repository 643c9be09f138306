//! Which causes a scene can hide, and how they are told.

use super::draw::effect;
use super::law::Effect;
use crate::base::{Error, Result};
use crate::lab::{ActionSpec, BodySpec, Scene, ShapeSpec};
use crate::twin::Truth;

/// What must be done in a scene for a cause to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shows {
    Push,
    /// A push, or a drag to and fro.
    Slide,
    Roll,
    Load,
    Press,
    Turn,
    Pair,
    Force,
}

/// All that can be hidden.
const CAUSES: &[(&str, Shows)] = &[
    ("velocity-weakening-friction", Shows::Slide),
    ("viscous-friction", Shows::Slide),
    ("static-ageing", Shows::Slide),
    ("rate-state-friction", Shows::Slide),
    ("anisotropic-friction", Shows::Slide),
    ("friction-patch", Shows::Slide),
    ("uneven-support-pressure", Shows::Push),
    ("presliding", Shows::Slide),
    ("wear-or-heating", Shows::Slide),
    ("tool-friction", Shows::Push),
    ("contact-law", Shows::Push),
    ("com-offset", Shows::Push),
    ("yaw-inertia", Shows::Push),
    ("nonuniform-density", Shows::Push),
    ("rolling-resistance", Shows::Roll),
    ("load-dependent-friction", Shows::Load),
    ("loose-mass", Shows::Push),
    ("added-inertia", Shows::Push),
    ("support-tilt", Shows::Slide),
    ("gravity-error", Shows::Slide),
    ("bump", Shows::Slide),
    ("magnet", Shows::Slide),
    ("tether", Shows::Slide),
    ("hidden-body", Shows::Push),
    ("breakaway-bond", Shows::Slide),
    ("outside-texture", Shows::Slide),
    ("outside-ratchet", Shows::Slide),
    ("outside-shaking-table", Shows::Slide),
    ("hardening-stiffness", Shows::Press),
    ("second-stage", Shows::Press),
    ("power-law-stiffness", Shows::Press),
    ("elastic-damping", Shows::Press),
    ("stress-relaxation", Shows::Press),
    ("plastic-set", Shows::Press),
    ("elastic-hysteresis", Shows::Press),
    ("guide-friction", Shows::Press),
    ("softening-by-use", Shows::Press),
    ("snap-through", Shows::Press),
    ("preload", Shows::Press),
    ("stiffness-drift", Shows::Press),
    ("adhesion", Shows::Press),
    ("support-compliance", Shows::Press),
    ("outside-ribs", Shows::Press),
    ("joint-damping", Shows::Turn),
    ("joint-quadratic-damping", Shows::Turn),
    ("joint-spring", Shows::Turn),
    ("joint-stiction", Shows::Turn),
    ("detent", Shows::Turn),
    ("latch", Shows::Turn),
    ("joint-gravity", Shows::Turn),
    ("soft-close", Shows::Turn),
    ("limit-compliance", Shows::Turn),
    ("backlash", Shows::Turn),
    ("joint-loose-mass", Shows::Turn),
    ("moving-axis", Shows::Turn),
    ("lever-arm", Shows::Turn),
    ("joint-coupling", Shows::Pair),
    ("outside-joint-texture", Shows::Turn),
    ("force-bias", Shows::Force),
    ("force-bias-world", Shows::Slide),
    ("force-gain", Shows::Push),
    ("force-drift", Shows::Force),
    ("force-crosstalk", Shows::Push),
    ("force-saturation", Shows::Force),
    ("time-delay", Shows::Slide),
    ("sensor-lag", Shows::Force),
    ("clock-drift", Shows::Slide),
    ("length-scale", Shows::Slide),
    ("tracking-error", Shows::Slide),
    ("contact-point-offset", Shows::Push),
    ("quantisation", Shows::Force),
    ("outliers", Shows::Force),
    ("outside-reflex", Shows::Force),
    ("outside-snagging-cable", Shows::Force),
];

fn shows(scene: &Scene, what: Shows) -> bool {
    let round = |name: &String| {
        let ball = |b: &&BodySpec| matches!(b.shape, ShapeSpec::Sphere { .. });
        scene.body.iter().filter(ball).any(|b| &b.name == name)
    };
    let hinged = |name: &String| scene.joint.iter().any(|j| &j.b == name || &j.a == name);
    scene.action.iter().any(|action| match (what, action) {
        (Shows::Push | Shows::Slide, ActionSpec::Push { target, .. }) => !hinged(target) && !round(target),
        (Shows::Slide, ActionSpec::Pull { target, back, .. }) => *back && !hinged(target),
        (Shows::Roll, ActionSpec::Push { target, .. }) => !hinged(target) && round(target),
        (Shows::Load, ActionSpec::Pull { target, down, .. }) => *down > 0.0 && !hinged(target),
        (Shows::Press, ActionSpec::Press { target, .. }) => {
            scene.body.iter().any(|b| &b.name == target && b.foam.is_some())
        }
        (Shows::Turn, ActionSpec::Push { target, .. } | ActionSpec::Pull { target, .. }) => hinged(target),
        (Shows::Pair, ActionSpec::Push { target, .. } | ActionSpec::Pull { target, .. }) => {
            scene.joint.len() > 1 && hinged(target)
        }
        (Shows::Force, ActionSpec::Push { .. } | ActionSpec::Pull { .. } | ActionSpec::Press { .. }) => true,
        _ => false,
    })
}

/// The causes that can be hidden in `scene`, given what is done in it; `outside-…` are none of the catalogue.
pub fn hidden_causes(scene: &Scene) -> Vec<&'static str> {
    let able = CAUSES.iter().filter(|(_, what)| shows(scene, *what));
    able.map(|(cause, _)| *cause).collect()
}

/// The body that effects are about: the target of the first push of a free body, else of the first action with one.
pub(in crate::lab) fn target(scene: &Scene) -> Option<&str> {
    let free = scene.action.iter().find_map(|action| match action {
        ActionSpec::Push { target, .. } => Some(target.as_str()),
        _ => None,
    });
    free.or_else(|| scene.action.iter().find_map(ActionSpec::target))
}

/// The effects of a scene, drawn.
///
/// # Errors
/// A cause that the scene cannot hide.
pub(in crate::lab) fn effects(scene: &Scene) -> Result<Vec<Effect>> {
    let able = hidden_causes(scene);
    let mut all = Vec::new();
    for (i, spec) in scene.hide.iter().enumerate() {
        let Some(cause) = able.iter().find(|cause| **cause == spec.cause) else {
            return Err(Error::bad_input(
                &scene.name,
                format!("hide[{i}].cause"),
                format!("{:?}", spec.cause),
                format!("one of {}", able.join(", ")),
            ));
        };
        all.push(effect(scene, cause, spec));
    }
    Ok(all)
}

/// Tells the truth of what is hidden; what has no strength is not there.
pub(in crate::lab) fn told(effects: &[Effect], truth: &mut Truth) {
    for effect in effects
        .iter()
        .filter(|e| e.parameters.get("strength").is_some_and(|s| *s > 0.0))
    {
        if !truth.causes.iter().any(|c| c == effect.cause) {
            truth.causes.push(effect.cause.to_owned());
        }
        truth
            .cause_parameters
            .insert(effect.cause.to_owned(), effect.parameters.clone());
    }
}
