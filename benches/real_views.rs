//! How far what was reconstructed is from what each view itself saw: `cargo bench --bench real_views -- CAPTURE`.
//!
//! For every view the median distance of its readings from the surface (the scene with the things in it), the share of
//! readings farther than 20 mm from it, and the share whose ray meets the surface more than 30 mm before the reading:
//! ghosts. Without a truth this is the least that a reconstruction of real views owes.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    reason = "a program that measures stops at what it cannot read, and prints"
)]

use std::path::Path;

use nalgebra::Point3;
use palpate::base::Notices;
use palpate::capture::{Capture, View, read_capture};
use palpate::geometry::{Mesh, SurfaceDistance};
use palpate::stages::shape::{Config, reconstruct, seen_surface};

/// Every so many pixels in rows and columns are asked.
const STEP: usize = 5;
/// Distance from which a surface does not show a reading, m.
const FAR: f64 = 0.02;
/// Distance before a reading from which a surface is a ghost, m.
const BEFORE: f64 = 0.03;

fn main() {
    let folder = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    let folder = folder.expect("the folder of a capture");
    let capture = read_capture(Path::new(&folder)).expect("a capture");
    let shapes = reconstruct(&capture, &Config::default(), &mut Notices::default()).expect("shapes");
    let mut whole = shapes.scene.clone().unwrap_or_default();
    for object in &shapes.objects {
        whole.append(&object.mesh.transformed(&object.world_from_link.0));
    }
    measure("scene and things", &capture, &whole);
    let seen = seen_surface(&capture, &Config::default(), &mut Notices::default()).expect("a surface");
    measure("seen surface", &capture, &seen);
}

fn measure(name: &str, capture: &Capture, mesh: &Mesh) {
    println!(
        "{name}: {} triangles, {:.0} cm²",
        mesh.triangles.len(),
        1e4 * mesh.area()
    );
    let surface = SurfaceDistance::new(mesh).expect("triangles");
    let mut worst: f64 = 0.0;
    for (i, view) in capture.views.iter().enumerate() {
        let points = points(capture, view);
        let eye = Point3::from(view.world_from_camera.translation.vector);
        let mut far: Vec<f64> = points.iter().map(|p| surface.distance(p)).collect();
        far.sort_by(f64::total_cmp);
        let ghost = |p: &&Point3<f64>| {
            let ray = *p - eye;
            surface.is_hit(&eye, &ray.normalize(), ray.norm() - BEFORE)
        };
        let ghosts = points.iter().filter(ghost).count();
        let share = |n: usize| 100.0 * n as f64 / points.len().max(1) as f64;
        let median = far.get(far.len() / 2).copied().unwrap_or(f64::INFINITY);
        println!(
            "view {i:2}: median {:.2} mm, {:.1} % farther than 20 mm, {:.1} % behind a ghost",
            1e3 * median,
            share(far.iter().filter(|d| **d > FAR).count()),
            share(ghosts)
        );
        worst = worst.max(median);
    }
    println!("worst median {:.2} mm\n", 1e3 * worst);
}

/// Readings of a view in the world, as a pinhole camera without distortion would see them.
fn points(capture: &Capture, view: &View) -> Vec<Point3<f64>> {
    let camera = &capture.cameras[view.camera];
    assert!(camera.distortion == [0.0; 5], "a camera without distortion");
    let (width, height) = (view.depth.width as usize, view.depth.height as usize);
    let mut points = Vec::new();
    for y in (0..height).step_by(STEP) {
        for x in (0..width).step_by(STEP) {
            let depth = f64::from(view.depth.counts[x + y * width]) * camera.depth_unit;
            if depth > camera.depth_min && depth < camera.depth_max {
                let ray = [(x as f64 - camera.cx) / camera.fx, (y as f64 - camera.cy) / camera.fy];
                points.push(view.world_from_camera.0 * Point3::new(ray[0] * depth, ray[1] * depth, depth));
            }
        }
    }
    points
}
