//! What several tests share: a good capture and the ways to damage it.

#![allow(dead_code, reason = "each test uses its own part")]
#![allow(clippy::expect_used, clippy::panic, reason = "tests may stop")]

pub mod damaged;
pub mod elsewhere;
pub mod good;
