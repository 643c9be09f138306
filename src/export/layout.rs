//! Lays a twin out for export: frames on joints, freedoms one by one, defaults filled in and named.

use nalgebra::{Isometry3, Translation3, Unit, Vector3};

use super::ExportNote;
use super::inertial::{DEFAULT_DENSITY, DEFAULT_MASS, DEFAULT_RADIUS, has_volume, inertial_of};
use super::laid::stop_where_it_lay;
use super::names::{Names, sanitised};
use super::scene::{Attachment, Floor, Motion, Part, Scene, Tree, Weld};
use super::standing::stand;
use super::surface::{DEFAULT_FRICTION, Surface, surface_of};
use super::unsayable::{SINKING, unsayable};
use crate::base::{Error, Estimate, Result};
use crate::geometry::Mesh;
use crate::twin::{Body, Joint, JointKind, Link, Model, RelationKind, SUPPORT, WORLD, texture_path};

/// Range of a slide whose ends were never reached and whose travel is unknown, m.
const DEFAULT_TRAVEL: [f64; 2] = [-1.0, 1.0];
/// How far the floor lies beneath things without a shape that hang on the world, m.
const BENEATH: f64 = 1.0;

/// Lays `model` out. Fails where the joints of a body do not make one tree.
pub(super) fn lay_out(model: &Model) -> Result<Scene> {
    let twin = &model.twin;
    let mut scene = Scene {
        name: sanitised(&twin.name),
        gravity: Vector3::from(twin.felt_gravity()),
        floor: None,
        trees: Vec::new(),
        welds: Vec::new(),
        notes: Vec::new(),
    };
    let (mut links, mut joints) = (Names::default(), Names::default());
    for body in &twin.bodies {
        let mut tree = Tree {
            name: sanitised(&body.name),
            parts: Vec::new(),
            anchored: false,
        };
        for (link, joint) in in_tree_order(body)? {
            let part = part_of(model, link, joint, &tree, (&mut links, &mut joints));
            tree.parts.push(part);
        }
        tree.anchored = body.links.first().is_some_and(|l| l.name == WORLD);
        scene.trees.push(tree);
    }
    name_trees(&mut scene.trees);
    scene.floor = floor_of(model, &scene.trees, &mut scene.notes);
    stop_where_it_lay(&mut scene, model);
    tie(&mut scene, model);
    stand(&mut scene, model);
    note_defaults(&mut scene);
    scene.notes.extend(unsayable(&scene, model));
    Ok(scene)
}

fn name_trees(trees: &mut [Tree]) {
    let mut names = Names::default();
    for tree in trees {
        tree.name = names.take(&tree.name);
    }
}

/// The links of a body, root first, each with the joint that holds it.
fn in_tree_order(body: &Body) -> Result<Vec<(&Link, Option<&Joint>)>> {
    let fail = |what: String| Error::Failed(format!("body {}: {what}", body.name));
    let holder = |link: &Link| body.joints.iter().find(|j| j.child == link.name);
    let roots: Vec<&Link> = body.links.iter().filter(|l| holder(l).is_none()).collect();
    if roots.len() != 1 {
        return Err(fail(format!("{} roots, a tree has one", roots.len())));
    }
    if body.joints.len() + 1 != body.links.len() {
        return Err(fail(format!(
            "{} joints between {} links do not make a tree",
            body.joints.len(),
            body.links.len()
        )));
    }
    let mut order = vec![(roots[0], None)];
    let mut next = 0;
    while next < order.len() {
        let parent = order[next].0;
        let children = body.links.iter().filter_map(|l| Some((l, holder(l)?)));
        order.extend(
            children
                .filter(|(_, j)| j.parent == parent.name)
                .map(|(l, j)| (l, Some(j))),
        );
        next += 1;
    }
    if order.len() != body.links.len() {
        return Err(fail(
            "a joint names a parent that is no link of it, or the joints run in a circle".into(),
        ));
    }
    Ok(order)
}

fn part_of(model: &Model, link: &Link, joint: Option<&Joint>, tree: &Tree, names: (&mut Names, &mut Names)) -> Part {
    let mesh = link.mesh.as_ref().and_then(|path| model.meshes.get(path));
    let textured = link.mesh.as_ref().filter(|path| model.textures.contains_key(*path));
    let inertial = inertial_of(link, mesh);
    let world_from_part = part_frame(link, joint);
    let link_origin = world_from_part
        .inverse_transform_point(&link.pose.translation.vector.into())
        .coords;
    let gravity = Vector3::from(model.twin.gravity).norm();
    Part {
        name: names.0.take(&link.name),
        link: link.name.clone(),
        world_from_part,
        link_origin,
        mass: inertial.mass,
        com: inertial.com + link_origin,
        inertia: inertial.inertia,
        assumed: inertial.assumed,
        visual: mesh.and(link.mesh.clone()),
        texture: textured.map(|path| texture_path(path)),
        flat: mesh.is_some_and(|m| !has_volume(m)),
        hulls: solid_paths(model, link),
        color: mean_color(mesh),
        surface: Surface {
            sinks: sinks(model),
            ..surface_of(link, inertial.mass, gravity)
        },
        attachment: joint.and_then(|j| attachment(j, tree, &world_from_part, names.1)),
    }
}

