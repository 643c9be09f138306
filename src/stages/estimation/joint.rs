//! Friction, damping and spring of joints from the load that the tool puts on the child.

use nalgebra::{DMatrix, DVector, Vector3};

use super::Config;
use super::drag::{Drag, less_drag, parted_friction, table_drag};
use super::drive::{Drive, drive_of};
use super::facts::{Ground, subject};
use super::joint_load::{JointAtWork, JointLoad, Span};
use super::parting::{Parted, part};
use super::push::steadiness;
use super::resolve::STAGE;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::capture::{Capture, Interaction, PhaseKind, Segmented};
use crate::math::{LinearFit, effective_samples, quantile, robust_linear};
use crate::twin::{Joint, JointKind, Model};

/// The blocks of one interaction, loads rid of inertia and weight where those are known.
struct Trial {
    interaction: String,
    loads: Vec<JointLoad>,
    /// Relative standard deviation of the force's jerking.
    chatter: f64,
}

/// Writes friction, damping and spring of every revolute and prismatic joint of the twin.
pub(super) fn joint_dynamics(
    capture: &Capture,
    segmented: &[Segmented],
    model: &mut Model,
    ground: &Ground,
    config: &Config,
    notices: &mut Notices,
) {
    let joints: Vec<Joint> = model.twin.joints().cloned().collect();
    for joint in joints {
        if !matches!(joint.kind, JointKind::Revolute | JointKind::Prismatic) {
            continue;
        }
        let trials: Vec<Trial> = capture
            .fitted()
            .filter_map(|i| {
                let cut = segmented.iter().find(|s| s.interaction == i.name)?;
                trial_of(i, cut, &joint, model, ground, config)
            })
            .collect();
        if trials.is_empty() {
            continue;
        }
        let drag = table_drag(&joint, model, ground);
        let parted = part(capture, segmented, &joint, model, ground, config);
        let mut found = conclude(&trials, drag, parted, &joint, notices);
        if let Some(driven) = drive_of(capture, segmented, &joint, model) {
            write_drive(&driven, &joint, model, &mut found, config.model_form, notices);
        }
        for body in &mut model.twin.bodies {
            for target in body
                .joints
                .iter_mut()
                .filter(|j| j.name == joint.name && j.child == joint.child)
            {
                (target.friction, target.damping, target.stiffness) = found.clone();
            }
        }
    }
}

/// A slide whose inertia shows: mass of the child, friction and damping of the joint.
fn write_drive(
    driven: &Drive,
    joint: &Joint,
    model: &mut Model,
    found: &mut Dynamics,
    form: f64,
    notices: &mut Notices,
) {
    // The law of friction and damping may itself be off by a share, which no stretch of the recording shows.
    let estimate = |v: [f64; 3], unit: &str| {
        let (sd, half) = (v[1].hypot(form * v[0]), v[2].hypot(1.96 * form * v[0]));
        Estimate::measured(v[0], sd, unit, driven.from.clone(), "joint-drive").with_interval([v[0] - half, v[0] + half])
    };
    found.0 = Some(estimate(driven.friction, "N"));
    found.1 = Some(estimate(driven.damping, "N·s/m"));
    if let Some(link) = model.twin.link_mut(&joint.child) {
        link.mass = Some(estimate(driven.mass, "kg"));
    }
    let [constant, _, half] = driven.constant;
    if constant.abs() > half {
        let message = format!(
            "a constant force of {constant:.3} ± {half:.3} N acts along the joint beside friction: a bias of the sensor, \
             or a slope"
        );
        notices.note(STAGE, &joint.name, message);
    }
}

type Dynamics = (Option<Estimate>, Option<Estimate>, Option<Estimate>);

