//! What a capture holds once it has been read and checked. SI units, world frame.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{Isometry3, Point3, UnitQuaternion, UnitVector3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::Pose;

/// The value of `format` that this version reads and writes.
pub const FORMAT: &str = "palpate-capture/1";

/// A capture, read and checked: one folder, what was measured of one tabletop scene.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The folder it was read from.
    pub root: PathBuf,
    /// What outputs are called.
    pub name: String,
    /// Gravity, m/s², world frame.
    pub gravity: Vector3<f64>,
    /// The table, where it was given.
    pub support: Option<Support>,
    /// The cameras.
    pub cameras: Vec<Camera>,
    /// The still views of the shape pass.
    pub views: Vec<View>,
    /// What is known beforehand of bodies.
    pub bodies: Vec<BodyPrior>,
    /// Known sensor noise.
    pub noise: Noise,
    /// What was done, in the order of the file.
    pub interactions: Vec<Interaction>,
    /// The file with the right answers, where there is one. Only `score` may read it.
    pub truth: Option<PathBuf>,
    /// SHA-256 over everything that was read, for provenance.
    pub digest: String,
}

/// The table that things stand on.
#[derive(Clone, Debug)]
pub struct Support {
    /// A point of the plane, m, world.
    pub point: Point3<f64>,
    /// Unit normal, away from the table, world.
    pub normal: UnitVector3<f64>,
    /// A name in the calibration tables.
    pub material: Option<String>,
    /// Friction against the support that is known beforehand.
    pub friction: Option<SupportFriction>,
}

/// Friction coefficients known beforehand, with their standard deviations.
#[derive(Clone, Copy, Debug)]
pub struct SupportFriction {
    /// Static coefficient.
    pub static_: Option<f64>,
    /// Its standard deviation.
    pub static_sd: Option<f64>,
    /// Kinetic coefficient.
    pub kinetic: Option<f64>,
    /// Its standard deviation.
    pub kinetic_sd: Option<f64>,
}

/// A pinhole camera with Brown-Conrady distortion; optical frame x right, y down, z forward.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name by which views refer to it.
    pub name: String,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Focal length in x, pixels.
    pub fx: f64,
    /// Focal length in y, pixels.
    pub fy: f64,
    /// Principal point x, pixels (the centre of the first pixel is 0).
    pub cx: f64,
    /// Principal point y, pixels.
    pub cy: f64,
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Metres per count of a depth image.
    pub depth_unit: f64,
    /// Nearest depth that is trusted, m.
    pub depth_min: f64,
    /// Farthest depth that is trusted, m.
    pub depth_max: f64,
    /// Depth noise at 1 m, one standard deviation, m; grows with range squared.
    pub depth_sd: Option<f64>,
}

/// One still view.
#[derive(Clone, Debug)]
pub struct View {
    /// Index into [`Capture::cameras`].
    pub camera: usize,
    /// Seconds on the clock of the capture.
    pub time: f64,
    /// Where the camera stood.
    pub world_from_camera: Pose,
    /// Range image.
    pub depth: DepthImage,
    /// Colour image, same size.
    pub color: Option<ColorImage>,
    /// Instance ids, same size, 0 = none.
    pub labels: Option<LabelImage>,
}

/// A range image in counts of the camera's `depth_unit`, row by row; 0 = no reading.
#[derive(Clone, Debug)]
pub struct DepthImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` counts.
    pub counts: Vec<u16>,
}

/// An 8-bit RGB image, row by row.
#[derive(Clone, Debug)]
pub struct ColorImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels.
    pub rgb: Vec<[u8; 3]>,
}

/// An image of instance ids, row by row; 0 = none.
#[derive(Clone, Debug)]
pub struct LabelImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` ids.
    pub ids: Vec<u16>,
}

/// What is known beforehand of one body (or link `body/link`).
#[derive(Clone, Debug, Default)]
pub struct BodyPrior {
    /// Its name.
    pub name: String,
    /// Its surface in the body frame, as the bytes of a mesh file.
    pub mesh: Option<MeshFile>,
    /// Its mass, kg.
    pub mass: Option<f64>,
    /// Standard deviation of that mass, kg.
    pub mass_sd: Option<f64>,
    /// Its material, a name in the calibration tables.
    pub material: Option<String>,
    /// Its pose at the time of the first view.
    pub world_from_body: Option<Pose>,
}

/// A mesh file as found on disk: parsing belongs to `geometry`.
#[derive(Clone, Debug)]
pub struct MeshFile {
    /// Where it was read.
    pub path: PathBuf,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Known sensor noise, one standard deviation each; absent = estimate it from the data.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    /// Force per axis, N.
    pub force: Option<f64>,
    /// Torque per axis, N·m.
    pub torque: Option<f64>,
    /// Tracked position per axis, m.
    pub position: Option<f64>,
    /// Tracked rotation per axis, rad.
    pub rotation: Option<f64>,
}

/// What was done in an interaction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A tool shoves from outside.
    Push,
    /// A tool holds the body and drags it.
    Pull,
    /// A tool squeezes it against the support.
    Press,
    /// A tool holds and raises it.
    Lift,
    /// The support turns until the body slides.
    Tilt,
    /// No tool: the body flies, hits, slides.
    Toss,
    /// Nothing is done: a control.
    Hold,
}

