//! The ground of the house: what every room needs and no algorithm.

mod digest;
mod error;
mod estimate;
mod file;
mod notices;
mod pose;
mod progress;
mod seed;

pub use digest::{Digest, digest_of};
pub use error::{Error, Result, nearest_name};
pub use estimate::{Confounded, Estimate, Status, Value};
pub use file::{StagedFolder, read_bytes, read_text, write_atomically};
pub use notices::{Notice, Notices, Severity};
pub use pose::Pose;
pub use progress::Progress;
pub use seed::{Seed, Stopwatch, rng_for};
