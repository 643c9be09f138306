//! The load of the tool along the freedom of a joint, beside how the joint moves. Where nobody tracked the child but the
//! tool holds it, the path of the tool is its motion: on a known hinge or rail a position alone fixes the joint.

use nalgebra::{Isometry3, Point3, Vector3};

use super::Config;
use super::evidence::{MeanWrench, Tare, mean_wrench, motion_at, tare_of, tool_at};
use super::joint_led::held_at_first;
use super::standing::standing;
use crate::capture::{Interaction, PoseStream, Segmented, WrenchStream, path_of, position_noise};
use crate::math::quantile;
use crate::twin::{Joint, JointKind, Link, Model};

/// Load and motion along the freedom of a joint, averaged over a block.
#[derive(Clone, Copy, Debug)]
pub struct JointLoad {
    /// Seconds, of the capture's clock.
    pub time: f64,
    /// N·m or N, of the tool on the child.
    pub load: f64,
    /// N·m of load per N of force: the arm about the axis, m; 1 for a slide.
    pub lever: f64,
    /// N·m of load per m by which the axis is elsewhere, along two directions across it; 0 for a slide.
    pub aside: [f64; 2],
    /// Unit vector, in the room, of the force that moves it.
    pub way: Vector3<f64>,
    /// rad or m since the first view.
    pub position: f64,
    /// rad/s or m/s.
    pub speed: f64,
    /// Standard deviation of the speed for unit noise of the position along the freedom, 1/s.
    pub speed_gain: f64,
    /// rad/s² or m/s², acceleration of the child along the freedom: of a slide the absolute one, of a hinge that
    /// against the parent.
    pub acceleration: f64,
}

/// A joint in one interaction that handles its child.
pub(super) struct JointAtWork<'a> {
    pub(super) interaction: &'a Interaction,
    pub(super) joint: &'a Joint,
    pub(super) child: &'a Link,
    pub(super) parent: Option<&'a Link>,
    tare: Tare,
    /// Path of the point that is held, where the child itself was not tracked.
    hand: Option<&'a PoseStream>,
    /// Where that point is at the joint's position 0.
    held: Point3<f64>,
    /// Where the parent stands throughout, if it does.
    pub(super) stands: Option<Isometry3<f64>>,
    /// Path of a tool that holds the tracked child and is known more finely than the track.
    pub(super) leads: Option<&'a PoseStream>,
    /// Where that tool was at first, and the joint's position there, rad or m.
    pub(super) led_from: Option<(Point3<f64>, f64)>,
}

/// Span over which a block is averaged, and half the span of the parabola that gives velocities, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub block: f64,
    pub half: f64,
    /// The same of the tool's path, where that is what tells the child's motion.
    pub led: Option<f64>,
    /// Forces are weighted over the span of the velocities as those are.
    pub matched: bool,
}

/// Blocks that a stretch of sliding is cut into at least, the shortest of them, s, and half the span of the parabola in
/// blocks: by the path of a tool, and by a track.
const LED: [f64; 3] = [12.0, 0.03, 0.5];
const TRACKED: [f64; 3] = [8.0, 0.04, 1.5];

impl Span {
    /// For a stretch of so many seconds: what moves for a short time moves fast, so that its speed shows in a short span;
    /// a tool's path is finer than a track.
    pub fn of(duration: f64, config: &Config, led: bool) -> Self {
        let [blocks, shortest, wide] = if led { LED } else { TRACKED };
        let block = (duration / blocks).max(shortest).min(config.block);
        let half = wide * block;
        Self {
            block,
            half: if led { config.smoothing.max(0.15) } else { half },
            led: led.then_some(half),
            matched: true,
        }
    }

    /// The mean wrench that goes with the velocity about `t`. The slope of a parabola over ±h is the mean of the velocity
    /// with the weights 1 - (s/h)²; a balance of momentum holds for means of both with the same weights, however the
    /// speed changes within the span.
    fn wrench(self, stream: &WrenchStream, t: f64, tare: &Tare) -> Option<MeanWrench> {
        if self.matched {
            weighted_wrench(stream, t, self.led.unwrap_or(self.half), tare)
        } else {
            mean_wrench(stream, t - 0.5 * self.block, t + 0.5 * self.block, tare)
        }
    }
}

