//! An action of the scene written out as motions in time.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use super::body::Frame;
use super::distance::{nearest, reach, support_radius};
use super::drive::{Course, Drive, Moves};
use crate::base::{Error, Result};
use crate::capture::{Kind, Tool, ToolShape};
use crate::lab::{ActionSpec, BodySpec, JointSpec, JointSpecKind, Scene, ToolSpec};
use crate::lab::{PartShape, Solid};

/// Stillness before and after, s.
const BEFORE: f64 = 0.5;
const AFTER: f64 = 0.4;
/// When a tool takes hold, s.
const ATTACH: f64 = 0.3;
/// Mean acceleration of the tool, m/s²; of a tool that leaves a body coasting; of the support, rad/s².
const GENTLE: f64 = 0.5;
/// The least one of a tool that shoves a body which has broken loose (its inertia should not hide how it broke
/// loose), and the share of the travel after which it is to be at speed.
const SHOVING: (f64, f64) = (0.15, 0.2);
const ABRUPT: f64 = 30.0;
const TURNING: f64 = 1.0;
/// How far a push starts behind the contact, at best and at least, m.
const RUN_UP: [f64; 6] = [0.028, 0.025, 0.02, 0.015, 0.01, 0.006];
/// A push that is not to leave the body coasting comes to the contact at this speed, m/s, so that the body breaks loose
/// before the blow of the contact could shove it; from this far before the contact to this far behind it, m.
const CAREFUL: f64 = 0.004;
const BEWARE: (f64, f64) = (-0.0015, 0.001);
/// Where a push looks for the true first touch about the aimed one, m.
const SEARCH: f64 = 0.12;
const SEARCH_STEP: f64 = 0.001;
/// How far above the contact a press starts, m.
const ABOVE: f64 = 0.015;
/// How far the tool draws back at the end, m.
const RETREAT: f64 = 0.01;
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

    fn of_target(scene: &Scene, name: &str, target: &str, kind: Kind, held_out: bool) -> Result<Self> {
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

fn wrong(scene: &Scene, action: &str, key: &str, found: &str, expected: &str) -> Error {
    Error::bad_input(&scene.name, format!("action {action:?}: {key}"), found, expected)
}

fn unit(scene: &Scene, action: &str, key: &str, vector: [f64; 3]) -> Result<Vector3<f64>> {
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

fn positive(scene: &Scene, action: &str, key: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(wrong(scene, action, key, &value.to_string(), "a positive number"))
}

fn tool_of(spec: &ToolSpec) -> (ToolShape, PartShape) {
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

fn push(scene: &Scene, action: &ActionSpec, solids: &[&Solid]) -> Result<Script> {
    let ActionSpec::Push {
        name,
        target,
        at,
        direction,
        travel,
        speed,
        tool,
        tool_friction,
        retreat,
        held_out,
    } = action
    else {
        return Err(Error::Failed("not a push".into()));
    };
    let mut script = Script::of_target(scene, name, target, Kind::Push, *held_out)?;
    let direction = unit(scene, name, "direction", *direction)?;
    let (travel, speed) = (
        positive(scene, name, "travel", *travel)?,
        positive(scene, name, "speed", *speed)?,
    );
    let (tool_shape, shape) = tool_of(tool);
    // A plate faces the way it goes; a ball and an upright cylinder look the same from all sides.
    let heading = if matches!(tool, ToolSpec::Box { .. }) {
        direction.y.atan2(direction.x)
    } else {
        0.0
    };
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    let ahead = support_radius(&shape, &rotation.inverse_transform_vector(&direction));
    let mut drive = Drive {
        origin: Vector3::from(*at) - direction * ahead,
        rotation,
        course: Course::Line { direction },
        moves: Moves::default(),
    };
    if let Some(touched) = solids
        .iter()
        .find(|s| s.name == *target)
        .and_then(|s| first_touch(&shape, &drive, s))
    {
        drive.origin += direction * touched;
    }
    let clear = |back: &&f64| {
        solids
            .iter()
            .all(|solid| is_clear(&shape, &drive.frame_at(-**back, 0.0), solid))
    };
    let Some(back) = RUN_UP.iter().find(clear) else {
        return Err(wrong(
            scene,
            name,
            "at",
            &format!("{at:?}"),
            "a point that the tool can come to from behind",
        ));
    };
    drive.moves = shove(-back, travel, speed, *retreat);
    script.duration = drive.moves.end() + AFTER + if *retreat { 0.3 } else { 0.0 };
    script.wielding = Some(Wielding {
        tool: Tool {
            shape: tool_shape,
            grip: false,
            pin: false,
        },
        shape,
        friction: *tool_friction,
        drive,
        holds: None,
    });
    Ok(script)
}

/// From the run-up through the contact (travel 0) and back a little.
fn shove(from: f64, travel: f64, speed: f64, retreat: bool) -> Moves {
    let away = travel - RETREAT;
    let start = Moves::from(from).rest(BEFORE);
    if retreat {
        return start
            .leg(travel, 0.0, speed, GENTLE, ABRUPT)
            .leg(away, 0.0, speed.max(0.05), ABRUPT, GENTLE);
    }
    let careful = CAREFUL.min(speed);
    let near = if speed > CAREFUL && travel > 2.0 * BEWARE.1 {
        start
            .leg(BEWARE.0, careful, speed, GENTLE, GENTLE)
            .leg(BEWARE.1, careful, careful, GENTLE, GENTLE)
    } else {
        start
    };
    let gather = (0.5 * speed * speed / (SHOVING.1 * travel)).max(SHOVING.0).min(GENTLE);
    near.leg(travel, 0.0, speed, gather, GENTLE)
        .rest(AFTER)
        .leg(away, 0.0, 0.05, GENTLE, GENTLE)
}

/// The travel at which the tool, coming from behind, first touches the solid near to where contact is aimed.
fn first_touch(shape: &PartShape, drive: &Drive, solid: &Solid) -> Option<f64> {
    let clear = |travel: f64| is_clear(shape, &drive.frame_at(travel, 0.0), solid);
    let steps = (2.0 * SEARCH / SEARCH_STEP) as usize;
    let travel = |k: usize| -SEARCH + SEARCH_STEP * k as f64;
    let hit = (1..=steps).find(|k| !clear(travel(*k)))?;
    let (mut free, mut touching) = (travel(hit - 1), travel(hit));
    for _ in 0..20 {
        let middle = 0.5 * (free + touching);
        if clear(middle) {
            free = middle
        } else {
            touching = middle
        }
    }
    clear(-SEARCH).then_some(free)
}

fn is_clear(shape: &PartShape, tool: &Frame, solid: &Solid) -> bool {
    solid.parts.iter().all(|part| {
        let place = solid.world_from_body.0 * part.body_from_part.0;
        let centre = place.inverse_transform_point(&tool.position.into()).coords;
        let found = nearest(&part.shape, &centre, &centre);
        found.distance > reach(shape)
            || found.distance > support_radius(shape, &tool.matrix.tr_mul(&(place.rotation * found.normal)))
    })
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
    };
    script.wielding = Some(holding(drive, *pin, (ATTACH, f64::INFINITY)));
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
        JointSpecKind::Revolute => axis.cross(&(at - centre)),
        JointSpecKind::Prismatic => axis,
    };
    let axis = if way.dot(&direction) < 0.0 { -axis } else { axis };
    match joint.kind {
        JointSpecKind::Revolute => Course::Arc { centre, axis, turning },
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
    let moves = up.rest(*hold).leg(0.0, 0.0, speed, GENTLE, GENTLE);
    let release = moves.end() + 0.2;
    script.duration = release + AFTER;
    let drive = Drive {
        origin: Vector3::from(*at),
        rotation: UnitQuaternion::identity(),
        course: Course::Line {
            direction: Vector3::z(),
        },
        moves,
    };
    script.wielding = Some(holding(drive, false, (ATTACH, release)));
    Ok(script)
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
