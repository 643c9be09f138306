//! Revolute, screw and prismatic joints: stiff springs on what is constrained, Coulomb and viscous friction on what is free.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::body::{Frame, RigidBody, Wrench};
use super::weld::{rotation_error, stiff};
use crate::lab::hidden::JointLaw;
use crate::lab::{JointSpec, JointSpecKind};

/// Stiffness that is wanted of what is constrained, N/m and N·m/rad (less where a part is too light for it).
const WANTED: (f64, f64) = (2e6, 5e3);
/// Travel before a joint's dry friction is fully up, rad or m.
const PRESLIDING: (f64, f64) = (5e-4, 2e-5);

/// Hidden laws of a slide count in this many metres, and in its inverse in newtons.
const SLIDE: f64 = 0.1;

/// A joint between the bodies `a` and `b`; positive motion is that of `b` against `a`.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub a: usize,
    pub b: usize,
    revolute: bool,
    /// m/rad, 0 but for a screw.
    pitch: f64,
    anchor_a: Vector3<f64>,
    anchor_b: Vector3<f64>,
    axis_a: Vector3<f64>,
    axis_b: Vector3<f64>,
    side_a: Vector3<f64>,
    side_b: Vector3<f64>,
    a_from_b: UnitQuaternion<f64>,
    linear: (f64, f64),
    angular: (f64, f64),
    along: (f64, f64),
    bristle: f64,
    friction: f64,
    bristle_stiffness: f64,
    bristle_damping: f64,
    damping: f64,
    stiffness: f64,
    rest: f64,
    limits: Option<[f64; 2]>,
    position: f64,
    rate: f64,
    hidden: Vec<JointLaw>,
}

/// What a law that gears the second joint to the first asks of both, N·m or N along their freedom.
pub(super) fn geared(first: &Joint, second: &Joint) -> Option<[f64; 2]> {
    let of = |law: &JointLaw| match *law {
        JointLaw::Coupling { ratio, stiffness } => Some((ratio, stiffness)),
        _ => None,
    };
    let (ratio, stiffness) = second.hidden.iter().find_map(of)?;
    let stretch = ratio * first.position - second.position;
    let rate = ratio * first.rate - second.rate;
    let effort = stiffness * (stretch + GEAR * rate);
    Some([-ratio * effort, effort])
}

/// Damping of a gear over its stiffness, s.
const GEAR: f64 = 0.01;

/// Projections on directions of shifting and of turning.
pub(super) struct Ways {
    pub shift: Matrix3<f64>,
    pub turn: Matrix3<f64>,
}

/// Where a joint holds its bodies and what it leaves free.
pub(super) struct Grasp {
    /// World point.
    pub point: Vector3<f64>,
    /// What friction and damping act along.
    pub free: Ways,
    /// What is held.
    pub stays: Ways,
}

impl Joint {
    /// As the bodies are at first; `axis` must be a unit vector.
    pub fn new(spec: &JointSpec, axis: Vector3<f64>, (a, b): (usize, usize), bodies: &[RigidBody]) -> Self {
        let (body_a, body_b) = (&bodies[a], &bodies[b]);
        let origin = Vector3::from(spec.origin);
        let revolute = spec.kind != JointSpecKind::Prismatic;
        let anchor = if revolute { origin } else { body_b.frame.position };
        let point_compliance = body_a.compliance_at(&anchor) + body_b.compliance_at(&anchor);
        let turn_compliance = body_a.angular_compliance() + body_b.angular_compliance();
        let linear = stiff(WANTED.0, point_compliance);
        let angular = stiff(WANTED.1, turn_compliance);
        let (preslide, along) = if revolute {
            (PRESLIDING.0, angular)
        } else {
            (PRESLIDING.1, linear)
        };
        let compliance = if revolute { turn_compliance } else { point_compliance };
        let (bristle_stiffness, bristle_damping) = stiff(spec.friction / preslide, compliance);
        let side = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
        Self {
            a,
            b,
            revolute,
            pitch: spec.pitch,
            anchor_a: body_a.frame.local(&anchor),
            anchor_b: body_b.frame.local(&anchor),
            axis_a: body_a.frame.matrix.tr_mul(&axis),
            axis_b: body_b.frame.matrix.tr_mul(&axis),
            side_a: body_a.frame.matrix.tr_mul(&side),
            side_b: body_b.frame.matrix.tr_mul(&side),
            a_from_b: body_a.frame.rotation.inverse() * body_b.frame.rotation,
            linear,
            angular,
            along,
            bristle: 0.0,
            friction: spec.friction,
            bristle_stiffness,
            bristle_damping,
            damping: spec.damping,
            stiffness: spec.stiffness,
            rest: spec.rest,
            limits: spec.limits,
            position: 0.0,
            rate: 0.0,
            hidden: Vec::new(),
        }
    }

    /// Where the joint holds its bodies as they are now, and which directions it leaves free.
    pub fn grasp(&self, bodies: &[RigidBody]) -> Grasp {
        let (a, b) = (&bodies[self.a].frame, &bodies[self.b].frame);
        let axis = a.matrix * self.axis_a;
        let (along, none) = (axis * axis.transpose(), Matrix3::zeros());
        let (shift, turn) = if self.revolute { (none, along) } else { (along, none) };
        let whole = Matrix3::identity();
        Grasp {
            point: b.point(&self.anchor_b),
            free: Ways { shift, turn },
            stays: Ways {
                shift: whole - shift,
                turn: whole - turn,
            },
        }
    }

    /// Viscous damping along what is free.
    pub fn viscous(&self) -> f64 {
        self.damping
    }

