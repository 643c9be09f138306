//! One smooth solid for a thing: the superquadric against the size and the centre that the thing was made with.

use std::time::Instant;

use nalgebra::{Isometry3, Point3};
use palpate::geometry::{Mesh, superquadric_fit};

use super::any_pose;
use super::rendered::{place, seen, shaped};
use super::shapes::symmetric;

/// Things that a superquadric can be: the others only get the nearest one.
const EXACT: [&str; 6] = ["box", "book", "cube", "cylinder", "ball", "ellipsoid"];
const NEAREST: [&str; 4] = ["cup", "mug", "bottle", "octagon"];

pub fn superquadrics() {
    println!("\nsuperquadrics: clean meshes in any pose, and fused from 16 views");
    for (i, thing) in symmetric().iter().enumerate() {
        let exact = EXACT.contains(&thing.name.as_str());
        if !exact && !NEAREST.contains(&thing.name.as_str()) {
            continue;
        }
        let pose = any_pose(i as u64);
        row(&thing.name, "clean", &thing.mesh.transformed(&pose), &thing.mesh, &pose);
        let yaw = (0.37 * i as f64) % 6.0;
        let capture = seen(thing, 16, yaw, i as u64);
        let Some(object) = shaped(&capture) else { continue };
        let link_from_thing = object.world_from_link.0.inverse() * place(yaw);
        row(&thing.name, "fused", &object.mesh, &thing.mesh, &link_from_thing);
    }
}

/// Worst half size (sorted) and distance of the centres, mm, against the bounds of what the thing was made as.
fn row(name: &str, how: &str, mesh: &Mesh, truth: &Mesh, mesh_from_truth: &Isometry3<f64>) {
    let start = Instant::now();
    let Some(fit) = superquadric_fit(mesh) else {
        println!("{name:12} {how}: no fit");
        return;
    };
    let seconds = start.elapsed().as_secs_f64();
    let (low, high) = truth.bounds().expect("not empty");
    let half = (high - low) * 0.5;
    let (mut found, mut made) = (fit.size, [half.x, half.y, half.z]);
    found.sort_by(f64::total_cmp);
    made.sort_by(f64::total_cmp);
    let size = found.iter().zip(made).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let center = mesh_from_truth * nalgebra::center(&low, &high);
    let off = (Point3::from(fit.pose.translation.vector) - center).norm();
    println!(
        "{name:12} {how}: half size off by {:.2} mm, centre {:.2} mm, exponents {:.2} {:.2}, residual {:.2} mm  {seconds:.2} s",
        1e3 * size,
        1e3 * off,
        fit.exponents[0],
        fit.exponents[1],
        1e3 * fit.residual
    );
}
