//! The camera rig: rings of poses that look at one spot.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use rand::Rng;

use super::{CameraSpec, FilmSpec};
use crate::base::{Pose, Seed, rng_for};
use crate::capture::Camera;

/// The name of the one camera.
const NAME: &str = "range";
/// Metres per count of the depth images.
const DEPTH_UNIT: f64 = 0.0005;
/// Nearest and farthest reading, m.
const DEPTH_RANGE: [f64; 2] = [0.15, 2.5];
/// How far the rig's poses stray from the rings, m.
const JITTER: f64 = 0.008;

/// The pinhole camera of the rig; the noise is stated only where `stated`.
pub(super) fn camera(spec: &CameraSpec, stated: bool) -> Camera {
    Camera {
        name: NAME.into(),
        width: spec.width,
        height: spec.height,
        fx: spec.focal,
        fy: spec.focal,
        cx: (f64::from(spec.width) - 1.0) / 2.0,
        cy: (f64::from(spec.height) - 1.0) / 2.0,
        distortion: [0.0; 5],
        depth_unit: DEPTH_UNIT,
        depth_min: DEPTH_RANGE[0],
        depth_max: DEPTH_RANGE[1],
        depth_sd: stated.then_some(spec.depth_sd),
    }
}

/// World-from-camera of each view, ring after ring, lower rings (which are longer) with more views.
pub(super) fn poses(spec: &CameraSpec, seed: Seed) -> Vec<Pose> {
    let mut rng = rng_for(seed, "camera rig");
    let mut stray = || Vector3::from_fn(|_, _| rng.random_range(-JITTER..JITTER));
    let target = Point3::from(spec.target);
    let mut poses = Vec::with_capacity(spec.views);
    for (ring, views) in views_per_ring(spec).into_iter().enumerate() {
        let (up, out) = spec.elevations[ring].to_radians().sin_cos();
        for i in 0..views {
            let (s, c) = (TAU * (i as f64 / views as f64) + 0.7 * ring as f64).sin_cos();
            let eye = target + Vector3::new(out * c, out * s, up) * spec.distance + stray();
            poses.push(looking(eye, target + stray()));
        }
    }
    poses
}

/// The still camera that films.
pub(super) fn film_pose(spec: &FilmSpec) -> Pose {
    let (up, out) = spec.elevation.to_radians().sin_cos();
    let (s, c) = spec.azimuth.to_radians().sin_cos();
    let target = Point3::from(spec.target);
    looking(target + Vector3::new(out * c, out * s, up) * spec.distance, target)
}

/// Shares the views among the rings by their circumference; none goes empty while there are views enough.
fn views_per_ring(spec: &CameraSpec) -> Vec<usize> {
    let lengths: Vec<f64> = spec.elevations.iter().map(|e| e.to_radians().cos()).collect();
    let total: f64 = lengths.iter().sum();
    let mut ideal = 0.0;
    let mut given = 0;
    lengths
        .iter()
        .map(|length| {
            ideal += length / total * spec.views as f64;
            let views = (ideal.round() as usize).min(spec.views) - given;
            given += views;
            views
        })
        .collect()
}

/// A camera at `eye` with z towards `target`, x level and y as far down as can be.
fn looking(eye: Point3<f64>, target: Point3<f64>) -> Pose {
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    let rotation = UnitQuaternion::from_rotation_matrix(&axes);
    Pose(Isometry3::from_parts(eye.into(), rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_camera_looks_at_the_target_with_its_y_axis_down() {
        let spec = CameraSpec::default();
        let poses = poses(&spec, Seed(1));
        assert_eq!(poses.len(), spec.views);
        for pose in poses {
            let seen = pose.inverse_transform_point(&Point3::from(spec.target));
            assert!(
                seen.x.hypot(seen.y) < 0.03 && (seen.z - spec.distance).abs() < 0.03,
                "{seen}"
            );
            assert!((pose.rotation * Vector3::y()).z < 0.0);
            assert!((pose.rotation * Vector3::x()).z.abs() < 1e-12);
        }
    }
}
