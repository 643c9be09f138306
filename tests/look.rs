//! The next view goes to where something was hidden, ends when nothing is to be won; and what stays hidden of a thin-walled
//! vessel is closed at the thickness of its wall, and said so.
#![allow(clippy::expect_used, clippy::disallowed_macros, missing_docs, reason = "a test")]

use std::path::Path;

use nalgebra::Vector3;
use palpate::base::{Notices, Pose, Progress, Seed};
use palpate::capture::{Answer, Rig};
use palpate::geometry::Mesh;
use palpate::lab::{LabRig, Scene, parse_scene, synthesise};
use palpate::stages::shape::{
    Config, Decision, FindSymmetry, NextView, NextViewConfig, ShapedObject, reconstruct_with,
};
use palpate::stages::symmetry::{self, Evidence, detect};
use palpate::twin::{SupportPlane, Symmetry};

const BOWL: &str =
    "[[0, 0], [0.03, 0], [0.055, 0.02], [0.07, 0.05], [0.066, 0.05], [0.051, 0.023], [0.028, 0.004], [0, 0.004]]";

fn one(shape: &str, z: f64) -> Scene {
    let text = format!(
        "name = \"one\"\ncamera = {{ views = 16 }}\n[[body]]\nname = \"thing\"\ntracked = false\nshape = {shape}\n\
         position = [0.0, 0.0, {z}]\n"
    );
    parse_scene(&text, Path::new("one.toml")).expect("a scene")
}

/// From where the views were chosen until it was enough, relative to the middle of the things.
fn looks(scene: &Scene) -> Vec<Vector3<f64>> {
    let mut rig = LabRig::new(scene, Path::new("."), Seed(1)).expect("a rig");
    let said = rig.describe().expect("a description");
    let camera = &said.cameras[0];
    let config = NextViewConfig::default();
    let mut planner =
        NextView::new(config, camera, &said.reach, said.workspace, said.support.as_ref()).expect("a planner");
    let mut ways = Vec::new();
    while let (Decision::Look(choice), true) = (planner.decide(), ways.len() < 40) {
        println!("{}", choice.why);
        if let Answer::Done(view) = rig.look(&choice.world_from_camera).expect("a view") {
            planner.add(camera, &view);
            ways.push(view.world_from_camera.translation.vector);
        }
    }
    ways
}

#[test]
fn the_second_look_is_from_behind_and_looking_ends() {
    let ways = looks(&one("{ kind = \"box\", size = [0.08, 0.06, 0.1] }", 0.05));
    let (first, second) = (ways[0].xy().normalize(), ways[1].xy().normalize());
    println!("cosine {:.2}, {} views", first.dot(&second), ways.len());
    assert!(first.dot(&second) < -0.5);
    assert!((4..=16).contains(&ways.len()));
}

#[test]
fn a_thin_vessel_is_looked_into() {
    let profile = "[[0, 0], [0.035, 0], [0.035, 0.1], [0.031, 0.1], [0.031, 0.004], [0, 0.004]]";
    let ways = looks(&one(&format!("{{ kind = \"lathe\", profile = {profile} }}"), 0.0));
    let steep = ways.iter().filter(|w| w.z > 0.85 * w.norm()).count();
    println!("{steep} steep ones of {}", ways.len());
    assert!(steep >= 2 && ways.len() <= 16);
}

/// The largest thing, what it is off in volume, and whether its wall was continued.
fn vessel(profile: &str, find: &FindSymmetry) -> (ShapedObject, f64, bool) {
    let scene = one(&format!("{{ kind = \"lathe\", profile = {profile} }}"), 0.0);
    let rig = LabRig::new(&scene, Path::new("."), Seed(1)).expect("a rig");
    let truth = rig.solids().values().next().expect("a thing").mesh.volume();
    let made = synthesise(&scene, Path::new("."), Seed(1), &Progress::silent()).expect("a capture");
    let mut notices = Notices::default();
    let shapes = reconstruct_with(&made.capture, &Config::default(), find, &mut notices).expect("settings that work");
    let said = notices.0.iter().any(|n| n.message.contains("its wall is"));
    let largest = shapes
        .objects
        .into_iter()
        .max_by(|a, b| a.mesh.area().total_cmp(&b.mesh.area()))
        .expect("seen");
    let off = largest.mesh.volume() / truth - 1.0;
    println!(
        "off by {:+.2} %, {:?}, said {said}",
        100.0 * off,
        largest.mesh.origin_shares()
    );
    (largest, off, said)
}

fn no_symmetry(_: &Mesh, _: &Pose, _: Option<&SupportPlane>) -> palpate::base::Result<Symmetry> {
    Ok(Symmetry::default())
}

#[test]
fn the_hidden_outside_of_a_bowl_is_closed_at_the_thickness_of_its_wall() {
    let (bowl, off, said) = vessel(BOWL, &no_symmetry);
    let [_, mirrored, closed] = bowl.mesh.origin_shares();
    assert!(off.abs() < 0.02 && said && mirrored == 0.0 && closed > 0.1);
}

#[test]
fn images_of_empty_space_do_not_thin_the_wall_of_a_bowl() {
    let evidence = Evidence {
        blur: 0.003,
        noise: 0.0002,
        ..Evidence::default()
    };
    let find = |mesh: &Mesh, _: &Pose, _: Option<&SupportPlane>| {
        detect(
            "it",
            mesh,
            &evidence,
            &symmetry::Config::default(),
            &mut Notices::default(),
        )
    };
    let (bowl, off, _) = vessel(BOWL, &find);
    let [_, mirrored, _] = bowl.mesh.origin_shares();
    assert!(off.abs() < 0.02 && mirrored > 0.01);
}

#[test]
fn a_thick_foot_that_the_seen_outside_shuts_in_stays_solid() {
    let (_, off, said) = vessel(
        "[[0, 0], [0.04, 0], [0.04, 0.08], [0.036, 0.08], [0.036, 0.02], [0, 0.02]]",
        &no_symmetry,
    );
    assert!(off.abs() < 0.02 && !said);
}
