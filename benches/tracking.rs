//! How well and how fast bodies are followed by vision, and parts told apart by motion:
//! `RAYON_NUM_THREADS=1 cargo bench --bench tracking`.
#![allow(
    missing_docs,
    dead_code,
    clippy::expect_used,
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    reason = "a program that prints what it measured"
)]

#[path = "../tests/common/filmed.rs"]
mod filmed;

use std::path::Path;

use filmed::{Errors, filmed, shapes, share_right};
use palpate::base::Notices;
use palpate::lab::{Scene, parse_scene, scene_named};
use palpate::stages::shape::{Config, follow};

/// One body of a shape that is pushed off its centre, filmed at 30 Hz by 320 x 240 pixels.
fn pushed(name: &str, shape: &str, height: f64, at: [f64; 3]) -> Scene {
    let text = format!(
        r#"
        name = "{name}"
        camera = {{ views = 24, distance = 0.42, target = [0.0, 0.0, 0.03] }}
        film = {{ rate = 30.0, distance = 0.42, azimuth = -60.0, target = [0.02, 0.0, 0.03] }}
        [[body]]
        name = "{name}"
        shape = {shape}
        position = [0.0, 0.0, {height}]
        yaw = 0.3
        [[action]]
        kind = "push"
        name = "push"
        target = "{name}"
        at = [{}, {}, {}]
        direction = [1.0, 0.0, 0.0]
        travel = 0.05
        speed = 0.06
        "#,
        at[0], at[1], at[2]
    );
    parse_scene(&text, Path::new("bench.toml")).expect("a scene")
}

/// CPU seconds of this process so far, to 10 ms (`/proc/self/stat`, ticks of 10 ms); other work on the machine is not
/// in it.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("Linux");
    let fields: Vec<&str> = stat.rsplit(')').next().expect("fields").split_whitespace().collect();
    fields[11..13].iter().filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn track(scene: &Scene) {
    let made = filmed(scene.clone(), 1);
    let mut shapes = shapes(&made.capture);
    let mut notices = Notices::default();
    let start = cpu_seconds();
    let followed = follow(&made.capture, &mut shapes, &Config::default(), &mut notices).expect("tracks");
    let seconds = cpu_seconds() - start;
    for track in &followed.tracks {
        let truth = &made.truth[&(track.interaction.clone(), scene.name.clone())];
        let errors = Errors::of(
            track,
            truth,
            &made.home[&scene.name],
            &shapes.objects[0].world_from_link.0,
        );
        let (mm, degrees) = errors.rms();
        println!(
            "{:<10} {mm:>8.3} {degrees:>8.3} {:>12.2} {:>6} {:>8} {:>14.0}",
            scene.name,
            errors.normalised.iter().sum::<f64>() / errors.normalised.len() as f64 / 6.0,
            errors.lost,
            track.unseen,
            track.track.len() as f64 / seconds
        );
    }
}

fn main() {
    println!("one body         mm      deg error^2/cov/6   lost   unseen  Hz of CPU time");
    track(&pushed(
        "box",
        r#"{ kind = "box", size = [0.09, 0.06, 0.05] }"#,
        0.025,
        [-0.045, 0.012, 0.02],
    ));
    track(&pushed(
        "brick",
        r#"{ kind = "box", size = [0.05, 0.05, 0.09] }"#,
        0.045,
        [-0.025, 0.01, 0.03],
    ));
    track(&pushed(
        "cylinder",
        r#"{ kind = "cylinder", radius = 0.03, height = 0.07 }"#,
        0.035,
        [-0.03, 0.0, 0.03],
    ));
    let mug = r#"{ kind = "lathe", profile = [[0.0, 0.0], [0.038, 0.0], [0.038, 0.09], [0.034, 0.09], [0.034, 0.005], [0.0, 0.005]], handle = [0.022, 0.005, 0.045] }"#;
    track(&pushed("mug", mug, 0.0, [-0.038, 0.0, 0.03]));
    println!("parts by motion   things before   links   surface right");
    for name in ["filmed-drawer", "filmed-lid", "filmed-hinge"] {
        let scene = scene_named(name).expect("a scene");
        let made = filmed(scene.clone(), 3);
        let mut shapes = shapes(&made.capture);
        let before = shapes.objects.len();
        follow(&made.capture, &mut shapes, &Config::default(), &mut Notices::default()).expect("tracks");
        let share = 100.0 * share_right(&scene, &shapes);
        println!("{name:<16} {before:>14} {:>7} {share:>13.1} %", shapes.objects.len());
    }
}
