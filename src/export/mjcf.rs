//! MJCF: the scene as MuJoCo runs it, on the table, in the pose of the first view.

use nalgebra::{Isometry3, Point3, Vector3};

use super::doubts;
use super::feet::{Corners, RADIUS, feet};
use super::inertial::six;
use super::mjcf_contact::{FOOT, contact, touching};
use super::mjcf_effects::{Said, anchors, said, sites, tendons};
use super::scene::{Attachment, Motion, Part, Scene, Tree};
use super::urdf::upright_to;
use super::xml::{Element, number, numbers, vector};
use crate::twin::{JointKind, Model};

/// The file's text.
pub(super) fn of_scene(scene: &Scene, model: &Model) -> String {
    let mut root = Element::new("mujoco").with("model", &scene.name);
    for note in scene.notes_for("mjcf") {
        root.comment(format!("{}: {}", note.about, note.message));
    }
    let compiler = Element::new("compiler")
        .with("angle", "radian")
        .with("autolimits", "true")
        .with("balanceinertia", "false");
    root.push(compiler);
    let option = Element::new("option")
        .with("timestep", "0.002")
        .with("gravity", vector(&scene.gravity))
        .with("integrator", "implicitfast")
        .with("cone", "elliptic")
        .with("impratio", "10");
    root.push(option);
    root.push(assets(scene));
    let effects = said(scene, model);
    root.push(world(scene, model, &effects));
    let sections = [
        contact(scene, model, &effects),
        tendons(&effects),
        equality(scene),
        custom(scene, model),
    ];
    for section in sections.into_iter().filter(|s| !s.is_empty()) {
        root.push(section);
    }
    root.document()
}

/// Visual meshes need not close: their inertia is never used, and asked for as a shell's it never fails.
fn assets(scene: &Scene) -> Element {
    let mut asset = Element::new("asset");
    let mesh = |name: String, file: &str, inertia: &str| {
        Element::new("mesh")
            .with("name", name)
            .with("file", file)
            .with("inertia", inertia)
    };
    for (_, part) in scene.parts() {
        if let Some(path) = &part.visual {
            asset.push(mesh(format!("{}_visual", part.name), path, "shell"));
        }
        if let Some(image) = &part.texture {
            let name = format!("{}_colors", part.name);
            let texture = Element::new("texture").with("name", &name).with("type", "2d");
            asset.push(texture.with("file", image));
            let material = Element::new("material").with("name", &name).with("texture", &name);
            asset.push(material.with("specular", "0.1").with("shininess", "0.1"));
        }
        for (k, path) in part.hulls.iter().enumerate() {
            asset.push(mesh(format!("{}_hull_{k}", part.name), path, "convex"));
        }
    }
    asset
}

fn world(scene: &Scene, model: &Model, effects: &[Option<Said>]) -> Element {
    let mut world = Element::new("worldbody");
    let light = Element::new("light")
        .with("name", "lamp")
        .with("type", "directional")
        .with("pos", "0 0 2")
        .with("dir", "0.2 0.3 -1");
    world.push(light);
    if let Some(floor) = &scene.floor {
        // Lower priority than the bodies': what was measured of a body on this support is what counts.
        let plane = Element::new("geom")
            .with("name", "support")
            .with("type", "plane")
            .with("size", "2 2 0.05")
            .with("pos", vector(&floor.point))
            .with(
                "quat",
                quaternion(&Isometry3::from_parts(
                    Vector3::zeros().into(),
                    upright_to(&floor.normal),
                )),
            )
            .with("rgba", "0.8 0.78 0.74 1")
            .with("priority", "0");
        world.push(plane);
    }
    anchors(effects).into_iter().for_each(|a| world.push(a));
    for tree in &scene.trees {
        world.push(body((scene, model, effects), tree, 0));
    }
    world
}

