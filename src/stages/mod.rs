//! The wings: one stage, one verb, one noun that only it writes.

pub mod articulation;
pub mod diagnosis;
pub mod estimation;
pub mod interaction;
pub mod relations;
pub mod shape;
pub mod snapshots;
pub mod symmetry;