/// How far the support gives, m/N.
fn sinks(model: &Model) -> Option<f64> {
    let mut effects = model.twin.effects.iter();
    let found = effects.find(|e| e.cause == SINKING)?;
    Some(found.parameters.get("compliance")?.value).filter(|c| *c > 0.0)
}

/// The convex parts; a mesh without any stands for itself, and simulators take its hull. What is flat is left
/// out: no simulator can use it, and some refuse the whole file.
fn solid_paths(model: &Model, link: &Link) -> Vec<String> {
    let known = |path: &&String| model.meshes.get(*path).is_some_and(has_volume);
    if link.collision.is_empty() {
        return link.mesh.iter().filter(known).cloned().collect();
    }
    link.collision.iter().filter(known).cloned().collect()
}

fn mean_color(mesh: Option<&Mesh>) -> [f64; 3] {
    let colors = mesh.map_or(&[][..], |m| &m.colors);
    let count = colors.len() as f64;
    if colors.is_empty() {
        return [0.7; 3];
    }
    std::array::from_fn(|k| {
        let mean = colors.iter().map(|c| f64::from(c[k])).sum::<f64>() / count / 255.0;
        (mean * 1e4).round() / 1e4
    })
}

/// World-from-part at the first view; see the module `scene` for the choice of the origin.
fn part_frame(link: &Link, joint: Option<&Joint>) -> Isometry3<f64> {
    let turns = |k: JointKind| !matches!(k, JointKind::Fixed | JointKind::Prismatic);
    match joint.filter(|j| turns(j.kind)) {
        Some(j) => Isometry3::from_parts(Translation3::from(j.origin.value), link.pose.rotation),
        None => link.pose.0,
    }
}

fn attachment(joint: &Joint, tree: &Tree, frame: &Isometry3<f64>, names: &mut Names) -> Option<Attachment> {
    let parent = tree.parts.iter().position(|p| p.link == joint.parent)?;
    let name = names.take(&joint.name);
    let motions = motions_of(joint, &name, frame);
    Some(Attachment {
        parent,
        name,
        joint: joint.name.clone(),
        kind: joint.kind,
        parent_from_part: tree.parts[parent].world_from_part.inverse() * frame,
        motions,
        axis: Unit::new_normalize(frame.inverse_transform_vector(&Vector3::from(joint.axis.value))),
        pitch: joint.pitch.as_ref().map_or(0.0, |p| p.value),
        follows: joint
            .effects
            .coupling
            .as_ref()
            .map(|c| (c.leader.clone(), c.ratio.value)),
    })
}

/// The freedoms of a joint as single turns and slides; of a screw only the turn.
fn motions_of(joint: &Joint, name: &str, frame: &Isometry3<f64>) -> Vec<Motion> {
    let axis = frame.inverse_transform_vector(&Vector3::from(joint.axis.value));
    let axis = Unit::new_normalize(axis);
    let across = Unit::new_normalize(any_perpendicular(&axis));
    let third = Unit::new_normalize(axis.cross(&across));
    let list: Vec<(bool, Unit<Vector3<f64>>)> = match joint.kind {
        JointKind::Fixed => Vec::new(),
        JointKind::Revolute | JointKind::Screw => vec![(true, axis)],
        JointKind::Prismatic => vec![(false, axis)],
        JointKind::Cylindrical => vec![(false, axis), (true, axis)],
        JointKind::Planar => vec![(false, across), (false, third), (true, axis)],
        JointKind::Spherical => vec![(true, axis), (true, across), (true, third)],
    };
    let single = list.len() == 1;
    let numbered = |i: usize| {
        if single {
            name.to_string()
        } else {
            format!("{name}_{}", i + 1)
        }
    };
    list.into_iter()
        .enumerate()
        .map(|(i, (turns, axis))| motion(joint, numbered(i), turns, axis))
        .collect()
}

fn motion(joint: &Joint, name: String, turns: bool, axis: Unit<Vector3<f64>>) -> Motion {
    let value = |e: &Option<Estimate>| {
        let mine = e.as_ref().filter(|e| speaks_of_turning(&e.unit) == turns);
        mine.map_or(0.0, |e| e.value)
    };
    let start = joint.position.as_ref().map_or(0.0, |p| p.value);
    let measured = joint.limits.as_ref().filter(|l| l.unit.contains("rad") == turns);
    let range = measured.map(|l| l.value.map(|v| v - start)).map(ordered);
    let travelled = joint.travelled.map(|t| widened(ordered(t.map(|v| v - start))));
    Motion {
        name,
        turns,
        axis,
        range,
        lay: false,
        stated_range: range.or(travelled).unwrap_or(DEFAULT_TRAVEL),
        friction: value(&joint.friction),
        damping: value(&joint.damping),
        stiffness: value(&joint.stiffness),
        rest: joint.rest.as_ref().map_or(0.0, |r| r.value - start),
    }
}