fn body((scene, model, effects): (&Scene, &Model, &[Option<Said>]), tree: &Tree, index: usize) -> Element {
    let part = &tree.parts[index];
    let place = part
        .attachment
        .as_ref()
        .map_or(part.world_from_part, |a| a.parent_from_part);
    let mut body = Element::new("body")
        .with("name", &part.name)
        .with("pos", vector(&place.translation.vector))
        .with("quat", quaternion(&place));
    if !part.assumed.is_empty() {
        body.comment(format!("assumed: {}", part.assumed.join(", ")));
    }
    match &part.attachment {
        None if !tree.anchored => body.push(Element::new("freejoint").with("name", format!("{}_free", part.name))),
        None => {}
        Some(hold) => joints(hold).into_iter().for_each(|j| body.push(j)),
    }
    let inertial = Element::new("inertial")
        .with("pos", vector(&part.com))
        .with("mass", number(part.mass))
        .with("fullinertia", numbers(&six(&part.inertia)));
    body.push(inertial);
    geoms(part).into_iter().for_each(|g| body.push(g));
    sites(scene, effects, &part.name).into_iter().for_each(|s| body.push(s));
    for (k, at) in standing(scene, model, tree, part).iter().enumerate() {
        body.push(foot(part, k, at));
    }
    let children =
        (0..tree.parts.len()).filter(|i| tree.parts[*i].attachment.as_ref().is_some_and(|a| a.parent == index));
    for child in children {
        body.push(self::body((scene, model, effects), tree, child));
    }
    body
}

/// Centres of the feet of a part.
pub(super) fn standing(scene: &Scene, model: &Model, tree: &Tree, part: &Part) -> Vec<Point3<f64>> {
    let corners = match tree.parts.len() {
        1 => Corners::All,
        _ => Corners::Bearing,
    };
    feet(part, model, scene.floor.as_ref(), corners)
}

fn geoms(part: &Part) -> Vec<Element> {
    let geom = |name: String, mesh: String| {
        Element::new("geom")
            .with("name", name)
            .with("type", "mesh")
            .with("mesh", mesh)
            .with("pos", vector(&part.link_origin))
    };
    let [r, g, b] = part.color;
    let mut geoms = Vec::new();
    if part.visual.is_some() {
        let name = format!("{}_visual", part.name);
        let visual = geom(name.clone(), name)
            .with("group", "2")
            .with("contype", "0")
            .with("conaffinity", "0");
        // A colour of the geom would overrule its material.
        geoms.push(match &part.texture {
            Some(_) => visual.with("material", format!("{}_colors", part.name)),
            None => visual.with("rgba", numbers(&[r, g, b, 1.0])),
        });
    }
    for k in 0..part.hulls.len() {
        let name = format!("{}_hull_{k}", part.name);
        geoms.push(touching(part, geom(name.clone(), name)));
    }
    geoms
}

/// A small ball.
fn foot(part: &Part, k: usize, at: &Point3<f64>) -> Element {
    let ball = Element::new("geom")
        .with("name", format!("{}_foot_{k}", part.name))
        .with("type", "sphere")
        .with("size", number(RADIUS))
        .with("pos", vector(&at.coords));
    touching(part, ball).with("solref", FOOT)
}

fn joints(hold: &Attachment) -> Vec<Element> {
    if hold.kind == JointKind::Spherical {
        let m = &hold.motions[0];
        let ball = Element::new("joint").with("name", &hold.name).with("type", "ball");
        return vec![with_losses(ball, m)];
    }
    let mut joints: Vec<Element> = hold.motions.iter().map(single).collect();
    if hold.kind == JointKind::Screw {
        let axis = vector(&hold.motions[0].axis);
        let slide = Element::new("joint").with("name", slide_of(hold)).with("type", "slide");
        joints.push(slide.with("axis", axis));
    }
    joints
}