fn weighted_wrench(stream: &WrenchStream, t: f64, half: f64, tare: &Tare) -> Option<MeanWrench> {
    let rows = stream.time.partition_point(|x| *x < t - half)..stream.time.partition_point(|x| *x <= t + half);
    let weight = |i: usize| (1.0 - ((stream.time[i] - t) / half).powi(2)).max(0.0);
    let mean = |values: &[Vector3<f64>]| {
        let read = rows.clone().filter(|i| values[*i].iter().all(|x| x.is_finite()));
        let (sum, total, count) = read.fold((Vector3::zeros(), 0.0, 0), |(sum, total, n), i| {
            (sum + values[i] * weight(i), total + weight(i), n + 1)
        });
        (total > 0.0).then(|| (sum / total, count))
    };
    let (force, rows) = mean(&stream.force)?;
    let torque = stream.torque.as_ref().and_then(|t| mean(t));
    Some(MeanWrench {
        force: force - tare.force,
        torque: torque.map(|(t, _)| t - tare.torque),
        rows,
    })
}

impl<'a> JointAtWork<'a> {
    /// `None` where the child is not known, or neither tracked nor held.
    pub fn new(interaction: &'a Interaction, cut: &Segmented, joint: &'a Joint, model: &'a Model) -> Option<Self> {
        let child = model.twin.link(&joint.child)?;
        let path = path_of(interaction, &joint.child)?;
        let hand = (!interaction.tracks.contains_key(&joint.child)).then_some(path);
        // What nobody tracked and nothing carries is placed where it was first held.
        let first = (0..path.len()).find(|i| path.position[*i].x.is_finite())?;
        let holds = interaction.tool.as_ref().is_some_and(|t| t.grip || t.pin)
            && super::facts::subject(interaction, cut) == Some(joint.child.as_str());
        let finer = |tool: &&PoseStream| position_noise(&[*tool]) <= position_noise(&[path]);
        let mut at_work = Self {
            interaction,
            joint,
            child,
            parent: model.twin.link(&joint.parent),
            // A hand that holds from the first row on shows no tare.
            tare: if hand.is_some() || held_at_first(interaction, cut) {
                Tare::default()
            } else {
                tare_of(interaction, cut)
            },
            hand,
            held: path.position[first],
            stands: interaction.tracks.get(&joint.parent).and_then(standing),
            leads: interaction
                .tool_path
                .as_ref()
                .filter(|_| holds && hand.is_none())
                .filter(finer),
            led_from: None,
        };
        at_work.led_from = at_work.led_at_first();
        Some(at_work)
    }

    /// True where nothing but the path of what holds the child tells how it moves.
    pub fn by_hand(&self) -> bool {
        self.hand.is_some()
    }

    /// True where the tool's own path tells how the child moves.
    pub fn led(&self) -> bool {
        self.leads.is_some()
    }

    /// The load of the hand where nothing but its path is known, in the block about `t`.
    fn at_hand(&self, path: &PoseStream, t: f64, span: Span) -> Option<JointLoad> {
        let stream = self.interaction.force.as_ref()?;
        let w = span.wrench(stream, t, &self.tare)?;
        let m = motion_at(path, t, span.half)?;
        let (axis, origin) = (
            Vector3::from(self.joint.axis.value),
            Point3::from(self.joint.origin.value),
        );
        let level = |v: Vector3<f64>| v - axis * axis.dot(&v);
        let shift = m.pose.translation.vector - self.held.coords;
        if self.joint.kind == JointKind::Prismatic {
            return Some(JointLoad {
                time: t,
                load: w.force.dot(&axis),
                lever: 1.0,
                aside: [0.0; 2],
                way: axis,
                position: shift.dot(&axis),
                speed: m.velocity.dot(&axis),
                speed_gain: m.velocity_gain,
                acceleration: m.acceleration.dot(&axis),
            });
        }
        let (arm, home) = (m.pose.translation.vector - origin.coords, level(self.held - origin));
        let (out, radius) = (level(arm), level(arm).norm().max(1e-6));
        let pitch = self.joint.pitch.as_ref().map_or(0.0, |p| p.value);
        let way = axis.cross(&out);
        Some(JointLoad {
            time: t,
            load: way.dot(&w.force) + pitch * axis.dot(&w.force),
            lever: radius,
            aside: aside(&axis, &w.force),
            way: way / radius,
            position: axis.dot(&home.cross(&out)).atan2(home.dot(&out)),
            speed: way.dot(&m.velocity) / radius.powi(2),
            speed_gain: m.velocity_gain,
            acceleration: way.dot(&m.acceleration) / radius.powi(2),
        })
    }

