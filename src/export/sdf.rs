//! SDFormat: a world with its gravity, its table, and a model for all that is held together.
//!
//! Every model stands at the world's origin, so a link's pose is its pose in the world. Links of joints with more
//! than one freedom hang on carriers of a milligram, as in URDF. Bodies that are glued to each other are one model
//! with a fixed joint: a joint between models is not read by every loader. The table is a slab, as in URDF, and no
//! unbounded plane: Drake 1.51 crashes on one that stands before some fifty colliders.

use nalgebra::Isometry3;

use super::doubts::{self, Doubt};
use super::inertial::six;
use super::layout::of_carriers;
use super::scene::{Attachment, Motion, Part, Scene};
use super::urdf::{CARRIER, TABLE, TABLE_SIZE, roll_pitch_yaw, upright_to};
use super::xml::{Element, number, numbers, vector};
use crate::twin::{JointKind, Model};

/// The file's text.
pub(super) fn of_scene(scene: &Scene, model: &Model) -> String {
    let mut world = Element::new("world").with("name", &scene.name);
    world.push(leaf("gravity", vector(&scene.gravity)));
    if let Some(floor) = &scene.floor {
        let [half, thick] = TABLE_SIZE;
        let turn = upright_to(&floor.normal);
        let place = Isometry3::from_parts(floor.point.into(), turn);
        let slab = || {
            let slab = Element::new("box").holding(leaf("size", numbers(&[2.0 * half, 2.0 * half, 2.0 * thick])));
            Element::new("geometry").holding(slab)
        };
        let below = Isometry3::translation(0.0, 0.0, -thick);
        let shape = |tag: &str| {
            let named = Element::new(tag).with("name", "slab");
            named.holding(pose(&below)).holding(slab())
        };
        let link = Element::new("link")
            .with("name", "top")
            .holding(shape("collision"))
            .holding(shape("visual"));
        let table = Element::new("model")
            .with("name", TABLE)
            .holding(leaf("static", "true"))
            .holding(pose(&place));
        world.push(table.holding(link));
    }
    for group in groups(scene) {
        world.push(one_model(scene, model, &group));
    }
    let mut root = Element::new("sdf").with("version", "1.10");
    root = root.with("xmlns:drake", "http://drake.mit.edu");
    for note in scene.notes_for("sdf") {
        root.comment(format!("{}: {}", note.about, note.message));
    }
    root.holding(world).document()
}

fn leaf(tag: &str, text: impl ToString) -> Element {
    Element::new(tag).saying(text)
}

fn pose(place: &Isometry3<f64>) -> Element {
    let rpy = roll_pitch_yaw(&place.rotation);
    leaf(
        "pose",
        format!("{} {}", vector(&place.translation.vector), vector(&rpy)),
    )
}

/// Trees that are welded together, by index.
fn groups(scene: &Scene) -> Vec<Vec<usize>> {
    let mut group: Vec<usize> = (0..scene.trees.len()).collect();
    for [a, b] in scene.welds.iter().map(|w| w.ends) {
        let (keep, lose) = (group[a.tree], group[b.tree]);
        group.iter_mut().filter(|g| **g == lose).for_each(|g| *g = keep);
    }
    let members = |first: usize| (0..group.len()).filter(|i| group[*i] == first).collect::<Vec<_>>();
    (0..group.len()).map(members).filter(|m| !m.is_empty()).collect()
}

fn one_model(scene: &Scene, twin: &Model, group: &[usize]) -> Element {
    let mut model = Element::new("model").with("name", format!("{}_model", scene.trees[group[0]].name));
    for tree in group.iter().map(|i| &scene.trees[*i]) {
        for part in &tree.parts {
            model.push(link(part, twin));
            if let Some(hold) = part.hold() {
                joints(&mut model, &tree.parts[hold.parent].name, part, hold, (scene, twin));
            }
        }
        if let Some(root) = tree.parts.first().filter(|_| tree.anchored) {
            model.push(joint(&format!("{}_hold", root.name), "fixed", "world", &root.name));
        }
    }
    for [a, b] in scene
        .welds
        .iter()
        .map(|w| w.ends)
        .filter(|[a, _]| group.contains(&a.tree))
    {
        let (a, b) = (&scene.part(a).name, &scene.part(b).name);
        model.push(joint(&format!("{a}_{b}_bond"), "fixed", a, b));
    }
    model
}

fn link(part: &Part, twin: &Model) -> Element {
    let mut link = Element::new("link").with("name", &part.name);
    if !part.assumed.is_empty() {
        link.comment(format!("assumed: {}", part.assumed.join(", ")));
    }
    let said = twin.twin.link(&part.link).map(doubts::of_link).unwrap_or_default();
    said.iter().filter_map(Doubt::comment).for_each(|c| link.comment(c));
    link.push(pose(&part.world_from_part));
    link.push(inertial(part.mass, &part.com, &six(&part.inertia)));
    let offset = Isometry3::translation(part.link_origin.x, part.link_origin.y, part.link_origin.z);
    let shape = |tag: &str, name: String, path: &str| {
        let mesh = Element::new("mesh").holding(leaf("uri", path));
        Element::new(tag)
            .with("name", name)
            .holding(pose(&offset))
            .holding(Element::new("geometry").holding(mesh))
    };
    if let Some(path) = part.visual.as_ref().filter(|_| !part.flat) {
        let [r, g, b] = part.texture.as_ref().map_or(part.color, |_| [1.0; 3]);
        let mut material = Element::new("material").holding(leaf("diffuse", numbers(&[r, g, b, 1.0])));
        if let Some(image) = &part.texture {
            let metal = Element::new("metal").holding(leaf("albedo_map", image));
            let rough = metal.holding(leaf("metalness", "0")).holding(leaf("roughness", "0.8"));
            material.push(Element::new("pbr").holding(rough));
        }
        link.push(shape("visual", format!("{}_visual", part.name), path).holding(material));
    }
    for (k, path) in part.hulls.iter().enumerate() {
        let collision = shape("collision", format!("{}_hull_{k}", part.name), path);
        link.push(collision.holding(surface(part)).holding(proximity(part)));
    }
    link
}

