//! An action of the scene written out as motions in time.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use super::distance::support_radius;
use super::drive::{Course, Drive, Moves};
use super::shove::push;
use crate::base::{Error, Result};
use crate::capture::{Kind, Tool, ToolShape};
use crate::lab::{ActionSpec, BodySpec, JointSpec, JointSpecKind, Scene, ToolSpec};
use crate::lab::{PartShape, Solid};

/// Stillness before and after, s.
pub(super) const BEFORE: f64 = 0.5;
pub(super) const AFTER: f64 = 0.4;
/// When a tool takes hold, s.
const ATTACH: f64 = 0.3;
/// Mean acceleration of the tool, m/s², and of the support, rad/s².
pub(super) const GENTLE: f64 = 0.5;
const TURNING: f64 = 1.0;
/// Fastest spin of what is twisted, rad/s, its mean acceleration, rad/s², and how long it rests afterwards, s.
const TWISTING: (f64, f64) = (3.0, 20.0);
const PAUSE: f64 = 0.3;
/// How far above the contact a press starts, m.
const ABOVE: f64 = 0.015;
/// The ball that stands for a hand that grips or pins, m.
const GRIPPER: f64 = 0.008;

/// What is done, in time.
#[derive(Clone, Debug)]
pub(crate) struct Script {
    pub name: String,
    pub kind: Kind,
    pub target: Option<String>,
    pub held_out: bool,
    pub wielding: Option<Wielding>,
    pub tilting: Option<Tilting>,
    /// s.
    pub duration: f64,
}

/// A tool and its motion.
#[derive(Clone, Debug)]
pub(crate) struct Wielding {
    pub tool: Tool,
    pub shape: PartShape,
    pub friction: f64,
    /// Force with which it presses down what it holds, N.
    pub down: f64,
    pub drive: Drive,
    /// From when to when it holds the target; otherwise it touches from outside.
    pub holds: Option<(f64, f64)>,
}

/// A support that turns.
#[derive(Clone, Debug)]
pub(crate) struct Tilting {
    pub axis: UnitVector3<f64>,
    pub angle: Moves,
    /// Distance after which the recording ends, m.
    pub slide: f64,
}

impl Script {
    /// Reads an action. Fails where it names what does not exist, or starts inside something.
    pub fn new<'a>(scene: &Scene, action: &ActionSpec, solids: impl Iterator<Item = &'a Solid>) -> Result<Self> {
        match action {
            ActionSpec::Push { .. } => push(scene, action, &solids.collect::<Vec<_>>()),
            ActionSpec::Pull { .. } => pull(scene, action),
            ActionSpec::Press { .. } => press(scene, action),
            ActionSpec::Lift { .. } => lift(scene, action),
            ActionSpec::Tilt { .. } => tilt(scene, action),
            ActionSpec::Hold { name, seconds } => Ok(Self {
                name: name.clone(),
                kind: Kind::Hold,
                target: None,
                held_out: false,
                wielding: None,
                tilting: None,
                duration: *seconds,
            }),
        }
    }

    /// A script that still lacks its motion. Fails where the target does not exist.
    pub(super) fn of_target(scene: &Scene, name: &str, target: &str, kind: Kind, held_out: bool) -> Result<Self> {
        if !scene.body.iter().any(|b: &BodySpec| b.name == target) {
            let known = scene
                .body
                .iter()
                .map(|b| b.name.as_str())
                .collect::<Vec<_>>()
                .join(", ");
            return Err(wrong(
                scene,
                name,
                "target",
                target,
                &format!("one of the bodies: {known}"),
            ));
        }
        Ok(Self {
            name: name.to_owned(),
            kind,
            target: Some(target.to_owned()),
            held_out,
            wielding: None,
            tilting: None,
            duration: 0.0,
        })
    }
}

/// A mistake in an action of the scene.
pub(super) fn wrong(scene: &Scene, action: &str, key: &str, found: &str, expected: &str) -> Error {
    Error::bad_input(&scene.name, format!("action {action:?}: {key}"), found, expected)
}

/// The direction of a vector that must not be zero.
pub(super) fn unit(scene: &Scene, action: &str, key: &str, vector: [f64; 3]) -> Result<Vector3<f64>> {
    Vector3::from(vector)
        .try_normalize(1e-9)
        .filter(|v| v.iter().all(|x| x.is_finite()))
        .ok_or_else(|| {
            wrong(
                scene,
                action,
                key,
                &format!("{vector:?}"),
                "a direction that is not zero",
            )
        })
}

