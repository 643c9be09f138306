//! The laws of the made-up world: rigid bodies in maximal coordinates, dry contacts, joints, glue, a driven tool.

mod body;
mod cluster;
mod distance;
mod drive;
mod footprint;
mod friction;
mod hiding;
mod joint;
mod patch;
mod prepared;
mod script;
mod shove;
mod steady;
#[cfg(test)]
mod tests;
mod tool;
mod weld;
mod world;

pub(crate) use body::Frame;
pub(crate) use cluster::{Ties, participants, put_on_table};
pub(crate) use script::{Script, Tilting, Wielding};
pub(crate) use tool::Hand;
pub(crate) use world::{Turning, World};