fn conclude(
    trials: &[Trial],
    drag: Option<Drag>,
    parted: Option<Parted>,
    joint: &Joint,
    notices: &mut Notices,
) -> Dynamics {
    let from: Vec<String> = trials.iter().map(|t| t.interaction.clone()).collect();
    let revolute = joint.kind == JointKind::Revolute;
    let units = if revolute {
        ["N·m", "N·m·s/rad", "N·m/rad"]
    } else {
        ["N", "N·s/m", "N/m"]
    };
    let Some(law) = law_of(trials, revolute) else {
        return (None, None, None);
    };
    let estimate =
        |(value, sd): (f64, f64), unit: &str| Estimate::measured(value, sd, unit, from.clone(), "joint-load");
    let mut friction = estimate(law.friction, units[0]);
    if let Some(speed) = law.one_speed {
        let low = 0.3 * law.friction.0;
        let [_, high] = friction.ci95.unwrap_or([low, law.friction.0]);
        friction = friction.with_interval([low, high]);
        friction.status = Status::Assumed;
        friction.confounded = Some(Confounded {
            with: vec!["damping".into()],
            known: format!("friction + {speed:.3} damping = {:.4} {}", law.friction.0, units[0]),
            experiment: "move the joint at half and at twice the speed".into(),
        });
    }
    if let (Some(_), Some(parted), JointKind::Revolute) = (&drag, parted, joint.kind) {
        friction = parted_friction(&parted, units[0]);
    } else if let Some(drag) = drag.as_ref().filter(|d| free_of(d, joint.kind) > law.friction.0) {
        let message = format!(
            "the load is {:.4} {}, less than the child's friction on the support would be ({:.4} or more): it is taken \
             to hang free of it",
            law.friction.0,
            units[0],
            free_of(drag, joint.kind)
        );
        notices.note(STAGE, &joint.name, message);
    } else if let Some(drag) = drag {
        friction = less_drag(&friction, &drag, joint, units[0], notices);
    }
    (
        Some(friction),
        law.damping.map(|d| estimate(d, units[1])),
        law.spring.map(|s| estimate(s, units[2])),
    )
}

/// The drag that a load must reach for the child to bear on the support, N or N·m: of a slide, which mostly rides in
/// its parent, the likely one; of a hinge, whose links mostly stand side by side, the least.
fn free_of(drag: &Drag, kind: JointKind) -> f64 {
    if kind == JointKind::Prismatic {
        drag.value
    } else {
        drag.least
    }
}

/// `load = friction sign(speed) + damping speed + spring (position - rest)` with what the motion excites.
struct Law {
    friction: (f64, f64),
    damping: Option<(f64, f64)>,
    spring: Option<(f64, f64)>,
    /// The speed, where there was but one.
    one_speed: Option<f64>,
}

fn fit_law(trials: &[&Trial], damping: bool, spring: bool) -> Option<LinearFit> {
    let loads: Vec<JointLoad> = trials.iter().flat_map(|t| t.loads.iter().copied()).collect();
    let columns = 1 + usize::from(damping) + usize::from(spring);
    let a = DMatrix::from_fn(loads.len(), columns, |i, j| match (j, damping) {
        (0, _) => loads[i].speed.signum(),
        (1, true) => loads[i].speed,
        _ => loads[i].position,
    });
    let b = DVector::from_iterator(loads.len(), loads.iter().map(|l| l.load));
    let mut fit = robust_linear(&a, &b)?;
    let memory = loads.len() as f64 / effective_samples(fit.residuals.as_slice());
    fit.covariance *= memory.max(1.0);
    Some(fit)
}

/// Standard deviation of component `k` by leaving out one trial at a time; blocks of one trial share its errors.
fn jackknife(trials: &[Trial], whole: &LinearFit, k: usize, damping: bool, spring: bool) -> f64 {
    let n = trials.len() as f64;
    let spread: f64 = (0..trials.len())
        .filter_map(|out| {
            let rest: Vec<&Trial> = (0..trials.len()).filter(|i| *i != out).map(|i| &trials[i]).collect();
            let fit = fit_law(&rest, damping, spring)?;
            Some((fit.x[k] - whole.x[k]).powi(2))
        })
        .sum();
    let scatter = ((n - 1.0) / n * spread).sqrt();
    // One trial shows no scatter: 3 % stands in for it.
    whole
        .sd(k)
        .hypot(scatter)
        .hypot(0.03 / n.sqrt() * whole.x[0].abs() / if k == 0 { 1.0 } else { f64::INFINITY })
}

