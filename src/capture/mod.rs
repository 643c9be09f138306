//! Evidence: what was measured of one tabletop, as recorded (`docs/capture-format.md`).
//!
//! A capture knows no belief: nothing here imports the twin.

mod check;
mod document;
mod folder;
mod frames;
mod images;
mod json;
mod model;
mod phases;
mod read;
mod streams;
mod table;
mod write;

pub use frames::read_frame;
pub use json::capture_schema;
pub use model::{
    BodyPrior, Camera, Capture, ColorImage, DepthImage, FORMAT, Frames, Interaction, Kind, LabelImage, MeshFile, Noise,
    PoseStream, Support, SupportFriction, Tool, ToolShape, VectorStream, View, WrenchStream,
};
pub use phases::{Phase, PhaseKind, Segmented};
pub use read::read_capture;
pub use write::write_capture;
