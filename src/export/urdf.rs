//! URDF: a robot for each body, and one of the whole scene on its table.
//!
//! A URDF file holds one robot with one root. A scene of several bodies is a robot whose root is the table,
//! with every body on three slides and three turns (x, y, z, then about z, y, x) from it: a `floating` joint
//! would say the same, but no two loaders agree on it, and a `fixed` one would nail the body down.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use super::doubts::{self, Doubt};
use super::inertial::six;
use super::layout::of_carriers;
use super::scene::{Attachment, Floor, Motion, Part, PartId, Scene, Tree};
use super::xml::{Element, number, numbers, vector};
use crate::twin::Model;

/// Name of the root of a scene of several bodies.
pub(super) const TABLE: &str = "support";
/// Mass, kg, and moments of inertia, kg·m², of a link that only carries a freedom on.
pub(super) const CARRIER: (f64, f64) = (1e-6, 1e-9);
/// Reach of the slides on which a body floats, m.
const REACH: f64 = 100.0;
/// Effort and velocity that stand where URDF must have some.
const EFFORT: f64 = 1000.0;
const VELOCITY: f64 = 100.0;
/// Half edge, half thickness, m, and mass, kg, of the table.
pub(super) const TABLE_SIZE: [f64; 2] = [1.0, 0.01];
const TABLE_MASS: f64 = 100.0;

/// The robot of one body; `meshes` leads from the file's folder to the twin's.
pub(super) fn of_tree(scene: &Scene, model: &Model, tree: &Tree, meshes: &str) -> String {
    let mut robot = open(scene, &tree.name);
    add_tree(&mut robot, (scene, model), tree, meshes);
    robot.document()
}

/// The whole scene: the robot of its only body, or all bodies on the table.
pub(super) fn of_scene(scene: &Scene, model: &Model) -> String {
    if let [tree] = scene.trees.as_slice() {
        return of_tree(scene, model, tree, "");
    }
    let mut robot = open(scene, &scene.name);
    robot.push(table(scene.floor.as_ref()));
    for (i, tree) in scene.trees.iter().enumerate() {
        hold_root(&mut robot, scene, i);
        add_tree(&mut robot, (scene, model), tree, "");
    }
    robot.document()
}

fn open(scene: &Scene, name: &str) -> Element {
    let mut robot = Element::new("robot")
        .with("name", name)
        .with("xmlns:drake", "http://drake.mit.edu");
    for note in scene.notes_for("urdf") {
        robot.comment(format!("{}: {}", note.about, note.message));
    }
    let compiler = Element::new("compiler")
        .with("fusestatic", "false")
        .with("discardvisual", "false")
        .with("strippath", "false")
        .with("balanceinertia", "false");
    robot.push(Element::new("mujoco").holding(compiler));
    robot
}

/// A tree with the interval of each of its numbers as a comment before what it is of.
fn add_tree(robot: &mut Element, (scene, model): (&Scene, &Model), tree: &Tree, meshes: &str) {
    for part in &tree.parts {
        if let Some(hold) = &part.attachment {
            let known = model.twin.joints().find(|j| j.name == hold.joint);
            let said = known.map(doubts::of_joint).unwrap_or_default();
            said.iter()
                .filter_map(Doubt::comment)
                .for_each(|c| robot.comment(format!("{}: {c}", hold.name)));
            add_joints(robot, scene, (tree, part), hold);
        }
        let said = model.twin.link(&part.link).map(doubts::of_link).unwrap_or_default();
        said.iter()
            .filter_map(Doubt::comment)
            .for_each(|c| robot.comment(format!("{}: {c}", part.name)));
        robot.push(link(part, meshes));
    }
}

fn link(part: &Part, meshes: &str) -> Element {
    let mut link = Element::new("link").with("name", &part.name);
    if !part.is_bare() {
        link.push(contact(part.surface.kinetic_friction, part.surface.restitution));
    }
    link.push(inertial(part.mass, &part.com, &six(&part.inertia)));
    let place = || {
        origin(&Isometry3::translation(
            part.link_origin.x,
            part.link_origin.y,
            part.link_origin.z,
        ))
    };
    let mesh = |path: &str| {
        let mesh = Element::new("mesh").with("filename", format!("{meshes}{path}"));
        Element::new("geometry").holding(mesh)
    };
    if let Some(path) = part.visual.as_ref().filter(|_| !part.flat) {
        // Readers multiply the image by the colour.
        let [r, g, b] = part.texture.as_ref().map_or(part.color, |_| [1.0; 3]);
        let color = Element::new("color").with("rgba", numbers(&[r, g, b, 1.0]));
        let mut material = Element::new("material")
            .with("name", format!("{}_color", part.name))
            .holding(color);
        if let Some(image) = &part.texture {
            material.push(Element::new("texture").with("filename", format!("{meshes}{image}")));
        }
        let visual = Element::new("visual").holding(place()).holding(mesh(path));
        link.push(visual.holding(material));
    }
    for path in &part.hulls {
        let collision = Element::new("collision").holding(place()).holding(mesh(path));
        link.push(collision.holding(proximity(part)));
    }
    link
}