fn law_of(trials: &[Trial], revolute: bool) -> Option<Law> {
    let all: Vec<&Trial> = trials.iter().collect();
    let loads = || trials.iter().flat_map(|t| t.loads.iter());
    let range = |pick: fn(&JointLoad) -> f64| {
        loads()
            .map(pick)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    };
    // Noise in the velocities is no variety: the bulk of the blocks must differ.
    let speeds: Vec<f64> = loads().map(|l| l.speed.abs()).collect();
    let (slow, fast) = (quantile(&speeds, 0.1)?, quantile(&speeds, 0.9)?);
    let (start, end) = range(|l| l.position);
    let clear = |damping: bool, spring: bool, k: usize| {
        fit_law(&all, damping, spring).is_some_and(|f| f.x[k] > 4.0 * jackknife(trials, &f, k, damping, spring))
    };
    let varied = fast > 1.6 * slow;
    let damping = varied && clear(true, false, 1);
    let spring = end - start > if revolute { 0.3 } else { 0.05 } && clear(damping, true, 1 + usize::from(damping));
    let fit = fit_law(&all, damping, spring)?;
    let read = |k: usize| (fit.x[k], jackknife(trials, &fit, k, damping, spring));
    let mut friction = read(0);
    if varied && !damping {
        // Damping may hide below what was seen: its doubt is that of friction too.
        let both = fit_law(&all, true, false)?;
        friction.1 = friction.1.hypot(both.sd(0)).hypot(0.5 * (both.x[0] - friction.0));
    }
    let chatter = trials.iter().map(|t| t.chatter).sum::<f64>() / trials.len() as f64;
    friction.1 = friction.1.hypot(0.25 * chatter * friction.0);
    (friction.0 > 0.0).then(|| Law {
        friction,
        damping: damping.then(|| read(1)),
        spring: spring.then(|| read(1 + usize::from(damping))),
        one_speed: (!varied).then_some(0.5 * (slow + fast)),
    })
}

fn loads(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    ground: &Ground,
    config: &Config,
) -> Option<Vec<JointLoad>> {
    let slide = cut.of(PhaseKind::Slide).next()?;
    let at_work = JointAtWork::new(interaction, cut, joint, model)?;
    let span = Span {
        block: config.block,
        half: config.smoothing.max(0.15),
    };
    let mut out = Vec::new();
    let mut t = slide.start + config.settling + 0.5 * config.block;
    while t + 0.5 * config.block <= slide.end - 0.5 * config.settling {
        if let Some(load) = at_work.at(t, span) {
            let (from, to) = (t - 0.5 * config.block, t + 0.5 * config.block);
            let (plateau, _) = steadiness(interaction, cut, &ground.plane, from, to);
            out.push(JointLoad {
                load: plateau * load.load,
                ..load
            });
        }
        t += config.block;
    }
    (out.len() >= 4).then_some(out)
}

/// The blocks of one interaction that moved the joint; `None` where it did not.
fn trial_of(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    ground: &Ground,
    config: &Config,
) -> Option<Trial> {
    let about = subject(interaction, cut)?;
    if about != joint.child {
        return None;
    }
    let mut loads = loads(interaction, cut, joint, model, ground, config)?;
    let fastest = loads.iter().map(|l| l.speed.abs()).fold(0.0, f64::max);
    let least = if joint.kind == JointKind::Revolute { 0.02 } else { 2e-3 };
    loads.retain(|l| l.speed.abs() > (0.2 * fastest).max(least));
    if loads.len() < 4 {
        return None;
    }
    // Inertia along a prismatic freedom is the child's mass where it was measured.
    let mass = model
        .twin
        .links()
        .find(|(_, l)| l.name == joint.child)
        .and_then(|(_, l)| l.mass.as_ref());
    let mass = mass.filter(|m| m.status != Status::Assumed).map_or(0.0, |m| m.value);
    let weight = mass * ground.gravity.dot(&Vector3::from(joint.axis.value));
    if joint.kind == JointKind::Prismatic {
        for load in &mut loads {
            load.load += weight - mass * load.acceleration;
        }
    }
    let slide = cut.of(PhaseKind::Slide).next()?;
    let (_, chatter) = steadiness(
        interaction,
        cut,
        &ground.plane,
        slide.start + config.settling,
        slide.end,
    );
    Some(Trial {
        interaction: interaction.name.clone(),
        loads,
        chatter: chatter.min(0.5),
    })
}