    /// The load in the block about `t`; `None` where force or motion is missing.
    pub fn at(&self, t: f64, span: Span) -> Option<JointLoad> {
        if let Some(path) = self.hand {
            return self.at_hand(path, t, span);
        }
        let (joint, child) = (self.joint, self.child);
        let stream = self.interaction.force.as_ref()?;
        let w = span.wrench(stream, t, &self.tare)?;
        let c = motion_at(self.interaction.tracks.get(&joint.child)?, t, span.half)?;
        let home = self.parent.map_or(Isometry3::identity(), |l| l.pose.0);
        let still = (home, Vector3::zeros(), Vector3::zeros());
        let track = self
            .interaction
            .tracks
            .get(&joint.parent)
            .filter(|_| self.stands.is_none());
        let (parent_pose, v_parent, spin_parent) = match self.stands {
            Some(pose) => (pose, Vector3::zeros(), Vector3::zeros()),
            None => pose_now(track, self.parent, t, span.half).unwrap_or(still),
        };
        let moved = parent_pose * home.inverse();
        let axis = moved * Vector3::from(joint.axis.value);
        let origin = moved * Point3::from(joint.origin.value);
        if joint.kind != JointKind::Prismatic {
            let turned = (parent_pose.rotation * home.rotation.inverse()).inverse();
            let turn = turned * c.pose.rotation * child.pose.rotation.inverse();
            let tool = self.interaction.tool_path.as_ref().and_then(|p| tool_at(p, t));
            let arm = tool.unwrap_or(Point3::from(c.pose.translation.vector)) - origin;
            let thread = joint.pitch.as_ref().map_or(0.0, |p| p.value);
            let parent_turns = track.and_then(|s| motion_at(s, t, span.half)).map(|m| m.spin_rate);
            let moment = arm.cross(&w.force) + w.torque.unwrap_or_default() + w.force * thread;
            let by_track = [
                (c.spin - spin_parent).dot(&axis),
                (c.spin_rate - parent_turns.unwrap_or_default()).dot(&axis),
                c.velocity_gain,
            ];
            let carried = v_parent + spin_parent.cross(&(arm + origin.coords - parent_pose.translation.vector));
            let way = axis.cross(&arm) + axis * thread;
            let [speed, acceleration, speed_gain] = self.by_tool(t, span.led, &way, &carried).unwrap_or(by_track);
            return Some(JointLoad {
                time: t,
                load: moment.dot(&axis),
                lever: axis.cross(&arm).norm(),
                aside: aside(&self.joint.axis.value.into(), &moved.inverse_transform_vector(&w.force)),
                way: way / way.norm().max(1e-9),
                position: self
                    .position_by_tool(t, span.led, &axis, &origin)
                    .unwrap_or_else(|| turn.scaled_axis().dot(&Vector3::from(joint.axis.value))),
                speed,
                speed_gain,
                acceleration,
            });
        }
        let by_track = [
            (c.velocity - v_parent).dot(&axis),
            c.acceleration.dot(&axis),
            c.velocity_gain,
        ];
        let [speed, acceleration, speed_gain] = self.by_tool(t, span.led, &axis, &v_parent).unwrap_or(by_track);
        let carried = parent_pose.translation.vector - home.translation.vector;
        let shift = c.pose.translation.vector - child.pose.translation.vector - carried;
        Some(JointLoad {
            time: t,
            load: w.force.dot(&axis),
            lever: 1.0,
            aside: [0.0; 2],
            way: axis,
            position: self
                .position_by_tool(t, span.led, &axis, &origin)
                .unwrap_or_else(|| shift.dot(&axis)),
            speed,
            speed_gain,
            acceleration,
        })
    }

