//! `infer`: friction and what else a thing's motions tell, from where it was before and after a tool moved it.

mod bench;
mod config;
mod course;
mod diagnose;
mod effects;
mod evidence;
mod gather;
mod infer;
mod judge;
mod learnt;
mod likelihood;
mod posterior;
mod process;
mod report;
mod search;
mod space;
mod write;

pub use bench::{Bench, Group, Measured, Simulated};
pub use config::Config;
pub use course::{Begun, Course, Keeper};
pub use effects::{Effect, Gaussian, energy_distance};
pub use gather::{gather, holds_snapshots_only};
pub use infer::{divergence, fresh, infer, optimise, study};
pub use judge::{Judged, judge};
pub use learnt::{Kind, LearntPrior, Seen, ShapeClass};
pub use posterior::{Marginal, Posterior, posterior};
pub use process::Process;
pub use report::{GroupResult, SearchStep, Snapshots, ThingResult};
pub use search::{Evaluation, Search};
pub use space::{DIMENSIONS, NAMES, Prior, Scales, Scores, Space, UNITS};
