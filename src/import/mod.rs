//! Other people's recordings as captures: TUM trajectories, BOP scenes, MCAP files of robots.

mod bag;
mod bop;
mod bop_json;
mod mcap;
mod messages;
mod pictures;
mod places;
mod tum;

pub use self::mcap::{McapRequest, import_mcap};
pub use bop::{BopRequest, import_bop};
pub use tum::import_tum;
