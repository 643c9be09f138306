//! A push or a pull along the table, slow enough that inertia does not matter.

use nalgebra::{Point2, Vector2, Vector3};

use super::grip::{Felt, alone, led, turned};
use super::riders::riders;
use super::tool_path::{STEP, divided, smooth_path};
use super::{Action, Contact, Course, Hold, Linkage, Prediction, Stance, solve_contact_on};
use crate::base::Pose;
use crate::twin::Model;

/// A prediction with what it rests on.
#[derive(Clone, Debug, Default)]
pub struct PushPrediction {
    /// What the sensors would see.
    pub prediction: Prediction,
    /// Times in which the tool touched.
    pub contact: Vec<(f64, f64)>,
    /// What rides on the pushed link, and is taken to go with it.
    pub carried: Vec<String>,
}

/// What the sensors would see of a push or a pull; nothing where the twin does not know enough.
///
/// `gap` (m) moves the tool back from the body along its way: the offset between the reconstructed and
/// the touched surface, which every interaction has anew.
pub fn predict_push(model: &Model, action: &Action, gap: f64) -> Option<PushPrediction> {
    predict_in_parts(model, action, gap, 1)
}

/// The same, each step along the smoothed path in so many equal parts: what that changes is the solver's own error.
fn predict_in_parts(model: &Model, action: &Action, gap: f64, parts: usize) -> Option<PushPrediction> {
    let mut play = Play::new(model, action, 1)?;
    play.path = divided(play.path, parts);
    play.with(model, gap)
}

/// A push or a pull that is played again and again with other numbers of the same twin: where all stands and the tool's way are
/// looked up once.
#[derive(Clone, Debug)]
pub struct Play {
    action: Action,
    stance: Stance,
    height: f64,
    path: Vec<(f64, Point2<f64>)>,
}

impl Play {
    /// Of a model with its meshes; of the steps only every so many, which is coarser and as many times cheaper. Nothing where a
    /// link has no pose or no body is touched.
    pub fn new(model: &Model, action: &Action, every: usize) -> Option<Self> {
        let body = model.twin.body_of(&action.target)?;
        let normal = action.normal.into_inner();
        let height = action.tool.position.first().map(|p| p.coords.dot(&normal))?;
        let stance = Stance::of(model, body, &action.start, &normal, height)?;
        let path = smooth_path(action, &stance);
        Some(Self {
            action: action.clone(),
            stance,
            height,
            path: path.into_iter().step_by(every.max(1)).collect(),
        })
    }

    /// What was done.
    pub fn action(&self) -> &Action {
        &self.action
    }

    /// What the sensors would see with the numbers of `model`, whose links, joints and places are those that it was made of (its
    /// meshes are not asked for); nothing where the twin does not know enough. `gap` as of [`predict_push`].
    pub fn with(&self, model: &Model, gap: f64) -> Option<PushPrediction> {
        let action = &self.action;
        let body = model.twin.body_of(&action.target)?;
        let mut linkage = Linkage::on(&self.stance, model, body, &action.start)?;
        let target = linkage.index(&action.target)?;
        let carried = carried(model, action, target, &linkage);
        let hand = Hand::new(action, &linkage, target, &self.path, gap, friction_of(model, action))?;
        let upright = action.tool.hold == Hold::Grip;
        let rigid = hand.held.filter(|_| upright && alone(&linkage, target));
        let mut course = Course::default();
        let mut record = Record::of(&linkage, self.path.len());
        let mut felt = None;
        for i in 0..self.path.len() {
            if i > 0 {
                let way = [&self.path[i - 1], &self.path[i]];
                felt = match (rigid, turned(action, way)) {
                    (Some(start), Some(by)) => led(&mut linkage, (target, &start), felt, way, by),
                    _ => hand.step(&mut linkage, &mut course, felt, way),
                };
            }
            if let Some(felt) = felt.filter(|_| !upright) {
                linkage.tip(target, &felt.force, self.height, action.gravity);
            }
            record.add(&linkage, self.path[i].0, felt);
        }
        let mut out = record.finished(&linkage);
        carry(&mut out, &action.target, &carried);
        Some(out)
    }
}

