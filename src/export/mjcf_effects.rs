//! Effects that MJCF can hold beside the plain laws: springs that bear from some place on, cables to the room, and friction that
//! differs along two directions of the table.

use nalgebra::{Point3, Vector3};

use super::scene::{PartId, Scene};
use super::xml::{Element, number, numbers, vector};
use crate::twin::{Effect, Model};

/// How far away the far end of a cable is taken to be that pulls in one direction wherever the thing is, m.
const FAR: f64 = 100.0;
/// An end that no joint comes to, rad or m.
const NEVER: f64 = 1e3;
/// Least share of the mean friction that is left in any direction.
const LEAST: f64 = 0.05;

/// What of an effect MJCF says.
pub(super) enum Said {
    Stop(Stop),
    Tether(Tether),
    /// Friction along the world's x and y axes over the mean.
    Friction([f64; 2]),
}

impl Said {
    /// What it says only in part.
    pub(super) fn approximate(&self) -> Option<&'static str> {
        match self {
            Self::Friction(_) => Some(
                "contacts with the table have what lies along the world's axes (ac), not what is skew to them (as)",
            ),
            _ => None,
        }
    }
}

/// A spring of a joint that bears beyond one place.
pub(super) struct Stop {
    motion: String,
    /// Between these it is slack, rad or m.
    slack: [f64; 2],
    /// N·m/rad or N/m.
    stiffness: f64,
}

/// A cable from a thing on the table to a place of the room.
pub(super) struct Tether {
    part: PartId,
    /// World.
    anchor: Point3<f64>,
    /// Up to this length it is slack, m.
    slack: f64,
    /// N/m.
    stiffness: f64,
}

/// What MJCF says of each effect of the twin, in the same order.
pub(super) fn said(scene: &Scene, model: &Model) -> Vec<Option<Said>> {
    let effects = model.twin.effects.iter();
    effects.map(|effect| of_effect(scene, model, effect)).collect()
}

fn of_effect(scene: &Scene, model: &Model, effect: &Effect) -> Option<Said> {
    match effect.cause.as_str() {
        "limit-compliance" => stop(scene, model, effect).map(Said::Stop),
        "tether" => tether(scene, effect).map(Said::Tether),
        "anisotropic-friction" => along_axes(scene, effect).map(Said::Friction),
        _ => None,
    }
}

fn value(effect: &Effect, name: &str) -> Option<f64> {
    effect.parameters.get(name).map(|e| e.value).filter(|v| v.is_finite())
}

/// The spring lies toward the end of the travel that is nearer to where it begins. Beside a spring of the whole way, which may
/// stand in for it, there is none.
fn stop(scene: &Scene, model: &Model, effect: &Effect) -> Option<Stop> {
    let joint = model.twin.joints().find(|j| j.name == effect.place)?;
    let hold = scene
        .parts()
        .filter_map(|(_, p)| p.hold())
        .find(|h| h.joint == joint.name)?;
    let [motion] = hold.motions.as_slice() else { return None };
    let (stiffness, from) = (value(effect, "k")?, value(effect, "q_limit")?);
    let [low, high] = joint.travelled?;
    if stiffness <= 0.0 || motion.stiffness > 0.0 {
        return None;
    }
    let above = from > 0.5 * (low + high);
    Some(Stop {
        motion: motion.name.clone(),
        slack: if above { [-NEVER, from] } else { [from, NEVER] },
        stiffness,
    })
}

/// Axes of the table's plane as the diagnosis has them: the world's where it is level.
fn plane(scene: &Scene) -> Option<[Vector3<f64>; 3]> {
    let normal = scene.floor.as_ref()?.normal.into_inner();
    let first = (Vector3::x() - normal * normal.x)
        .try_normalize(1e-3)
        .unwrap_or_else(Vector3::y);
    Some([first, normal.cross(&first), normal])
}

