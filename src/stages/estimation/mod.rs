//! `identify`: mass, friction, centre of mass, inertia, stiffness from what was measured, with intervals.

mod body;
mod calibrate;
mod config;
mod drag;
mod evidence;
mod facts;
mod friction_force;
mod identify;
mod joint;
mod lift;
mod materials;
mod parting;
mod pool;
mod press;
mod push;
mod resolve;
mod share;
mod solid;
mod surface;
mod tilt;

pub use calibrate::calibrate_friction;
pub use config::Config;
pub use identify::identify;
pub use materials::{MaterialFriction, material_friction, material_table};
