//! A finished run as one self-contained page; computes no new result.

mod page;

pub use page::render;