    /// Stiffness and damping: of what holds points together, of what holds directions together, of dry friction.
    pub fn springs(&self) -> [(f64, f64); 3] {
        [
            self.linear,
            self.angular,
            (self.bristle_stiffness, self.bristle_damping),
        ]
    }

    /// Follows one more law from now on.
    pub fn hide(&mut self, law: JointLaw) {
        self.hidden.push(law);
    }

    /// The wrench on `b` of an effort along the freedom.
    pub fn along(&self, a: &Frame, b: &Frame, effort: f64) -> Wrench {
        let (axis, mut wrench) = (a.matrix * self.axis_a, Wrench::zero());
        if self.revolute {
            wrench.moment += axis * effort;
        } else {
            wrench.push(&b.point(&self.anchor_b), axis * effort);
        }
        wrench
    }

    /// The wrench on `b`; `a` gets the opposite.
    pub fn act(&mut self, a: &Frame, b: &Frame, dt: f64) -> Wrench {
        if self.revolute {
            self.act_revolute(a, b, dt)
        } else {
            self.act_prismatic(a, b, dt)
        }
    }

    fn act_revolute(&mut self, a: &Frame, b: &Frame, dt: f64) -> Wrench {
        let (at_a, at) = (a.point(&self.anchor_a), b.point(&self.anchor_b));
        let axis = a.matrix * self.axis_a;
        let mut wrench = Wrench::zero();
        let relative = b.velocity_at(&at) - a.velocity_at(&at);
        let turning = b.angular_velocity - a.angular_velocity;
        let rate = turning.dot(&axis);
        let lean = axis.cross(&(b.matrix * self.axis_b));
        wrench.moment -= lean * self.angular.0 + (turning - axis * rate) * self.angular.1;
        let (side_a, side_b) = (a.matrix * self.side_a, b.matrix * self.side_b);
        let angle = axis.dot(&side_a.cross(&side_b)).atan2(side_a.dot(&side_b));
        let turns = ((self.position - angle) / std::f64::consts::TAU).round();
        self.position = angle + turns * std::f64::consts::TAU;
        // Of a screw the place along the axis follows the angle; the thread turns axial force into torque (virtual work).
        let [path, way] = self.wandering(&axis, &side_a);
        let way = way + axis * self.pitch;
        let offset = at - at_a - axis * (self.pitch * self.position) - path;
        let slipping = relative - way * rate;
        let held = offset * -self.linear.0 - slipping * self.linear.1;
        wrench.push(&at, held);
        wrench.moment -= axis * held.dot(&way);
        wrench.moment += axis * self.effort(rate, dt);
        wrench
    }

    fn act_prismatic(&mut self, a: &Frame, b: &Frame, dt: f64) -> Wrench {
        let (at_a, at) = (a.point(&self.anchor_a), b.point(&self.anchor_b));
        let axis = a.matrix * self.axis_a;
        let relative = b.velocity_at(&at) - a.velocity_at(&at);
        let (offset, rate) = (at - at_a, relative.dot(&axis));
        self.position = offset.dot(&axis);
        let held = (offset - axis * self.position) * -self.linear.0 - (relative - axis * rate) * self.linear.1;
        let mut wrench = Wrench::zero();
        wrench.push(&at, held + axis * self.effort(rate, dt));
        let turning = b.angular_velocity - a.angular_velocity;
        wrench.moment -= rotation_error(a, b, &self.a_from_b) * self.angular.0 + turning * self.angular.1;
        wrench
    }

    /// How far a hidden law takes the axis along, and its change with the position, world.
    fn wandering(&self, axis: &Vector3<f64>, side: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let other = axis.cross(side);
        let sum = |which: usize| {
            let each = self.hidden.iter().map(|law| {
                let [x, y] = law.wandering(self.position)[which];
                side * x + other * y
            });
            each.sum()
        };
        [sum(0), sum(1)]
    }

    /// Force or torque along the free direction: dry friction (an elastic bristle that slides at the Coulomb level),
    /// viscous damping, spring, stops that can only push.
    fn effort(&mut self, rate: f64, dt: f64) -> f64 {
        self.rate = rate;
        let mut effort = -self.damping * rate - self.stiffness * (self.position - self.rest);
        let (mut friction, mut play) = (self.friction, 0.0);
        if !self.hidden.is_empty() {
            let scale = if self.revolute { 1.0 } else { SLIDE };
            let (q, dq) = (self.position / scale, rate / scale);
            effort += self.hidden.iter().map(|law| law.effort(q, dq)).sum::<f64>() / scale;
            effort += self.hidden.iter_mut().map(|law| law.advance(q, dq, dt)).sum::<f64>() / scale;
            play = scale * self.hidden.iter().map(JointLaw::play).sum::<f64>();
            friction *= self.hidden.iter().map(|law| law.factor(q, dq)).product::<f64>();
        }
        if friction > 0.0 {
            let limit = friction / self.bristle_stiffness + play;
            let stretch = self.bristle + rate * dt;
            self.bristle = stretch.clamp(-limit, limit);
            let pressed = self.bristle.signum() * (self.bristle.abs() - play).max(0.0);
            let viscous = if stretch == self.bristle && pressed != 0.0 {
                self.bristle_damping * rate
            } else {
                0.0
            };
            effort -= (self.bristle_stiffness * pressed + viscous).clamp(-friction, friction);
        }
        if let Some([low, high]) = self.limits {
            let (k, c) = (0.2 * self.along.0, 0.4 * self.along.1);
            let below = low - self.position;
            let above = self.position - high;
            if below > 0.0 {
                effort += (k * below - c * rate).max(0.0);
            }
            if above > 0.0 {
                effort -= (k * above + c * rate).max(0.0);
            }
        }
        effort
    }
}
