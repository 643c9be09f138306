//! Friction, damping and spring of joints from the load that the tool puts on the child.

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector3};

use super::Config;
use super::evidence::{mean_wrench, motion_at, tare_of, tool_at};
use super::facts::{Ground, subject};
use super::pool::{pooled, relative_sd};
use super::resolve::STAGE;
use super::solid::solid_of;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::capture::{Capture, Interaction, PhaseKind, PoseStream, Segmented};
use crate::math::{LinearFit, effective_samples, robust_linear};
use crate::twin::{Joint, JointKind, Link, Model};

/// Load and motion along the freedom of a joint, averaged over a block.
#[derive(Clone, Copy, Debug)]
struct Load {
    /// N·m or N, of the tool on the child.
    load: f64,
    /// rad or m since the first view.
    position: f64,
    /// rad/s or m/s.
    speed: f64,
    /// rad/s² or m/s², absolute acceleration of the child along the freedom.
    acceleration: f64,
}

/// What one interaction says of a joint.
struct Trial {
    interaction: String,
    friction: (f64, f64),
    damping: Option<(f64, f64)>,
    spring: Option<(f64, f64)>,
}

/// Friction that the child feels from the table, along the freedom of the joint.
struct Drag {
    value: f64,
    sd: f64,
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
        let found = conclude(&trials, drag, &joint, notices);
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

type Dynamics = (Option<Estimate>, Option<Estimate>, Option<Estimate>);

fn conclude(trials: &[Trial], drag: Option<Drag>, joint: &Joint, notices: &mut Notices) -> Dynamics {
    let from: Vec<String> = trials.iter().map(|t| t.interaction.clone()).collect();
    let revolute = joint.kind == JointKind::Revolute;
    let units = if revolute {
        ["N·m", "N·m·s/rad", "N·m/rad"]
    } else {
        ["N", "N·s/m", "N/m"]
    };
    let frictions: Vec<(f64, f64)> = trials.iter().map(|t| t.friction).collect();
    let mut friction = pooled(&frictions, 0.03, 0.0, units[0], from.clone(), "joint-load");
    if let (Some(f), Some(drag)) = (&mut friction, drag) {
        let known = format!(
            "friction({}) + table friction of {} = {:.4} {}",
            joint.name, joint.child, f.value, units[0]
        );
        notices.warn(
            STAGE,
            &joint.name,
            format!("the child slides on the support while it moves: only {known} is measured"),
        );
        let sd = (relative_sd(f) * f.value).hypot(drag.sd);
        let value = (f.value - drag.value).max(0.0);
        let low = (value - 1.96 * sd).max(0.0);
        let mut parted = Estimate::measured(
            value,
            sd,
            units[0],
            from.clone(),
            "joint-load less table friction by volume",
        )
        .with_interval([low, (value + 1.96 * sd).min(f.value)]);
        parted.status = Status::Assumed;
        parted.confounded = Some(Confounded {
            with: vec![format!("friction_force.kinetic({})", joint.child)],
            known,
            experiment: "move the joint with the child off the support, or weigh the child".into(),
        });
        *f = parted;
    }
    let some = |pick: fn(&Trial) -> Option<(f64, f64)>| trials.iter().filter_map(pick).collect::<Vec<_>>();
    (
        friction,
        pooled(&some(|t| t.damping), 0.05, 0.0, units[1], from.clone(), "joint-load"),
        pooled(&some(|t| t.spring), 0.05, 0.0, units[2], from, "joint-load"),
    )
}

/// World-from-link at the first view, and a link's pose stream, where there are any.
fn pose_now(
    track: Option<&PoseStream>,
    link: Option<&Link>,
    t: f64,
    half: f64,
) -> Option<(Isometry3<f64>, Vector3<f64>, Vector3<f64>)> {
    match track {
        Some(stream) => motion_at(stream, t, half).map(|m| (m.pose, m.velocity, m.spin)),
        None => Some((link?.pose.0, Vector3::zeros(), Vector3::zeros())),
    }
}

fn loads(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    config: &Config,
) -> Option<Vec<Load>> {
    let stream = interaction.force.as_ref()?;
    let slide = cut.of(PhaseKind::Slide).next()?;
    let link = |name: &str| model.twin.links().find(|(_, l)| l.name == name).map(|(_, l)| l);
    let (parent, child) = (link(&joint.parent), link(&joint.child)?);
    let child_track = interaction.tracks.get(&joint.child)?;
    let parent_track = interaction.tracks.get(&joint.parent);
    let tare = tare_of(interaction, cut);
    let home = parent.map_or(Isometry3::identity(), |l| l.pose.0);
    let half = config.smoothing.max(0.15);
    let mut out = Vec::new();
    let mut t = slide.start + config.settling + 0.5 * config.block;
    while t + 0.5 * config.block <= slide.end - 0.5 * config.settling {
        let wrench = mean_wrench(stream, t - 0.5 * config.block, t + 0.5 * config.block, &tare);
        let child_now = motion_at(child_track, t, half);
        let parent_now = pose_now(parent_track, parent, t, half).or(Some((home, Vector3::zeros(), Vector3::zeros())));
        if let (Some(w), Some(c), Some((parent_pose, v_parent, spin_parent))) = (wrench, child_now, parent_now) {
            let moved = parent_pose * home.inverse();
            let axis = moved * Vector3::from(joint.axis.value);
            let origin = moved * Point3::from(joint.origin.value);
            let turn = (parent_pose.rotation * home.rotation.inverse()).inverse()
                * c.pose.rotation
                * child.pose.rotation.inverse();
            let load = if joint.kind == JointKind::Revolute {
                let tool = interaction.tool_path.as_ref().and_then(|p| tool_at(p, t));
                let arm = tool.unwrap_or(Point3::from(c.pose.translation.vector)) - origin;
                Load {
                    load: (arm.cross(&w.force) + w.torque.unwrap_or_default()).dot(&axis),
                    position: turn.scaled_axis().dot(&Vector3::from(joint.axis.value)),
                    speed: (c.spin - spin_parent).dot(&axis),
                    acceleration: 0.0,
                }
            } else {
                let carried = parent_pose.translation.vector - home.translation.vector;
                let shift = c.pose.translation.vector - child.pose.translation.vector - carried;
                Load {
                    load: w.force.dot(&axis),
                    position: shift.dot(&axis),
                    speed: (c.velocity - v_parent).dot(&axis),
                    acceleration: c.acceleration.dot(&axis),
                }
            };
            out.push(load);
        }
        t += config.block;
    }
    (out.len() >= 4).then_some(out)
}

/// Fits `load = friction sign(speed) + damping speed + spring (position - rest)` with only the terms that the
/// motion excites and the data demand.
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
    let mut loads = loads(interaction, cut, joint, model, config)?;
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
    let slope = if joint.kind == JointKind::Prismatic {
        weight
    } else {
        0.0
    };
    let range = |pick: fn(&Load) -> f64| {
        let (lo, hi) = loads
            .iter()
            .map(pick)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (lo, hi)
    };
    let (slow, fast) = range(|l| l.speed.abs());
    let (start, end) = range(|l| l.position);
    let far = if joint.kind == JointKind::Revolute { 0.3 } else { 0.05 };
    let fit = |damping: bool, spring: bool| -> Option<(LinearFit, f64)> {
        let columns = 1 + usize::from(damping) + usize::from(spring);
        let a = DMatrix::from_fn(loads.len(), columns, |i, j| match (j, damping) {
            (0, _) => loads[i].speed.signum(),
            (1, true) => loads[i].speed,
            _ => loads[i].position,
        });
        let b = DVector::from_iterator(
            loads.len(),
            loads.iter().map(|l| l.load + slope - mass * l.acceleration),
        );
        let fit = robust_linear(&a, &b)?;
        let memory = (loads.len() as f64 / effective_samples(fit.residuals.as_slice()))
            .max(1.0)
            .sqrt();
        Some((fit, memory))
    };
    let clear = |f: &(LinearFit, f64), i: usize| f.0.x[i] > 4.0 * f.0.sd(i) * f.1;
    let damping = fast > 1.8 * slow && fit(true, false).is_some_and(|f| clear(&f, 1));
    let spring = end - start > far && fit(damping, true).is_some_and(|f| clear(&f, 1 + usize::from(damping)));
    let (fit, memory) = fit(damping, spring)?;
    let read = |i: usize| (fit.x[i], (fit.sd(i) * memory).hypot(0.01 * fit.x[i].abs()));
    Some(Trial {
        interaction: interaction.name.clone(),
        friction: read(0),
        damping: damping.then(|| read(1)),
        spring: spring.then(|| read(1 + usize::from(damping))),
    })
}

