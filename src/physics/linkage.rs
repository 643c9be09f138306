//! A body of links as it stands on the table: feet that rub, joints that turn about the table's normal
//! or slide along the table. Everything is in the plane frame (z along the support's normal), at the start.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Isometry2, Isometry3, Matrix2xX, Point2, UnitQuaternion, Vector2, Vector3};

use super::Footprint;
use super::Stance;
use super::foot::{Foot, Pressed, Pressing, loaded};
use super::quasistatic::Dissipator;
use super::stance::{Placed, on_the_lower};
use crate::base::{Estimate, Pose};
use crate::twin::{Body, Joint, JointKind, Link, Model, WORLD};

#[derive(Clone, Debug)]
enum Freedom {
    Turn(Point2<f64>),
    Slide(Vector2<f64>),
    /// None: glued.
    Weld,
}

#[derive(Clone, Debug)]
struct PlaneJoint {
    parent: usize,
    child: usize,
    freedom: Freedom,
    friction: f64,
    damping: f64,
    /// Spring, and where it is slack.
    spring: [f64; 2],
    /// Ends of the range that are known outright.
    ends: Option<[f64; 2]>,
    /// Where it was at the start of this action, and how far it has moved since.
    began: f64,
    position: f64,
    /// Stopped at an end.
    stopped: bool,
}

/// What holds a joint at the end of its range, N or N·m.
const STOP: f64 = 1e4;

#[derive(Clone, Debug)]
struct PlaneLink {
    name: String,
    start: Isometry3<f64>,
    foot: Option<Foot>,
    /// How the foot of a thing of links presses.
    pressing: Option<Pressing>,
    /// What hangs on this link without a foot of its own: its index and share of the load.
    hanging: Vec<(usize, f64)>,
    /// Centre of mass, plane frame at the start.
    centre: Point2<f64>,
    outline: Option<Arc<Footprint>>,
    moved: Isometry2<f64>,
    /// How far a force above the support has tipped the load ahead, plane frame, m.
    ahead: Vector2<f64>,
}

/// A tree of links that slides and turns on the table.
#[derive(Clone, Debug)]
pub struct Linkage {
    plane_from_world: UnitQuaternion<f64>,
    links: Vec<PlaneLink>,
    joints: Vec<PlaneJoint>,
    anchored: bool,
    /// Speed of the tool, m/s.
    tool_speed: f64,
}

impl Linkage {
    /// The linkage of `body` with its links at `start`; `height` is the tool's, along the normal.
    ///
    /// Nothing where a joint neither turns about the normal nor slides along the table, or where no
    /// friction of any link is known: then this model has nothing to say.
    pub fn new(
        model: &Model,
        body: &Body,
        start: &BTreeMap<String, Pose>,
        normal: &Vector3<f64>,
        height: f64,
    ) -> Option<Self> {
        Self::on(&Stance::of(model, body, start, normal, height)?, model, body, start)
    }

    /// The same of a body whose stance is known.
    pub fn on(stance: &Stance, model: &Model, body: &Body, start: &BTreeMap<String, Pose>) -> Option<Self> {
        let plane_from_world = stance.plane_from_world;
        let turn = Isometry3::from_parts(nalgebra::Translation3::identity(), plane_from_world);
        let placed = |(link, at): (&Link, &Placed)| PlaneLink {
            name: link.name.clone(),
            start: at.pose,
            foot: at.stand.foot(link).map(|f| loaded(f, model, link, start)),
            pressing: None,
            hanging: Vec::new(),
            centre: at.stand.centre,
            outline: at.outline.clone(),
            moved: Isometry2::identity(),
            ahead: Vector2::zeros(),
        };
        let mut links: Vec<PlaneLink> = body.links.iter().zip(&stance.links).map(placed).collect();
        let mut joints = Vec::new();
        for joint in &body.joints {
            joints.push(plane_joint(joint, body, start, &turn)?);
        }
        stand_on_the_lowest(&mut links, &joints);
        hang(&mut links, &joints, body);
        // What slides and turns at once does so with less than an ellipsoid through both tells, and not alike along a plate and
        // across it.
        links
            .iter_mut()
            .for_each(|l| l.pressing = l.foot.as_ref().and_then(Foot::pressing));
        let anchored = body.links.first().is_some_and(|l| l.name == WORLD);
        let rubs = links.iter().any(|l| l.foot.is_some()) || anchored;
        rubs.then_some(Self {
            plane_from_world,
            links,
            joints,
            anchored,
            tool_speed: 0.0,
        })
    }

