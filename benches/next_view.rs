//! How much of the true surface chosen views see, against random ones: `cargo bench --bench next_view [-- SCENES]`.
//!
//! Ten random table scenes of the lab, by seed. A spot of a true surface is seen by a view where the reading at its pixel
//! is within 4 mm of it; that is measured on the true meshes, and the planner knows nothing of them.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::disallowed_macros,
    reason = "a benchmark prints, and stops where it fails"
)]

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Point3;
use palpate::base::{Pose, Seed, Stopwatch, rng_for};
use palpate::capture::{Answer, Camera, Rig, RigDescription, View};
use palpate::geometry::sample_surface;
use palpate::lab::{LabRig, Scene, parse_scene};
use palpate::stages::shape::{Decision, NextView, NextViewConfig};
use rand::Rng;
use rand::seq::SliceRandom;

/// How far a reading may be from a spot that it is taken to show, m.
const NEAR: f64 = 0.004;
/// Random draws of 12 views of which the mean is taken.
const DRAWS: usize = 8;

/// Five to seven things of mixed shape on a table, none through another.
fn scene(seed: u64) -> Scene {
    let mut rng = rng_for(Seed(seed), "next view scene");
    let mut text = format!("name = \"table-{seed}\"\n[camera]\nviews = 1\ndistance = 0.6\ntarget = [0.0, 0.0, 0.05]\n");
    let mut taken: Vec<([f64; 2], f64)> = Vec::new();
    let count = rng.random_range(5..=7);
    while taken.len() < count {
        let i = taken.len();
        // To the tenth of a millimetre that the text below states, so that things stand on the table.
        let tenth = |x: f64| (x * 1e4).round() / 1e4;
        let half = tenth(rng.random_range(0.02..0.05));
        let height = tenth(rng.random_range(0.03..0.16));
        let (shape, radius, z) = match rng.random_range(0..5) {
            0 | 1 => {
                let wide = half * rng.random_range(0.5..1.0);
                let size = format!("[{:.4}, {:.4}, {height:.4}]", 2.0 * half, 2.0 * wide);
                (
                    format!("{{ kind = \"box\", size = {size} }}"),
                    half.hypot(wide),
                    height / 2.0,
                )
            }
            2 => (
                format!("{{ kind = \"cylinder\", radius = {half:.4}, height = {height:.4} }}"),
                half,
                height / 2.0,
            ),
            3 => (format!("{{ kind = \"sphere\", radius = {half:.4} }}"), half, half),
            _ => {
                let (r, h, w) = (half.max(0.028), 0.06 + half, 0.004);
                let profile = format!(
                    "[[0, 0], [{r:.4}, 0], [{r:.4}, {h:.4}], [{:.4}, {h:.4}], [{:.4}, {w}], [0, {w}]]",
                    r - w,
                    r - w
                );
                (format!("{{ kind = \"lathe\", profile = {profile} }}"), r, 0.0)
            }
        };
        let spot = [rng.random_range(-0.14..0.14), rng.random_range(-0.14..0.14)];
        let free = |(p, r): &([f64; 2], f64)| (p[0] - spot[0]).hypot(p[1] - spot[1]) > r + radius + 0.008;
        if !taken.iter().all(free) {
            continue;
        }
        taken.push((spot, radius));
        let yaw = rng.random_range(0.0..3.0);
        let _ = writeln!(
            text,
            "[[body]]\nname = \"thing-{i}\"\nshape = {shape}\nposition = [{:.5}, {:.5}, {z:.6}]\nyaw = {yaw:.4}",
            spot[0], spot[1]
        );
    }
    parse_scene(&text, Path::new("random.toml")).expect("a sound scene")
}

/// Spots of the true surfaces, world.
fn spots(rig: &LabRig, seed: u64) -> Vec<Point3<f64>> {
    let mut out = Vec::new();
    for solid in rig.solids().values() {
        let count = (solid.mesh.area() * 4e5) as usize;
        let mut rng = rng_for(Seed(seed), &solid.name);
        let samples = sample_surface(&solid.mesh, count, &mut rng);
        out.extend(samples.iter().map(|s| solid.world_from_body.0 * s.point));
    }
    out
}

/// Which spots a view shows.
fn shown(camera: &Camera, view: &View, spots: &[Point3<f64>]) -> Vec<bool> {
    let sees = |spot: &Point3<f64>| {
        let p = view.world_from_camera.inverse_transform_point(spot);
        let (u, v) = (camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy);
        if p.z <= 0.0
            || u < 0.0
            || v < 0.0
            || u.round() >= f64::from(camera.width)
            || v.round() >= f64::from(camera.height)
        {
            return false;
        }
        let at = v.round() as usize * camera.width as usize + u.round() as usize;
        let depth = f64::from(view.depth.counts[at]) * camera.depth_unit;
        depth > 0.0 && (depth - p.z).abs() < NEAR
    };
    spots.iter().map(sees).collect()
}

