//! Models for simulators, from a twin alone: URDF, MJCF, glTF, and the check that they say what the twin says.

mod glb;
mod glb_buffer;
mod inertial;
mod layout;
mod mjcf;
mod names;
mod note;
mod scene;
mod surface;
mod unsayable;
mod urdf;
mod write;
mod xml;

pub use note::ExportNote;
pub use write::{export_all, exports};