    /// Index of the link of that name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// A planar force as a world vector.
    pub fn lift_vector(&self, v: &Vector2<f64>) -> Vector3<f64> {
        self.plane_from_world.inverse() * Vector3::new(v.x, v.y, 0.0)
    }

    /// The outline of link `i` at the tool's height and how far it has moved.
    pub fn outline(&self, i: usize) -> Option<(&Footprint, &Isometry2<f64>)> {
        self.links[i].outline.as_deref().map(|o| (o, &self.links[i].moved))
    }

    /// How far link `i` has moved.
    pub fn moved(&self, i: usize) -> &Isometry2<f64> {
        &self.links[i].moved
    }

    /// Names of all links.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.links.iter().map(|l| l.name.as_str())
    }

    /// World poses of all links.
    pub fn poses(&self) -> Vec<Pose> {
        let back = Isometry3::from_parts(nalgebra::Translation3::identity(), self.plane_from_world.inverse());
        let of = |l: &PlaneLink| {
            let t = l.moved.translation.vector;
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), l.moved.rotation.angle());
            let moved = Isometry3::from_parts(nalgebra::Translation3::new(t.x, t.y, 0.0), turn);
            Pose(back * moved * l.start)
        };
        self.links.iter().map(of).collect()
    }

    /// The velocity of the point `p` of link `i` per generalised velocity (root twist about the origin of
    /// the plane frame, then joint rates): 2 × n, and the row of its angular velocity.
    pub fn jacobian(&self, i: usize, p: &Point2<f64>) -> (Matrix2xX<f64>, DVector<f64>) {
        let n = 3 + self.joints.len();
        let mut linear = Matrix2xX::zeros(n);
        let mut angular = DVector::zeros(n);
        if !self.anchored {
            linear[(0, 0)] = 1.0;
            linear[(1, 1)] = 1.0;
            linear[(0, 2)] = -p.y;
            linear[(1, 2)] = p.x;
            angular[2] = 1.0;
        }
        let mut link = i;
        while let Some((k, joint)) = self.joints.iter().enumerate().find(|(_, j)| j.child == link) {
            let parent = &self.links[joint.parent].moved;
            let column = match &joint.freedom {
                Freedom::Turn(centre) => {
                    let arm = p - parent.transform_point(centre);
                    angular[3 + k] = 1.0;
                    Vector2::new(-arm.y, arm.x)
                }
                Freedom::Slide(axis) => parent.rotation * axis,
                Freedom::Weld => Vector2::zeros(),
            };
            linear.set_column(3 + k, &column);
            link = joint.parent;
        }
        (linear, angular)
    }

    /// Everything that rubs, for the present configuration.
    pub fn dissipators(&mut self) -> Vec<Dissipator> {
        let n = 3 + self.joints.len();
        let mut all = Vec::new();
        for i in 0..self.links.len() {
            let Some((radius, Pressed { centre, points })) = self.pressed(i) else {
                continue;
            };
            let (linear, angular) = self.jacobian(i, &self.links[i].moved.transform_point(&centre));
            let mut rows = DMatrix::zeros(3, n);
            rows.rows_mut(0, 2).copy_from(&linear);
            rows.row_mut(2).copy_from(&(angular.transpose() * radius));
            if let Some(foot) = &self.links[i].foot {
                all.push(Dissipator {
                    rows,
                    points,
                    force: foot.force,
                    creep: foot.creep + foot.creep_ratio * self.tool_speed,
                    damping: 0.0,
                    pull: 0.0,
                });
            }
        }
        for (k, joint) in self.joints.iter().enumerate() {
            let mut rows = DMatrix::zeros(1, n);
            rows[(0, 3 + k)] = 1.0;
            all.push(Dissipator {
                rows,
                points: Vec::new(),
                force: if joint.stopped { STOP } else { joint.friction.max(1e-6) },
                creep: 0.0,
                damping: joint.damping,
                pull: joint.spring[0] * (joint.began + joint.position - joint.spring[1]),
            });
        }
        all
    }

    /// The torsional radius of a foot, where its load acts, plane frame at the start, and, of a thing of links, the points that
    /// press, as they lie now.
    fn pressed(&mut self, i: usize) -> Option<(f64, Pressed)> {
        let foot = self.links[i].foot.as_ref()?;
        let centre = self.load_of(&self.links[i], foot);
        let (radius, hangs) = (foot.radius, !self.links[i].hanging.is_empty());
        let link = &mut self.links[i];
        if let Some(pressed) = link.pressing.as_mut().and_then(|p| p.at(&centre)) {
            let turn = |(p, share): &(Vector2<f64>, f64)| (link.moved.rotation * p, *share);
            let points = pressed.points.iter().map(turn).collect();
            return Some((1.0, Pressed { points, ..*pressed }));
        }
        let reached = link.foot.as_ref().filter(|_| hangs).map(|f| f.pressed_at(&centre));
        let ((centre, radius), points) = (reached.unwrap_or((centre, radius)), Vec::new());
        Some((radius, Pressed { centre, points }))
    }

    /// Where a link is loaded, plane frame at the start: what hangs on it pulls the load to its side, wherever its joint has
    /// brought it.
    fn load_of(&self, link: &PlaneLink, foot: &Foot) -> Point2<f64> {
        let mut centre = foot.centre + link.moved.rotation.inverse() * link.ahead;
        for (child, share) in &link.hanging {
            let child = &self.links[*child];
            let at = link
                .moved
                .inverse_transform_point(&child.moved.transform_point(&child.centre));
            centre += (at - foot.centre) * *share;
        }
        centre
    }

    /// Tips the load of a link ahead under a force (N) of a tool at `height` (m along the normal): friction, which
    /// balances it, acts at the support, and the pressure moves by their couple over the load (N). Within the
    /// torsional radius: beyond, the thing would topple. Links of a linkage hold each other upright.
    pub fn tip(&mut self, i: usize, force: &Vector2<f64>, height: f64, gravity: f64) {
        let alone = self.joints.is_empty();
        let link = &mut self.links[i];
        let Some((foot, mass)) = link.foot.as_ref().filter(|_| alone).and_then(|f| Some((f, f.mass?))) else {
            return;
        };
        let ahead = force * ((height - foot.ground).max(0.0) / (mass * gravity).max(1e-6));
        link.ahead = ahead * (foot.radius / ahead.norm().max(foot.radius));
    }

    /// Whether a velocity carries a joint beyond an end of its range in `dt` seconds that it did not stop at yet; those
    /// stop there.
    pub fn stops(&mut self, velocity: &DVector<f64>, dt: f64) -> bool {
        let mut any = false;
        for (k, joint) in self.joints.iter_mut().enumerate() {
            let next = joint.began + joint.position + velocity[3 + k] * dt;
            let beyond = joint.ends.is_some_and(|[low, high]| {
                (next < low && velocity[3 + k] < 0.0) || (next > high && velocity[3 + k] > 0.0)
            });
            any |= beyond && !joint.stopped;
            joint.stopped |= beyond;
        }
        any
    }

    /// No joint is stopped any more, and the tool goes so fast, m/s.
    pub fn loosen(&mut self, tool_speed: f64) {
        self.joints.iter_mut().for_each(|j| j.stopped = false);
        self.tool_speed = tool_speed;
    }

    /// Moves everything by a generalised velocity for `dt` seconds.
    pub fn advance(&mut self, velocity: &DVector<f64>, dt: f64) {
        if !self.anchored {
            let (vx, vy, w) = (velocity[0] * dt, velocity[1] * dt, velocity[2] * dt);
            let root = &mut self.links[0].moved;
            // Exact for a constant twist about the plane's origin (the exponential map of SE(2)).
            let (s, c) = if w.abs() < 1e-9 {
                (1.0, 0.5 * w)
            } else {
                (w.sin() / w, (1.0 - w.cos()) / w)
            };
            let step = Vector2::new(s * vx - c * vy, c * vx + s * vy);
            *root = Isometry2::new(step, w) * *root;
        }
        for k in 0..self.joints.len() {
            self.joints[k].position += velocity[3 + k] * dt;
            let joint = &self.joints[k];
            let relative = match &joint.freedom {
                Freedom::Turn(centre) => {
                    let turn = Isometry2::rotation(joint.position);
                    Isometry2::new(centre.coords - (turn * centre).coords, joint.position)
                }
                Freedom::Slide(axis) => Isometry2::translation(axis.x * joint.position, axis.y * joint.position),
                Freedom::Weld => Isometry2::identity(),
            };
            self.links[joint.child].moved = self.links[joint.parent].moved * relative;
        }
    }
}

