//! What a push says of how the pushed body turns: force and its moment, motion, and where the finger met the face, all as
//! measured, in the plane of the support.

use nalgebra::{Isometry3, Matrix2x3, UnitQuaternion, Vector2, Vector3};

use super::Config;
use super::action::action_of;
use super::evidence::{motion_at, tool_at};
use super::facts::{Ground, ground_of};
use super::push::{Block, Plane, read_push};
use super::slip::PlaneFrame;
use crate::capture::{Capture, Interaction, PhaseKind, Segmented};
use crate::physics::{Footprint, Hold, Linkage};
use crate::twin::Model;

/// A stretch of a push: means of the force, the motion in its middle. Plane of the support, axes of [`Turned::axes`].
#[derive(Clone, Debug)]
pub struct Turned {
    /// s.
    pub time: f64,
    /// Force on the body, N.
    pub force: Vector2<f64>,
    /// Moment of the force about the tracked origin, along the support's normal, N·m.
    pub moment: f64,
    /// Force on the body away from the support, N.
    pub lift: f64,
    /// Height above the support at which the force acts, m.
    pub height: f64,
    /// Of the tracked origin, m/s.
    pub velocity: Vector2<f64>,
    /// Its standard deviation, m/s.
    pub velocity_sd: f64,
    /// Of the tracked origin, m/s².
    pub acceleration: Vector2<f64>,
    /// About the support's normal, rad/s.
    pub spin: f64,
    /// How fast that grows, rad/s², and its standard deviation for unit noise of an angle, 1/s².
    pub spin_rate: (f64, f64),
    /// Plane vector of a link vector: `axes * v`.
    pub axes: Matrix2x3<f64>,
    /// How far the finger's surface is inside of the face that it touches, m.
    pub inside: f64,
    /// Outward normal of that face.
    pub outward: Vector2<f64>,
    /// Heading of the tool, rad.
    pub tool: f64,
    /// Where the tracked origin lies, about the origin of the room, m.
    pub origin: Vector2<f64>,
    /// Where the finger touches, about the same, m.
    pub contact: Vector2<f64>,
}

/// How far the finger may seem from the face, m.
const NEAR: f64 = 0.015;
/// Stretches of a push, and the shortest of them, s.
const STRETCHES: f64 = 12.0;
const SHORTEST: f64 = 0.04;

/// The stretches of a push of the single-link body `name`; nothing where it is held, or where force, track or outline are
/// missing.
pub fn turned(
    capture: &Capture,
    interaction: &Interaction,
    segmented: &Segmented,
    model: &Model,
    name: &str,
) -> Option<Vec<Turned>> {
    let action = action_of(capture, interaction, Some(segmented), model).filter(|a| a.tool.hold == Hold::Push)?;
    let normal = action.normal.into_inner();
    let height = action.tool.position.first()?.coords.dot(&normal);
    let linkage = Linkage::new(model, model.twin.body_of(name)?, &action.start, &normal, height)?;
    let (outline, _) = linkage.outline(linkage.index(name)?)?;
    let frame = PlaneFrame {
        turn: UnitQuaternion::rotation_between(&normal, &Vector3::z())?,
        start: *action.start.get(name)?,
    };
    let ground = Ground {
        plane: Plane {
            x: frame.turn.inverse() * Vector3::x(),
            y: frame.turn.inverse() * Vector3::y(),
            normal,
        },
        ..ground_of(capture, &model.twin)
    };
    let slide = segmented.of(PhaseKind::Slide).next()?;
    let block = ((slide.end - slide.start) / STRETCHES).max(SHORTEST);
    let config = Config {
        block,
        smoothing: block.clamp(0.06, 0.12),
        settling: SHORTEST,
        ..Config::default()
    };
    let push = read_push(interaction, segmented, name, &ground, &config).filter(|p| !p.bridged)?;
    let touch = Touch {
        interaction,
        name,
        frame,
        outline,
        normal,
        radius: action.tool.radius,
        smoothing: config.smoothing,
    };
    let rows: Vec<Turned> = push.blocks.iter().filter_map(|b| touch.at(b)).collect();
    (rows.len() >= 2).then_some(rows)
}

/// Finger and face.
struct Touch<'a> {
    interaction: &'a Interaction,
    name: &'a str,
    frame: PlaneFrame,
    outline: &'a Footprint,
    normal: Vector3<f64>,
    radius: f64,
    smoothing: f64,
}

impl Touch<'_> {
    fn at(&self, block: &Block) -> Option<Turned> {
        let path = self.interaction.tool_path.as_ref()?;
        let motion = motion_at(self.interaction.tracks.get(self.name)?, block.time, self.smoothing)?;
        let body: Isometry3<f64> = motion.pose;
        let finger = self.frame.flat(&tool_at(path, block.time)?.coords);
        let near = self.outline.nearest(&self.frame.moved(&body), &finger.into());
        let row = path.time.partition_point(|t| *t < block.time).min(path.len() - 1);
        let heading = path.rotation[row].map_or(0.0, |q| {
            let way = self.frame.flat(&(q * Vector3::x()));
            way.y.atan2(way.x)
        });
        let inside = self.radius - near.distance;
        let moment = block.moment?;
        // Without torque the line of the force goes through where the finger touches.
        let torque = self.interaction.force.as_ref()?.torque.is_some();
        let shifted = if torque {
            0.0
        } else {
            self.radius * block.force.perp(&near.outward)
        };
        (inside.abs() < NEAR).then_some(Turned {
            time: block.time,
            force: block.force,
            moment: moment + shifted,
            lift: block.lift,
            height: block.height,
            velocity: block.velocity,
            velocity_sd: block.velocity_sd,
            acceleration: block.acceleration,
            spin: block.spin,
            // Of a parabola through evenly spaced readings, by what its slope is known to.
            spin_rate: (
                motion.spin_rate.dot(&self.normal),
                15.0_f64.sqrt() * motion.velocity_gain / self.smoothing,
            ),
            axes: block.axes,
            inside,
            outward: near.outward,
            tool: heading,
            origin: self.frame.flat(&body.translation.vector),
            contact: finger - near.outward * self.radius,
        })
    }
}