/// A number that must be positive.
pub(super) fn positive(scene: &Scene, action: &str, key: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(wrong(scene, action, key, &value.to_string(), "a positive number"))
}

/// The tool as the capture and as the contacts know it.
pub(super) fn tool_of(spec: &ToolSpec) -> (ToolShape, PartShape) {
    match *spec {
        ToolSpec::Sphere { radius } => (ToolShape::Sphere { radius }, PartShape::Sphere { radius }),
        ToolSpec::Box { half } => {
            let half = Vector3::from(half);
            (ToolShape::Box { half }, PartShape::Box { half })
        }
        ToolSpec::Cylinder { radius, half_height } => (
            ToolShape::Cylinder { radius, half_height },
            PartShape::Cylinder { radius, half_height },
        ),
    }
}

/// A tool that holds the target by `drive` while `holds`.
fn holding(drive: Drive, pin: bool, holds: (f64, f64)) -> Wielding {
    Wielding {
        tool: Tool {
            shape: ToolShape::Sphere { radius: GRIPPER },
            grip: !pin,
            pin,
        },
        shape: PartShape::Sphere { radius: GRIPPER },
        friction: 0.0,
        down: 0.0,
        drive,
        holds: Some(holds),
    }
}

fn pull(scene: &Scene, action: &ActionSpec) -> Result<Script> {
    let ActionSpec::Pull {
        name,
        target,
        at,
        direction,
        travel,
        speed,
        pin,
        down,
        arc,
        back,
        held_out,
    } = action
    else {
        return Err(Error::Failed("not a pull".into()));
    };
    let mut script = Script::of_target(scene, name, target, Kind::Pull, *held_out)?;
    let direction = unit(scene, name, "direction", *direction)?;
    let (travel, speed) = (
        positive(scene, name, "travel", *travel)?,
        positive(scene, name, "speed", *speed)?,
    );
    let course = if *arc {
        let Some(joint) = joint_of(scene, target) else {
            return Err(wrong(scene, name, "arc", "true", "a target that hangs on a joint"));
        };
        along_joint(
            joint,
            Vector3::from(*at),
            direction,
            unit(scene, name, "joint axis", joint.axis)?,
            !pin,
        )
    } else {
        Course::Line { direction }
    };
    let mut moves = Moves::from(0.0).rest(BEFORE).leg(travel, 0.0, speed, GENTLE, GENTLE);
    if *back {
        moves = moves.rest(AFTER).leg(0.0, 0.0, speed, GENTLE, GENTLE);
    }
    script.duration = moves.end() + AFTER;
    let drive = Drive {
        origin: Vector3::from(*at),
        rotation: UnitQuaternion::identity(),
        course,
        moves,
        twist: None,
    };
    script.wielding = Some(Wielding {
        down: *down,
        ..holding(drive, *pin, (ATTACH, f64::INFINITY))
    });
    Ok(script)
}

/// The joint that a body hangs on, itself or by glue.
fn joint_of<'a>(scene: &'a Scene, target: &str) -> Option<&'a JointSpec> {
    let direct = |name: &str| {
        scene
            .joint
            .iter()
            .find(|j| j.b == name)
            .or(scene.joint.iter().find(|j| j.a == name))
    };
    direct(target).or_else(|| {
        let partners = scene.bond.iter().filter_map(|bond| match target {
            t if t == bond.a => Some(bond.b.as_str()),
            t if t == bond.b => Some(bond.a.as_str()),
            _ => None,
        });
        partners.filter_map(direct).next()
    })
}

fn along_joint(
    joint: &JointSpec,
    at: Vector3<f64>,
    direction: Vector3<f64>,
    axis: Vector3<f64>,
    turning: bool,
) -> Course {
    let centre = Vector3::from(joint.origin);
    let way = match joint.kind {
        JointSpecKind::Revolute | JointSpecKind::Screw => axis.cross(&(at - centre)),
        JointSpecKind::Prismatic => axis,
    };
    let axis = if way.dot(&direction) < 0.0 { -axis } else { axis };
    match joint.kind {
        JointSpecKind::Revolute | JointSpecKind::Screw => Course::Arc {
            centre,
            axis,
            pitch: joint.pitch,
            turning,
        },
        JointSpecKind::Prismatic => Course::Line { direction: axis },
    }
}