/// What the cable holds is the thing it was seen at, or the only one that is free.
fn tether(scene: &Scene, effect: &Effect) -> Option<Tether> {
    let [first, second, normal] = plane(scene)?;
    let free = || {
        let mut trees = scene.trees.iter().enumerate().filter(|(_, t)| !t.anchored);
        let (tree, _) = trees.next()?;
        trees.next().is_none().then_some(PartId { tree, part: 0 })
    };
    let part = scene.find(&effect.place).or_else(free)?;
    let held = scene.part(part);
    let at = held.world_from_part * Point3::from(held.com);
    let above = normal * normal.dot(&at.coords);
    let stiffness = value(effect, "k").filter(|k| *k > 0.0)?;
    let (anchor, slack) = match (value(effect, "px"), value(effect, "direction")) {
        (Some(x), _) => (
            first * x + second * value(effect, "py")?,
            value(effect, "L").unwrap_or(0.0),
        ),
        (None, Some(angle)) => {
            // Taut where the thing is farther along the direction than `slack`.
            let way = first * angle.cos() + second * angle.sin();
            let beside = at.coords - normal * normal.dot(&at.coords);
            let across = beside - way * way.dot(&beside);
            (across - way * FAR, FAR + value(effect, "slack")?)
        }
        _ => return None,
    };
    Some(Tether {
        part,
        anchor: Point3::from(anchor + above),
        slack,
        stiffness,
    })
}

/// Friction of the table along the world's axes, `1 ± ac`: the frame of a contact with a level plane has them (MuJoCo's documentation,
/// "Contact": the first tangent is the world's y axis, or its projection). What is skew to them (`as`) a contact cannot say.
fn along_axes(scene: &Scene, effect: &Effect) -> Option<[f64; 2]> {
    let level = plane(scene)?[2].z > 0.999;
    let of_table = level && effect.place == "support";
    let along = value(effect, "ac")
        .filter(|_| of_table)?
        .clamp(LEAST - 1.0, 1.0 - LEAST);
    Some([1.0 + along, 1.0 - along])
}

/// Sites of a part that a cable is tied to.
pub(super) fn sites(scene: &Scene, said: &[Option<Said>], name: &str) -> Vec<Element> {
    let tethers = tethers(said).filter(|(_, t)| scene.part(t.part).name == name);
    tethers
        .map(|(k, t)| site(&format!("tether_{k}_end"), &scene.part(t.part).com))
        .collect()
}

/// Sites of the room that a cable is tied to.
pub(super) fn anchors(said: &[Option<Said>]) -> Vec<Element> {
    tethers(said)
        .map(|(k, t)| site(&format!("tether_{k}_anchor"), &t.anchor.coords))
        .collect()
}

fn site(name: &str, at: &Vector3<f64>) -> Element {
    Element::new("site")
        .with("name", name)
        .with("pos", vector(at))
        .with("size", "0.001")
        .with("group", "3")
}

fn tethers(said: &[Option<Said>]) -> impl Iterator<Item = (usize, &Tether)> {
    said.iter().enumerate().filter_map(|(k, s)| match s {
        Some(Said::Tether(t)) => Some((k, t)),
        _ => None,
    })
}

/// Springs that are slack within a range: of a joint's position, or of a cable's length.
pub(super) fn tendons(said: &[Option<Said>]) -> Element {
    let mut tendon = Element::new("tendon");
    for (k, one) in said.iter().enumerate() {
        match one {
            Some(Said::Stop(stop)) => {
                let joint = Element::new("joint").with("joint", &stop.motion).with("coef", "1");
                tendon.push(
                    Element::new("fixed")
                        .with("name", format!("{}_limit_{k}", stop.motion))
                        .with("stiffness", number(stop.stiffness))
                        .with("springlength", numbers(&stop.slack))
                        .holding(joint),
                );
            }
            Some(Said::Tether(tether)) => {
                let end = |name: &str| Element::new("site").with("site", format!("tether_{k}_{name}"));
                tendon.push(
                    Element::new("spatial")
                        .with("name", format!("tether_{k}"))
                        .with("stiffness", number(tether.stiffness))
                        .with("springlength", numbers(&[0.0, tether.slack]))
                        .holding(end("anchor"))
                        .holding(end("end")),
                );
            }
            _ => {}
        }
    }
    tendon
}

/// Friction of the table along the world's x and y axes over the mean, where one was found.
pub(super) fn shares(said: &[Option<Said>]) -> Option<[f64; 2]> {
    said.iter().flatten().find_map(|s| match s {
        Said::Friction(shares) => Some(*shares),
        _ => None,
    })
}
