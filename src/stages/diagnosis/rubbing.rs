//! Whose friction a push feels.

use super::predict::Scene;
use crate::capture::PhaseKind;
use crate::physics::riders;
use crate::stages::estimation::{Company, company, first_rest, start_poses};
use crate::twin::{Link, Relation, RelationKind};

/// What rubs on the table where something is pushed.
pub struct Rubbing {
    /// By name; one that carries what is weighed, as it is itself, goes by its own.
    pub whose: String,
    /// Weight of what goes by that name, N.
    pub load: f64,
    /// What the table bears over that: more than 1 with something known on it.
    pub laden: f64,
}

/// What rubs where `link` is pushed: with what moves along as one with it friction is another, unless all that rides on it is weighed.
/// Nothing where something is shoved out of the way, or only on part of it.
pub fn rubbing(scene: &Scene, link: &Link, gravity: f64) -> Option<Rubbing> {
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
    let (own, more) = (weight(link), carried.clone().map(weight).sum::<f64>());
    let told = |link: &Link| link.mass.as_ref().is_some_and(|m| m.is_told());
    let on_it = riding(scene, &link.name);
    if told(link) && carried.clone().all(told) && others.iter().all(|o| on_it.contains(o)) {
        return Some(Rubbing {
            whose: link.name.clone(),
            load: own,
            laden: 1.0 + more / own,
        });
    }
    let mut whose = link.name.clone();
    for other in &others {
        whose = format!("{whose} with {other}");
    }
    Some(Rubbing {
        whose,
        load: own + more,
        laden: 1.0,
    })
}

/// What rides on it where the interaction begins.
fn riding(scene: &Scene, name: &str) -> Vec<String> {
    let rest = first_rest(scene.interaction, scene.segmented);
    riders(
        scene.model,
        name,
        &start_poses(scene.capture, scene.interaction, rest, scene.model),
    )
}

/// What a single body shoved along that does not belong to it: what that adds to the force is not foretold.
pub fn shoved_along(scene: &Scene, name: &str) -> Option<String> {
    let twin = &scene.model.twin;
    twin.body_of(name).filter(|b| b.links.len() == 1)?;
    if companions(scene, name) == Company::Alone {
        return None;
    }
    let on_it = riding(scene, name);
    let apart = |other: &&String| {
        let between = |r: &&Relation| (r.a == name && r.b == **other) || (r.b == name && r.a == **other);
        let relation = twin.relations.iter().find(between);
        !on_it.contains(other) && relation.is_none_or(|r| r.kind == RelationKind::Separate)
    };
    let moving = scene.segmented?.of(PhaseKind::Slide).flat_map(|p| &p.moving);
    moving.filter(|n| *n != name).find(apart).cloned()
}

fn companions(scene: &Scene, name: &str) -> Company {
    let of = |cut| company(scene.interaction, cut, name, &scene.model.twin);
    scene.segmented.map_or(Company::Alone, of)
}
