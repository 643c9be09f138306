//! `segment`: each recording cut into rest, approach, stick, slide, release, with what was in contact.

mod ceiling;
mod clipped;
mod config;
mod contact;
mod cut;
mod doubtful;
mod frozen;
mod hum;
mod motion;
mod preload;
mod segment;
mod sift;
mod stairs;
mod strangers;

pub use config::Config;
pub use segment::segment;
pub use sift::sift;
pub use strangers::warn_of_strangers;
