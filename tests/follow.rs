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
    // Squares of errors over the stated covariance average 6 where that is honest.
    let ratio = errors.normalised.iter().sum::<f64>() / errors.normalised.len() as f64 / 6.0;
    println!("mean square of the normalised errors {ratio:.2}");
    assert!((0.2..2.5).contains(&ratio));
}

#[test]
fn a_box_that_is_taken_away_is_lost_and_found_again_when_it_is_back() {
    let scene = |text: &str| parse_scene(text, Path::new("box.toml")).expect("a scene");
    let mut made = filmed(scene(BOX), 1);
    let away = BOX.replace("position = [0.0, 0.0, 0.025]", "position = [0.0, 0.16, 0.025]");
    let away = filmed(
        scene(&away.replace("at = [-0.045, 0.012, 0.02]", "at = [-0.045, 0.172, 0.02]")),
        1,
    );
    let empty = away.capture.interactions[0]
        .frames
        .as_ref()
        .expect("frames")
        .taken
        .clone();
    let frames = made.capture.interactions[0].frames.as_mut().expect("frames");
    let (first, last) = (frames.taken.len() / 3, frames.taken.len() / 3 + 10);
    frames.taken[first..last].clone_from_slice(&empty[first..last]);
    let mut shapes = shapes(&made.capture);
    let mut notices = Notices::default();
    let followed = follow(&made.capture, &mut shapes, &Config::default(), &mut notices).expect("tracks");
    let track = &followed.tracks[0];
    let rows: Vec<bool> = track.covariance.iter().map(Option::is_some).collect();
    println!("{rows:?} {notices:?}");
    assert!(rows[..first].iter().all(|found| *found) && rows[first..last].iter().all(|found| !found));
    assert!(rows[last..].iter().filter(|found| **found).count() * 10 >= 9 * (rows.len() - last));
    assert!(notices.0.iter().any(|n| n.message.contains("lost in")));
    let truth = &made.truth[&("push".into(), "box".into())];
    let (mm, degrees) = Errors::of(track, truth, &made.home["box"], &shapes.objects[0].world_from_link.0).rms();
    assert!(mm < 1.0 && degrees < 0.5, "{mm} mm, {degrees} degrees");
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