fn share(seen: &[Vec<bool>]) -> f64 {
    let count = seen.first().map_or(0, Vec::len);
    let any = (0..count).filter(|i| seen.iter().any(|view| view[*i])).count();
    any as f64 / count.max(1) as f64
}

fn look(rig: &mut LabRig, pose: &Pose) -> View {
    match rig.look(pose).expect("a view") {
        Answer::Done(view) => view,
        Answer::Refused(why) => panic!("{why}"),
    }
}

/// Shares after each chosen view, how many it took to stop, and the seconds of each choice.
fn chosen(rig: &mut LabRig, said: &RigDescription, spots: &[Point3<f64>]) -> (Vec<f64>, Option<usize>, f64) {
    let camera = &said.cameras[0];
    // It goes on to ten views, and the place is noted where it would have stopped.
    let config = NextViewConfig {
        least_gain: 0.0,
        ..NextViewConfig::default()
    };
    let mut planner =
        NextView::new(config, camera, &said.reach, said.workspace, said.support.as_ref()).expect("a planner");
    let (mut seen, mut shares, mut stopped, mut seconds) = (Vec::new(), Vec::new(), None, 0.0);
    while shares.len() < 10 {
        let watch = Stopwatch::start();
        let decision = planner.decide();
        seconds += watch.seconds();
        let pose = match decision {
            Decision::Look(choice) => {
                let defaults = NextViewConfig::default();
                if shares.len() >= defaults.least_views && choice.share < defaults.least_gain {
                    stopped.get_or_insert(shares.len());
                }
                if std::env::var("WHY").is_ok() {
                    println!("    {}", choice.why);
                }
                choice.world_from_camera
            }
            Decision::Stop(why) => {
                if std::env::var("WHY").is_ok() {
                    println!("    {why}");
                }
                break;
            }
        };
        let view = look(rig, &pose);
        planner.add(camera, &view);
        seen.push(shown(camera, &view, spots));
        shares.push(share(&seen));
    }
    let last = shares.last().copied().unwrap_or(0.0);
    shares.resize(10, last);
    (shares, stopped, seconds / 10.0)
}

fn main() {
    let scenes: u64 = std::env::args().filter_map(|a| a.parse().ok()).next().unwrap_or(10);
    println!("scene     6 chosen  12 random   10 chosen  60 random  of 60   stop   s a choice");
    let mut sums = [0.0; 4];
    let mut least = [f64::INFINITY; 2];
    for seed in 0..scenes {
        let made = scene(seed);
        let mut rig = LabRig::new(&made, Path::new("."), Seed(seed)).expect("a rig");
        let said = rig.describe().expect("a description");
        let spots = spots(&rig, seed);
        let (shares, stopped, seconds) = chosen(&mut rig, &said, &spots);
        let poses = said.reach.poses(240);
        let seen: Vec<Vec<bool>> = poses
            .iter()
            .map(|pose| shown(&said.cameras[0], &look(&mut rig, pose), &spots))
            .collect();
        let mut rng = rng_for(Seed(seed), "random views");
        let mut order: Vec<usize> = (0..poses.len()).collect();
        let mut mean = [0.0; 2];
        for _ in 0..DRAWS {
            order.shuffle(&mut rng);
            for (sum, count) in mean.iter_mut().zip([12, 60]) {
                let drawn: Vec<Vec<bool>> = order[..count].iter().map(|i| seen[*i].clone()).collect();
                *sum += share(&drawn) / DRAWS as f64;
            }
        }
        let row = [shares[5], mean[0], shares[9], mean[1]];
        for (sum, x) in sums.iter_mut().zip(row) {
            *sum += x / scenes as f64;
        }
        least = [least[0].min(row[0] - row[1]), least[1].min(row[2] / row[3])];
        let stop = stopped.map_or("-".to_owned(), |n| n.to_string());
        println!(
            "{:10} {:.4}    {:.4}      {:.4}     {:.4}    {:.4}  {stop:>4}   {seconds:.2}",
            made.name,
            row[0],
            row[1],
            row[2],
            row[3],
            row[2] / row[3]
        );
    }
    println!(
        "mean       {:.4}    {:.4}      {:.4}     {:.4}    {:.4}",
        sums[0],
        sums[1],
        sums[2],
        sums[3],
        sums[2] / sums[3]
    );
    println!(
        "6 chosen less 12 random: mean {:+.4}, worst {:+.4} (bar: not below 0)\n10 chosen over 60: mean {:.4}, worst {:.4} (bar: 0.98)",
        sums[0] - sums[1],
        least[0],
        sums[2] / sums[3],
        least[1]
    );
}
