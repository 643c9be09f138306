//! What a jointed link feels from the support it may rub on, and what is left for the joint itself.

use nalgebra::{Point3, Vector3};

use super::facts::Ground;
use super::parting::Parted;
use super::pool::relative_sd;
use super::resolve::STAGE;
use super::solid::solid_of;
use crate::base::{Confounded, Estimate, Notices, Status};
use crate::twin::{Joint, JointKind, Model};

/// Friction that the child feels from the table, along the freedom of the joint.
pub(super) struct Drag {
    pub value: f64,
    pub sd: f64,
    /// The least that it is if the child bears on the support at all (2.5 %).
    pub least: f64,
}

/// The joint's own friction where pushes of both links tell it from what the links feel from the support.
pub(super) fn parted_friction(parted: &Parted, unit: &str) -> Estimate {
    let (value, sd) = parted.joint;
    let sd = sd.hypot(0.05 * value);
    Estimate::measured(value, sd, unit, parted.from.clone(), "push-balance of both links")
}

/// Mean of a normal distribution that is cut to `[0, most]`.
fn mean_within(mean: f64, sd: f64, most: f64) -> f64 {
    let steps = 200;
    let (mut sum, mut weight) = (0.0, 0.0);
    for i in 0..steps {
        let x = most * (f64::from(i) + 0.5) / f64::from(steps);
        let w = (-0.5 * ((x - mean) / sd).powi(2)).exp();
        sum += w * x;
        weight += w;
    }
    if weight > 0.0 {
        sum / weight
    } else {
        mean.clamp(0.0, most)
    }
}

/// The joint's own friction where the child also drags over the support: the difference, and only assumed.
pub(super) fn less_drag(total: &Estimate, drag: &Drag, joint: &Joint, unit: &str, notices: &mut Notices) -> Estimate {
    let known = format!(
        "friction({}) + table friction of {} = {:.4} {unit}",
        joint.name, joint.child, total.value
    );
    notices.warn(
        STAGE,
        &joint.name,
        format!("the child may slide on the support while it moves: only {known} is measured"),
    );
    let sd = (relative_sd(total) * total.value).hypot(drag.sd);
    let left = total.value - drag.value;
    let value = mean_within(left, sd.max(1e-9), total.value);
    let method = "joint-load less table friction by volume";
    // Whether it drags at all, the shapes tell to a few millimetres only: all of the load may be the joint's.
    let mut parted = Estimate::measured(value, sd, unit, total.from.clone(), method)
        .with_interval([(left - 1.96 * sd).max(0.0).min(value), total.value * 1.1]);
    parted.status = Status::Assumed;
    parted.confounded = Some(Confounded {
        with: vec![format!("friction_force.kinetic({})", joint.child)],
        known,
        experiment: "move the joint with the child off the support, or weigh the child".into(),
    });
    parted
}

/// The table's drag on a child that stands on it, along the freedom of the joint; `None` where it does not
/// stand on it, as far as the shapes say.
pub(super) fn table_drag(joint: &Joint, model: &Model, ground: &Ground) -> Option<Drag> {
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
    let least = force.ci95.map_or(0.0, |ci| ci[0]);
    Some(Drag {
        least: 0.9 * least * arm,
        value: force.value * arm,
        sd: relative * force.value * arm,
    })
}