fn press(scene: &Scene, action: &ActionSpec) -> Result<Script> {
    let ActionSpec::Press {
        name,
        target,
        at,
        depth,
        speed,
        hold,
        tool,
        held_out,
    } = action
    else {
        return Err(Error::Failed("not a press".into()));
    };
    let mut script = Script::of_target(scene, name, target, Kind::Press, *held_out)?;
    let (depth, speed) = (
        positive(scene, name, "depth", *depth)?,
        positive(scene, name, "speed", *speed)?,
    );
    let (tool_shape, shape) = tool_of(tool);
    let down = -Vector3::z();
    let sink = Moves::from(-ABOVE).rest(BEFORE).leg(depth, 0.0, speed, GENTLE, GENTLE);
    let drive = Drive {
        origin: Vector3::from(*at) - down * support_radius(&shape, &down),
        rotation: UnitQuaternion::identity(),
        course: Course::Line { direction: down },
        moves: sink.rest(*hold).leg(-ABOVE, 0.0, speed, GENTLE, GENTLE),
        twist: None,
    };
    script.duration = drive.moves.end() + AFTER;
    script.wielding = Some(Wielding {
        tool: Tool {
            shape: tool_shape,
            grip: false,
            pin: false,
        },
        shape,
        drive,
        friction: 0.4,
        down: 0.0,
        holds: None,
    });
    Ok(script)
}

fn lift(scene: &Scene, action: &ActionSpec) -> Result<Script> {
    let ActionSpec::Lift {
        name,
        target,
        at,
        height,
        speed,
        hold,
        twist,
        held_out,
    } = action
    else {
        return Err(Error::Failed("not a lift".into()));
    };
    let mut script = Script::of_target(scene, name, target, Kind::Lift, *held_out)?;
    let (height, speed) = (
        positive(scene, name, "height", *height)?,
        positive(scene, name, "speed", *speed)?,
    );
    let up = Moves::from(0.0).rest(BEFORE).leg(height, 0.0, speed, GENTLE, GENTLE);
    let twist = twisting(*twist, up.end() + *hold);
    let aloft = twist.as_ref().map_or(*hold, |t| t.end() - up.end() + PAUSE);
    let moves = up.rest(aloft).leg(0.0, 0.0, speed, GENTLE, GENTLE);
    let release = moves.end() + 0.2;
    script.duration = release + AFTER;
    let drive = Drive {
        origin: Vector3::from(*at),
        rotation: UnitQuaternion::identity(),
        course: Course::Line {
            direction: Vector3::z(),
        },
        moves,
        twist,
    };
    script.wielding = Some(holding(drive, false, (ATTACH, release)));
    Ok(script)
}

/// Twice to and fro by an angle, from a time on.
fn twisting(angle: f64, from: f64) -> Option<Moves> {
    let swing = |moves: Moves, to: f64| moves.leg(to, 0.0, TWISTING.0, TWISTING.1, TWISTING.1);
    (angle > 0.0).then(|| {
        [angle, -angle, angle, -angle, 0.0]
            .into_iter()
            .fold(Moves::from(0.0).rest(from), swing)
    })
}

fn tilt(scene: &Scene, action: &ActionSpec) -> Result<Script> {
    let ActionSpec::Tilt {
        name,
        target,
        axis,
        rate,
        limit,
        slide,
        held_out,
    } = action
    else {
        return Err(Error::Failed("not a tilt".into()));
    };
    let mut script = Script::of_target(scene, name, target, Kind::Tilt, *held_out)?;
    let axis = unit(scene, name, "axis", *axis)?;
    if axis.z.abs() > 1e-6 {
        return Err(wrong(scene, name, "axis", &format!("{axis:?}"), "a horizontal axis"));
    }
    let (rate, limit) = (
        positive(scene, name, "rate", *rate)?,
        positive(scene, name, "limit", *limit)?,
    );
    let angle = Moves::from(0.0).rest(BEFORE).leg(limit, 0.0, rate, TURNING, TURNING);
    script.duration = angle.end() + 0.3;
    script.tilting = Some(Tilting {
        axis: UnitVector3::new_normalize(axis),
        angle,
        slide: positive(scene, name, "slide", *slide)?,
    });
    Ok(script)
}
