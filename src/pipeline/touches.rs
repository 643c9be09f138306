//! The default set of touches: what tells of mass and friction, for everything that was seen.

use nalgebra::{Point3, Vector3};

use crate::capture::{Kind, RigDescription, Touch};
use crate::stages::shape::{ShapedObject, Shapes};

/// How high a thing is lifted, m, how fast, m/s, and how long it is held, s.
const LIFT: [f64; 3] = [0.02, 0.05, 1.0];
/// How far and how fast a thing is pushed, m and m/s; the second push is quicker and is kept for checking.
const PUSH: [[f64; 2]; 2] = [[0.03, 0.03], [0.03, 0.05]];
/// Height of a push above the support over the height of the thing: low, so that it slides and does not topple.
const HEIGHT: f64 = 0.35;
/// Gap to the support from which a thing stands on something else, m.
const STANDS: f64 = 0.008;
/// Directions of a push that are compared.
const DIRECTIONS: usize = 8;

/// A thing as a box in the world.
struct Thing<'a> {
    name: &'a str,
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Thing<'_> {
    fn of(object: &ShapedObject) -> Option<Thing<'_>> {
        let (low, high) = object.mesh.transformed(&object.world_from_link.0).bounds()?;
        Some(Thing {
            name: &object.name,
            low,
            high,
        })
    }

    fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    fn radius(&self) -> f64 {
        0.5 * (self.high - self.low).xy().norm()
    }
}

/// One lift and two pushes for each thing, as far as the rig offers them, each with its reason.
pub(super) fn default_touches(shapes: &Shapes, said: &RigDescription) -> Vec<(Touch, String)> {
    let things: Vec<Thing> = shapes.objects.iter().filter_map(Thing::of).collect();
    let floor = shapes.support.as_ref().map(|s| s.point[2]);
    let mut touches = Vec::new();
    for thing in &things {
        if said.touches.contains(&Kind::Lift) {
            touches.push((lift(thing), "a lift weighs it: mass without friction".to_owned()));
        }
        let stands = floor.is_none_or(|floor| thing.low.z - floor < STANDS);
        if said.touches.contains(&Kind::Push) && stands {
            touches.extend(pushes(thing, &things));
        }
    }
    touches
}

fn touch(thing: &Thing, kind: Kind, label: &str) -> Touch {
    Touch {
        name: format!("{label}-{}", thing.name.replace('/', "-")),
        kind,
        target: Some(thing.name.to_owned()),
        start: thing.middle(),
        direction: Vector3::z(),
        travel: 0.0,
        speed: 0.0,
        duration: 0.0,
        held_out: false,
    }
}

fn lift(thing: &Thing) -> Touch {
    let middle = thing.middle();
    let [travel, speed, duration] = LIFT;
    Touch {
        start: Point3::new(middle.x, middle.y, thing.high.z),
        travel,
        speed,
        duration,
        ..touch(thing, Kind::Lift, "lift")
    }
}

/// Two pushes through the middle: along the free-est way, and across or back, kept for checking.
fn pushes(thing: &Thing, things: &[Thing]) -> Vec<(Touch, String)> {
    let mut ways: Vec<(f64, Vector3<f64>)> = (0..DIRECTIONS)
        .map(|k| {
            let (s, c) = (std::f64::consts::TAU * k as f64 / DIRECTIONS as f64).sin_cos();
            let way = Vector3::new(c, s, 0.0);
            (clearance(thing, things, &way), way)
        })
        .collect();
    ways.sort_by(|a, b| b.0.total_cmp(&a.0));
    let Some(first) = ways.first().copied() else {
        return Vec::new();
    };
    let second = ways
        .iter()
        .find(|(_, way)| way.dot(&first.1).abs() < 0.1)
        .copied()
        .unwrap_or(first);
    let mut out = Vec::new();
    for (k, ((free, way), [travel, speed])) in [first, second].into_iter().zip(PUSH).enumerate() {
        let middle = thing.middle();
        let height = thing.low.z + HEIGHT * (thing.high.z - thing.low.z);
        let edge = way.component_mul(&((thing.high - thing.low) * 0.5)).norm();
        let start = Point3::new(middle.x, middle.y, height) - way * edge;
        let why = match k {
            0 => format!("a slow push tells of its friction; this way the next thing is {free:.2} m off"),
            _ => "a push across, kept for checking what the first one told".to_owned(),
        };
        let asked = Touch {
            start,
            direction: way,
            travel,
            speed,
            duration: 0.3,
            held_out: k == 1,
            ..touch(thing, Kind::Push, if k == 0 { "push" } else { "push-across" })
        };
        out.push((asked, why));
    }
    out
}

/// Room along a way ahead of a thing, and behind it for the tool, m.
fn clearance(thing: &Thing, things: &[Thing], way: &Vector3<f64>) -> f64 {
    let room = |other: &Thing| {
        let off = (other.middle() - thing.middle()).xy();
        let along = off.x * way.x + off.y * way.y;
        let aside = (off.norm_squared() - along * along).max(0.0).sqrt();
        let gap = other.radius() + thing.radius();
        if aside > gap {
            return 1.0;
        }
        // Behind, only the tool must fit.
        if along > 0.0 { along - gap } else { -along - gap + 0.02 }
    };
    let others = things.iter().filter(|o| !std::ptr::eq(*o, thing));
    others.map(room).fold(1.0, f64::min)
}
