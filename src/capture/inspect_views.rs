//! How much of the scene the still views see.

use nalgebra::{Point3, UnitVector3, Vector3};

use super::inspection::{CameraSummary, ViewSummary};
use super::{Camera, Capture, View};

/// A view covers the azimuths within this many degrees of its own.
const COVERED: f64 = 30.0;

/// The views of `capture` in figures; nothing where there are none.
pub(super) fn summarise_views(capture: &Capture) -> Option<ViewSummary> {
    if capture.views.is_empty() {
        return None;
    }
    let valid: Vec<f64> = capture
        .views
        .iter()
        .map(|v| valid_fraction(v, &capture.cameras[v.camera]))
        .collect();
    let centre = scene_centre(capture);
    let up = -capture.gravity.normalize();
    let eyes: Vec<Vector3<f64>> = capture.views.iter().map(|v| eye(v) - centre).collect();
    let elevation = |d: &Vector3<f64>| {
        (d.dot(&up) / d.norm().max(f64::MIN_POSITIVE))
            .clamp(-1.0, 1.0)
            .asin()
            .to_degrees()
    };
    let elevations: Vec<f64> = eyes.iter().map(elevation).collect();
    Some(ViewSummary {
        count: capture.views.len(),
        cameras: capture
            .cameras
            .iter()
            .enumerate()
            .map(|(i, c)| camera(capture, i, c))
            .collect(),
        valid_fraction: valid.iter().sum::<f64>() / valid.len() as f64,
        worst_valid_fraction: valid.iter().copied().fold(1.0, f64::min),
        azimuth_coverage_deg: azimuth_coverage(&eyes, &up),
        elevation_deg: [
            elevations.iter().copied().fold(90.0, f64::min),
            elevations.iter().copied().fold(-90.0, f64::max),
        ],
        direction_spread_deg: direction_spread(&capture.views),
        with_color: capture.views.iter().filter(|v| v.color.is_some()).count(),
        with_labels: capture.views.iter().filter(|v| v.labels.is_some()).count(),
    })
}

fn camera(capture: &Capture, index: usize, camera: &Camera) -> CameraSummary {
    CameraSummary {
        name: camera.name.clone(),
        width: camera.width,
        height: camera.height,
        views: capture.views.iter().filter(|v| v.camera == index).count(),
    }
}

fn is_valid(count: u16, camera: &Camera) -> bool {
    let depth = f64::from(count) * camera.depth_unit;
    count > 0 && depth >= camera.depth_min && depth <= camera.depth_max
}

fn valid_fraction(view: &View, camera: &Camera) -> f64 {
    let valid = view.depth.counts.iter().filter(|c| is_valid(**c, camera)).count();
    valid as f64 / view.depth.counts.len().max(1) as f64
}

fn eye(view: &View) -> Point3<f64> {
    view.world_from_camera.translation.vector.into()
}

fn direction(view: &View) -> UnitVector3<f64> {
    view.world_from_camera.rotation * Vector3::z_axis()
}

/// The mean of what each view looks at: its optical axis at the median depth of the middle of its image.
fn scene_centre(capture: &Capture) -> Point3<f64> {
    let targets = capture.views.iter().filter_map(|view| {
        let depth = middle_depth(view, &capture.cameras[view.camera])?;
        Some((eye(view) + direction(view).into_inner() * depth).coords)
    });
    let targets: Vec<Vector3<f64>> = targets.collect();
    let sum: Vector3<f64> = targets.iter().sum();
    Point3::from(sum / targets.len().max(1) as f64)
}

fn middle_depth(view: &View, camera: &Camera) -> Option<f64> {
    let (w, h) = (view.depth.width as usize, view.depth.height as usize);
    let rows = (h / 3..h - h / 3).flat_map(|y| (w / 3..w - w / 3).map(move |x| y * w + x));
    let mut counts: Vec<u16> = rows
        .map(|i| view.depth.counts[i])
        .filter(|c| is_valid(*c, camera))
        .collect();
    counts.sort_unstable();
    counts.get(counts.len() / 2).map(|c| f64::from(*c) * camera.depth_unit)
}

/// Degrees of azimuth about `up` that have an eye within [`COVERED`].
fn azimuth_coverage(eyes: &[Vector3<f64>], up: &Vector3<f64>) -> f64 {
    let across = if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let e = up.cross(&across).normalize();
    let n = up.cross(&e);
    let azimuth = |d: &Vector3<f64>| d.dot(&n).atan2(d.dot(&e)).to_degrees();
    let mut azimuths: Vec<f64> = eyes.iter().map(azimuth).collect();
    azimuths.sort_by(f64::total_cmp);
    let around = azimuths.first().map(|a| a + 360.0);
    let next = azimuths.iter().skip(1).copied().chain(around);
    azimuths.iter().zip(next).map(|(a, b)| (b - a).min(2.0 * COVERED)).sum()
}

fn direction_spread(views: &[View]) -> f64 {
    let directions: Vec<UnitVector3<f64>> = views.iter().map(direction).collect();
    let pairs = directions
        .iter()
        .enumerate()
        .flat_map(|(i, a)| directions[..i].iter().map(move |b| a.angle(b)));
    pairs.fold(0.0, f64::max).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_is_covered_within_thirty_degrees_of_a_view() {
        let at = |deg: f64| Vector3::new(deg.to_radians().cos(), deg.to_radians().sin(), 0.5);
        let cover = |list: &[f64]| {
            let eyes: Vec<Vector3<f64>> = list.iter().map(|d| at(*d)).collect();
            azimuth_coverage(&eyes, &Vector3::z()).round()
        };
        assert_eq!(cover(&[10.0]), 60.0);
        assert_eq!(cover(&[0.0, 20.0]), 80.0);
        assert_eq!(cover(&[0.0, 60.0, 120.0, 180.0, 240.0, 300.0]), 360.0);
        assert_eq!(cover(&[0.0, 180.0]), 120.0);
    }
}
