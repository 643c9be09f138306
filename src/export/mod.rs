//! Models for simulators, from a twin alone: URDF, MJCF, glTF, and the check that they say what the twin says.

mod check;
mod colliders;
mod deed;
mod engine;
mod glb;
mod glb_buffer;
mod inertial;
mod layout;
mod load_glb;
mod load_mjcf;
mod load_sdf;
mod load_urdf;
mod loaded;
mod manipulate;
mod mjcf;
mod names;
mod note;
mod outcome;
mod playable;
mod rest;
mod scene;
mod sdf;
mod surface;
mod unsayable;
mod urdf;
mod usd;
mod write;
mod xml;

pub use check::{CheckReport, Problem, check};
pub use deed::Deed;
pub use manipulate::{manipulate, manipulate_folder};
pub use note::ExportNote;
pub use outcome::{Opened, Outcome, PartOutcome, Verdict};
pub use playable::{PlayBond, PlayFloor, PlayJoint, PlayMotion, PlayPart, Playable, playable};
pub use rest::RestResult;
pub use write::{Files, Format, export_all, export_into, exports, exports_as};
