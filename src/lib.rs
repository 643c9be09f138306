//! The library behind the `palpate` binary.
//!
#![doc = include_str!("../README.md")]

pub mod base;
pub mod capture;
pub mod cli;
pub mod engines;
pub mod export;
pub mod geometry;
pub mod import;
pub mod lab;
pub mod math;
pub mod physics;
pub mod pipeline;
#[cfg(feature = "rerun")]
pub mod recording;
pub mod report;
pub mod stages;
pub mod twin;
