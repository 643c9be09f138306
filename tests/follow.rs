//! Bodies are followed through the images of the lab's camera, and things come apart where they move apart.
#![allow(clippy::expect_used, clippy::disallowed_macros, missing_docs, reason = "a test")]

#[path = "common/filmed.rs"]
mod filmed;

use std::path::Path;

use filmed::{Errors, filmed, shapes, share_right};
use palpate::base::Notices;
use palpate::lab::{parse_scene, scene_named};
use palpate::stages::shape::{Config, follow};

const BOX: &str = r#"
    name = "pushed-box"
    camera = { views = 20, distance = 0.42, target = [0.0, 0.0, 0.03] }
    film = { rate = 15.0, distance = 0.42, azimuth = -25.0, target = [0.02, 0.0, 0.03] }
    [[body]]
    name = "box"
    shape = { kind = "box", size = [0.09, 0.06, 0.05] }
    position = [0.0, 0.0, 0.025]
    yaw = 0.3
    [[action]]
    kind = "push"
    name = "push"
    target = "box"
    at = [-0.045, 0.012, 0.02]
    direction = [1.0, 0.0, 0.0]
    travel = 0.05
    speed = 0.06
"#;

#[test]
fn a_pushed_box_is_followed_within_a_millimetre() {
    let made = filmed(parse_scene(BOX, Path::new("box.toml")).expect("a scene"), 1);
    let mut shapes = shapes(&made.capture);
    let mut notices = Notices::default();
    let followed = follow(&made.capture, &mut shapes, &Config::default(), &mut notices).expect("tracks");
    println!("{notices:?}");
    assert_eq!(followed.tracks.len(), 1);
    let errors = Errors::of(
        &followed.tracks[0],
        &made.truth[&("push".into(), "box".into())],
        &made.home["box"],
        &shapes.objects[0].world_from_link.0,
    );
    let (mm, degrees) = errors.rms();
    println!(
        "{mm:.3} mm, {degrees:.3} degrees, normalised {:.2}, lost {}, unseen {}",
        errors.median_normalised(),
        errors.lost,
        followed.tracks[0].unseen
    );
    assert!(mm < 1.0 && degrees < 0.5 && errors.lost == 0);
}

fn parted(name: &str) -> (usize, f64) {
    let scene = scene_named(name).expect("a scene");
    let made = filmed(scene.clone(), 3);
    let mut shapes = shapes(&made.capture);
    let before = shapes.objects.len();
    let mut notices = Notices::default();
    let followed = follow(&made.capture, &mut shapes, &Config::default(), &mut notices).expect("tracks");
    println!(
        "{name}: {before} -> {} links, {} tracks, {notices:?}",
        shapes.objects.len(),
        followed.tracks.len()
    );
    let share = share_right(&scene, &shapes);
    println!("{name}: {:.1} % of the surface right", 100.0 * share);
    (shapes.objects.len(), share)
}

#[test]
fn a_drawer_comes_apart_from_its_carcass() {
    let (links, share) = parted("filmed-drawer");
    assert!(links == 2 && share > 0.95);
}

#[test]
fn a_lid_comes_apart_from_its_box() {
    let (links, share) = parted("filmed-lid");
    assert!(links == 2 && share > 0.95);
}

#[test]
fn a_flap_comes_apart_from_its_post() {
    let (links, share) = parted("filmed-hinge");
    assert!(links == 2 && share > 0.95);
}
