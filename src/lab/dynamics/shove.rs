//! A push written out as motion in time: run-up, careful contact, shove, retreat.

use nalgebra::{UnitQuaternion, Vector3};

use super::body::Frame;
use super::distance::{nearest, reach, support_radius};
use super::drive::{Course, Drive, Moves};
use super::script::{AFTER, BEFORE, GENTLE, Script, Wielding, positive, tool_of, unit, wrong};
use crate::base::{Error, Result};
use crate::capture::{Kind, Tool};
use crate::lab::{ActionSpec, PartShape, Scene, Solid, ToolSpec};

/// Mean deceleration of a tool that leaves a body coasting, m/s².
const ABRUPT: f64 = 30.0;
/// The least one of a tool that shoves a body which has broken loose (its inertia should not hide how it broke
/// loose), and the share of the travel after which it is to be at speed.
const SHOVING: (f64, f64) = (0.15, 0.2);
/// How far a push starts behind the contact, at best and at least, m.
const RUN_UP: [f64; 6] = [0.028, 0.025, 0.02, 0.015, 0.01, 0.006];
/// A push that is not to leave the body coasting comes to the contact at this speed, m/s, so that the body breaks loose
/// before the blow of the contact could shove it; from this far before the contact to this far behind it, m.
const CAREFUL: f64 = 0.004;
const BEWARE: (f64, f64) = (-0.0015, 0.001);
/// Where a push looks for the true first touch about the aimed one, m.
const SEARCH: f64 = 0.12;
const SEARCH_STEP: f64 = 0.001;
/// How far the tool draws back at the end, m.
const RETREAT: f64 = 0.01;

/// Reads a push. It aims at the true first touch on the target nearest to where contact is aimed.
pub(super) fn push(scene: &Scene, action: &ActionSpec, solids: &[&Solid]) -> Result<Script> {
    let ActionSpec::Push {
        name,
        target,
        at,
        direction,
        travel,
        speed,
        tool,
        tool_friction,
        turned,
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
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading + turned);
    let ahead = support_radius(&shape, &rotation.inverse_transform_vector(&direction));
    let mut drive = Drive {
        origin: Vector3::from(*at) - direction * ahead,
        rotation,
        course: Course::Line { direction },
        moves: Moves::default(),
        twist: None,
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
        down: 0.0,
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
