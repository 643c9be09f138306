//! A scene of the lab as a TOML file: what there is, how it is looked at, what is done to it. SI units.

use std::borrow::Cow;
use std::collections::BTreeMap;

use rand_distr::{Distribution, StandardNormal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use super::instruments::{CameraSpec, FilmSpec, NoiseSpec};
pub use super::script::{ActionSpec, ToolSpec};
use crate::base::{Seed, rng_for};

/// A made-up tabletop with the script of what is done to it.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// What the capture is called.
    pub name: String,
    /// m/s², world.
    #[serde(default = "earth")]
    pub gravity: [f64; 3],
    /// The table.
    #[serde(default)]
    pub support: SupportSpec,
    /// The things, each one rigid part.
    #[serde(default)]
    pub body: Vec<BodySpec>,
    /// Joints between parts.
    #[serde(default)]
    pub joint: Vec<JointSpec>,
    /// Glue between parts.
    #[serde(default)]
    pub bond: Vec<BondSpec>,
    /// Friction of pairs that differs from the default.
    #[serde(default)]
    pub pair: Vec<PairSpec>,
    /// The camera rig.
    #[serde(default)]
    pub camera: CameraSpec,
    /// A camera that films the actions; absent = none does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub film: Option<FilmSpec>,
    /// The sensors.
    #[serde(default)]
    pub noise: NoiseSpec,
    /// How well one action repeats another.
    #[serde(default, skip_serializing_if = "RepeatSpec::is_perfect")]
    pub repeat: RepeatSpec,
    /// What is done, in this order; each starts from the scene as it was at first.
    #[serde(default)]
    pub action: Vec<ActionSpec>,
    /// Seconds of stillness before an action, by its name, beyond the usual half second.
    #[serde(default)]
    pub pause: BTreeMap<String, f64>,
    /// Effects that a plain model lacks; the capture says nothing of them.
    #[serde(default)]
    pub hide: Vec<HideSpec>,
}

impl Scene {
    /// Seconds of stillness before each action, beyond the usual half second.
    pub fn pauses(&self) -> Vec<f64> {
        let of = |action: &ActionSpec| self.pause.get(action.name()).copied().unwrap_or(0.0);
        self.action.iter().map(of).collect()
    }
}

/// Scatter from one action to the next: standard deviations of logarithms. The truth file tells the middle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RepeatSpec {
    /// Of all friction of things, static and kinetic alike, and of joints.
    pub friction: f64,
    /// Of the stiffness and damping of springy parts.
    pub stiffness: f64,
    /// What is drawn is drawn from this and the action's name.
    pub seed: u64,
}

impl RepeatSpec {
    fn is_perfect(&self) -> bool {
        self.friction == 0.0 && self.stiffness == 0.0
    }
}

impl Scene {
    /// The scene as `action` meets it.
    pub(super) fn on(&self, action: &str) -> Cow<'_, Self> {
        let repeat = self.repeat;
        if repeat.is_perfect() {
            return Cow::Borrowed(self);
        }
        let mut dice = rng_for(Seed(repeat.seed), action);
        let [slippery, soft] = [repeat.friction, repeat.stiffness].map(|sd| {
            let z: f64 = StandardNormal.sample(&mut dice);
            (sd * z).exp()
        });
        let mut scene = self.clone();
        let of_bodies = scene.body.iter_mut().map(|b| &mut b.friction);
        for friction in of_bodies.chain(scene.pair.iter_mut().map(|p| &mut p.friction)) {
            friction.static_ *= slippery;
            friction.kinetic *= slippery;
        }
        for joint in &mut scene.joint {
            joint.friction *= slippery;
        }
        for foam in scene.body.iter_mut().filter_map(|b| b.foam.as_mut()) {
            foam.stiffness *= soft;
            foam.damping *= soft;
        }
        Cow::Owned(scene)
    }
}

/// A hidden effect.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HideSpec {
    /// One of those that `hidden_causes` lists for the scene.
    pub cause: String,
    /// 1 is a plain amplitude of its kind, 0 none.
    #[serde(default = "plain")]
    pub strength: f64,
    /// Its other numbers are drawn from this.
    #[serde(default)]
    pub seed: u64,
}

fn plain() -> f64 {
    1.0
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.80665]
}

/// The table: its top is the plane z = 0 of the scene. With a hidden `tilt` all coordinates are still the table's, but
/// gravity leans against them, as where a robot's base stands on a table that is not level.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SupportSpec {
    /// How steeply the table rises along x and y, rad; the capture says nothing of it.
    pub tilt: [f64; 2],
    /// A material name that the capture states.
    pub material: Option<String>,
    /// Write the support into the capture; otherwise it must be found.
    pub hidden: bool,
}

impl SupportSpec {
    /// The angle between the table's normal and the vertical, rad.
    pub fn lean(&self) -> f64 {
        self.tilt[0].tan().hypot(self.tilt[1].tan()).atan()
    }
}