impl Kind {
    /// The word for it in `capture.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Push => "push",
            Self::Pull => "pull",
            Self::Press => "press",
            Self::Lift => "lift",
            Self::Tilt => "tilt",
            Self::Toss => "toss",
            Self::Hold => "hold",
        }
    }
}

/// One recorded interaction: streams as recorded, each at its own rate, none resampled.
#[derive(Clone, Debug)]
pub struct Interaction {
    /// Unique in the capture.
    pub name: String,
    /// What was done.
    pub kind: Kind,
    /// Free label by which trials are grouped.
    pub action: Option<String>,
    /// Free label of the tool by which trials are grouped.
    pub tool_name: Option<String>,
    /// The tool, where there was one.
    pub tool: Option<Tool>,
    /// The body, or `body/link`, that the tool means to touch.
    pub target: Option<String>,
    /// What the tool exerts ON the body, at the tool's origin, world axes.
    pub force: Option<WrenchStream>,
    /// World-from-tool.
    pub tool_path: Option<PoseStream>,
    /// The support's normal, world axes, for a tilt.
    pub support_path: Option<VectorStream>,
    /// World-from-body of each tracked body or `body/link`.
    pub tracks: BTreeMap<String, PoseStream>,
    /// Images taken meanwhile.
    pub frames: Option<Frames>,
    /// Never used to fit, only to check predictions.
    pub held_out: bool,
}

/// The tool of an interaction.
#[derive(Clone, Debug)]
pub struct Tool {
    /// Its shape.
    pub shape: ToolShape,
    /// It holds the body rigidly.
    pub grip: bool,
    /// It holds the body by a free pivot.
    pub pin: bool,
}

/// The shape of a tool, in its own frame, m.
#[derive(Clone, Debug)]
pub enum ToolShape {
    /// A ball.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A box.
    Box {
        /// Half extents, m.
        half: Vector3<f64>,
    },
    /// A cylinder along z.
    Cylinder {
        /// Radius, m.
        radius: f64,
        /// Half height, m.
        half_height: f64,
    },
    /// A surface from a file.
    Mesh(MeshFile),
}

/// Forces and torques over time; a missing reading is NaN.
#[derive(Clone, Debug, Default)]
pub struct WrenchStream {
    /// Seconds, not decreasing.
    pub time: Vec<f64>,
    /// N, world axes.
    pub force: Vec<Vector3<f64>>,
    /// N·m about the tool's origin, world axes; absent where the file has no torque columns.
    pub torque: Option<Vec<Vector3<f64>>>,
}

/// Poses over time; a row that is wholly missing has a NaN position and no rotation.
#[derive(Clone, Debug, Default)]
pub struct PoseStream {
    /// Seconds, not decreasing.
    pub time: Vec<f64>,
    /// m, world.
    pub position: Vec<Point3<f64>>,
    /// Absent where only the position is known.
    pub rotation: Vec<Option<UnitQuaternion<f64>>>,
}

impl PoseStream {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// True where there is no row.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// The full pose of row `i`, where position and rotation are both there.
    pub fn pose(&self, i: usize) -> Option<Pose> {
        let p = self.position[i];
        let q = self.rotation[i]?;
        p.coords
            .iter()
            .all(|x| x.is_finite())
            .then(|| Pose(Isometry3::from_parts(p.into(), q)))
    }

    /// A snapshot pair: one pose before, one after, nothing between.
    pub fn is_snapshot_pair(&self) -> bool {
        self.len() == 2
    }
}

/// Directions over time.
#[derive(Clone, Debug, Default)]
pub struct VectorStream {
    /// Seconds, not decreasing.
    pub time: Vec<f64>,
    /// Unit vectors, world axes.
    pub vector: Vec<UnitVector3<f64>>,
}

/// Images taken during an interaction, loaded when asked for.
#[derive(Clone, Debug)]
pub struct Frames {
    /// Index into [`Capture::cameras`].
    pub camera: usize,
    /// Where the camera stands, if it stands still.
    pub world_from_camera: Option<Pose>,
    /// Seconds of each frame.
    pub time: Vec<f64>,
    /// Depth image of each frame, absolute path.
    pub depth: Vec<PathBuf>,
    /// Colour image of each frame.
    pub color: Vec<Option<PathBuf>>,
    /// Where the camera stood at each frame, if it moved.
    pub poses: Option<PoseStream>,
    /// The images themselves where they never were in files; empty where `depth` says where they are.
    pub taken: Vec<(DepthImage, Option<ColorImage>)>,
}

impl Frames {
    /// World-from-camera at frame `i`.
    pub fn pose(&self, i: usize) -> Option<Pose> {
        self.world_from_camera.or_else(|| self.poses.as_ref()?.pose(i))
    }
}

impl Capture {
    /// The interactions that may be used to fit.
    pub fn fitted(&self) -> impl Iterator<Item = &Interaction> {
        self.interactions.iter().filter(|i| !i.held_out)
    }

    /// The interactions that are kept to check predictions.
    pub fn held_out(&self) -> impl Iterator<Item = &Interaction> {
        self.interactions.iter().filter(|i| i.held_out)
    }

    /// What is known beforehand of the body or link `name`.
    pub fn prior(&self, name: &str) -> Option<&BodyPrior> {
        self.bodies.iter().find(|b| b.name == name)
    }
}
