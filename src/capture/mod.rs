//! Evidence: what was measured of one tabletop, as recorded (`docs/capture-format.md`).
//!
//! A capture knows no belief: nothing here imports the twin.

mod model;
mod motion;
mod phases;
mod read;
mod write;

pub use model::{
    BodyPrior, Camera, Capture, ColorImage, DepthImage, FORMAT, Frames, Interaction, Kind, LabelImage, MeshFile, Noise,
    PoseStream, Support, SupportFriction, Tool, ToolShape, VectorStream, View, WrenchStream,
};
pub use motion::{RelativePose, TrackNoise, first_rest, path_of, position_noise, relative_motion, track_noise};
pub use phases::{Phase, PhaseKind, Segmented};
pub use read::read_capture;
pub use write::write_capture;
