//! `identify`: mass, friction, centre of mass, inertia, stiffness from what was measured, with intervals.

mod action;
mod body;
mod calibrate;
mod chain;
mod chain_trial;
mod coast;
mod combine;
mod config;
mod drag;
mod drive;
mod evidence;
mod facts;
mod finger;
mod friction_force;
mod identify;
mod joint;
mod lift;
mod materials;
mod parting;
mod pool;
mod press;
mod push;
mod replay;
mod resolve;
mod share;
mod solid;
mod squeeze;
mod surface;
mod tilt;
mod together;

pub use action::{action_of, first_rest, rest_pose, start_poses, support_normal};
pub use calibrate::calibrate_friction;
pub use config::Config;
pub use identify::identify;
pub use materials::{MaterialFriction, material_friction, material_table};
pub use replay::{replay_push, travel_direction};
