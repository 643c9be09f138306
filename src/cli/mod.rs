//! The command line: parse, call, print.

mod arguments;
mod batch;
mod calibrate;
mod check;
mod demo;
mod diagnose;
mod explore;
mod export;
mod import;
mod inspect;
mod output;
mod reconstruct;
mod run;
mod schema;
mod score;
mod simulate;
mod synth;
mod view;

pub use arguments::{Arguments, Command};
pub use run::run;
