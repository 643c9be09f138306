//! What the twin says and a format cannot.

use super::ExportNote;
use super::mjcf_effects::{Said, said};
use super::scene::{Attachment, Part, Scene};
use crate::base::Estimate;
use crate::twin::{Effect, Joint, JointKind, Model, RelationKind};

/// The cause of a support that gives, which a contact of MJCF can say.
pub(super) const SINKING: &str = "support-compliance";

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
            let known = model.twin.joints().find(|j| j.name == hold.joint);
            notes.extend(known.map(of_effects).unwrap_or_default());
        }
        if id.part == 0 && scene.trees[id.tree].anchored {
            let words = "held to the world: load it with a fixed base, a URDF cannot say so";
            notes.push(ExportNote::new("urdf", about, words));
        }
    }
    let in_mjcf = said(scene, model);
    let effects = model.twin.effects.iter().zip(&in_mjcf);
    notes.extend(effects.flat_map(|(effect, said)| of_effect(effect, said.as_ref())));
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

/// A number with its unit and interval.
fn told(e: &Estimate) -> String {
    let unit = if e.unit == "1" {
        String::new()
    } else {
        format!(" {}", e.unit)
    };
    let within = e.ci95.map(|c| c.map(short));
    let within = within.map(|[low, high]| format!(" (95 % within [{low}, {high}])"));
    format!("{}{unit}{}", short(e.value), within.unwrap_or_default())
}

/// To four significant digits.
fn short(v: f64) -> f64 {
    let scale = 10f64.powi(3 - v.abs().max(1e-300).log10().floor() as i32);
    if scale.is_finite() && v != 0.0 {
        (v * scale).round() / scale
    } else {
        v
    }
}

/// What a joint does that only some formats can say, or none.
fn of_effects(joint: &Joint) -> Vec<ExportNote> {
    let mut notes = Vec::new();
    let mut say = |format: &str, words: String| notes.push(ExportNote::new(format, &joint.name, words));
    let effects = &joint.effects;
    if let Some(excess) = &effects.static_excess {
        let words = format!(
            "to set it going takes {} more than to keep it going: left out",
            told(excess)
        );
        say("all", words);
    }
    for detent in &effects.detents {
        let words = format!(
            "{} at {} that draws back with up to {}, most of it {} away: left out",
            if detent.latch { "a latch" } else { "a notch" },
            told(&detent.position),
            told(&detent.load),
            told(&detent.reach)
        );
        say("all", words);
    }
    if let Some(play) = &effects.backlash {
        let words = format!(
            "a play of {} to either side: left out, it turns without any",
            told(play)
        );
        say("all", words);
    }
    if let Some(coupling) = &effects.coupling {
        let words = format!("follows {} by {}", coupling.leader, told(&coupling.ratio));
        say("gltf", format!("{words}: left out; it is in the extras"));
        say("usd", format!("{words}: left out; the ratio is in customData"));
        say("urdf", format!("{words}: a mimic joint, which PyBullet does not read"));
        say("sdf", format!("{words}: said in a tag of Drake"));
    }
    notes
}

/// What no number of the twin holds: each is said beside the plain law, not beside numbers that may stand in for it.
fn of_effect(effect: &Effect, in_mjcf: Option<&Said>) -> Vec<ExportNote> {
    let numbers: Vec<String> = effect
        .parameters
        .iter()
        .map(|(name, e)| format!("{name} {}", told(e)))
        .collect();
    let found = format!(
        "{} was found (probability {:.2}; {})",
        effect.cause,
        effect.probability,
        numbers.join(", ")
    );
    let note = |format: &str, words: &str| ExportNote::new(format, &effect.place, format!("{found}: {words}"));
    match effect.cause.as_str() {
        SINKING => {
            let words = "contacts of what was pressed with the table give that much, those of other things do not";
            let mut notes = vec![note("mjcf", words)];
            notes.extend(["urdf", "gltf", "sdf", "usd"].map(|f| note(f, "left out")));
            notes
        }
        "force-gain" => vec![note("all", "forces are as the sensor read them")],
        _ => match in_mjcf.and_then(Said::approximate) {
            None if in_mjcf.is_none() => vec![note("all", "left out")],
            words => {
                let others = ["urdf", "gltf", "sdf", "usd"].map(|f| note(f, "left out"));
                words.map(|w| note("mjcf", w)).into_iter().chain(others).collect()
            }
        },
    }
}