/// Bullet's tag; of two bodies it takes the product.
fn contact(friction: f64, restitution: Option<f64>) -> Element {
    let value = |tag: &str, v: f64| Element::new(tag).with("value", number(v));
    let contact = Element::new("contact").holding(value("lateral_friction", friction));
    match restitution {
        Some(r) => contact.holding(value("restitution", r)),
        None => contact,
    }
}

/// Drake's tag; of two bodies it takes `2 a b / (a + b)`.
fn proximity(part: &Part) -> Element {
    let value = |tag: &str, v: f64| Element::new(tag).with("value", number(v));
    Element::new("drake:proximity_properties")
        .holding(value("drake:mu_static", part.surface.static_friction))
        .holding(value("drake:mu_dynamic", part.surface.kinetic_friction))
}

fn inertial(mass: f64, com: &Vector3<f64>, six: &[f64; 6]) -> Element {
    let mut inertia = Element::new("inertia");
    for (key, value) in ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"].iter().zip(six) {
        inertia = inertia.with(key, number(*value));
    }
    Element::new("inertial")
        .holding(Element::new("origin").with("xyz", vector(com)).with("rpy", "0 0 0"))
        .holding(Element::new("mass").with("value", number(mass)))
        .holding(inertia)
}

fn carrier(name: &str) -> Element {
    let (mass, moment) = CARRIER;
    let inertial = inertial(mass, &Vector3::zeros(), &[moment, moment, moment, 0.0, 0.0, 0.0]);
    Element::new("link").with("name", name).holding(inertial)
}

/// The joints of one attachment, with a carrier link between each two.
fn add_joints(robot: &mut Element, scene: &Scene, (tree, part): (&Tree, &Part), hold: &Attachment) {
    let parent = &tree.parts[hold.parent].name;
    if hold.motions.is_empty() {
        robot.push(joint(&hold.name, "fixed", [parent, &part.name], &hold.parent_from_part));
        return;
    }
    chain(
        robot,
        scene,
        [parent, &part.name],
        &hold.parent_from_part,
        &hold.motions,
    );
}

fn chain(
    robot: &mut Element,
    scene: &Scene,
    [parent, child]: [&str; 2],
    parent_from_child: &Isometry3<f64>,
    motions: &[Motion],
) {
    let mut above = parent.to_string();
    for (i, (motion, below)) in motions.iter().zip(of_carriers(child, motions.len())).enumerate() {
        let last = i + 1 == motions.len();
        if !last {
            robot.push(carrier(&below));
        }
        let place = if i == 0 {
            *parent_from_child
        } else {
            Isometry3::identity()
        };
        let mut joint = moving(motion, [&above, &below], &place);
        if let Some((leader, ratio)) = scene.leader(&motion.name) {
            let mimic = Element::new("mimic").with("joint", leader);
            joint.push(mimic.with("multiplier", number(ratio)).with("offset", "0"));
        }
        robot.push(joint);
        above = below;
    }
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], place: &Isometry3<f64>) -> Element {
    Element::new("joint")
        .with("name", name)
        .with("type", kind)
        .holding(origin(place))
        .holding(Element::new("parent").with("link", parent))
        .holding(Element::new("child").with("link", child))
}

fn moving(motion: &Motion, ends: [&str; 2], place: &Isometry3<f64>) -> Element {
    let range = if motion.turns {
        motion.range
    } else {
        Some(motion.stated_range)
    };
    let kind = match (motion.turns, range) {
        (true, None) => "continuous",
        (true, Some(_)) => "revolute",
        (false, _) => "prismatic",
    };
    let mut limit = Element::new("limit");
    if let Some([low, high]) = range {
        limit = limit.with("lower", number(low)).with("upper", number(high));
    }
    let dynamics = Element::new("dynamics")
        .with("damping", number(motion.damping))
        .with("friction", number(motion.friction));
    joint(&motion.name, kind, ends, place)
        .holding(Element::new("axis").with("xyz", vector(&motion.axis)))
        .holding(limit.with("effort", number(EFFORT)).with("velocity", number(VELOCITY)))
        .holding(dynamics)
}

fn origin(place: &Isometry3<f64>) -> Element {
    Element::new("origin")
        .with("xyz", vector(&place.translation.vector))
        .with("rpy", vector(&roll_pitch_yaw(&place.rotation)))
}

