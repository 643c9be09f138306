//! The same things seen by the lab's range camera and fused.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use nalgebra::{Isometry3, Point3, Vector3};
use palpate::base::{Notices, Pose, Progress, Seed};
use palpate::capture::Capture;
use palpate::geometry::{Mesh, Plane, SurfaceDistance, sample_surface};
use palpate::lab::{parse_scene, synthesise};
use palpate::stages::shape::{self, FreeSpace, ShapedObject, reconstruct, reconstruct_with};
use palpate::stages::symmetry::Evidence;
use palpate::twin::{SupportPlane, Symmetry};

use super::judge::{Tally, judge};
use super::shapes::{Thing, asymmetric, symmetric};

/// Noise of a fused surface, voxels.
const NOISE: f64 = 0.1;

/// World-from-thing in the scene.
pub fn place(yaw: f64) -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.02, -0.03, 0.0), Vector3::z() * yaw)
}

/// A capture of one thing by so many views.
pub fn seen(thing: &Thing, views: usize, yaw: f64, seed: u64) -> Capture {
    let folder: PathBuf = std::env::temp_dir().join(format!("palpate-symmetry-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut text = String::new();
    for v in &thing.mesh.vertices {
        writeln!(text, "v {} {} {}", v.x, v.y, v.z).expect("text");
    }
    for t in &thing.mesh.triangles {
        writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).expect("text");
    }
    std::fs::write(folder.join("thing.obj"), text).expect("a file");
    let at = place(yaw).translation;
    let scene = format!(
        "name = \"one\"\ncamera = {{ views = {views} }}\n[[body]]\nname = \"thing\"\ntracked = false\n\
         shape = {{ kind = \"mesh\", file = \"thing.obj\" }}\nposition = [{}, {}, {}]\nyaw = {yaw}\n",
        at.x, at.y, at.z
    );
    let scene = parse_scene(&scene, &folder.join("scene.toml")).expect("a scene");
    let made = synthesise(&scene, &folder, Seed(seed), &Progress::silent()).expect("a capture");
    std::fs::remove_dir_all(&folder).expect("removed");
    made.capture
}

/// The largest thing that the views show.
pub fn shaped(capture: &Capture) -> Option<ShapedObject> {
    let shapes = reconstruct(capture, &shape::Config::default(), &mut Notices::default()).expect("settings that work");
    shapes
        .objects
        .into_iter()
        .max_by(|a, b| a.mesh.area().total_cmp(&b.mesh.area()))
}

/// As `shaped`, completed by its symmetry.
fn completed(capture: &Capture) -> Option<ShapedObject> {
    let free = FreeSpace::new(capture, &shape::Config::default());
    let find =
        |mesh: &Mesh, world_from_mesh: &Pose, _: Option<&SupportPlane>| Ok(found_in(&free, mesh, world_from_mesh));
    let shapes = reconstruct_with(capture, &shape::Config::default(), &find, &mut Notices::default());
    let objects = shapes.expect("settings that work").objects.into_iter();
    objects.max_by(|a, b| a.mesh.area().total_cmp(&b.mesh.area()))
}

pub fn found(capture: &Capture, object: &ShapedObject) -> Symmetry {
    let free = FreeSpace::new(capture, &shape::Config::default());
    found_in(&free, &object.mesh, &object.world_from_link)
}

fn found_in(free: &FreeSpace, mesh: &Mesh, world_from_mesh: &Pose) -> Symmetry {
    let voxel = shape::Config::default().voxel;
    let is_free = |p: &Point3<f64>| free.is_free(&(world_from_mesh.0 * p));
    let up = world_from_mesh.rotation.inverse() * Vector3::z_axis();
    let evidence = Evidence {
        free: Some(&is_free),
        floor: Some(Plane::through(&(world_from_mesh.0.inverse() * Point3::origin()), up)),
        blur: 1.5 * voxel,
        noise: NOISE * voxel,
    };
    super::found(mesh, &evidence)
}

pub fn fused() {
    println!("\nfused from 16 views of 320 x 240 (noise 1 mm at 1 m), 2 mm voxels");
    let mut tally = Tally::default();
    for (i, thing) in symmetric().iter().chain(&asymmetric()).enumerate() {
        let yaw = (0.37 * i as f64) % 6.0;
        let capture = seen(thing, 16, yaw, i as u64);
        let Some(object) = shaped(&capture) else {
            println!("{:20} nothing was made of it", thing.name);
            continue;
        };
        let start = Instant::now();
        let symmetry = found(&capture, &object);
        let seconds = start.elapsed().as_secs_f64();
        let judged = judge(thing, &symmetry, &(object.world_from_link.0.inverse() * place(yaw)));
        println!("{:20} {judged}  {seconds:.2} s", thing.name);
        tally.add(&thing.name, judged);
    }
    println!("{tally}");
}

/// Views from one side only.
pub fn one_sided(mut capture: Capture, half_angle: f64) -> Capture {
    capture.views.retain(|v| {
        let eye = v.world_from_camera.translation.vector;
        eye.y.atan2(eye.x).abs() < half_angle
    });
    capture
}

pub fn partial() {
    println!("\nseen from a third of the circle only");
    let mut sums = (0.0, 0.0);
    let mut tally = Tally::default();
    for (i, thing) in symmetric().iter().chain(&asymmetric()).enumerate() {
        let yaw = (0.37 * i as f64) % 6.0;
        let capture = one_sided(seen(thing, 30, yaw, i as u64), 1.1);
        let Some(object) = shaped(&capture) else { continue };
        let symmetry = found(&capture, &object);
        let judged = judge(thing, &symmetry, &(object.world_from_link.0.inverse() * place(yaw)));
        let truth = thing.mesh.transformed(&place(yaw));
        let whole = two_way(&object.mesh.transformed(&object.world_from_link.0), &truth);
        let after =
            completed(&capture).map_or(f64::NAN, |o| two_way(&o.mesh.transformed(&o.world_from_link.0), &truth));
        println!(
            "{:20} seen {:.2} {judged}  two-way {whole:.3}, completed {after:.3} mm",
            thing.name, object.seen
        );
        sums = (sums.0 + whole, sums.1 + after);
        tally.add(&thing.name, judged);
    }
    println!("{tally}");
    let count = (symmetric().len() + asymmetric().len()) as f64;
    println!(
        "mean distance both ways: {:.2} mm, completed {:.2} mm",
        sums.0 / count,
        sums.1 / count
    );
}

/// Mean distance both ways, mm.
pub fn two_way(a: &Mesh, b: &Mesh) -> f64 {
    let one = |from: &Mesh, to: &Mesh| {
        let surface = SurfaceDistance::new(to).expect("triangles");
        let points = sample_surface(from, 4000, &mut palpate::base::rng_for(Seed(1), "two-way"));
        points.iter().map(|s| surface.distance(&s.point)).sum::<f64>() / points.len() as f64
    };
    500.0 * (one(a, b) + one(b, a))
}

/// Volumes closed at the support, and completed by symmetry first, as `palpate reconstruct` does. `SEED=N` takes other
/// noise, views and headings.
pub fn bottoms() {
    println!("\nvolume of flat-bottomed things fused from 16 views, true volume in cm³; closed, then completed first");
    let other = std::env::var("SEED").map_or(0, |s| s.parse::<u64>().expect("a number"));
    let mut worst = [0.0_f64; 2];
    for (i, thing) in symmetric().iter().filter(|t| t.flat && t.name != "mug").enumerate() {
        let yaw = 0.2 * i as f64 + 0.71 * other as f64;
        let capture = seen(thing, 16, yaw, i as u64 + 1000 * other);
        let truth = thing.mesh.transformed(&place(yaw));
        let mut said = String::new();
        for (object, worst) in [shaped(&capture), completed(&capture)].iter().zip(&mut worst) {
            let Some(object) = object else { continue };
            let off = object.mesh.volume() / truth.volume() - 1.0;
            let whole = two_way(&object.mesh.transformed(&object.world_from_link.0), &truth);
            write!(said, "   off by {:+5.2} %, two-way {whole:.3} mm", 100.0 * off).expect("text");
            *worst = worst.max(off.abs());
        }
        println!("{:20} {:8.2}{said}", thing.name, 1e6 * truth.volume());
    }
    println!("worst {:.2} %, completed {:.2} %", 100.0 * worst[0], 100.0 * worst[1]);
}

/// Intervals against errors over noise seeds.
pub fn coverage() {
    println!("\nintervals over seeds of noise, views and headings, 14 views");
    let mut all = Tally::default();
    let names = ["box", "mug", "L", "hexagon", "bottle", "tray"];
    for thing in symmetric().iter().filter(|t| names.contains(&t.name.as_str())) {
        let mut tally = Tally::default();
        for seed in 0..12_u64 {
            let yaw = (0.53 * seed as f64) % 6.0;
            let capture = seen(thing, 14, yaw, 100 + seed);
            let Some(object) = shaped(&capture) else { continue };
            let symmetry = found(&capture, &object);
            let judged = judge(thing, &symmetry, &(object.world_from_link.0.inverse() * place(yaw)));
            tally.add(&thing.name, judged.clone());
            all.add(&thing.name, judged);
        }
        println!("{}:\n{tally}", thing.name);
    }
    println!("all:\n{all}");
}

/// Where fused vessels are off, by height and side: mean, mm, and number of vertices, seen and not.
pub fn look() {
    for thing in symmetric()
        .iter()
        .filter(|t| ["cup", "bowl"].contains(&t.name.as_str()))
    {
        let capture = seen(thing, 16, 0.0, 1);
        let object = completed(&capture).expect("seen");
        println!(
            "{} {:.1} of {:.1}",
            thing.name,
            1e6 * object.mesh.volume(),
            1e6 * thing.mesh.volume()
        );
        let mesh = object.mesh.transformed(&object.world_from_link.0);
        let truth = SurfaceDistance::new(&thing.mesh.transformed(&place(0.0))).expect("triangles");
        let axis = place(0.0) * thing.center;
        let normals = palpate::geometry::vertex_normals(&mesh);
        let mut bins = vec![[(0.0, 0); 4]; 20];
        for (i, v) in mesh.vertices.iter().enumerate() {
            let outward = normals[i].x * (v.x - axis.x) + normals[i].y * (v.y - axis.y) > 0.0;
            let kind = usize::from(!outward) + 2 * usize::from(!mesh.seen[i]);
            let b = &mut bins[(v.z / 0.005) as usize][kind];
            b.0 += truth.signed(v).unwrap_or(0.0);
            b.1 += 1;
        }
        for (k, b) in bins.iter().enumerate() {
            let said: Vec<String> = b
                .iter()
                .map(|b| format!("{:+.2} ({})", 1e3 * b.0 / f64::from(b.1.max(1)), b.1))
                .collect();
            println!(
                "z {:2} mm: outside, inside seen {} {}  unseen {} {}",
                5 * k,
                said[0],
                said[1],
                said[2],
                said[3]
            );
        }
    }
}
