//! What a real range camera makes of a scene: noise that grows with range squared, steps of the depth unit, edges that
//! fly between near and far, nothing at grazing incidence.

use nalgebra::{Point3, Vector3};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::CameraSpec;
use super::ray::{Hit, Stage};
use crate::base::{Pose, Seed, rng_for};
use crate::capture::{Camera, ColorImage, DepthImage, LabelImage, View};

/// Beyond this angle between ray and normal there is no reading.
const GRAZING_DEGREES: f64 = 80.0;
/// How far a pixel's ray strays sideways, pixels (1 sd).
const LATERAL_SD: f64 = 0.12;
/// A step between neighbours that is an edge, m.
const EDGE: f64 = 0.015;
/// Noise of a colour channel, counts (1 sd).
const COLOR_SD: f64 = 1.5;

/// Takes the view of number `index` from `world_from_camera`.
pub(super) fn take(stage: &Stage, spec: &CameraSpec, camera: &Camera, pose: &Pose, index: usize, seed: Seed) -> View {
    let mut rng = rng_for(seed, &format!("view {index}"));
    let mut view = shot(stage, spec, camera, pose, &mut rng);
    view.time = 0.1 * index as f64;
    view
}

/// One image with its dice, at time zero.
pub(super) fn shot(stage: &Stage, spec: &CameraSpec, camera: &Camera, pose: &Pose, rng: &mut ChaCha8Rng) -> View {
    let hits = shoot_all(stage, camera, pose, rng);
    let depths: Vec<f64> = hits.iter().map(|hit| hit.map_or(f64::NAN, |h| h.distance)).collect();
    let counts = (0..hits.len())
        .map(|i| reading(spec, camera, &depths, &hits, i, pose, rng))
        .collect();
    let (width, height) = (camera.width, camera.height);
    View {
        camera: 0,
        time: 0.0,
        world_from_camera: *pose,
        depth: DepthImage { width, height, counts },
        color: Some(ColorImage {
            width,
            height,
            rgb: hits.iter().map(|hit| color(hit, rng)).collect(),
        }),
        labels: spec.labels.then(|| LabelImage {
            width,
            height,
            ids: hits.iter().map(|hit| hit.map_or(0, |h| h.owner)).collect(),
        }),
    }
}

/// The ray of a pixel in the camera frame, with z = 1, so that distances along it are depths.
fn pixel_ray(camera: &Camera, u: f64, v: f64) -> Vector3<f64> {
    Vector3::new((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0)
}

fn shoot_all(stage: &Stage, camera: &Camera, pose: &Pose, rng: &mut ChaCha8Rng) -> Vec<Option<Hit>> {
    let eye = Point3::from(pose.translation.vector);
    let mut hits = Vec::with_capacity((camera.width * camera.height) as usize);
    for v in 0..camera.height {
        for u in 0..camera.width {
            let mut stray = || LATERAL_SD * rng.sample::<f64, _>(StandardNormal);
            let ray = pixel_ray(camera, f64::from(u) + stray(), f64::from(v) + stray());
            hits.push(stage.shoot(&eye, &(pose.rotation * ray), camera.depth_max));
        }
    }
    hits
}

/// The count of pixel `i`. It draws the same number of dice whatever it sees.
fn reading(
    spec: &CameraSpec,
    camera: &Camera,
    depths: &[f64],
    hits: &[Option<Hit>],
    i: usize,
    pose: &Pose,
    rng: &mut ChaCha8Rng,
) -> u16 {
    let noise: f64 = rng.sample(StandardNormal);
    let [flies, between] = [rng.random::<f64>(), rng.random::<f64>()];
    let Some(hit) = hits[i] else { return 0 };
    let width = camera.width as usize;
    let ray = pose.rotation * pixel_ray(camera, (i % width) as f64, (i / width) as f64);
    if -hit.normal.dot(&ray.normalize()) < GRAZING_DEGREES.to_radians().cos() {
        return 0;
    }
    let mut depth = hit.distance;
    if let Some(other) = across_edge(depths, i, width)
        && flies < spec.flying
    {
        depth += between * (other - depth);
    }
    depth += noise * spec.depth_sd * depth * depth;
    if !(camera.depth_min..=camera.depth_max).contains(&depth) {
        return 0;
    }
    (depth / camera.depth_unit).round() as u16
}

/// The depth of the neighbour that differs most, where pixel `i` lies on an edge.
fn across_edge(depths: &[f64], i: usize, width: usize) -> Option<f64> {
    let column = i % width;
    let neighbours = [
        (column > 0).then(|| i - 1),
        (column + 1 < width).then_some(i + 1),
        i.checked_sub(width),
        (i + width < depths.len()).then_some(i + width),
    ];
    neighbours
        .into_iter()
        .flatten()
        .map(|n| depths[n])
        .filter(|d| (d - depths[i]).abs() > EDGE)
        .max_by(|a, b| (a - depths[i]).abs().total_cmp(&(b - depths[i]).abs()))
}

fn color(hit: &Option<Hit>, rng: &mut ChaCha8Rng) -> [u8; 3] {
    let seen = hit.map_or([24.0; 3], |h| h.color);
    seen.map(|c| {
        let noise: f64 = rng.sample(StandardNormal);
        (c + COLOR_SD * noise).round().clamp(0.0, 255.0) as u8
    })
}
