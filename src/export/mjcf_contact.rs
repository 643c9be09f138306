//! Contacts of MJCF: friction, and the stiffness that a press showed.

use super::mjcf::{attachments, standing};
use super::mjcf_effects::{Said, shares};
use super::scene::{Part, Scene};
use super::xml::{Element, numbers};
use crate::twin::Model;

/// Torsional friction, m, and rolling friction, m, of MuJoCo where none was measured.
const DEFAULT_TORSION: f64 = 0.005;
const DEFAULT_ROLLING: f64 = 0.0001;
/// Constant impedance of a contact whose stiffness is stated.
const IMPEDANCE: f64 = 0.95;
const SOFT: &str = "0.95 0.95 0.001";
/// Damping of a soft contact where none was seen, over the critical: a press that shows none must not meet any.
const LIGHT: f64 = 0.1;

/// Stiff, so that a foot stands out of the face under the weight too.
pub(super) const FOOT: &str = "0.004 1";

/// The contact properties: sliding friction is a pure number, torsional and rolling friction are lengths.
pub(super) fn touching(part: &Part, geom: Element) -> Element {
    let s = &part.surface;
    let torsion = s.torsional_radius.map_or(DEFAULT_TORSION, |r| r * s.kinetic_friction);
    let friction = [s.kinetic_friction, torsion, s.rolling.unwrap_or(DEFAULT_ROLLING)];
    let geom = geom
        .with("group", "3")
        .with("priority", "1")
        .with("condim", if s.rolling.is_some() { "6" } else { "3" })
        .with("friction", numbers(&friction))
        .with("rgba", "0.4 0.6 0.8 0.3");
    match s.compliance {
        None => geom,
        Some((stiffness, damping)) => {
            let [tool, _] = shared(stiffness, s.sinks);
            let reference = direct_reference(tool, damping, part.mass, LIGHT);
            // A constant impedance makes the contact's spring linear and equal to the stated one.
            geom.with("solref", numbers(&reference)).with("solimp", SOFT)
        }
    }
}

/// Stiffness of the contact with a tool (one point) and of each with the support (taken to be four), so that a press
/// between the two shows the measured one: one point is given 5/4 of the whole, four are five times it, and both in series
/// the whole. Where the support was seen to give, its four give that much, and the tool's the rest, a tenth at least.
fn shared(stiffness: f64, sinks: Option<f64>) -> [f64; 2] {
    let support = sinks.map_or(0.2, |c| (c * stiffness).min(0.9));
    [stiffness / (1.0 - support), 0.25 * stiffness / support]
}

/// `solref` in MuJoCo's direct form for a contact of that stiffness. In equilibrium its force is `f = k x / ((1 - d) A)`
/// with the impedance d and `A = 1/m` ("Computation", MuJoCo's documentation: `R = (1 - d)/d A`, `a_ref = -k/d x`).
/// The same holds for the damping, that of a press, of which a contact has 5/4; one below `least` of the critical is raised
/// to that, and where none was measured it is `least`.
fn direct_reference(stiffness: f64, damping: Option<f64>, mass: f64, least: f64) -> [f64; 2] {
    let share = (1.0 - IMPEDANCE) / mass;
    // The contact obeys a + b v + k x = 0 whatever it carries.
    let critical = 2.0 * (share * stiffness).sqrt();
    let b = damping.map_or(least * critical, |c| {
        (1.25 * share * c).clamp(least * critical, 10.0 * critical)
    });
    [-share * stiffness, -b]
}

/// The contact of a soft part with the table, damped critically: with less, what rests on it would rock and creep. It is
/// the stiffer of the two in a press, so that a press hardly feels it; the part's own contacts keep what was measured.
/// Where friction differs along the table's axes (`shares` along x and y) every part has such contacts: a geom has one number for both.
fn resting(part: &Part, feet: usize, shares: Option<[f64; 2]>) -> Vec<Element> {
    let s = &part.surface;
    if s.compliance.is_none() && shares.is_none() {
        return Vec::new();
    }
    let torsion = s.torsional_radius.map_or(DEFAULT_TORSION, |r| r * s.kinetic_friction);
    let rolling = s.rolling.unwrap_or(DEFAULT_ROLLING);
    // The first tangent of a contact with a level plane is the world's y axis.
    let [x, y] = shares.unwrap_or([1.0, 1.0]).map(|share| share * s.kinetic_friction);
    let friction = [y, x, torsion, rolling, rolling];
    let pair = |name: String| {
        Element::new("pair")
            .with("geom1", "support")
            .with("geom2", name)
            .with("condim", if s.rolling.is_some() { "6" } else { "3" })
            .with("friction", numbers(&friction))
    };
    let hull = |k: usize| {
        let pair = pair(format!("{}_hull_{k}", part.name));
        match s.compliance {
            None => pair,
            Some((stiffness, damping)) => {
                let [_, support] = shared(stiffness, s.sinks);
                let reference = direct_reference(support, damping, part.mass, 1.0);
                pair.with("solref", numbers(&reference)).with("solimp", SOFT)
            }
        }
    };
    let standing = |k: usize| pair(format!("{}_foot_{k}", part.name)).with("solref", FOOT);
    let hulls = (0..part.hulls.len()).map(hull);
    hulls
        .chain((0..feet).filter(|_| shares.is_some()).map(standing))
        .collect()
}

/// Which parts never touch, and contacts that are not those of their geoms.
pub(super) fn contact(scene: &Scene, model: &Model, effects: &[Option<Said>]) -> Element {
    let mut contact = Element::new("contact");
    let exclude = |a: &str, b: &str| Element::new("exclude").with("body1", a).with("body2", b);
    for (child, parent, _) in attachments(scene) {
        contact.push(exclude(&parent.name, &child.name));
    }
    for [a, b] in scene.welds.iter().map(|w| w.ends) {
        contact.push(exclude(&scene.part(a).name, &scene.part(b).name));
    }
    if scene.floor.is_some() {
        let shares = shares(effects);
        for (id, part) in scene.parts() {
            let feet = standing(scene, model, &scene.trees[id.tree], part).len();
            resting(part, feet, shares).into_iter().for_each(|p| contact.push(p));
        }
    }
    contact
}
