//! Effects that a plain model lacks, hidden in a scene for blind tests: in its laws, in its make, or in its sensors.

mod catalogue;
mod draw;
mod draw_more;
mod elastic;
mod fault;
mod jointed;
mod law;
mod occasion;
mod setting;
mod slide;
#[cfg(test)]
mod tests;
mod word;

pub use catalogue::hidden_causes;
pub(super) use catalogue::{effects, target, told};
pub(super) use elastic::ElasticLaw;
pub(super) use fault::faults;
pub(super) use jointed::JointLaw;
pub(super) use law::{Act, Effect};
pub(super) use occasion::{Occasion, occasions};
pub(super) use setting::{Pad, Setting, alter_solids, altered};
pub(super) use slide::{Make, SlideLaw, Surroundings};
pub(super) use word::most_of;
pub use word::{hide_at_random, hide_by_word};
