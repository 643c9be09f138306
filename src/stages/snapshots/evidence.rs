//! What a capture says of the support and of the tool's force.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use super::gather::{pushes, subject};
use crate::capture::{Capture, Interaction};
use crate::twin::Model;

/// The support's frame: z along its normal, the plane at z = 0.
pub(super) fn support_from_world(capture: &Capture, model: &Model) -> Isometry3<f64> {
    let up = (-capture.gravity).try_normalize(1e-9).unwrap_or_else(Vector3::z);
    let (point, normal) = match &model.twin.support {
        Some(s) => (
            Point3::from(s.point),
            Vector3::from(s.normal).try_normalize(1e-9).unwrap_or(up),
        ),
        None => (Point3::from(up * ground_level(capture, model, &up).unwrap_or(0.0)), up),
    };
    let turn = UnitQuaternion::rotation_between(&normal, &Vector3::z())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let height = normal.dot(&point.coords);
    Isometry3::from_parts(Vector3::new(0.0, 0.0, -height).into(), turn)
}

/// Where the lowest points of the things were before they were touched, along `up`, m: the support where none was given or
/// seen.
fn ground_level(capture: &Capture, model: &Model, up: &Vector3<f64>) -> Option<f64> {
    let of = |interaction: &Interaction| {
        let name = subject(interaction)?;
        let link = model.twin.link(name)?;
        let mesh = model.meshes.get(link.mesh.as_ref()?)?;
        let track = interaction.tracks.get(name)?;
        let turn = (*track.rotation.first()?).unwrap_or(link.pose.rotation);
        let low = mesh
            .vertices
            .iter()
            .map(|p| up.dot(&(turn * p.coords)))
            .fold(f64::INFINITY, f64::min);
        Some(up.dot(&track.position.first()?.coords) + low).filter(|z| z.is_finite())
    };
    let levels: Vec<f64> = capture
        .interactions
        .iter()
        .filter(|i| pushes(i))
        .filter_map(of)
        .collect();
    crate::math::median(&levels)
}

/// The length of the impulse that the tool gave over the recording, N·s, and its standard deviation; the recording's first
/// readings, before it can have touched, give the tare.
pub(super) fn impulse_of(capture: &Capture, interaction: &Interaction) -> Option<(f64, f64)> {
    let stream = interaction.force.as_ref()?;
    let rows: Vec<usize> = (0..stream.time.len())
        .filter(|i| stream.force[*i].iter().all(|x| x.is_finite()))
        .collect();
    if rows.len() < 8 {
        return None;
    }
    let tare_rows = (rows.len() / 50).clamp(4, 50);
    let tare = rows[..tare_rows].iter().map(|i| stream.force[*i]).sum::<Vector3<f64>>() / tare_rows as f64;
    let scatter = rows[..tare_rows]
        .iter()
        .map(|i| (stream.force[*i] - tare).norm_squared() / 3.0)
        .sum::<f64>();
    let noise = capture.noise.force.unwrap_or((scatter / (tare_rows - 1) as f64).sqrt());
    // Only readings that stand out of the noise belong to the touch.
    let touching: Vec<usize> = (1..rows.len())
        .filter(|k| (stream.force[rows[*k]] - tare).norm() > 4.0 * noise)
        .collect();
    let step = |k: usize| stream.time[rows[k]] - stream.time[rows[k - 1]];
    let total: Vector3<f64> = touching
        .iter()
        .map(|k| (stream.force[rows[*k]] - tare) * step(*k))
        .sum();
    let span: f64 = touching.iter().map(|k| step(*k)).sum();
    let white: f64 = touching.iter().map(|k| (noise * step(*k)).powi(2)).sum();
    let tare_error = noise * span / (tare_rows as f64).sqrt();
    (total.norm() > 0.0).then(|| (total.norm(), white.sqrt().hypot(tare_error).hypot(1e-4)))
}
