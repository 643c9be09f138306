//! `identify`: mass, friction, centre of mass, inertia, stiffness from what was measured, with intervals.

mod identify;

pub use identify::{Config, identify};
