//! What the twin says and a format cannot.

use super::ExportNote;
use super::scene::{Attachment, Part, Scene};
use crate::twin::{JointKind, Model, RelationKind};

/// A note for everything that is lost on the way into a format.
pub(super) fn unsayable(scene: &Scene, model: &Model) -> Vec<ExportNote> {
    let mut notes = general(scene);
    for (id, part) in scene.parts() {
        let about = part.link.as_str();
        notes.extend(of_surface(part, about));
        if part.flat {
            let words = "the mesh is flat: left out, since MuJoCo refuses a URDF that holds one";
            notes.push(ExportNote::new("urdf", about, words));
        }
        if let Some(hold) = &part.attachment {
            notes.extend(of_joint(hold));
        }
        if id.part == 0 && scene.trees[id.tree].anchored {
            let words = "held to the world: load it with a fixed base, a URDF cannot say so";
            notes.push(ExportNote::new("urdf", about, words));
        }
    }
    for relation in &model.twin.relations {
        if let Some(force) = relation
            .breakaway
            .as_ref()
            .filter(|_| relation.kind == RelationKind::Fixed)
        {
            let words = format!("the bond gives way at {} N; here it never does", force.value);
            notes.push(ExportNote::new("all", &format!("{}|{}", relation.a, relation.b), words));
        }
    }
    notes
}

fn general(scene: &Scene) -> Vec<ExportNote> {
    let mut notes = vec![
        ExportNote::new(
            "urdf",
            "scene",
            "no gravity; intervals are comments; friction of surfaces and restitution only in tags of PyBullet (contact) and Drake",
        ),
        ExportNote::new(
            "mjcf",
            "scene",
            "one coefficient of friction: the kinetic one; the static one is in <custom>",
        ),
        ExportNote::new(
            "gltf",
            "scene",
            "no gravity vector and no intervals in the physics extension: see the extras of each node",
        ),
    ];
    let words = "intervals are comments; how two coefficients of friction combine is the engine's choice; breakaway of bonds is left out";
    notes.push(ExportNote::new("sdf", "scene", words));
    let words =
        "torsional and rolling friction and the compliance of surfaces are left out; intervals are in customData";
    notes.push(ExportNote::new("usd", "scene", words));
    if !scene.welds.is_empty() {
        let words =
            "bodies that are fixed to each other are joined in scene.urdf only; their own files hold each alone";
        notes.push(ExportNote::new("urdf", "scene", words));
    }
    notes
}

fn of_surface(part: &Part, about: &str) -> Vec<ExportNote> {
    let mut notes = Vec::new();
    let surface = &part.surface;
    if surface.restitution.is_some() {
        let words = "restitution: MuJoCo's contacts have none";
        notes.push(ExportNote::new("mjcf", about, words));
    }
    if surface.compliance.is_some() {
        let words = "measured stiffness and damping of the surface are left out";
        notes.push(ExportNote::new("urdf", about, words));
        notes.push(ExportNote::new("gltf", about, words));
        let words = "solref shows the measured stiffness to a press between a point-like tool and a support that \
                     touches in four points; other contacts are stiffer or softer";
        notes.push(ExportNote::new("mjcf", about, words));
    }
    if surface.torsional_radius.is_some() || surface.rolling.is_some() {
        let words = "torsional and rolling friction are left out";
        notes.push(ExportNote::new("urdf", about, words));
        notes.push(ExportNote::new("gltf", about, words));
    }
    notes
}

fn of_joint(hold: &Attachment) -> Vec<ExportNote> {
    let mut notes = Vec::new();
    let mut say = |format: &str, words: &str| notes.push(ExportNote::new(format, &hold.joint, words));
    match hold.kind {
        JointKind::Screw => {
            say("usd", "stand-in: a screw turns without advancing here");
            say(
                "urdf",
                "stand-in: a screw turns without advancing here; its pitch is in twin.json",
            );
            say(
                "gltf",
                "stand-in: a screw turns without advancing here; its pitch is in the extras",
            );
        }
        JointKind::Cylindrical | JointKind::Planar | JointKind::Spherical => {
            say(
                "sdf",
                "stand-in: a chain of single turns and slides through links of a milligram",
            );
            say(
                "urdf",
                "stand-in: a chain of single turns and slides through links of a milligram",
            );
        }
        _ => {}
    }
    for motion in &hold.motions {
        if motion.stiffness > 0.0 {
            say("urdf", "the return spring is left out");
        }
        if motion.friction > 0.0 {
            say("gltf", "dry friction of the joint is left out; it is in the extras");
            say("usd", "dry friction of the joint is left out; it is in customData");
        }
        if !motion.turns && motion.range.is_none() {
            say(
                "urdf",
                "assumed: a slide must have ends; these are half the travel beyond what was seen",
            );
        }
    }
    notes
}
