//! Evidence: what was measured of one tabletop, as recorded (`docs/capture-format.md`).
//!
//! A capture knows no belief: nothing here imports the twin.

mod check;
mod csv_text;
mod document;
mod faults;
mod folder;
mod frames;
mod images;
mod inspect;
mod inspect_missing;
mod inspect_noise;
mod inspect_views;
mod inspection;
mod json;
mod model;
mod motion;
mod phases;
mod read;
mod rig;
mod rig_json;
mod rig_process;
mod rig_protocol;
mod streams;
mod table;
mod write;

pub use faults::{Clipped, Hum, SensorFaults, Strays};
pub use frames::read_frame;
pub use images::color_png;
pub use inspect::inspect;
pub use inspection::{
    CameraSummary, Inspection, InteractionSummary, Missing, Motion, NoiseAtRest, StreamSummary, ViewSummary,
};
pub use json::capture_schema;
pub use model::{
    BodyPrior, Camera, Capture, ColorImage, DepthImage, FORMAT, Frames, Interaction, Kind, LabelImage, MeshFile, Noise,
    PoseStream, Support, SupportFriction, Tool, ToolShape, VectorStream, View, WrenchStream,
};
pub use motion::{RelativePose, TrackNoise, first_rest, path_of, position_noise, relative_motion, track_noise};
pub use phases::{Phase, PhaseKind, Segmented};
pub use read::read_capture;
pub use rig::{Answer, Reach, Rig, RigDescription, Touch, looking_at};
pub use rig_process::ProcessRig;
pub use rig_protocol::RIG_PROTOCOL;
pub use write::{write_capture, write_capture_with};