/// One rigid part, standing or lying where `position` and `yaw` put its frame.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodySpec {
    /// Unique name; tracks are keyed by it.
    pub name: String,
    /// Its shape. The body frame is the shape's own frame: centre of a box, cylinder or sphere; the foot of
    /// a lathe profile; the file's frame of a mesh.
    pub shape: ShapeSpec,
    /// kg/m³ of the uniform filling.
    #[serde(default = "wood")]
    pub density: f64,
    /// Where the frame's origin is, world, at the first view.
    pub position: [f64; 3],
    /// Heading of the frame, rad about world z.
    #[serde(default)]
    pub yaw: f64,
    /// Weights hidden inside.
    #[serde(default)]
    pub weight: Vec<WeightSpec>,
    /// Friction against the support.
    #[serde(default)]
    pub friction: FrictionSpec,
    /// Springiness of what is pressed.
    #[serde(default)]
    pub foam: Option<FoamSpec>,
    /// sRGB.
    #[serde(default = "grey")]
    pub color: [u8; 3],
    /// Held to the world (a cabinet's carcass).
    #[serde(default)]
    pub fixed: bool,
    /// Tracked (default); an untracked part has no track in the capture.
    #[serde(default = "yes")]
    pub tracked: bool,
    /// Write its surface, in the body frame, and its pose into the capture as known beforehand.
    #[serde(default)]
    pub known_mesh: bool,
}

fn wood() -> f64 {
    600.0
}
fn grey() -> [u8; 3] {
    [160, 160, 160]
}
fn yes() -> bool {
    true
}

/// A solid. Lengths in m.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum ShapeSpec {
    /// A box with its centre at the origin.
    Box {
        /// Full edge lengths.
        size: [f64; 3],
    },
    /// A cylinder along z with its centre at the origin.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Full height.
        height: f64,
    },
    /// A ball with its centre at the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// A closed profile of (radius, z) turned about z, such as a mug or a bowl.
    Lathe {
        /// Polyline that starts and ends on the axis.
        profile: Vec<[f64; 2]>,
        /// A mug's handle: [ring radius, tube radius, height of its centre]; absent = none.
        #[serde(default)]
        handle: Option<[f64; 3]>,
    },
    /// A box open at the top or at one side (drawer, carcass): walls of one thickness.
    Tray {
        /// Full outer edge lengths.
        size: [f64; 3],
        /// Wall thickness.
        wall: f64,
        /// Which face is open: "+z", "+x", ….
        open: String,
    },
    /// A closed surface from an OBJ file beside the scene file.
    Mesh {
        /// Path relative to the scene file.
        file: String,
    },
}

/// A weight hidden inside a part (a small ball).
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeightSpec {
    /// kg.
    pub mass: f64,
    /// Body frame, m.
    pub position: [f64; 3],
    /// Radius of the ball, m (for its inertia).
    #[serde(default)]
    pub radius: f64,
}

/// Coefficients of dry friction of a pair.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionSpec {
    /// Before it slides.
    #[serde(rename = "static")]
    pub static_: f64,
    /// While it slides.
    pub kinetic: f64,
}

impl Default for FrictionSpec {
    fn default() -> Self {
        Self {
            static_: 0.33,
            kinetic: 0.30,
        }
    }
}

/// A springy part: what is pressed gives way at the spot.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FoamSpec {
    /// N/m.
    pub stiffness: f64,
    /// N·s/m.
    #[serde(default)]
    pub damping: f64,
}

/// The kind of a joint of the lab.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum JointSpecKind {
    /// Turns about the axis.
    Revolute,
    /// Slides along the axis.
    Prismatic,
    /// Turns about the axis and climbs along it by its pitch.
    Screw,
}

/// A joint between two parts.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointSpec {
    /// Parent part.
    pub a: String,
    /// Child part.
    pub b: String,
    /// Its kind.
    pub kind: JointSpecKind,
    /// World direction at the first view.
    pub axis: [f64; 3],
    /// World point at the first view.
    #[serde(default)]
    pub origin: [f64; 3],
    /// m/rad along the axis, of a screw.
    #[serde(default)]
    pub pitch: f64,
    /// Range, rad or m, 0 at the first view.
    #[serde(default)]
    pub limits: Option<[f64; 2]>,
    /// Coulomb, N·m or N.
    #[serde(default)]
    pub friction: f64,
    /// N·m·s/rad or N·s/m.
    #[serde(default)]
    pub damping: f64,
    /// N·m/rad or N/m.
    #[serde(default)]
    pub stiffness: f64,
    /// Where the spring is slack, rad or m.
    #[serde(default)]
    pub rest: f64,
}

/// Glue between two parts.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BondSpec {
    /// One part.
    pub a: String,
    /// The other.
    pub b: String,
    /// Pulling force at which it gives way, N; absent = never.
    #[serde(default)]
    pub breakaway: Option<f64>,
}

/// Friction between two parts that touch.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PairSpec {
    /// One part.
    pub a: String,
    /// The other.
    pub b: String,
    /// Their friction.
    pub friction: FrictionSpec,
}
