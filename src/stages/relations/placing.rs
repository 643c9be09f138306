//! Where the things stand at the first view, and which of them bear on each other.

use nalgebra::{Point3, Vector3};

use super::Config;
use crate::capture::Capture;
use crate::geometry::{Mesh, gap};
use crate::twin::{Link, Model, WORLD};

/// One link at the first view.
pub struct Placed {
    /// Its name.
    pub name: String,
    /// Its surface in the world, where it is known.
    pub mesh: Option<Mesh>,
    /// Its middle, or the origin of its track, m, world.
    pub centre: Vector3<f64>,
}

/// How two things bear on each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bearing {
    /// The second lies on the first.
    SecondOnTop,
    /// The first lies on the second.
    FirstOnTop,
    /// They touch sideways, or one is in the other.
    Beside,
    /// Their surfaces are not known; they are near enough to be held to each other.
    Perhaps,
}

/// Every link of the model at the first view.
pub fn placed(model: &Model) -> Vec<Placed> {
    let things = model.twin.links().filter(|(_, link)| link.name != WORLD);
    things.map(|(_, link)| place(model, link)).collect()
}

fn place(model: &Model, link: &Link) -> Placed {
    let mesh = link
        .mesh
        .as_ref()
        .and_then(|path| model.meshes.get(path))
        .map(|m| m.transformed(&link.pose));
    let centre = mesh
        .as_ref()
        .and_then(Mesh::bounds)
        .map_or(link.pose.translation.vector, |(l, h)| 0.5 * (l.coords + h.coords));
    Placed {
        name: link.name.clone(),
        mesh,
        centre,
    }
}

/// Away from the table; against gravity where there is none.
pub fn up(capture: &Capture, model: &Model) -> Vector3<f64> {
    if let Some(plane) = &model.twin.support {
        return Vector3::from(plane.normal);
    }
    match &capture.support {
        Some(support) => support.normal.into_inner(),
        None => -capture.gravity.try_normalize(1e-9).unwrap_or_else(|| -Vector3::z()),
    }
}

/// A point of the table, where there is one.
pub fn table(capture: &Capture, model: &Model) -> Option<Point3<f64>> {
    let found = model.twin.support.as_ref().map(|s| Point3::from(s.point));
    found.or_else(|| capture.support.as_ref().map(|s| s.point))
}

impl Placed {
    /// Lowest and highest point along a direction.
    pub fn extent(&self, along: &Vector3<f64>) -> Option<(f64, f64)> {
        let values = self.mesh.as_ref()?.vertices.iter().map(|v| along.dot(&v.coords));
        Some(values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x))))
    }
}

/// How two things bear on each other at the first view, if they do.
pub fn bearing(a: &Placed, b: &Placed, up: &Vector3<f64>, config: &Config) -> Option<Bearing> {
    let (Some(mesh_a), Some(mesh_b)) = (&a.mesh, &b.mesh) else {
        return by_origins(a, b, up);
    };
    let (low, high) = (a.extent(up)?, b.extent(up)?);
    let over = (high.0 - low.1).abs() < config.gap;
    let under = (low.0 - high.1).abs() < config.gap;
    if over && beneath_each_other(a, b, up) {
        return Some(Bearing::SecondOnTop);
    }
    if under && beneath_each_other(a, b, up) {
        return Some(Bearing::FirstOnTop);
    }
    gap(mesh_a, mesh_b).filter(|g| *g < config.gap)?;
    Some(Bearing::Beside)
}

/// True where the boxes around the two overlap seen from above.
fn beneath_each_other(a: &Placed, b: &Placed, up: &Vector3<f64>) -> bool {
    let first = up.cross(&Vector3::ith(up.iamin(), 1.0)).normalize();
    [first, up.cross(&first)]
        .iter()
        .all(|d| match (a.extent(d), b.extent(d)) {
            (Some(x), Some(y)) => x.0 < y.1 && y.0 < x.1,
            _ => false,
        })
}

/// How much higher the middle of what is borne lies at least, m.
const HIGHER: f64 = 3e-3;

/// True where `lower` may bear `upper` from beneath, as a tray bears what stands within its rim.
pub fn may_bear(lower: &Placed, upper: &Placed, up: &Vector3<f64>) -> bool {
    let (Some(below), Some(above)) = (lower.extent(up), upper.extent(up)) else {
        return up.dot(&(upper.centre - lower.centre)) > HIGHER;
    };
    let rests = above.0 + above.1 > below.0 + below.1 + 2.0 * HIGHER || above.0 > below.0 + HIGHER;
    rests && beneath_each_other(lower, upper, up)
}

/// Without surfaces: one origin well above the other is a stack; near ones may be held to each other.
fn by_origins(a: &Placed, b: &Placed, up: &Vector3<f64>) -> Option<Bearing> {
    let apart = b.centre - a.centre;
    let height = up.dot(&apart);
    let level = (apart - up * height).norm();
    if height.abs() > 0.012 && height.abs() < 0.2 && level < 0.8 * height.abs() {
        return Some(if height > 0.0 {
            Bearing::SecondOnTop
        } else {
            Bearing::FirstOnTop
        });
    }
    (apart.norm() < 0.15).then_some(Bearing::Perhaps)
}
