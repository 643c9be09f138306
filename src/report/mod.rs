//! A finished run as one self-contained page; computes no new result.

mod causes;
mod diagnosis;
mod engines;
mod estimates;
mod graph;
mod header;
mod interactions;
mod joints;
mod layout;
mod markup;
mod notices;
mod numbers;
mod pack;
mod page;
mod plots;
mod profiles;
mod reasons;
mod replay;
mod rows;
mod scale;
mod scene;
mod snapshots;

pub use engines::with_engines;
pub use page::render;