/// The links below each of `count` single freedoms: carriers of no account, then the child.
pub(super) fn of_carriers(child: &str, count: usize) -> Vec<String> {
    let name = |i: usize| {
        if i == count {
            child.to_string()
        } else {
            format!("{child}_carrier_{i}")
        }
    };
    (1..=count).map(name).collect()
}

/// Whether a unit of friction, damping or stiffness belongs to a turn: `N·m`, `N·m·s/rad`, `N·m/rad`.
fn speaks_of_turning(unit: &str) -> bool {
    unit.contains("rad") || unit.starts_with("N·m") || unit.starts_with("N*m") || unit.starts_with("Nm")
}

/// Low before high, a hair apart at least: some simulators read an empty range as no range.
fn ordered([a, b]: [f64; 2]) -> [f64; 2] {
    let (low, high) = (a.min(b), a.max(b));
    [low, high.max(low + 1e-6)]
}

/// Half the travel more at either end, and 5 cm at least.
fn widened([low, high]: [f64; 2]) -> [f64; 2] {
    let margin = (0.5 * (high - low)).max(0.05);
    [low - margin, high + margin]
}

fn any_perpendicular(axis: &Vector3<f64>) -> Vector3<f64> {
    let least = axis.iamin();
    let mut other = Vector3::zeros();
    other[least] = 1.0;
    axis.cross(&other)
}

fn floor_of(model: &Model, trees: &[Tree], notes: &mut Vec<ExportNote>) -> Option<Floor> {
    if let Some(s) = &model.twin.support {
        let normal = Unit::new_normalize(Vector3::from(s.normal));
        let point = Vector3::from(s.point);
        return Some(Floor { point, normal });
    }
    let up = Unit::try_new(-Vector3::from(model.twin.gravity), 1e-9)?;
    let points = model.twin.links().flat_map(|(_, link)| {
        let mesh = link.mesh.as_ref().and_then(|p| model.meshes.get(p));
        mesh.into_iter()
            .flat_map(|m| m.vertices.iter())
            .map(|v| (link.pose.0 * v).coords)
    });
    let hung = !trees.is_empty() && trees.iter().all(|t| t.anchored);
    let links = || {
        model
            .twin
            .links()
            .map(|(_, link)| link.pose.translation.vector - up.scale(BENEATH))
    };
    let lower = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&up).total_cmp(&b.dot(&up));
    // What has no shape and hangs on the world needs no table, only one that is out of its way.
    let lowest = points
        .min_by(lower)
        .or_else(|| links().filter(|_| hung).min_by(lower))?;
    notes.push(ExportNote::new(
        "all",
        SUPPORT,
        "assumed: no table was given or seen; a level one under the lowest point",
    ));
    Some(Floor {
        point: lowest,
        normal: up,
    })
}

/// Relations `fixed`: to the support they hold a tree, between two trees they weld parts.
fn tie(scene: &mut Scene, model: &Model) {
    for relation in model.twin.relations.iter().filter(|r| r.kind == RelationKind::Fixed) {
        let ends = [&relation.a, &relation.b].map(|name| (name == SUPPORT, scene.find(name)));
        match ends {
            [(true, _), (_, Some(held))] | [(_, Some(held)), (true, _)] => scene.trees[held.tree].anchored = true,
            [(_, Some(a)), (_, Some(b))] if a.tree != b.tree => scene.welds.push(Weld {
                ends: [a, b],
                breakaway: relation.breakaway.as_ref().map(|b| b.value),
            }),
            _ => {}
        }
    }
}

fn note_defaults(scene: &mut Scene) {
    let mut notes = Vec::new();
    for (_, part) in scene.parts() {
        if !part.assumed.is_empty() {
            let basis = match part.visual {
                Some(_) => format!("default: mesh filled with {DEFAULT_DENSITY} kg/m3"),
                None => format!("default: a ball of {DEFAULT_MASS} kg and {DEFAULT_RADIUS} m radius"),
            };
            notes.push(ExportNote::new(
                "all",
                &part.link,
                format!("assumed: {} ({basis})", part.assumed.join(", ")),
            ));
        }
        if part.surface.assumed {
            let words = format!("assumed: coefficient of friction {DEFAULT_FRICTION}");
            notes.push(ExportNote::new("all", &part.link, words));
        }
        if part.is_bare() {
            notes.push(ExportNote::new("all", &part.link, "no solid shape: it touches nothing"));
        }
    }
    scene.notes.extend(notes);
}
