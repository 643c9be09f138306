//! A scene of the lab as a TOML file: what there is, how it is looked at, what is done to it. SI units.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// The sensors.
    #[serde(default)]
    pub noise: NoiseSpec,
    /// What is done, in this order; each starts from the scene as it was at first.
    #[serde(default)]
    pub action: Vec<ActionSpec>,
}

fn earth() -> [f64; 3] {
    [0.0, 0.0, -9.80665]
}

/// The table: its top is the plane z = 0 of the scene, tilted by `tilt` if that is hidden in the scene.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SupportSpec {
    /// Slopes of the table along x and y, rad; the capture says nothing of them.
    pub tilt: [f64; 2],
    /// A material name that the capture states.
    pub material: Option<String>,
    /// Write the support into the capture; otherwise it must be found.
    pub hidden: bool,
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

/// Rings of camera poses that look at `target`.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSpec {
    /// Number of views, spread over the rings; 0 = no views.
    pub views: usize,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Focal length, pixels.
    pub focal: f64,
    /// Elevations of the rings, degrees.
    pub elevations: Vec<f64>,
    /// Distance from the target, m.
    pub distance: f64,
    /// What it looks at, world.
    pub target: [f64; 3],
    /// Depth noise at 1 m, m; grows with range squared.
    pub depth_sd: f64,
    /// Fraction of edge pixels that fly between near and far.
    pub flying: f64,
}

impl Default for CameraSpec {
    fn default() -> Self {
        Self {
            views: 24,
            width: 320,
            height: 240,
            focal: 300.0,
            elevations: vec![25.0, 45.0, 68.0],
            distance: 0.6,
            target: [0.0, 0.0, 0.04],
            depth_sd: 0.001,
            flying: 0.3,
        }
    }
}

/// The sensors' noise, one standard deviation per axis, and their rates.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseSpec {
    /// N.
    pub force: f64,
    /// N·m.
    pub torque: f64,
    /// m.
    pub position: f64,
    /// rad.
    pub rotation: f64,
    /// Force and tool path, Hz.
    pub force_rate: f64,
    /// Tracks, Hz.
    pub track_rate: f64,
    /// State the noise in the capture.
    pub stated: bool,
}

impl Default for NoiseSpec {
    fn default() -> Self {
        Self {
            force: 0.02,
            torque: 0.002,
            position: 0.0002,
            rotation: 0.002,
            force_rate: 500.0,
            track_rate: 120.0,
            stated: false,
        }
    }
}

/// The tool of an action.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "shape", rename_all = "lowercase", deny_unknown_fields)]
pub enum ToolSpec {
    /// A ball.
    Sphere {
        /// m.
        radius: f64,
    },
    /// A box, half extents.
    Box {
        /// m.
        half: [f64; 3],
    },
    /// An upright cylinder.
    Cylinder {
        /// m.
        radius: f64,
        /// m.
        half_height: f64,
    },
}

impl Default for ToolSpec {
    fn default() -> Self {
        Self::Sphere { radius: 0.008 }
    }
}

/// One thing that is done. Points and directions are world coordinates at the first view.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum ActionSpec {
    /// The tool starts clear of the body, moves along `direction` through `at`, and stops.
    Push {
        /// Unique name.
        name: String,
        /// Part that is meant.
        target: String,
        /// A point on the path: where contact is aimed.
        at: [f64; 3],
        /// Direction of motion.
        direction: [f64; 3],
        /// Travel after the aimed contact, m.
        travel: f64,
        /// m/s.
        speed: f64,
        /// Tool.
        #[serde(default)]
        tool: ToolSpec,
        /// Coefficient of friction between tool and body.
        #[serde(default = "tool_friction")]
        tool_friction: f64,
        /// Move away at the end and wait, so that coasting shows.
        #[serde(default)]
        retreat: bool,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The tool holds the body (pivot if `pin`) at `at` and moves along `direction`, or, with `arc`, along a
    /// circle about the joint that the target hangs on.
    Pull {
        /// Unique name.
        name: String,
        /// Part that is held.
        target: String,
        /// Where it is held.
        at: [f64; 3],
        /// Direction of motion (at first).
        direction: [f64; 3],
        /// Travel, m (along the arc).
        travel: f64,
        /// m/s.
        speed: f64,
        /// Free pivot rather than a rigid grip.
        #[serde(default)]
        pin: bool,
        /// Follow the joint of the target.
        #[serde(default)]
        arc: bool,
        /// Go back again afterwards.
        #[serde(default)]
        back: bool,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The tool comes from above at `at`, presses `depth` deep, holds, and goes.
    Press {
        /// Unique name.
        name: String,
        /// Part that is pressed.
        target: String,
        /// Point of contact on top.
        at: [f64; 3],
        /// m below the contact.
        depth: f64,
        /// m/s.
        speed: f64,
        /// Seconds of holding.
        #[serde(default = "one_second")]
        hold: f64,
        /// Tool.
        #[serde(default)]
        tool: ToolSpec,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The tool grips the body at `at`, raises it by `height`, waits, lowers it.
    Lift {
        /// Unique name.
        name: String,
        /// Part that is held.
        target: String,
        /// Where it is held.
        at: [f64; 3],
        /// m.
        height: f64,
        /// m/s.
        #[serde(default = "slow")]
        speed: f64,
        /// Seconds of waiting at the top.
        #[serde(default = "one_second")]
        hold: f64,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// The support turns about `axis` at `rate` until the body has slid `slide`, or `limit` is reached.
    Tilt {
        /// Unique name.
        name: String,
        /// Part that is watched; it alone stands on the support then.
        target: String,
        /// Horizontal axis.
        axis: [f64; 3],
        /// rad/s.
        rate: f64,
        /// rad.
        limit: f64,
        /// m.
        #[serde(default = "slide")]
        slide: f64,
        /// Keep it for checking.
        #[serde(default)]
        held_out: bool,
    },
    /// Nothing is done.
    Hold {
        /// Unique name.
        name: String,
        /// Seconds.
        seconds: f64,
    },
}

fn tool_friction() -> f64 {
    0.4
}
fn one_second() -> f64 {
    1.0
}
fn slow() -> f64 {
    0.05
}
fn slide() -> f64 {
    0.05
}
