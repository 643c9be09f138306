//! `diagnose`: how far the twin's predictions are from what was measured, against the noise floor, and which causes
//! the data name for it.

mod alike;
mod asking;
mod axes;
mod compare;
mod config;
mod delay;
mod diagnose;
mod evidence;
mod family;
mod fit;
mod frames;
mod inertia;
mod joints;
mod marginal;
mod motion_history;
mod motion_laws;
mod motion_places;
mod motions;
mod named;
mod naming;
mod offset;
mod predict;
mod press_laws;
mod presses;
mod profile;
mod push_catalogue;
mod push_laws;
mod push_motion;
mod push_places;
mod push_states;
mod pushes;
mod screen;
mod sensor;
mod slide;
mod slope;
mod structure;
mod toss_curves;
mod toss_laws;
mod tosses;
mod trace;
mod turns;
mod white;

pub use config::Config;
pub use diagnose::{Diagnosed, diagnose};
pub use trace::{Curve, Path, Quantity, Trace};
