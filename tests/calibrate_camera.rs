//! The noise of the lab's range camera from views of its bare table.

#![allow(clippy::expect_used, reason = "a test fails aloud")]

use std::path::Path;

use palpate::base::{Notices, Progress, Seed};
use palpate::capture::Capture;
use palpate::lab::{Scene, synthesise};
use palpate::stages::shape::{Term, camera_noise};

/// Views of a bare table from two distances.
fn capture(depth_sd: f64, seed: u64) -> Capture {
    let from = |distance: f64| {
        let text = format!(
            "name = \"table\"\n[camera]\nviews = 6\ndistance = {distance}\ndepth_sd = {depth_sd}\n\
             target = [0.0, 0.0, 0.0]\nelevations = [30.0, 50.0, 70.0]\n"
        );
        let scene: Scene = toml::from_str(&text).expect("a scene");
        synthesise(&scene, Path::new("."), Seed(seed), &Progress::silent())
            .expect("made")
            .capture
    };
    let mut near = from(0.4);
    near.views.extend(from(0.9).views);
    near
}

fn holds(term: &Term, truth: f64) -> bool {
    term.ci95[0] <= truth && truth <= term.ci95[1]
}

#[test]
fn noise_that_grows_with_the_range_is_told_from_rays_that_stray() {
    for (seed, depth_sd) in [(1, 0.0008), (2, 0.002)] {
        let found = camera_noise(&capture(depth_sd, seed), &mut Notices::default()).expect("noise");
        let noise = &found[0];
        assert!(
            (noise.depth_sd.value / depth_sd - 1.0).abs() < 0.05 && holds(&noise.depth_sd, depth_sd),
            "{noise:?}"
        );
        // The lab's rays stray by 0.12 pixels, and nothing but rounding is the same at every range.
        let stray = noise.stray.expect("seen at a slant");
        assert!((stray.value / 0.12 - 1.0).abs() < 0.15, "{noise:?}");
        assert!(noise.floor.expect("two distances").value < 3e-4, "{noise:?}");
    }
}

#[test]
fn a_capture_without_views_says_what_to_record() {
    let mut bare = capture(0.001, 3);
    bare.views.clear();
    let said = camera_noise(&bare, &mut Notices::default()).expect_err("no views");
    assert!(said.to_string().contains("views of a bare, still table"), "{said}");
}
