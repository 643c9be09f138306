//! `relate`: what rests on what, what is held to what, from what moved along and what was tried.

mod relate;

pub use relate::{Config, relate};
