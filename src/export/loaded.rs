//! What a file says once it is loaded, in the world of the twin, so that formats can be compared.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, UnitQuaternion, Vector3};

use super::inertial::tensor;
use super::scene::{Part, Scene};
use crate::twin::{Link, Model};

/// The content of a file, by the names of its parts and of its joints.
#[derive(Clone, Debug, Default)]
pub(super) struct Loaded {
    pub(super) parts: BTreeMap<String, Solid>,
    pub(super) axes: BTreeMap<String, Axis>,
    /// By part, of those that can touch.
    pub(super) skins: BTreeMap<String, Skin>,
    /// Paths of meshes and images as the file names them.
    pub(super) files: Vec<String>,
}

/// A part's matter, world frame at the first view.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    pub(super) mass: f64,
    pub(super) com: Vector3<f64>,
    pub(super) inertia: Matrix3<f64>,
    /// Orientation of the part's frame.
    pub(super) rotation: UnitQuaternion<f64>,
}

/// How a part touches. What a format does not carry is absent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Skin {
    pub(super) static_friction: Option<f64>,
    pub(super) kinetic_friction: Option<f64>,
    pub(super) restitution: Option<f64>,
    /// m.
    pub(super) rolling: Option<f64>,
}

/// One degree of freedom, world frame at the first view. What a format does not carry is absent.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) turns: bool,
    pub(super) direction: Vector3<f64>,
    pub(super) origin: Vector3<f64>,
    pub(super) range: Option<[f64; 2]>,
    pub(super) damping: Option<f64>,
    pub(super) friction: Option<f64>,
    pub(super) stiffness: Option<f64>,
    /// The joint that it follows, and the ratio of the two; nought where a format says none.
    pub(super) follows: Option<(String, f64)>,
}

impl Solid {
    /// From values in the frame of the part.
    pub(super) fn new(mass: f64, com: Vector3<f64>, inertia: &Matrix3<f64>, world: &Isometry3<f64>) -> Self {
        let turn = world.rotation.to_rotation_matrix();
        Self {
            mass,
            com: (world * Point3::from(com)).coords,
            inertia: turn * inertia * turn.transpose(),
            rotation: world.rotation,
        }
    }
}

/// What every file should say: measured values straight from the twin, documented defaults for the rest.
pub(super) fn expected(scene: &Scene, model: &Model) -> Loaded {
    let mut out = Loaded::default();
    for (_, part) in scene.parts() {
        if let Some(link) = model.twin.link(&part.link) {
            out.parts.insert(part.name.clone(), solid(part, link));
        }
        if !part.is_bare() {
            let s = &part.surface;
            let skin = Skin {
                static_friction: Some(s.static_friction),
                kinetic_friction: Some(s.kinetic_friction),
                restitution: s.restitution,
                rolling: s.rolling,
            };
            out.skins.insert(part.name.clone(), skin);
        }
        for motion in part.hold().iter().flat_map(|h| &h.motions) {
            let axis = Axis {
                turns: motion.turns,
                direction: part.world_from_part * motion.axis.into_inner(),
                origin: part.world_from_part.translation.vector,
                range: motion.range,
                damping: Some(motion.damping),
                friction: Some(motion.friction),
                stiffness: Some(motion.stiffness),
                follows: scene.leader(&motion.name).map(|(leader, ratio)| (leader.into(), ratio)),
            };
            out.axes.insert(motion.name.clone(), axis);
        }
    }
    out
}

fn solid(part: &Part, link: &Link) -> Solid {
    let mass = link.mass.as_ref().map_or(part.mass, |m| m.value);
    let com = link
        .com
        .as_ref()
        .map_or(part.com - part.link_origin, |c| Vector3::from(c.value));
    let inertia = link.inertia.as_ref().map_or(part.inertia, |i| tensor(&i.value));
    Solid::new(mass, com, &inertia, &link.pose.0)
}
