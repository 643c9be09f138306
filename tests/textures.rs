//! Textures show what was seen, stand beside their meshes, and come back as they were written.
#![allow(clippy::expect_used, reason = "tests may panic")]

use std::fs;
use std::path::Path;

use palpate::base::{Progress, Seed, StagedFolder};
use palpate::export::{Format, check, export_all, exports_as};
use palpate::geometry::Texture;
use palpate::lab::{parse_scene, synthesise};
use palpate::pipeline::{Options, Run, build};
use palpate::twin::{TWIN_FILE, read_twin, texture_path, write_twin};

/// A red box close before a green one, seen by eight views.
const SCENE: &str = r#"
name = "two"
[camera]
views = 8
[[body]]
name = "red"
shape = { kind = "box", size = [0.06, 0.05, 0.05] }
position = [0.0, 0.0, 0.025]
color = [200, 40, 40]
[[body]]
name = "green"
shape = { kind = "box", size = [0.06, 0.05, 0.08] }
position = [0.0, 0.075, 0.04]
color = [40, 200, 40]
"#;

fn run() -> Run {
    let scene = parse_scene(SCENE, Path::new("two.toml")).expect("a scene");
    let made = synthesise(&scene, Path::new("."), Seed(3), &Progress::silent()).expect("a capture");
    build(&made.capture, &Options::default(), &Progress::silent()).expect("a twin")
}

/// Every thing has its own colours and none of its neighbour's; what is written comes back, every export names the image,
/// and a check misses it when it is gone.
#[test]
fn textures_show_what_was_seen_and_come_back() {
    let run = run();
    let model = &run.model;
    let textures: Vec<(&String, &Texture)> = model.textures.iter().collect();
    assert_eq!(textures.len(), 2);
    for (path, texture) in &textures {
        assert!(texture.width <= 1024 && texture.height <= 1024);
        let link = model.twin.links().find(|(_, l)| l.mesh.as_ref() == Some(path));
        let green = link.expect("its link").1.pose.translation.vector.y > 0.04;
        let own = |c: &&[u8; 3]| if green { c[1] > c[0] + 20 } else { c[0] > c[1] + 20 };
        let share = texture.rgb.iter().filter(own).count() as f64 / texture.rgb.len() as f64;
        assert!(share > 0.99, "{path}: {share} of the texels are its own");
    }

    let place = tempfile::tempdir().expect("a folder");
    let target = place.path().join("twin");
    let staged = StagedFolder::create(&target, TWIN_FILE).expect("a folder");
    write_twin(&staged, model, &run.diagnosis).expect("written");
    export_all(model, &staged).expect("exported");
    staged.commit().expect("there");
    let (back, _) = read_twin(&target).expect("reads back");
    for (path, texture) in &textures {
        let read = &back.textures[*path];
        assert_eq!((&read.rgb, &read.corners), (&texture.rgb, &texture.corners), "{path}");
        let off = read.places.iter().zip(&texture.places);
        assert!(
            off.flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]])
                .all(|d| d.abs() < 1e-6)
        );
    }
    let (files, _) = exports_as(&back, &[Format::Urdf, Format::Mjcf, Format::Sdf, Format::Usd]).expect("exports");
    for (file, text) in files.iter().filter(|(file, _)| file.starts_with("scene.")) {
        let text = String::from_utf8_lossy(text);
        for (path, _) in &textures {
            assert!(
                text.contains(&texture_path(path)),
                "{file} does not name the image of {path}"
            );
        }
    }
    assert!(check(&target).expect("checked").passed());
    fs::remove_file(target.join(texture_path(textures[0].0))).expect("removed");
    assert!(read_twin(&target).is_err());
}
