//! Symmetry of things whose symmetry is known: `cargo bench --bench symmetry [clean|fused|partial|coverage|bottoms|superquadrics]`.
//! Angles in degrees, distances in mm; truth is how the things were made, the range camera is the lab's.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::print_stdout,
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    reason = "a program that prints a table"
)]

mod judge;
mod quadrics;
mod rendered;
mod shapes;

use std::time::Instant;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use palpate::base::{Notices, Seed, rng_for};
use palpate::geometry::Mesh;
use palpate::stages::symmetry::{Config, Evidence, detect};
use palpate::twin::Symmetry;
use rand::Rng;

use judge::{Tally, judge};
use shapes::{asymmetric, scans, symmetric};

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wants = |name: &str| asked.is_empty() || asked.iter().any(|a| a == name);
    if wants("clean") {
        clean();
    }
    if wants("fused") {
        rendered::fused();
    }
    if wants("partial") {
        rendered::partial();
    }
    if wants("bottoms") {
        rendered::bottoms();
    }
    if wants("superquadrics") {
        quadrics::superquadrics();
    }
    if asked.iter().any(|a| a == "look") {
        rendered::look();
    }
    if wants("coverage") {
        rendered::coverage();
    }
}

pub fn found(mesh: &Mesh, evidence: &Evidence) -> Symmetry {
    detect("it", mesh, evidence, &Config::default(), &mut Notices::default()).expect("settings that work")
}

/// A pose that favours no axis.
pub fn any_pose(seed: u64) -> Isometry3<f64> {
    let mut rng = rng_for(Seed(seed), "pose");
    let mut one = || rng.random_range(-1.0..1.0);
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(one(), one(), one()) * 2.0);
    Isometry3::from_parts(Vector3::new(one(), one(), one()).scale(0.3).into(), turn)
}

fn clean() {
    println!("\nclean meshes, any pose: planes found of true, false ones, worst plane and axis");
    let mut tally = Tally::default();
    for (i, thing) in symmetric().iter().chain(&asymmetric()).enumerate() {
        let pose = any_pose(i as u64);
        let start = Instant::now();
        let symmetry = found(&thing.mesh.transformed(&pose), &Evidence::default());
        let seconds = start.elapsed().as_secs_f64();
        let judged = judge(thing, &symmetry, &pose);
        println!("{:20} {judged}  {seconds:.2} s", thing.name);
        tally.add(&thing.name, judged);
    }
    println!("{tally}");
    for (name, mesh) in scans() {
        let symmetry = found(
            &mesh,
            &Evidence {
                noise: 5e-4,
                ..Evidence::default()
            },
        );
        let planes: Vec<String> = symmetry.planes.iter().map(|p| format!("{:.2}", p.score)).collect();
        let axes: Vec<String> = symmetry
            .axes
            .iter()
            .map(|a| format!("{}-fold {:.2}", a.fold, a.score))
            .collect();
        println!("scan {name:22} planes {planes:?} axes {axes:?}");
    }
}

/// Distance of two directions, degrees.
pub fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b).abs()).to_degrees()
}

pub fn distance_to_line(p: &Point3<f64>, on: &Point3<f64>, direction: &Vector3<f64>) -> f64 {
    (p - on).cross(direction).norm()
}
