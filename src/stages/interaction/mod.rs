//! `segment`: each recording cut into rest, approach, stick, slide, release, with what was in contact.

mod segment;

pub use segment::{Config, segment};
