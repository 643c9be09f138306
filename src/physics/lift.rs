//! A lift: once off the table, the tool carries the weight.

use nalgebra::{Point3, Vector3};

use crate::base::Pose;
use crate::twin::Link;

/// Force and torque (about the tool's origin) that a tool at `tool` exerts to carry `link` at `pose`
/// slowly against gravity (vector, m/s²): `f = -m g`, `tau = (com - tool) x f`. World frame.
pub fn predict_lift(
    link: &Link,
    pose: &Pose,
    tool: &Point3<f64>,
    gravity: &Vector3<f64>,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let mass = link.mass.as_ref()?.value;
    let force = -gravity * mass;
    let com = pose.0 * Point3::from(link.com.as_ref()?.value);
    Some((force, (com - tool).cross(&force)))
}