fn single(motion: &Motion) -> Element {
    let kind = if motion.turns { "hinge" } else { "slide" };
    let mut joint = Element::new("joint")
        .with("name", &motion.name)
        .with("type", kind)
        .with("axis", vector(&motion.axis));
    if let Some(range) = motion.range {
        joint = joint.with("range", numbers(&range));
    }
    if motion.stiffness > 0.0 {
        joint = joint
            .with("stiffness", number(motion.stiffness))
            .with("springref", number(motion.rest));
    }
    with_losses(joint, motion)
}

/// MuJoCo's dry friction is a soft constraint that creeps under a load; at this impedance it creeps by less than
/// a hundredth of a millimetre a second.
fn with_losses(joint: Element, motion: &Motion) -> Element {
    let joint = joint
        .with("damping", number(motion.damping))
        .with("frictionloss", number(motion.friction));
    if motion.friction > 0.0 {
        joint.with("solimpfriction", "0.9999 0.9999 0.001")
    } else {
        joint
    }
}

fn slide_of(hold: &Attachment) -> String {
    format!("{}_advance", hold.name)
}

/// Every part that hangs on another, that other, and how.
pub(super) fn attachments<'a>(scene: &'a Scene) -> impl Iterator<Item = (&'a Part, &'a Part, &'a Attachment)> {
    let held = |tree: &'a Tree, part: &'a Part| {
        let hold = part.hold()?;
        Some((part, &tree.parts[hold.parent], hold))
    };
    scene
        .trees
        .iter()
        .flat_map(move |t| t.parts.iter().filter_map(move |p| held(t, p)))
}

fn equality(scene: &Scene) -> Element {
    let mut equality = Element::new("equality");
    for (_, _, hold) in attachments(scene).filter(|(_, _, h)| h.kind == JointKind::Screw) {
        let coupling = Element::new("joint")
            .with("joint1", slide_of(hold))
            .with("joint2", &hold.motions[0].name)
            .with("polycoef", numbers(&[0.0, hold.pitch, 0.0, 0.0, 0.0]));
        equality.push(coupling);
    }
    for (own, leader, ratio) in scene.couplings() {
        let coupling = Element::new("joint")
            .with("joint1", &own.name)
            .with("joint2", &leader.name)
            .with("polycoef", numbers(&[0.0, ratio, 0.0, 0.0, 0.0]));
        equality.push(coupling);
    }
    for [a, b] in scene.welds.iter().map(|w| w.ends) {
        let (a, b) = (&scene.part(a).name, &scene.part(b).name);
        equality.push(Element::new("weld").with("body1", a).with("body2", b));
    }
    equality
}

/// Static friction and the 95 % intervals, as numbers that a program can ask for.
fn custom(scene: &Scene, model: &Model) -> Element {
    let mut custom = Element::new("custom");
    let mut numeric = |name: String, data: &[f64]| {
        custom.push(Element::new("numeric").with("name", name).with("data", numbers(data)));
    };
    for (_, part) in scene.parts() {
        numeric(
            format!("{}_friction_static", part.name),
            &[part.surface.static_friction],
        );
        let said = model.twin.link(&part.link).map(doubts::of_link).unwrap_or_default();
        let hold = part.attachment.as_ref();
        let joint = hold.and_then(|h| Some((&h.name, model.twin.joints().find(|j| j.name == h.joint)?)));
        let moving = joint.map(|(name, joint)| (name, doubts::of_joint(joint)));
        let moving = moving
            .iter()
            .flat_map(|(name, all)| all.iter().map(move |d| (*name, d)));
        for (of, doubt) in said.iter().map(|d| (&part.name, d)).chain(moving) {
            if let Some(interval) = doubt.interval {
                numeric(format!("{of}_{}_ci95", doubt.name), &interval);
            }
        }
    }
    custom
}

/// MuJoCo's order, scalar first.
fn quaternion(pose: &Isometry3<f64>) -> String {
    let q = pose.rotation;
    let s = if q.w < 0.0 { -1.0 } else { 1.0 };
    numbers(&[s * q.w, s * q.i, s * q.j, s * q.k])
}
