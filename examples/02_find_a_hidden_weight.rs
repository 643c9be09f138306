//! A box of one's own with a weight hidden in it, synthesised, lifted and pushed; where is the weight?
//! `cargo run --release --example 02_find_a_hidden_weight`
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use std::path::Path;

use palpate::base::{Error, Progress, Result, Seed};
use palpate::lab::{parse_scene, synthesise};
use palpate::pipeline;

const SCENE: &str = r#"
name = "parcel"

[camera]
views = 8
width = 200
height = 150
focal = 215.0
elevations = [35.0]
distance = 0.42
target = [0.0, 0.0, 0.03]

[[body]]
name = "parcel"
shape = { kind = "box", size = [0.110, 0.080, 0.060] }
density = 400.0
position = [0.0, 0.0, 0.030]
friction = { static = 0.36, kinetic = 0.31 }

[[body.weight]]
mass = 0.120
position = [0.033, -0.012, 0.0]
radius = 0.015

[[action]]
kind = "lift"
name = "lift"
target = "parcel"
at = [0.0, 0.0, 0.060]
height = 0.030

[[action]]
kind = "push"
name = "push"
target = "parcel"
at = [-0.055, 0.0, 0.025]
direction = [1.0, 0.0, 0.0]
travel = 0.040
speed = 0.040
"#;

fn main() -> Result<()> {
    let scene = parse_scene(SCENE, Path::new("parcel.toml"))?;
    let made = synthesise(&scene, Path::new("."), Seed(1), &Progress::silent())?;
    let run = pipeline::build(&made.capture, &pipeline::Options::default(), &Progress::silent())?;
    let missing = |what: &str| Error::Failed(format!("{what} of the parcel was not found"));
    let (_, link) = run
        .model
        .twin
        .links()
        .find(|(_, link)| link.name == "parcel")
        .ok_or_else(|| missing("the body"))?;
    let mass = link.mass.as_ref().ok_or_else(|| missing("the mass"))?;
    let found = link.com.as_ref().ok_or_else(|| missing("the centre of mass"))?;
    let truth = made.truth.bodies.get("parcel").ok_or_else(|| missing("the truth"))?;
    println!(
        "mass: {:.4} kg, 95 % {:?}; truth {:?}",
        mass.value, mass.ci95, truth.mass
    );
    println!("centre of mass: {:.4?} m, 95 % {:.4?}", found.value, found.ci95);
    println!("       in truth: {:.4?} m", truth.com);
    // A parcel filled evenly has its centre of mass in the middle: the weight lies where it is drawn to.
    println!(
        "the weight is towards x {}, y {}",
        if found.value[0] > 0.0 { "+" } else { "-" },
        if found.value[1] > 0.0 { "+" } else { "-" }
    );
    Ok(())
}
