//! What several tests share: a good capture and the ways to damage it.

#![allow(dead_code, reason = "each test uses its own part")]

pub mod damaged;
pub mod good;
