//! Whose friction a push feels.

use super::predict::Scene;
use crate::capture::PhaseKind;
use crate::stages::estimation::{Company, company};
use crate::twin::{Link, Relation, RelationKind};

/// What rubs where `link` is pushed, by name, and its weight, N: with what moves along as one with it friction is
/// another. Nothing where something is shoved out of the way, or only on part of it.
pub fn rubbing(scene: &Scene, link: &Link, gravity: f64) -> Option<(String, f64)> {
    let others = match companions(scene, &link.name) {
        Company::Alone => Vec::new(),
        Company::Rigid(others) => others,
        Company::Jointed => return None,
    };
    let weight = |link: &Link| {
        link.mass.as_ref().filter(|m| m.is_told()).map_or_else(
            || link.friction_force.kinetic.as_ref().map_or(1.0, |f| f.value) / 0.35,
            |m| m.value * gravity,
        )
    };
    let carried = others.iter().filter_map(|name| scene.model.twin.link(name));
    let load = weight(link) + carried.map(weight).sum::<f64>();
    let mut name = link.name.clone();
    for other in &others {
        name = format!("{name} with {other}");
    }
    Some((name, load))
}

/// What a single body shoved along that does not belong to it: what that adds to the force is not foretold.
pub fn shoved_along(scene: &Scene, name: &str) -> Option<String> {
    let twin = &scene.model.twin;
    twin.body_of(name).filter(|b| b.links.len() == 1)?;
    if companions(scene, name) == Company::Alone {
        return None;
    }
    let apart = |other: &&String| {
        let between = |r: &&Relation| (r.a == name && r.b == **other) || (r.b == name && r.a == **other);
        let relation = twin.relations.iter().find(between);
        relation.is_none_or(|r| r.kind == RelationKind::Separate)
    };
    let moving = scene.segmented?.of(PhaseKind::Slide).flat_map(|p| &p.moving);
    moving.filter(|n| *n != name).find(apart).cloned()
}

fn companions(scene: &Scene, name: &str) -> Company {
    let of = |cut| company(scene.interaction, cut, name, &scene.model.twin);
    scene.segmented.map_or(Company::Alone, of)
}
