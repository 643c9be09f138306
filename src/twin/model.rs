//! The twin as a whole, and the meshes that travel with it.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Body, Effect, Joint, JointKind, Link, Relation};
use crate::base::{Estimate, Notice};
use crate::geometry::{Mesh, Texture, mass_properties};

/// The value of `format` in `twin.json`.
pub const FORMAT: &str = "palpate-twin/1";

/// Path of the open surface of all that was seen, in the world frame, where the twin has one.
pub const SCENE_MESH: &str = "meshes/_scene.obj";

/// The scene as data: the content of `twin.json`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Twin {
    /// `palpate-twin/1`.
    pub format: String,
    /// The name of the capture.
    pub name: String,
    /// m/s², world.
    pub gravity: [f64; 3],
    /// The table; absent where none was given or seen.
    pub support: Option<SupportPlane>,
    /// What moves, each as one tree.
    pub bodies: Vec<Body>,
    /// The relational-constraint graph.
    pub relations: Vec<Relation>,
    /// Departures from the plain laws that no other field holds.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
    /// How this was made.
    pub provenance: Provenance,
    /// Doubts that came up while it was made.
    #[serde(default)]
    pub notices: Vec<Notice>,
}

/// The plane that things stand on.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SupportPlane {
    /// A point of the plane, m, world.
    pub point: [f64; 3],
    /// Unit normal away from the table, world.
    pub normal: [f64; 3],
    /// Its material, where the capture named it.
    pub material: Option<String>,
    /// Gravity as things on it feel it, m/s², world, where pushes showed that it leans against the plane otherwise than
    /// the capture says. The exports carry it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Estimate<[f64; 3]>>,
}

/// How a twin was made.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Provenance {
    /// Version of palpate.
    pub version: String,
    /// SHA-256 over everything that was read.
    pub capture_digest: String,
    /// The effective options.
    pub options: BTreeMap<String, serde_json::Value>,
    /// The seed.
    pub seed: u64,
    /// Wall seconds per pass, in the order of the passes; `null` unless times were asked for, since
    /// the same seed must give the same bytes.
    pub seconds: BTreeMap<String, Option<f64>>,
    /// The tracks that were made from images; every other track was measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tracks_from_images: Vec<TrackFromImages>,
}

/// A track that no instrument gave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrackFromImages {
    /// The interaction that was filmed.
    pub interaction: String,
    /// The link that was followed.
    pub link: String,
    /// Images of the interaction.
    pub images: usize,
    /// Images in which it was lost; those rows of the track are missing.
    pub lost: usize,
    /// Directions of motion, of six, that no image constrained.
    pub unseen: usize,
    /// Median standard deviation of the position along an axis, m.
    pub position_sd: Option<f64>,
    /// Median standard deviation of the turn about an axis, rad.
    pub rotation_sd: Option<f64>,
}

/// A twin with the meshes that its links name.
#[derive(Clone, Debug)]
pub struct Model {
    /// The data.
    pub twin: Twin,
    /// Path relative to the twin's folder → mesh in the link frame.
    pub meshes: BTreeMap<String, Mesh>,
    /// Path of a mesh → the colours that were seen on it.
    pub textures: BTreeMap<String, Texture>,
}

impl Model {
    /// How far the middle of a link lies from the axis of the hinge that holds it, m; nothing where no hinge does.
    pub fn lever(&self, child: &str) -> Option<f64> {
        let holds = |j: &&Joint| j.child == child && j.kind == JointKind::Revolute;
        let joint = self.twin.joints().find(holds)?;
        let link = self.twin.link(child)?;
        let middle = mass_properties(self.meshes.get(link.mesh.as_ref()?)?)?.centroid;
        let arm = link.pose.0 * middle - Point3::from(joint.origin.value);
        Some(arm.cross(&Vector3::from(joint.axis.value)).norm())
    }
}

impl Twin {
    /// Gravity as things on the support feel it, m/s², world: as pushes showed it, else as the capture says.
    pub fn felt_gravity(&self) -> [f64; 3] {
        let felt = self.support.as_ref().and_then(|s| s.gravity.as_ref());
        felt.map_or(self.gravity, |g| g.value)
    }

    /// Every link with the body that it belongs to.
    pub fn links(&self) -> impl Iterator<Item = (&Body, &Link)> {
        self.bodies.iter().flat_map(|b| b.links.iter().map(move |l| (b, l)))
    }

    /// The link of that name. A track key `body/link` finds the link tracked under it.
    pub fn link(&self, name: &str) -> Option<&Link> {
        self.links().map(|(_, l)| l).find(|l| l.name == name)
    }

    /// The link of that name, to be written to.
    pub fn link_mut(&mut self, name: &str) -> Option<&mut Link> {
        self.bodies
            .iter_mut()
            .flat_map(|b| b.links.iter_mut())
            .find(|l| l.name == name)
    }

    /// The body that holds the link of that name.
    pub fn body_of(&self, link: &str) -> Option<&Body> {
        self.bodies.iter().find(|b| b.links.iter().any(|l| l.name == link))
    }

    /// Every joint.
    pub fn joints(&self) -> impl Iterator<Item = &Joint> {
        self.bodies.iter().flat_map(|b| b.joints.iter())
    }
}