/// `R = Rz(yaw) Ry(pitch) Rx(roll)`, exact to rounding at every attitude: near a pitch of 90 degrees, where
/// roll and yaw cannot be told apart, roll is nought and yaw takes what is left.
pub(super) fn roll_pitch_yaw(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let m = rotation.to_rotation_matrix();
    let cosine = m[(2, 1)].hypot(m[(2, 2)]);
    let pitch = (-m[(2, 0)]).atan2(cosine);
    if cosine < 1e-9 {
        return Vector3::new(0.0, pitch, (-m[(0, 1)]).atan2(m[(1, 1)]));
    }
    Vector3::new(m[(2, 1)].atan2(m[(2, 2)]), pitch, m[(1, 0)].atan2(m[(0, 0)]))
}

fn table(floor: Option<&Floor>) -> Element {
    let (half, thick) = (TABLE_SIZE[0], TABLE_SIZE[1]);
    let moment = TABLE_MASS / 3.0;
    let (flat, upright) = (moment * (half * half + thick * thick), moment * 2.0 * half * half);
    let Some(floor) = floor else {
        let six = [flat, flat, upright, 0.0, 0.0, 0.0];
        return Element::new("link")
            .with("name", TABLE)
            .holding(inertial(TABLE_MASS, &Vector3::zeros(), &six));
    };
    let rotation = upright_to(&floor.normal);
    let centre = floor.point - floor.normal.into_inner() * thick;
    let turn = rotation.to_rotation_matrix();
    let tensor = turn * nalgebra::Matrix3::from_diagonal(&Vector3::new(flat, flat, upright)) * turn.transpose();
    let place = origin(&Isometry3::from_parts(centre.into(), rotation));
    let slab = Element::new("box").with("size", numbers(&[2.0 * half, 2.0 * half, 2.0 * thick]));
    let geometry = Element::new("geometry").holding(slab);
    Element::new("link")
        .with("name", TABLE)
        .holding(contact(1.0, None))
        .holding(inertial(TABLE_MASS, &centre, &six(&tensor)))
        .holding(Element::new("visual").holding(place.clone()).holding(geometry.clone()))
        .holding(Element::new("collision").holding(place).holding(geometry))
}

/// The smallest turn that takes z to `normal`.
pub(super) fn upright_to(normal: &Unit<Vector3<f64>>) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&Vector3::z(), normal)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// Holds the root of tree `index`: nailed to the table, fixed to what it is glued to, or floating.
fn hold_root(robot: &mut Element, scene: &Scene, index: usize) {
    let Some(root) = scene.trees[index].parts.first() else {
        return;
    };
    let fixed_to = glued_to(scene, index);
    let nailed = scene.trees[index].anchored;
    let name = format!("{}_hold", root.name);
    match fixed_to.filter(|_| !nailed) {
        Some(id) => {
            let part = scene.part(id);
            let place = part.world_from_part.inverse() * root.world_from_part;
            robot.push(joint(&name, "fixed", [&part.name, &root.name], &place));
        }
        None if nailed => robot.push(joint(&name, "fixed", [TABLE, &root.name], &root.world_from_part)),
        None => {
            let six = floating(&root.name);
            chain(robot, scene, [TABLE, &root.name], &root.world_from_part, &six);
        }
    }
}

/// The part of an earlier tree that the root of tree `index` is glued to; a later one would come before
/// its own holder.
fn glued_to(scene: &Scene, index: usize) -> Option<PartId> {
    let other = |[a, b]: &[PartId; 2]| match (a.tree == index, b.tree == index) {
        (true, false) if a.part == 0 => Some(*b),
        (false, true) if b.part == 0 => Some(*a),
        _ => None,
    };
    scene
        .welds
        .iter()
        .filter_map(|w| other(&w.ends))
        .find(|id| id.tree < index)
}

fn floating(name: &str) -> Vec<Motion> {
    let axes = [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()];
    let freedoms = [(false, 0), (false, 1), (false, 2), (true, 2), (true, 1), (true, 0)];
    let words = ["x", "y", "z", "yaw", "pitch", "roll"];
    freedoms
        .iter()
        .zip(words)
        .map(|((turns, axis), word)| Motion {
            name: format!("{name}_float_{word}"),
            turns: *turns,
            axis: axes[*axis],
            range: None,
            lay: false,
            stated_range: [-REACH, REACH],
            friction: 0.0,
            damping: 0.0,
            stiffness: 0.0,
            rest: 0.0,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;

    #[test]
    fn roll_pitch_and_yaw_give_the_rotation_back_even_upright() {
        for (r, p, y) in [
            (0.3, -1.2, 2.0),
            (0.4, std::f64::consts::FRAC_PI_2, 1.0),
            (-2.0, 0.0, -3.0),
        ] {
            let turn = Rotation3::from_euler_angles(r, p, y);
            let v = roll_pitch_yaw(&turn.into());
            let back = Rotation3::from_euler_angles(v.x, v.y, v.z);
            assert!((turn.matrix() - back.matrix()).norm() < 1e-8, "{r} {p} {y}");
        }
    }
}