/// Of two that are glued the upper one does not rub on the support: what was given to it presses the lower one.
fn stand_on_the_lowest(links: &mut [PlaneLink], joints: &[PlaneJoint]) {
    for joint in joints.iter().filter(|j| matches!(j.freedom, Freedom::Weld)) {
        let [a, b] = [joint.parent, joint.child].map(|i| links[i].foot.take());
        (links[joint.parent].foot, links[joint.child].foot) = on_the_lower(a, b);
    }
}

/// The children without a foot hang on their parents: shares of the load by mass.
fn hang(links: &mut [PlaneLink], joints: &[PlaneJoint], body: &Body) {
    let mass = |i: usize| body.links[i].mass.as_ref().map_or(0.0, |m| m.value);
    let hangs = |j: &&PlaneJoint| links[j.child].foot.is_none() && links[j.parent].foot.is_some();
    let hanging: Vec<(usize, usize)> = joints.iter().filter(hangs).map(|j| (j.parent, j.child)).collect();
    for (parent, child) in &hanging {
        let all = mass(*parent)
            + hanging
                .iter()
                .filter(|h| h.0 == *parent)
                .map(|h| mass(h.1))
                .sum::<f64>();
        if all > 0.0 {
            links[*parent].hanging.push((*child, mass(*child) / all));
        }
    }
}

