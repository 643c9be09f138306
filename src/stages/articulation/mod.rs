//! `infer`: which tracked things are links of one body, and the joints between them.

mod infer;

pub use infer::{Articulation, Config, infer};
