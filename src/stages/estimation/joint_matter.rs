//! What hangs on a joint: its weight and inertia along the freedom, for what the tool must push beside friction.

use nalgebra::{Matrix3, Point3, Unit, UnitQuaternion, Vector3};

use super::Config;
use super::joint_law::Trial;
use super::pool::relative_sd;
use super::solid::solid_of;
use crate::math::median;
use crate::twin::{Joint, JointKind, Link, Model};

/// One link that the joint carries, where it stands at the first view.
#[derive(Clone, Debug)]
struct Part {
    /// kg.
    mass: f64,
    /// Centre of mass from the joint's origin, m, world.
    arm: Vector3<f64>,
    /// About the centre of mass, kg·m², world axes.
    inertia: Matrix3<f64>,
}

/// Everything that moves with the child of a joint.
#[derive(Clone, Debug)]
pub(super) struct Carried {
    parts: Vec<Part>,
    /// Standard deviation of its mass as a share: of the weighing, or of a density that nobody knows.
    pub relative: f64,
    axis: Unit<Vector3<f64>>,
    pitch: f64,
    slides: bool,
    gravity: Vector3<f64>,
}

/// Names of the child of a joint and of all that hangs on it.
pub(super) fn family(joint: &Joint, model: &Model) -> Vec<String> {
    let body = model
        .twin
        .bodies
        .iter()
        .find(|b| b.joints.iter().any(|j| j.name == joint.name));
    body.map_or_else(Vec::new, |b| b.hung_on(&joint.child))
}

fn part_of(link: &Link, model: &Model, origin: &Point3<f64>, config: &Config) -> Option<(Part, f64)> {
    let solid = solid_of(model.meshes.get(link.mesh.as_ref()?)?)?;
    let (density, log_sd) = config.density;
    let known = link.mass.as_ref().filter(|m| m.is_measured() && m.value > 0.0);
    let (mass, relative) = known.map_or((density * solid.volume, log_sd), |m| (m.value, relative_sd(m)));
    let com = link.com.as_ref().map_or(solid.centroid, |c| Point3::from(c.value));
    let turn = link.pose.0.rotation.to_rotation_matrix().into_inner();
    let part = Part {
        mass,
        arm: link.pose.0 * com - origin,
        inertia: turn * (solid.inertia * (mass / solid.volume)) * turn.transpose(),
    };
    Some((part, relative * mass))
}

impl Carried {
    /// `None` where no shape says where the mass could be.
    pub fn of(joint: &Joint, model: &Model, gravity: &Vector3<f64>, config: &Config) -> Option<Self> {
        let origin = Point3::from(joint.origin.value);
        let mut parts = Vec::new();
        let mut doubt: f64 = 0.0;
        for name in family(joint, model) {
            let (part, sd) = part_of(model.twin.link(&name)?, model, &origin, config)?;
            parts.push(part);
            doubt += sd;
        }
        let mass: f64 = parts.iter().map(|p| p.mass).sum();
        Some(Self {
            relative: doubt / mass,
            axis: Unit::try_new(Vector3::from(joint.axis.value), 1e-9)?,
            pitch: joint.pitch.as_ref().map_or(0.0, |p| p.value),
            slides: joint.kind == JointKind::Prismatic,
            gravity: *gravity,
            parts,
        })
    }

    /// Load that holds it at the position `q` (rad or m) and gives it the acceleration `a`, N·m or N.
    pub fn load(&self, q: f64, a: f64) -> f64 {
        let axis = self.axis.into_inner();
        if self.slides {
            let mass: f64 = self.parts.iter().map(|p| p.mass).sum();
            return mass * (a - self.gravity.dot(&axis));
        }
        let turn = UnitQuaternion::from_axis_angle(&self.axis, q);
        let of = |p: &Part| {
            let arm = turn * p.arm;
            let across = arm - axis * axis.dot(&arm);
            let inertia = axis.dot(&(p.inertia * axis)) + p.mass * (across.norm_squared() + self.pitch.powi(2));
            let way = axis.cross(&arm) + axis * self.pitch;
            inertia * a - p.mass * self.gravity.dot(&way)
        };
        self.parts.iter().map(of).sum()
    }

    /// What a centre of mass off by a fifth of its arm would add to the moment of the weight, N·m.
    pub fn slack(&self) -> f64 {
        let axis = self.axis.into_inner();
        let level = self.gravity - axis * axis.dot(&self.gravity);
        let moments = self.parts.iter().map(|p| p.mass * p.arm.norm());
        0.2 * level.norm() * moments.sum::<f64>()
    }
}

/// By how much friction may be less and more than it seems for a weight that only adds to it, N or N·m: the weight's
/// logarithm is known to `relative`.
pub(super) fn weight_open(trials: &[Trial], carried: &Carried) -> [f64; 2] {
    let loads = || trials.iter().flat_map(|t| &t.loads);
    let along: Vec<f64> = loads()
        .map(|l| l.speed.signum() * carried.load(l.position, 0.0))
        .collect();
    let weight = median(&along).unwrap_or(0.0);
    let factor = (1.96 * carried.relative).exp();
    let (heavier, lighter) = (weight.abs() * (factor - 1.0), weight.abs() * (1.0 - 1.0 / factor));
    if weight > 0.0 {
        [heavier, lighter]
    } else {
        [lighter, heavier]
    }
}
