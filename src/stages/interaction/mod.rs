//! `segment`: each recording cut into rest, approach, stick, slide, release, with what was in contact.

mod config;
mod contact;
mod cut;
mod motion;
mod segment;

pub use config::Config;
pub use segment::segment;
