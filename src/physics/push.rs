//! A push or a pull along the table, slow enough that inertia does not matter.

use nalgebra::{Point2, Vector2, Vector3};

use super::foot::riders;
use super::{Action, Contact, Hold, Linkage, Prediction, solve_contact};
use crate::base::Pose;
use crate::twin::Model;

/// A prediction with what it rests on.
#[derive(Clone, Debug, Default)]
pub struct PushPrediction {
    /// What the sensors would see.
    pub prediction: Prediction,
    /// Times in which the tool touched.
    pub contact: Vec<(f64, f64)>,
}

/// Seconds of one step of the simulation; the tool's path is averaged over four.
const STEP: f64 = 0.01;

/// What the sensors would see of a push or a pull; nothing where the twin does not know enough.
///
/// `gap` (m) moves the tool back from the body along its way: the offset between the reconstructed and
/// the touched surface, which every interaction has anew.
pub fn predict_push(model: &Model, action: &Action, gap: f64) -> Option<PushPrediction> {
    let body = model.twin.body_of(&action.target)?;
    let normal = action.normal.into_inner();
    let height = action.tool.position.first().map(|p| p.coords.dot(&normal))?;
    let mut linkage = Linkage::new(model, body, &action.start, &normal, height)?;
    let target = linkage.index(&action.target)?;
    let carried = carried(model, action, target, &linkage);
    let path = smooth_path(action, &linkage);
    let hand = Hand::new(action, &linkage, target, &path, gap, friction_of(model, action))?;
    let upright = action.tool.hold == Hold::Grip;
    let mut out = PushPrediction::default();
    for i in 0..path.len() {
        let force = if i == 0 {
            None
        } else {
            hand.step(&mut linkage, &path[i - 1], &path[i])
        };
        if let Some(force) = force.filter(|_| !upright) {
            linkage.tip(target, &force, height, action.gravity);
        }
        record(&mut out, &linkage, path[i].0, force);
    }
    carry(&mut out, &action.target, &carried);
    Some(out)
}

/// What rides on the target, with its pose in the target's frame at the start.
fn carried(model: &Model, action: &Action, target: usize, linkage: &Linkage) -> Vec<(String, Pose)> {
    let base = linkage.poses()[target].1;
    let of = |name: String| Some((name.clone(), base.inverse() * *action.start.get(&name)?));
    riders(model, &action.target).into_iter().filter_map(of).collect()
}

/// Riders move with what carries them: slow pushes do not overcome the friction between them.
fn carry(out: &mut PushPrediction, target: &str, carried: &[(String, Pose)]) {
    let Some(path) = out.prediction.poses.get(target).cloned() else {
        return;
    };
    for (name, relative) in carried {
        out.prediction
            .poses
            .insert(name.clone(), path.iter().map(|p| *p * *relative).collect());
    }
}

fn friction_of(model: &Model, action: &Action) -> f64 {
    let measured = model
        .twin
        .link(&action.target)
        .and_then(|l| l.friction.tool.as_ref())
        .map(|f| f.value);
    measured.unwrap_or(0.4)
}

fn record(out: &mut PushPrediction, linkage: &Linkage, time: f64, force: Option<Vector2<f64>>) {
    out.prediction.time.push(time);
    let world = force.map_or_else(Vector3::zeros, |f| linkage.lift_vector(&f));
    out.prediction.force.push(world);
    for (name, pose) in linkage.poses() {
        out.prediction.poses.entry(name.to_owned()).or_default().push(pose);
    }
    if force.is_some() {
        match out.contact.last_mut() {
            Some((_, end)) if time - *end < 3.0 * STEP => *end = time,
            _ => out.contact.push((time, time)),
        }
    }
}

/// The tool's way in the plane, one point a step, averaged over four steps against encoder noise.
fn smooth_path(action: &Action, linkage: &Linkage) -> Vec<(f64, Point2<f64>)> {
    let time = &action.tool.time;
    let flat: Vec<Point2<f64>> = action.tool.position.iter().map(|p| linkage.flatten(p)).collect();
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return Vec::new();
    };
    let steps = ((last - first) / STEP) as usize;
    let mut path = Vec::with_capacity(steps + 1);
    for k in 0..=steps {
        let t = first + k as f64 * STEP;
        let from = time.partition_point(|x| *x < t - 2.0 * STEP);
        let to = time
            .partition_point(|x| *x <= t + 2.0 * STEP)
            .max(from + 1)
            .min(time.len());
        let window = flat[from.min(to - 1)..to]
            .iter()
            .filter(|p| p.x.is_finite() && p.y.is_finite());
        let (mut sum, mut count) = (Vector2::zeros(), 0.0);
        for p in window {
            sum += p.coords;
            count += 1.0;
        }
        if count > 0.0 {
            path.push((t, Point2::from(sum / count)));
        }
    }
    path
}

/// The tool with what it holds or touches.
struct Hand {
    target: usize,
    radius: f64,
    gap: f64,
    friction: f64,
    /// Where it holds, plane frame at the start.
    held: Option<Point2<f64>>,
}

impl Hand {
    fn new(
        action: &Action,
        linkage: &Linkage,
        target: usize,
        path: &[(f64, Point2<f64>)],
        gap: f64,
        friction: f64,
    ) -> Option<Self> {
        let held = match action.tool.hold {
            Hold::Push => {
                linkage.outline(target)?;
                None
            }
            Hold::Grip | Hold::Pin => Some(path.first()?.1),
        };
        Some(Self {
            target,
            radius: action.tool.radius,
            gap,
            friction,
            held,
        })
    }

    /// Moves the tool from one point of its way to the next; the force on the body, where it touches.
    fn step(&self, linkage: &mut Linkage, from: &(f64, Point2<f64>), to: &(f64, Point2<f64>)) -> Option<Vector2<f64>> {
        let dt = to.0 - from.0;
        let tool_velocity = (to.1 - from.1) / dt;
        let contact = match self.held {
            Some(start) => self.holding(linkage, &start, &to.1, dt),
            None => self.touching(linkage, &to.1, tool_velocity, dt)?,
        };
        let solved = solve_contact(&linkage.dissipators(), &contact)?;
        linkage.advance(&solved.velocity, dt);
        Some(solved.force)
    }

    fn touching(&self, linkage: &Linkage, tool: &Point2<f64>, velocity: Vector2<f64>, dt: f64) -> Option<Contact> {
        let (outline, moved) = linkage.outline(self.target)?;
        let near = outline.nearest(moved, tool);
        let depth = self.radius - self.gap - near.distance;
        if depth <= 0.0 {
            return None;
        }
        let inward = -near.outward;
        let tangent = velocity - inward * velocity.dot(&inward);
        let (jacobian, _) = linkage.jacobian(self.target, &near.point);
        let tool_velocity = inward * (depth / dt) + tangent;
        Some(Contact {
            jacobian,
            inward,
            tool_velocity,
            friction: self.friction,
            bilateral: false,
        })
    }

    fn holding(&self, linkage: &Linkage, start: &Point2<f64>, tool: &Point2<f64>, dt: f64) -> Contact {
        let held = linkage.moved(self.target).transform_point(start);
        let (jacobian, _) = linkage.jacobian(self.target, &held);
        let tool_velocity = (tool - held) / dt;
        let inward = tool_velocity.try_normalize(1e-9).unwrap_or_else(Vector2::x);
        Contact {
            jacobian,
            inward,
            tool_velocity,
            friction: f64::INFINITY,
            bilateral: true,
        }
    }
}