/// The table's drag on a child that stands on it, along the freedom of the joint; `None` where it does not
/// stand on it, as far as the shapes say.
fn table_drag(joint: &Joint, model: &Model, ground: &Ground) -> Option<Drag> {
    let link = model
        .twin
        .links()
        .find(|(_, l)| l.name == joint.child)
        .map(|(_, l)| l)?;
    let mesh = model.meshes.get(link.mesh.as_ref()?)?;
    let heights = mesh
        .vertices
        .iter()
        .map(|v| (link.pose.0 * v - ground.point).dot(&ground.plane.normal));
    let lowest = heights.fold(f64::INFINITY, f64::min);
    if lowest > 5e-3 {
        return None;
    }
    let force = link.friction_force.kinetic.as_ref()?;
    let solid = solid_of(mesh)?;
    let arm = match joint.kind {
        JointKind::Revolute => {
            let axis = Vector3::from(joint.axis.value);
            let out = link.pose.0 * solid.centroid - Point3::from(joint.origin.value);
            let across = out - axis * axis.dot(&out);
            // Mean distance of the footprint from the axis: its centre and its own spread.
            let spread = 0.27 * (solid.extent - axis.map(f64::abs).component_mul(&solid.extent)).norm();
            (across.norm_squared() + spread * spread).sqrt()
        }
        _ => 1.0,
    };
    let relative = relative_sd(force).hypot(0.15);
    Some(Drag {
        value: force.value * arm,
        sd: relative * force.value * arm,
    })
}