fn inertial(mass: f64, com: &nalgebra::Vector3<f64>, six: &[f64; 6]) -> Element {
    let keys = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
    let inertia = keys
        .iter()
        .zip(six)
        .fold(Element::new("inertia"), |e, (key, v)| e.holding(leaf(key, number(*v))));
    Element::new("inertial")
        .holding(leaf("pose", format!("{} 0 0 0", vector(com))))
        .holding(leaf("mass", number(mass)))
        .holding(inertia)
}

/// Coefficients of a pair are the lesser of the two in ODE; the table says none, and defaults to one.
fn surface(part: &Part) -> Element {
    let s = &part.surface;
    let mu = number(s.kinetic_friction);
    let ode = Element::new("ode").holding(leaf("mu", &mu)).holding(leaf("mu2", &mu));
    let mut bullet = Element::new("bullet").holding(leaf("friction", &mu));
    if let Some(rolling) = s.rolling {
        bullet.push(leaf("rolling_friction", number(rolling)));
    }
    let mut friction = Element::new("friction").holding(ode).holding(bullet);
    if let Some(radius) = s.torsional_radius {
        let torsion = Element::new("torsional")
            .holding(leaf("coefficient", &mu))
            .holding(leaf("use_patch_radius", "true"))
            .holding(leaf("patch_radius", number(1.5 * radius)));
        friction.push(torsion);
    }
    let mut surface = Element::new("surface").holding(friction);
    if let Some(r) = s.restitution {
        surface.push(Element::new("bounce").holding(leaf("restitution_coefficient", number(r))));
    }
    if let Some((stiffness, damping)) = s.compliance {
        let mut ode = Element::new("ode").holding(leaf("kp", number(stiffness)));
        if let Some(damping) = damping {
            ode.push(leaf("kd", number(damping)));
        }
        surface.push(Element::new("contact").holding(ode));
    }
    surface
}

fn proximity(part: &Part) -> Element {
    Element::new("drake:proximity_properties")
        .holding(leaf("drake:mu_static", number(part.surface.static_friction)))
        .holding(leaf("drake:mu_dynamic", number(part.surface.kinetic_friction)))
}

fn joint(name: &str, kind: &str, parent: &str, child: &str) -> Element {
    Element::new("joint")
        .with("name", name)
        .with("type", kind)
        .holding(leaf("parent", parent))
        .holding(leaf("child", child))
}

fn joints(model: &mut Element, parent: &str, part: &Part, hold: &Attachment, (scene, twin): (&Scene, &Model)) {
    if hold.motions.is_empty() {
        model.push(joint(&hold.name, "fixed", parent, &part.name));
        return;
    }
    let names = of_carriers(&part.name, hold.motions.len());
    let mut above = parent.to_string();
    for (motion, below) in hold.motions.iter().zip(&names) {
        if below != &part.name {
            let (mass, moment) = CARRIER;
            let carrier = Element::new("link")
                .with("name", below)
                .holding(pose(&part.world_from_part));
            let matter = inertial(
                mass,
                &nalgebra::Vector3::zeros(),
                &[moment, moment, moment, 0.0, 0.0, 0.0],
            );
            model.push(carrier.holding(matter));
        }
        let mut moving = moving(motion, hold, &above, below);
        let known = twin.twin.joints().find(|j| j.name == hold.joint);
        let said = known.map(doubts::of_joint).unwrap_or_default();
        said.iter().filter_map(Doubt::comment).for_each(|c| moving.comment(c));
        if let Some((leader, ratio)) = scene.leader(&motion.name) {
            let mimic = Element::new("drake:mimic").with("joint", leader);
            moving.push(mimic.with("multiplier", number(ratio)).with("offset", "0"));
        }
        model.push(moving);
        above.clone_from(below);
    }
}

fn moving(motion: &Motion, hold: &Attachment, above: &str, below: &str) -> Element {
    let kind = match (hold.kind, motion.turns) {
        (JointKind::Screw, _) => "screw",
        (_, true) => "revolute",
        (_, false) => "prismatic",
    };
    let mut dynamics = Element::new("dynamics")
        .holding(leaf("damping", number(motion.damping)))
        .holding(leaf("friction", number(motion.friction)));
    if motion.stiffness > 0.0 {
        dynamics.push(leaf("spring_reference", number(motion.rest)));
        dynamics.push(leaf("spring_stiffness", number(motion.stiffness)));
    }
    let mut axis = Element::new("axis").holding(leaf("xyz", vector(&motion.axis)));
    let mut limit = Element::new("limit");
    let [low, high] = motion.range.map_or(["-1e16".into(), "1e16".into()], |r| r.map(number));
    limit.push(leaf("lower", low));
    limit.push(leaf("upper", high));
    axis.push(limit);
    axis.push(dynamics);
    let mut out = joint(&motion.name, kind, above, below).holding(axis);
    if hold.kind == JointKind::Screw {
        // Metres a turn, not a radian.
        out.push(leaf("screw_thread_pitch", number(hold.pitch * std::f64::consts::TAU)));
    }
    out
}
