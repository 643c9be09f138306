//! `infer`: friction and what else a thing's motions tell, from where it was before and after a tool moved it.

mod bench;
mod config;
mod diagnose;
mod effects;
mod evidence;
mod gather;
mod infer;
mod learnt;
mod posterior;
mod process;
mod report;
mod search;
mod space;
mod write;

pub use bench::{Bench, Group, Measured};
pub use config::Config;
pub use effects::{Effect, Gaussian, energy_distance};
pub use gather::{gather, holds_snapshots_only};
pub use infer::{infer, optimise, study};
pub use learnt::{Kind, LearntPrior, Seen, ShapeClass};
pub use posterior::{Marginal, Posterior, posterior};
pub use process::Process;
pub use report::{GroupResult, SearchStep, Snapshots, ThingResult};
pub use search::{Evaluation, Search};
pub use space::{DIMENSIONS, NAMES, Prior, Scores, Space, UNITS};
