//! Friction, damping and spring that a model states of a joint, tried on the loads that moved it: its weight, inertia and
//! drag on the table are taken off as the model has them.

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::joint_told::{Row, Told};
use crate::base::Notices;
use crate::capture::{Capture, Segmented};
use crate::math::quantile;
use crate::physics::pressed_underside;
use crate::stages::estimation::{JointLoad, joint_loads};
use crate::twin::{Compared, Joint, JointKind, Model};

/// Block and half span of velocities, s, and how far the parent may move, m.
const SPAN: [f64; 3] = [0.06, 0.09, 3e-3];
/// Share of the usual speed from which on it slides, and by which the speed may change within a span.
const SLIDES: f64 = 0.4;
const STEADY: f64 = 0.15;
/// Fewest blocks.
const FEWEST: usize = 8;

/// What the loads say of each joint's friction and damping beside what the model says.
pub fn joint_numbers(
    capture: &Capture,
    segmented: &[Segmented],
    model: &Model,
    notices: &mut Notices,
) -> Vec<Compared> {
    let kinds = |j: &&Joint| matches!(j.kind, JointKind::Revolute | JointKind::Prismatic);
    let mut all = Vec::new();
    for joint in model.twin.joints().filter(kinds) {
        let Some(friction) = joint.friction.as_ref() else {
            continue;
        };
        let damping = joint.damping.as_ref().map_or(0.0, |d| d.value);
        match rows(capture, segmented, model, joint).and_then(|rows| Told::of(&rows)) {
            Ok(told) => {
                all.extend(told.beside(joint, [friction.value, damping]));
                all.extend(told.spring(joint));
            }
            Err(why) => notices.note(
                "diagnosis",
                &joint.name,
                format!("its friction and damping are not tried: {why}"),
            ),
        }
    }
    all
}

fn rows(capture: &Capture, segmented: &[Segmented], model: &Model, joint: &Joint) -> Result<Vec<Row>, String> {
    let hung = Hung::of(joint, model, &capture.gravity)?;
    let mut out = Vec::new();
    for (touch, interaction) in capture.interactions.iter().enumerate() {
        let Some(cut) = segmented.iter().find(|s| s.interaction == interaction.name) else {
            continue;
        };
        let Some(loads) = joint_loads(interaction, cut, joint, model, SPAN) else {
            continue;
        };
        let usual = quantile(&loads.iter().map(|l| l.speed.abs()).collect::<Vec<f64>>(), 0.9).unwrap_or(0.0);
        let slides = |l: &&JointLoad| l.speed.abs() > SLIDES * usual;
        let steady = |l: &&JointLoad| l.acceleration.abs() * SPAN[1] < STEADY * l.speed.abs();
        out.extend(
            loads
                .iter()
                .filter(slides)
                .filter(steady)
                .filter(|l| hung.within(l))
                .map(|l| Row {
                    touch,
                    load: l.load - hung.load(l),
                    speed: l.speed,
                    position: l.position,
                    drag: hung.drag * l.speed.signum(),
                }),
        );
    }
    if out.len() < FEWEST {
        return Err("no touch moves it steadily while what holds it stands".into());
    }
    Ok(out)
}

/// What hangs on a joint, as the model has it.
struct Hung {
    /// Mass, kg, arm from the joint's origin, m, and inertia about the axis through its centre, kg·m².
    parts: Vec<(f64, Vector3<f64>, f64)>,
    axis: Unit<Vector3<f64>>,
    slides: bool,
    gravity: Vector3<f64>,
    /// Friction on the table along the freedom, N or N·m, of what stands on it.
    drag: f64,
    /// Spring, and where it is slack.
    spring: [f64; 2],
    limits: Option<[f64; 2]>,
}

impl Hung {
    fn of(joint: &Joint, model: &Model, gravity: &Vector3<f64>) -> Result<Self, String> {
        let axis = Unit::try_new(Vector3::from(joint.axis.value), 1e-9).ok_or("its axis has no direction")?;
        let (origin, slides) = (Point3::from(joint.origin.value), joint.kind == JointKind::Prismatic);
        let mut out = Self {
            parts: Vec::new(),
            axis,
            slides,
            gravity: *gravity,
            drag: 0.0,
            spring: [&joint.stiffness, &joint.rest].map(|e| e.as_ref().map_or(0.0, |e| e.value)),
            limits: joint.limits.as_ref().map(|l| l.value),
        };
        let mut names = vec![joint.child.clone()];
        let mut at = 0;
        while at < names.len() {
            let more = model.twin.joints().filter(|j| j.parent == names[at]);
            let more: Vec<String> = more.map(|j| j.child.clone()).filter(|n| !names.contains(n)).collect();
            names.extend(more);
            let link = model.twin.link(&names[at]).ok_or("its child is not in the model")?;
            at += 1;
            let pose = link.pose.0;
            if let Some(mass) = link.mass.as_ref().map(|m| m.value) {
                let com = link.com.as_ref().map_or(Point3::origin(), |c| Point3::from(c.value));
                let along = pose.rotation.inverse() * axis.into_inner();
                let about = link.inertia.as_ref().map_or(0.0, |i| {
                    let [xx, yy, zz, xy, xz, yz] = i.value;
                    let m = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                    along.dot(&(m * along))
                });
                out.parts.push((mass, pose * com - origin, about));
            }
            if let Some(force) = link.friction_force.kinetic.as_ref() {
                let mesh = link.mesh.as_ref().and_then(|m| model.meshes.get(m));
                out.drag += force.value
                    * if slides {
                        1.0
                    } else {
                        out.reach(mesh, &pose, &origin, link)
                    };
            }
        }
        Ok(out)
    }

    /// Mean distance from the axis of what stands on the table, m.
    fn reach(
        &self,
        mesh: Option<&crate::geometry::Mesh>,
        pose: &Isometry3<f64>,
        origin: &Point3<f64>,
        link: &crate::twin::Link,
    ) -> f64 {
        let com = link.com.as_ref().map_or(Point3::origin(), |c| Point3::from(c.value));
        let centre = (pose * com).xy();
        let pressed = mesh.and_then(|m| pressed_underside(m, pose, &centre));
        pressed.map_or((centre - origin.xy()).norm(), |p| {
            let away = |(at, share): &(nalgebra::Vector2<f64>, f64)| share * (p.centre + at - origin.xy()).norm();
            p.points.iter().map(away).sum()
        })
    }

    /// Away from the ends that the model gives it.
    fn within(&self, l: &JointLoad) -> bool {
        self.limits.is_none_or(|[low, high]| {
            let rim = 0.02 * (high - low);
            l.position > low + rim && l.position < high - rim
        })
    }

    /// Weight, inertia, spring and drag, N or N·m.
    fn load(&self, l: &JointLoad) -> f64 {
        let axis = self.axis.into_inner();
        let turn = UnitQuaternion::from_axis_angle(&self.axis, l.position);
        let of = |(mass, arm, about): &(f64, Vector3<f64>, f64)| {
            if self.slides {
                return mass * (l.acceleration - self.gravity.dot(&axis));
            }
            let arm = turn * arm;
            let across = (arm - axis * axis.dot(&arm)).norm_squared();
            (about + mass * across) * l.acceleration - mass * self.gravity.dot(&axis.cross(&arm))
        };
        let pull = self.spring[0] * (l.position - self.spring[1]);
        self.parts.iter().map(of).sum::<f64>() + pull + self.drag * l.speed.signum()
    }
}
