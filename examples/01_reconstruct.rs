//! From a capture's folder to the masses of what was touched: `cargo run --release --example 01_reconstruct CAPTURE`.
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use palpate::base::{Error, Progress, Result};
use palpate::{capture::read_capture, pipeline};

fn main() -> Result<()> {
    let folder = std::env::args()
        .nth(1)
        .ok_or_else(|| Error::Usage("name a capture's folder".into()))?;
    let capture = read_capture(folder.as_ref())?;
    let run = pipeline::build(&capture, &pipeline::Options::default(), &Progress::silent())?;
    for (_, link) in run.model.twin.links() {
        println!("{}: {:?}", link.name, link.mass.as_ref().map(|m| (m.value, m.ci95)));
    }
    Ok(())
}
