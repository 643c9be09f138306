//! `relate`: what rests on what, what is held to what, from what moved along and what was tried.

mod breakaway;
mod carried;
mod config;
mod evidence;
mod placing;
mod relate;
mod support;
#[cfg(test)]
mod tests;

pub use config::Config;
pub use relate::relate;
