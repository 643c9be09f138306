//! Made-up views of things whose surface is known, and how near the fused surface comes to it.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use rand_distr::{Distribution, Normal};

use super::*;
use crate::base::{Seed, rng_for};
use crate::capture::{Camera, ColorImage, DepthImage};
use crate::geometry::Mesh;

/// Distance along a ray from `eye` to a thing, if it meets it.
type Cast = fn(&Point3<f64>, &Vector3<f64>) -> Option<f64>;

fn ball(eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let (a, b) = (ray.norm_squared(), eye.coords.dot(ray));
    let c = eye.coords.norm_squared() - 0.05 * 0.05;
    let root = b * b - a * c;
    (root > 0.0).then(|| (-b - root.sqrt()) / a)
}

/// A wall 3 mm thick.
fn wall(eye: &Point3<f64>, ray: &Vector3<f64>) -> Option<f64> {
    let half = Vector3::new(0.0015, 0.06, 0.06);
    let (mut from, mut to) = (0.0_f64, f64::MAX);
    for axis in 0..3 {
        let ends = [-half[axis], half[axis]].map(|h| (h - eye[axis]) / ray[axis]);
        from = from.max(ends[0].min(ends[1]));
        to = to.min(ends[0].max(ends[1]));
    }
    (from < to).then_some(from)
}

fn camera() -> Camera {
    Camera {
        name: "made-up".into(),
        width: 320,
        height: 240,
        fx: 300.0,
        fy: 300.0,
        cx: 159.5,
        cy: 119.5,
        distortion: [0.0; 5],
        depth_unit: 0.0001,
        depth_min: 0.1,
        depth_max: 2.0,
        depth_sd: None,
    }
}

/// From a ring around the origin, looking at it.
fn pose(n: usize) -> Isometry3<f64> {
    let angle = 0.2 + n as f64 * std::f64::consts::TAU / 16.0;
    let eye = Point3::new(
        0.35 * angle.cos(),
        0.35 * angle.sin(),
        if n.is_multiple_of(2) { 0.12 } else { -0.1 },
    );
    let back = UnitQuaternion::face_towards(&-eye.coords, &-Vector3::z());
    Isometry3::from_parts(Translation3::from(eye), back)
}

fn view(cast: Cast, pose: &Isometry3<f64>, sd: f64, seed: u64) -> (DepthImage, ColorImage) {
    let camera = camera();
    let noise = Normal::new(0.0, sd).unwrap();
    let mut rng = rng_for(Seed(seed), "view");
    let eye = Point3::from(pose.translation.vector);
    let mut counts = Vec::new();
    for y in 0..camera.height {
        for x in 0..camera.width {
            let ray = Vector3::new(
                (f64::from(x) - camera.cx) / camera.fx,
                (f64::from(y) - camera.cy) / camera.fy,
                1.0,
            );
            let depth = cast(&eye, &(pose * ray)).map_or(0.0, |z| z + noise.sample(&mut rng));
            counts.push((depth / camera.depth_unit).round() as u16);
        }
    }
    let (width, height) = (camera.width, camera.height);
    let rgb = vec![[200, 40, 90]; counts.len()];
    (DepthImage { width, height, counts }, ColorImage { width, height, rgb })
}

fn fused(cast: Cast, sd: f64, colored: bool) -> Mesh {
    let mut fusion = Fusion::new(FusionConfig::default()).unwrap();
    for n in 0..16 {
        let (depth, color) = view(cast, &pose(n), sd, n as u64);
        let color = colored.then_some(&color);
        fusion.integrate(&camera(), &pose(n), &depth, color).unwrap();
    }
    fusion.extract()
}

/// The same views added as one sequence.
fn fused_together(cast: Cast, sd: f64) -> Mesh {
    let views: Vec<_> = (0..16).map(|n| view(cast, &pose(n), sd, n as u64)).collect();
    let shots: Vec<Shot> = views
        .iter()
        .enumerate()
        .map(|(n, (depth, color))| Shot {
            field_from_camera: pose(n),
            depth,
            color: Some(color),
        })
        .collect();
    let mut fusion = Fusion::new(FusionConfig::default()).unwrap();
    fusion.integrate_all(&camera(), &shots).unwrap();
    fusion.extract()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    sum / count
}

#[test]
fn a_ball_is_found_through_the_noise() {
    let mesh = fused(ball, 0.001, false);
    assert!(mesh.triangles.len() > 4000, "{}", mesh.triangles.len());
    let error = mean(mesh.vertices.iter().map(|p| (p.coords.norm() - 0.05).abs()));
    let bias = mean(mesh.vertices.iter().map(|p| p.coords.norm() - 0.05));
    assert!(error < 0.25e-3 && bias.abs() < 0.1e-3, "error {error}, bias {bias}");
}

#[test]
fn a_wall_of_three_millimetres_keeps_both_sides() {
    let mesh = fused(wall, 0.0005, false);
    let inner = |p: &&Point3<f64>| p.y.abs() < 0.05 && p.z.abs() < 0.05;
    for side in [-1.0, 1.0] {
        let found = mesh.vertices.iter().filter(inner).filter(|p| p.x * side > 0.0);
        let error = mean(found.clone().map(|p| (p.x * side - 0.0015).abs()));
        assert!(found.count() > 2000 && error < 0.25e-3, "side {side}: {error}");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fused(ball, 0.001, true))
    };
    let (one, three) = (with(1), with(3));
    assert!(one == three);
    assert!(
        one.colors.iter().all(|c| *c == [200, 40, 90]),
        "{:?}",
        one.colors.first()
    );
}

#[test]
fn a_sequence_added_together_is_as_good_and_does_not_depend_on_the_threads() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fused_together(ball, 0.001))
    };
    let (one, three, alone) = (with(1), with(3), fused(ball, 0.001, true));
    assert!(one == three);
    let error = |mesh: &Mesh| mean(mesh.vertices.iter().map(|p| (p.coords.norm() - 0.05).abs()));
    let (together, alone) = (error(&one), error(&alone));
    assert!(together < alone + 2e-6, "{together} against {alone} one by one");
}

#[test]
fn an_image_of_another_size_is_refused() {
    let (mut depth, _) = view(ball, &pose(0), 0.0, 0);
    depth.width /= 2;
    let mut fusion = Fusion::new(FusionConfig::default()).unwrap();
    assert!(fusion.integrate(&camera(), &pose(0), &depth, None).is_err());
}

#[test]
fn settings_that_cannot_work_are_refused() {
    for voxel in [0.0, -0.001, f64::NAN] {
        assert!(Fusion::new(FusionConfig::with_voxel(voxel)).is_err());
    }
}
