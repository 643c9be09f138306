//! The table: given, or found as the largest level plane of the views.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3};

use super::range::Range;
use crate::base::{Notices, Seed, rng_for};
use crate::capture::Capture;
use crate::geometry::Plane;
use crate::twin::SupportPlane;

/// Largest tilt of a found support from level, as the cosine.
const LEVEL: f64 = 0.94;
/// Smallest fraction of the points that a found support must hold.
const LEAST_SHARE: f64 = 0.05;

/// The support and how rough it looks.
pub struct Ground {
    /// Absent where it was neither given nor seen.
    pub plane: Option<SupportPlane>,
    /// A frame whose plane z = 0 is the support, z away from it; or level at the world's origin.
    pub world_from_field: Isometry3<f64>,
    /// Scatter of single readings about the plane, 1 sd, m.
    pub roughness: f64,
}

/// Takes the given support, or finds one in points of the world frame.
pub fn find_support(capture: &Capture, ranges: &[Range], notices: &mut Notices) -> Ground {
    let points = sample(ranges, 20_000);
    let up = UnitVector3::try_new(-capture.gravity, 1e-9).unwrap_or_else(Vector3::z_axis);
    let tolerance = 0.004;
    if let Some(given) = &capture.support {
        let plane = Plane::through(&given.point, given.normal);
        let seen = plane.refit(&points, 0.01);
        let offset = seen.height(&given.point);
        let roughness = roughness(&plane, &points);
        if offset.abs() > 0.002 {
            let mm = -offset * 1000.0;
            notices.warn(
                "shape",
                "support",
                format!("the views show the support {mm:.1} mm above the given one"),
            );
        }
        return ground(given.point, given.normal, given.material.clone(), roughness);
    }
    let mut rng = rng_for(Seed(0), "support plane");
    let found = Plane::ransac(&points, tolerance, 1500, &mut rng, |n| n.dot(&up) > LEVEL);
    match found {
        Some((plane, share)) if share > LEAST_SHARE => {
            notices.note(
                "shape",
                "support",
                format!("found from the views: {:.0} % of the points lie on it", share * 100.0),
            );
            let inside = points.iter().filter(|p| plane.height(p).abs() < tolerance);
            let count = inside.clone().count().max(1) as f64;
            let centre = Point3::from(inside.map(|p| p.coords).sum::<Vector3<f64>>() / count);
            let foot = centre - plane.normal.into_inner() * plane.height(&centre);
            ground(foot, plane.normal, None, roughness(&plane, &points))
        }
        _ => {
            if !points.is_empty() {
                notices.warn("shape", "support", "none was given and the views show no level plane");
            }
            Ground {
                plane: None,
                world_from_field: level_frame(Point3::origin(), up),
                roughness: 0.001,
            }
        }
    }
}

fn ground(point: Point3<f64>, normal: UnitVector3<f64>, material: Option<String>, roughness: f64) -> Ground {
    Ground {
        plane: Some(SupportPlane {
            point: point.coords.into(),
            normal: normal.into_inner().into(),
            material,
            gravity: None,
        }),
        world_from_field: level_frame(point, normal),
        roughness,
    }
}

/// A frame at `point` with z along `normal` and the other axes as near to the world's as may be.
fn level_frame(point: Point3<f64>, normal: UnitVector3<f64>) -> Isometry3<f64> {
    let turn = Rotation3::rotation_between(&Vector3::z(), &normal)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Isometry3::from_parts(
        Translation3::from(point.coords),
        UnitQuaternion::from_rotation_matrix(&turn),
    )
}

/// About `count` points, spread over the views.
fn sample(ranges: &[Range], count: usize) -> Vec<Point3<f64>> {
    let points: Vec<Point3<f64>> = ranges.iter().flat_map(|r| r.points(6)).collect();
    let stride = (points.len() / count).max(1);
    points.into_iter().step_by(stride).collect()
}

/// Robust scatter of the points near a plane (median absolute deviation times 1.4826).
fn roughness(plane: &Plane, points: &[Point3<f64>]) -> f64 {
    let mut off: Vec<f64> = points
        .iter()
        .map(|p| plane.height(p).abs())
        .filter(|h| *h < 0.015)
        .collect();
    if off.is_empty() {
        return 0.001;
    }
    off.sort_by(f64::total_cmp);
    1.4826 * off[off.len() / 2]
}