/// What rides on the target, with its pose in the target's frame at the start.
fn carried(model: &Model, action: &Action, target: usize, linkage: &Linkage) -> Vec<(String, Pose)> {
    let base = linkage.poses()[target];
    let of = |name: String| Some((name.clone(), base.inverse() * *action.start.get(&name)?));
    riders(model, &action.target, &action.start)
        .into_iter()
        .filter_map(of)
        .collect()
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
        out.carried.push(name.clone());
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

/// What was played so far.
struct Record {
    out: PushPrediction,
    poses: Vec<Vec<Pose>>,
    /// Whether it was touched all the time since it last was moved.
    held_on: bool,
}

impl Record {
    fn of(linkage: &Linkage, steps: usize) -> Self {
        Self {
            out: PushPrediction::default(),
            poses: vec![Vec::with_capacity(steps); linkage.names().count()],
            held_on: false,
        }
    }

    fn add(&mut self, linkage: &Linkage, time: f64, felt: Option<Felt>) {
        self.out.prediction.time.push(time);
        let world = felt.map_or_else(Vector3::zeros, |f| linkage.lift_vector(&f.force));
        self.out.prediction.force.push(world);
        for (poses, pose) in self.poses.iter_mut().zip(linkage.poses()) {
            poses.push(pose);
        }
        // A touch ends when nothing moves any more.
        if felt.is_some_and(|f| f.moves) {
            match self.out.contact.last_mut() {
                Some((_, end)) if self.held_on || time - *end < 3.0 * STEP => *end = time,
                _ => self.out.contact.push((time, time)),
            }
            self.held_on = true;
        }
        self.held_on &= felt.is_some();
    }

    fn finished(mut self, linkage: &Linkage) -> PushPrediction {
        let named = linkage.names().map(str::to_owned).zip(self.poses);
        self.out.prediction.poses = named.collect();
        self.out
    }
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

/// A finger that is drawn back by less still presses as it did: neither it nor what it touches is rigid, and dry friction holds
/// what it moved, m.
const YIELDS: f64 = 1e-4;

/// A finger on a body that it does not hold.
enum Touch {
    Pushes(Contact),
    /// Within what yields: all is as it was.
    Rests,
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

    /// Moves the tool from one point of its way to the next; the force on the body, where it touches, with the one before.
    fn step(
        &self,
        linkage: &mut Linkage,
        course: &mut Course,
        before: Option<Felt>,
        [from, to]: [&(f64, Point2<f64>); 2],
    ) -> Option<Felt> {
        let dt = to.0 - from.0;
        let tool_velocity = (to.1 - from.1) / dt;
        let contact = match self.held {
            Some(start) => self.holding(linkage, &start, &to.1, dt),
            None => match self.touching(linkage, &to.1, tool_velocity, dt)? {
                Touch::Pushes(contact) => contact,
                Touch::Rests => return before.map(|felt| Felt { moves: false, ..felt }),
            },
        };
        linkage.loosen(tool_velocity.norm());
        let mut solved = solve_contact_on(course, &linkage.dissipators(), &contact)?;
        if linkage.stops(&solved.velocity, dt) {
            solved = solve_contact_on(course, &linkage.dissipators(), &contact)?;
        }
        linkage.advance(&solved.velocity, dt);
        Some(Felt {
            force: solved.force,
            moves: true,
        })
    }

    fn touching(&self, linkage: &Linkage, tool: &Point2<f64>, velocity: Vector2<f64>, dt: f64) -> Option<Touch> {
        let (outline, moved) = linkage.outline(self.target)?;
        let near = outline.nearest(moved, tool);
        let depth = self.radius - self.gap - near.distance;
        if depth <= 0.0 {
            return (depth > -YIELDS).then_some(Touch::Rests);
        }
        let inward = -near.outward;
        let tangent = velocity - inward * velocity.dot(&inward);
        let (jacobian, _) = linkage.jacobian(self.target, &near.point);
        let tool_velocity = inward * (depth / dt) + tangent;
        Some(Touch::Pushes(Contact {
            jacobian,
            inward,
            tool_velocity,
            friction: self.friction,
            bilateral: false,
        }))
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

#[cfg(test)]
pub(super) mod tests {
    use std::collections::BTreeMap;

    use nalgebra::Point3;

    use super::*;
    use crate::base::Estimate;
    use crate::geometry::solids::cuboid;
    use crate::physics::ToolMotion;
    use crate::twin::{Body, FORMAT, Link, Twin};

    fn estimate(value: f64, unit: &str) -> Option<Estimate> {
        Some(Estimate::assumed(value, 0.1 * value, unit, "test"))
    }

    /// A box that is pushed off the middle by a finger at 30 mm/s: it turns, and the finger slides along its face.
    pub fn pushed(tool_friction: f64) -> (Model, Action) {
        let pose = Pose(nalgebra::Isometry3::translation(0.0, 0.0, 0.04));
        let mut link = Link::new("box", pose);
        link.mesh = Some("box.obj".into());
        link.friction_force.kinetic = estimate(1.5, "N");
        link.friction.tool = estimate(tool_friction, "1");
        link.mass = estimate(0.5, "kg");
        let twin = Twin {
            format: FORMAT.into(),
            name: "push".into(),
            gravity: [0.0, 0.0, -9.81],
            support: None,
            bodies: vec![Body {
                name: "box".into(),
                links: vec![link],
                joints: Vec::new(),
            }],
            relations: Vec::new(),
            provenance: Default::default(),
            effects: Vec::new(),
            notices: Vec::new(),
        };
        let model = Model {
            twin,
            meshes: BTreeMap::from([("box.obj".to_owned(), cuboid([0.1, 0.08, 0.08]))]),
            textures: Default::default(),
        };
        let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 2e-3).collect();
        let position = |t: &f64| Point3::new(-0.06 + 0.03 * t, 0.015 + 0.01 * t, 0.03);
        let action = Action {
            target: "box".into(),
            tool: ToolMotion {
                radius: 0.008,
                hold: Hold::Push,
                turned: Vec::new(),
                position: time.iter().map(position).collect(),
                time,
            },
            start: BTreeMap::from([("box".to_owned(), pose)]),
            normal: Vector3::z_axis(),
            gravity: 9.81,
        };
        (model, action)
    }

    #[test]
    fn halving_the_step_changes_little() {
        for tool_friction in [0.15, 0.8] {
            let (model, action) = pushed(tool_friction);
            let [coarse, fine] = [1, 2].map(|parts| {
                let found = predict_in_parts(&model, &action, 0.0, parts).expect("a prediction");
                *found.prediction.poses["box"].last().expect("a pose")
            });
            let moved = (coarse.translation.vector - fine.translation.vector).norm();
            let turned = (coarse.rotation * fine.rotation.inverse()).angle();
            let all = coarse.rotation.angle();
            assert!(all > 0.1, "{all}");
            assert!(
                moved < 1e-4 && turned < 4e-3,
                "{tool_friction}: {moved} m, {turned} rad of {all}"
            );
        }
    }
    #[test]
    fn what_creeps_with_the_tool_creeps_as_fast_as_that_goes() {
        let (mut model, action) = pushed(0.3);
        model.twin.bodies[0].links[0].friction.creep_ratio = estimate(0.3, "1");
        let turn = action.normal.into_inner();
        let mut linkage =
            Linkage::new(&model, &model.twin.bodies[0], &action.start, &turn, 0.03).expect("a body that rubs");
        for speed in [0.0, 0.05, 0.1] {
            linkage.loosen(speed);
            assert!((linkage.dissipators()[0].creep - 0.3 * speed).abs() < 1e-12);
        }
    }

    /// A tool whose way is read with 0.1 mm of noise: it seems to go back for a moment, and the force stays.
    #[test]
    fn a_finger_that_trembles_does_not_let_go() {
        let (model, mut action) = pushed(0.3);
        let mut state = 1_u64;
        for p in &mut action.tool.position {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            p.x += 3.4e-4 * ((state >> 40) as f64 / (1 << 24) as f64 - 0.5);
            p.y += 0.004;
        }
        action.tool.time = action.tool.time.iter().map(|t| 4.0 * t).collect();
        let found = predict_push(&model, &action, 0.0).expect("a prediction");
        assert_eq!(found.contact.len(), 1, "{:?}", found.contact);
        let (from, to) = found.contact[0];
        let all = found.prediction.time.iter().zip(&found.prediction.force);
        let touched: Vec<f64> = all.filter(|r| (from..=to).contains(r.0)).map(|r| r.1.norm()).collect();
        assert!(touched.len() > 300 && touched.iter().all(|f| *f > 0.5));
    }
}
