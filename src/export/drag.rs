//! What a model that somebody wrote drags by on the table: its coefficients times what stands on them.

use super::adopt::{GRAVITY, Trust};
use crate::base::Estimate;
use crate::twin::{Body, Link, Lump, Model, lumped};

/// What is this far above the table or less stands on it, m.
const STANDS: f64 = 2e-3;

/// Writes the force of friction of all that stands on the table (z = 0): of what is held fast to each other with the
/// member that is lowest; what joints carry clear of the table weighs on what carries it.
pub(super) fn drag(model: &mut Model, trust: Trust) {
    let lumps = lumped(model, |_| 0);
    for body in &lumps.model.twin.bodies {
        let standing: Vec<&Link> = body.links.iter().filter(|l| stands(l, &lumps.model)).collect();
        for link in &standing {
            let hung = body
                .links
                .iter()
                .filter(|l| carrier(l, body, &standing) == Some(link.name.as_str()));
            let mass: f64 = hung.filter_map(|l| Some(l.mass.as_ref()?.value)).sum();
            let Some(lump) = lumps.of(&link.name).filter(|_| mass > 0.0) else {
                continue;
            };
            let force = |mu: &Option<Estimate>| mu.as_ref().map(|mu| trust.estimate(mu.value * mass * GRAVITY, "N"));
            let forces = (force(&link.friction.static_), force(&link.friction.kinetic));
            if let Some(link) = lowest(lump, model).and_then(|name| model.twin.link_mut(&name)) {
                (link.friction_force.static_, link.friction_force.kinetic) = forces;
            }
        }
    }
}

/// Height of the lowest point, m.
fn height(link: &Link, model: &Model) -> f64 {
    let vertices = link
        .mesh
        .iter()
        .filter_map(|p| model.meshes.get(p))
        .flat_map(|m| &m.vertices);
    vertices.map(|v| (link.pose.0 * v).z).fold(f64::INFINITY, f64::min)
}

/// A root without any shape stands where it is.
fn stands(link: &Link, model: &Model) -> bool {
    let shapeless = model.meshes.is_empty() && model.twin.bodies.iter().any(|b| b.links[0].name == link.name);
    shapeless || height(link, model) < STANDS
}

fn lowest(lump: &Lump, model: &Model) -> Option<String> {
    let links = lump.members.iter().filter_map(|(name, _)| model.twin.link(name));
    let by_height = links.min_by(|a, b| height(a, model).total_cmp(&height(b, model)));
    by_height.map(|l| l.name.clone())
}

/// What bears the weight of a link: itself where it stands, else the nearest that stands of those that joints lead to,
/// towards the root first.
fn carrier<'a>(link: &Link, body: &Body, standing: &[&'a Link]) -> Option<&'a str> {
    let mut seen = vec![link.name.as_str()];
    let mut at = 0;
    while at < seen.len() {
        if let Some(found) = standing.iter().find(|s| s.name == seen[at]) {
            return Some(&found.name);
        }
        let here = seen[at];
        let up = body
            .joints
            .iter()
            .filter(|j| j.child == here)
            .map(|j| j.parent.as_str());
        let down = body
            .joints
            .iter()
            .filter(|j| j.parent == here)
            .map(|j| j.child.as_str());
        let next: Vec<&str> = up.chain(down).filter(|n| !seen.contains(n)).collect();
        seen.extend(next);
        at += 1;
    }
    None
}
