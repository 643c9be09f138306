//! What tells a yaw inertia: a twist of what hangs on the tool, or fast pushes off the middle, after which a thing spins until it
//! rests.

use nalgebra::Vector3;

use crate::capture::{Capture, Interaction, Kind};
use crate::stages::estimation::push_lines;
use crate::twin::{AskedTouch, Model};

/// Share of half the width by which they pass the centre of mass, to either side.
const ASIDE: [f64; 2] = [0.5, -0.5];
/// Way, m, and speed, m/s; the tool leaves at once.
const TRAVEL: f64 = 0.05;
const SPEED: f64 = 0.25;
/// How many are asked for.
const COUNT: usize = 6;

/// Height to which it is lifted, m, speed, m/s, time for which it hangs still first, s, and angle of the twist, rad.
const HEIGHT: f64 = 0.04;
const LIFTING: f64 = 0.05;
const HANGS: f64 = 0.5;
const ANGLE: f64 = 0.4;

/// A lift like one that was made, in which the thing is twisted; nothing where it was not lifted by what feels torques, or has
/// been twisted already (`told`).
pub fn twist(capture: &Capture, normal: &Vector3<f64>, name: &str, told: bool) -> Option<AskedTouch> {
    let feels = |i: &&Interaction| i.force.as_ref().is_some_and(|f| f.torque.is_some());
    let of_it = |i: &&Interaction| i.kind == Kind::Lift && i.target.as_deref() == Some(name);
    let lift = capture.fitted().filter(of_it).find(feels).filter(|_| !told)?;
    let start = *lift.tool_path.as_ref()?.position.first()?;
    Some(AskedTouch {
        kind: "lift".into(),
        target: name.into(),
        start: start.into(),
        direction: (*normal).into(),
        travel: HEIGHT,
        speed: LIFTING,
        duration: HANGS,
        turned: ANGLE,
        ..AskedTouch::default()
    })
}

/// Those that would tell the yaw inertia of a thing that was pushed; `normal` is the support's.
pub fn spins(model: &Model, normal: &Vector3<f64>, name: &str) -> Vec<AskedTouch> {
    let Some(link) = model.twin.link(name) else {
        return Vec::new();
    };
    let sides = ASIDE.map(|aside| push_lines(model, normal, link, aside).map_or_else(Vec::new, |l| l.0));
    // One side, then the other, from all headings in turn.
    let pairs = sides[0].iter().zip(&sides[1]).flat_map(|(a, b)| [a, b]);
    let one = |line: &crate::stages::estimation::PushLine| AskedTouch {
        kind: "push".into(),
        target: name.into(),
        start: line.start.into(),
        direction: line.direction.into(),
        travel: TRAVEL,
        speed: SPEED,
        ..AskedTouch::default()
    };
    pairs.cycle().take(COUNT).map(one).collect()
}
