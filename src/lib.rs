//! palpate looks at a tabletop, touches it, and hands back a simulator model that tells the truth.

pub mod base;
pub mod capture;
pub mod cli;
pub mod export;
pub mod geometry;
pub mod lab;
pub mod math;
pub mod physics;
pub mod pipeline;
pub mod report;
pub mod stages;
pub mod twin;