    /// How far the parent is from where it began for a tenth of this interaction, m at the child's place: noise of the
    /// track is no motion.
    pub fn parent_moves(&self) -> f64 {
        let Some(track) = self.interaction.tracks.get(&self.joint.parent) else {
            return 0.0;
        };
        let poses: Vec<Isometry3<f64>> = (0..track.len()).filter_map(|i| Some(track.pose(i)?.0)).collect();
        let (Some(first), at) = (poses.first(), Point3::from(self.child.pose.0.translation.vector)) else {
            return 0.0;
        };
        let home = first.inverse() * at;
        // Far from the parent's own origin a little noise of its heading is a long way: means of many rows calm it.
        let rows = (poses.len() / 20).clamp(1, CALM);
        let mean = |of: &[Isometry3<f64>]| of.iter().map(|p| (p * home).coords).sum::<Vector3<f64>>() / of.len() as f64;
        let places: Vec<Vector3<f64>> = poses.chunks(rows).map(mean).collect();
        let away: Vec<f64> = places.iter().map(|p| (p - places[0]).norm()).collect();
        quantile(&away, 0.9).unwrap_or(0.0)
    }
}

/// Rows of a parent's track that are averaged at most.
const CALM: usize = 25;

/// What a force adds to the moment about an axis that is off by 1 m, along two directions across it.
fn aside(axis: &Vector3<f64>, force: &Vector3<f64>) -> [f64; 2] {
    let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
    [first, axis.cross(&first)].map(|e| e.cross(force).dot(axis))
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

/// Farther than this from where it began poses do not tell an angle, short of half a turn by their noise, rad.
const HALF_TURN: f64 = 3.0;
/// Seconds over which a speed tells how far a joint went on.
const GOES_ON: f64 = 0.5;

/// The angle of a joint that went farther than half a turn goes on over whole turns: poses do not count them.
pub(super) fn go_on_over_turns(loads: &mut [JointLoad], joint: &Joint) {
    use std::f64::consts::TAU;
    let far = |[low, high]: [f64; 2]| low < -HALF_TURN || high > HALF_TURN;
    if joint.kind == JointKind::Prismatic || !joint.travelled.is_some_and(far) {
        return;
    }
    for i in 1..loads.len() {
        let last = loads[i - 1];
        let lasts = loads[i].time - last.time;
        let speed = if lasts < GOES_ON {
            0.5 * (last.speed + loads[i].speed)
        } else {
            0.0
        };
        let ahead = speed * lasts;
        loads[i].position += TAU * ((last.position + ahead - loads[i].position) / TAU).round();
    }
}

/// Loads of one interaction that handles the child of `joint` while its parent stands, block by block.
///
/// Velocities come from local parabolas over ±`half` s. `None` where the child is not what is handled, is not tracked
/// or not felt, or where the parent moves by more than `stands` m.
pub fn joint_loads(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    read: [f64; 3],
) -> Option<Vec<JointLoad>> {
    loads_of(interaction, cut, joint, model, (read, None))
}

/// The same by the path of a tool that holds the child, over ±`led` s, where that is known more finely than the child's track.
pub fn joint_loads_by_tool(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    (read, led): ([f64; 3], f64),
) -> Option<Vec<JointLoad>> {
    loads_of(interaction, cut, joint, model, (read, Some(led)))
}

fn loads_of(
    interaction: &Interaction,
    cut: &Segmented,
    joint: &Joint,
    model: &Model,
    ([block, half, stands], led): ([f64; 3], Option<f64>),
) -> Option<Vec<JointLoad>> {
    if super::facts::subject(interaction, cut)? != joint.child {
        return None;
    }
    let at_work = JointAtWork::new(interaction, cut, joint, model).filter(|w| w.parent_moves() <= stands)?;
    let stream = interaction.force.as_ref()?;
    let (first, last) = (*stream.time.first()?, *stream.time.last()?);
    let span = Span {
        block,
        half,
        led: led.filter(|_| at_work.led()),
        matched: false,
    };
    let blocks = 0..((last - first) / block) as usize;
    let each = blocks.filter_map(|k| at_work.at(first + (k as f64 + 0.5) * block, span));
    let mut loads: Vec<JointLoad> = each.collect();
    go_on_over_turns(&mut loads, joint);
    Some(loads)
}