fn plane_joint(
    joint: &Joint,
    body: &Body,
    start: &BTreeMap<String, Pose>,
    turn: &Isometry3<f64>,
) -> Option<PlaneJoint> {
    let index = |name: &str| body.links.iter().position(|l| l.name == name);
    let (parent, child) = (index(&joint.parent)?, index(&joint.child)?);
    // The joint is given at the first view; carry it along with its parent to where this action starts.
    let carried = turn * start.get(&joint.parent)?.0 * body.links[parent].pose.0.inverse();
    let axis = carried * Vector3::from(joint.axis.value);
    let origin = carried * nalgebra::Point3::from(joint.origin.value);
    let freedom = match joint.kind {
        JointKind::Revolute if axis.z.abs() > 0.9 => Freedom::Turn(origin.xy()),
        JointKind::Prismatic if axis.z.abs() < 0.3 => Freedom::Slide(axis.xy().normalize()),
        JointKind::Fixed => Freedom::Weld,
        _ => return None,
    };
    let number = |e: &Option<Estimate>| e.as_ref().map_or(0.0, |e| e.value);
    let stated = joint.limits.as_ref().filter(|l| l.sd.is_none());
    // In the plane a turn counts about the normal, whichever way the axis points.
    let sign = match &freedom {
        Freedom::Turn(_) => axis.z.signum(),
        Freedom::Slide(_) | Freedom::Weld => 1.0,
    };
    let first = carried * body.links[child].pose.0;
    let now = turn * start.get(&joint.child)?.0;
    let began = match &freedom {
        Freedom::Turn(_) => (now.rotation * first.rotation.inverse()).scaled_axis().z,
        Freedom::Slide(along) => (now.translation.vector - first.translation.vector).xy().dot(along),
        Freedom::Weld => 0.0,
    };
    let ends = stated.map(|l| l.value.map(|x| sign * x));
    Some(PlaneJoint {
        parent,
        child,
        began,
        position: 0.0,
        freedom,
        friction: number(&joint.friction),
        damping: number(&joint.damping),
        spring: [number(&joint.stiffness), sign * number(&joint.rest)],
        ends: ends.map(|[a, b]| [a.min(b), a.max(b)]),
        stopped: false,
    })
}
