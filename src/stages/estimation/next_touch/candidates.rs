//! The pool of touches among which the next one is chosen: what the rig can do and what keeps a thing upright.

use std::f64::consts::TAU;

use nalgebra::{Point2, Point3, Vector2, Vector3};

use super::belief::Belief;
use super::thing::{Thing, clearance};
use crate::capture::Kind;

/// A touch that could be done to one thing. Plane frame.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub thing: usize,
    pub kind: Kind,
    pub start: Point3<f64>,
    pub direction: Vector3<f64>,
    pub travel: f64,
    pub speed: f64,
    pub duration: f64,
    pub way: Way,
    /// Tells apart what was tried or refused.
    pub key: String,
    /// What it is, in words.
    pub words: String,
}

/// How a touch tells, with what its forward model needs.
#[derive(Clone, Debug)]
pub(super) enum Way {
    Lift,
    /// Where the tool meets the outline, the outline's normal there, the direction of the tool.
    Push {
        point: Point2<f64>,
        outward: Vector2<f64>,
        way: Vector2<f64>,
    },
    /// A fast push that lets go.
    Coast,
    Tilt,
}

/// How high a thing is lifted, m, how fast, m/s, and how long it is held, s.
const LIFT: [f64; 3] = [0.02, 0.05, 1.0];
/// Travel and speed of a slow push, m and m/s.
const PUSH: [f64; 2] = [0.03, 0.03];
/// Travel and speed of a push that lets the thing coast, m and m/s.
const COAST: [f64; 2] = [0.06, 0.5];
/// Room that a coasting thing needs beyond the push, m.
const ROOM: f64 = 0.12;
/// Limit and rate of a tilt, rad and rad/s.
const TILT: [f64; 2] = [0.7, 0.1];
/// Directions of a push that are compared, and how far off the middle it goes, as shares of half the width.
pub(super) const DIRECTIONS: usize = 8;
const ASIDE: [f64; 3] = [0.0, -0.5, 0.5];
/// Least height of a tool above the support, m.
pub(super) const LOWEST: f64 = 0.010;
/// Height of a push over that of the thing at most, and share of the height at which it would topple.
pub(super) const HEIGHT: f64 = 0.35;
const UPRIGHT: f64 = 0.6;
/// Gap to the support from which a thing stands on something else, m.
const STANDS: f64 = 0.008;

/// All touches of the rig's `kinds` that suit the things; `floor` is the height of the support.
pub(super) fn pool(things: &[Thing], beliefs: &[Belief], kinds: &[Kind], floor: Option<f64>) -> Vec<Candidate> {
    let mut found = Vec::new();
    let upright = |k: usize| stable(&things[k], &beliefs[k]);
    let tiltable = kinds.contains(&Kind::Tilt) && (0..things.len()).all(upright);
    for (k, thing) in things.iter().enumerate() {
        if kinds.contains(&Kind::Lift) {
            found.push(lift(k, thing));
        }
        let stands = floor.is_none_or(|floor| thing.low.z - floor < STANDS);
        if stands && kinds.contains(&Kind::Push) {
            pushes(k, things, &beliefs[k], &mut found);
        }
        if stands && tiltable {
            found.extend(tilts(k, thing));
        }
    }
    found
}

/// Kinetic friction that is not exceeded in 97 of 100 cases.
fn most_friction(belief: &Belief) -> f64 {
    (belief.mean[1] + 2.0 * Belief::doubts(&belief.information)[1]).exp()
}

/// Whether it slides before it topples, whichever way the support tilts.
fn stable(thing: &Thing, belief: &Belief) -> bool {
    let centre = Belief::centre(&belief.mean);
    let slip = most_friction(belief) * 0.5 * thing.height();
    (0..DIRECTIONS).all(|d| thing.lever(&centre, &heading(d)) > slip)
}

pub(super) fn heading(d: usize) -> Vector2<f64> {
    let (s, c) = (TAU * d as f64 / DIRECTIONS as f64).sin_cos();
    Vector2::new(c, s)
}

fn lift(k: usize, thing: &Thing) -> Candidate {
    let middle = thing.middle();
    let [travel, speed, duration] = LIFT;
    Candidate {
        thing: k,
        kind: Kind::Lift,
        start: Point3::new(middle.x, middle.y, thing.high.z),
        direction: Vector3::z(),
        travel,
        speed,
        duration,
        way: Way::Lift,
        key: format!("lift {}", thing.name),
        words: "a lift".into(),
    }
}

fn tilts(k: usize, thing: &Thing) -> [Candidate; 2] {
    let [travel, speed] = TILT;
    [Vector3::y(), Vector3::x()].map(|axis| Candidate {
        thing: k,
        kind: Kind::Tilt,
        start: Point3::new(thing.middle().x, thing.middle().y, thing.low.z),
        direction: axis,
        travel,
        speed,
        duration: 0.0,
        way: Way::Tilt,
        key: format!("tilt {} {:.0}", thing.name, axis.x),
        words: "a tilt until it slides".into(),
    })
}

fn pushes(k: usize, things: &[Thing], belief: &Belief, found: &mut Vec<Candidate>) {
    let thing = &things[k];
    let centre = Belief::centre(&belief.mean);
    let friction = most_friction(belief);
    for d in 0..DIRECTIONS {
        let way = heading(d);
        let free = clearance(thing, things, &way);
        if free < PUSH[0] + 0.01 {
            continue;
        }
        let topples = thing.lever(&centre, &way) / friction;
        let up = (HEIGHT * thing.height()).min(UPRIGHT * topples);
        if up < LOWEST {
            continue;
        }
        let z = thing.low.z + up;
        let Some(outline) = thing.outline(z) else { continue };
        for aside in ASIDE {
            let Some(met) = thing.meet(&outline, &way, aside) else {
                continue;
            };
            // Nearly along the face, the tool would only graze.
            if met.outward.dot(&way) > -0.5 {
                continue;
            }
            let side = match aside {
                a if a < 0.0 => " off the middle to the right",
                a if a > 0.0 => " off the middle to the left",
                _ => "",
            };
            let degrees = 360 * d / DIRECTIONS;
            let slow = Candidate {
                thing: k,
                kind: Kind::Push,
                start: Point3::new(met.point.x, met.point.y, z),
                direction: Vector3::new(way.x, way.y, 0.0),
                travel: PUSH[0],
                speed: PUSH[1],
                duration: 0.3,
                way: Way::Push {
                    point: met.point,
                    outward: met.outward,
                    way,
                },
                key: format!("push {} {degrees} {aside}", thing.name),
                words: format!("a slow push towards {degrees} degrees{side}"),
            };
            if aside == 0.0 && free > COAST[0] + ROOM && up < 0.5 * UPRIGHT * topples {
                found.push(Candidate {
                    travel: COAST[0],
                    speed: COAST[1],
                    way: Way::Coast,
                    key: format!("coast {} {degrees}", thing.name),
                    words: format!("a fast push towards {degrees} degrees that lets it coast"),
                    ..slow.clone()
                });
            }
            found.push(slow);
        }
    }
}
