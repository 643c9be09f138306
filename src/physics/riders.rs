//! What rides on what.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3};

use crate::base::Pose;
use crate::geometry::Mesh;
use crate::twin::{Model, RelationKind};

/// The links that rest on `link`, and on those in turn, where all stand as at `start` (world-from-link): glued or not where no touch
/// could have told, they ride on it. What was put on it since the first view does, and what was taken off it does not.
pub fn riders(model: &Model, link: &str, start: &BTreeMap<String, Pose>) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    let mut carriers = vec![link.to_owned()];
    while let Some(carrier) = carriers.pop() {
        for (body, upper) in model.twin.links() {
            let name = &upper.name;
            // What has no place while others have one is not there.
            let there = start.is_empty() || start.contains_key(name);
            if name == link || !there || found.contains(name) || body.links.iter().any(|l| l.name == carrier) {
                continue;
            }
            let mut between = model.twin.relations.iter();
            let told = between.find(|r| r.a == carrier && r.b == *name).map(|r| r.kind);
            let said = match told {
                Some(RelationKind::Resting) => true,
                Some(RelationKind::Unknown) => above(model, &carrier, name),
                _ => false,
            };
            let loose = matches!(
                told,
                None | Some(RelationKind::Resting | RelationKind::Unknown | RelationKind::Separate)
            );
            let rides = match seat(model, &carrier, name, start) {
                Some(Seat::On) => loose,
                Some(Seat::Away) => false,
                _ => said,
            };
            if rides {
                found.push(name.clone());
                carriers.push(name.clone());
            }
        }
    }
    found
}

/// Where a thing is beside what may carry it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seat {
    /// Its lowest points are at the other's highest, its middle within reach of the other's.
    On,
    /// Neither reaches the other, seen from above.
    Away,
    /// Anything else.
    Beside,
}

/// Distance of the highest point of a carrier from the lowest of what stands on it, m.
const SEATED: f64 = 6e-3;
/// Middles farther apart than this, level, are not looked at any more, m.
const FAR: f64 = 1.5;

/// Where `upper` stands beside `lower`, along gravity; nothing where a shape or a place is not known.
fn seat(model: &Model, lower: &str, upper: &str, start: &BTreeMap<String, Pose>) -> Option<Seat> {
    let up = (-Vector3::from(model.twin.gravity)).try_normalize(1e-9)?;
    let level = |v: &Vector3<f64>| v - up * up.dot(v);
    let placed = |name: &str| {
        let mesh = model.meshes.get(model.twin.link(name)?.mesh.as_ref()?)?;
        Some((start.get(name)?.0, mesh))
    };
    let (one, other) = (placed(lower)?, placed(upper)?);
    if level(&(one.0.translation.vector - other.0.translation.vector)).norm() > FAR {
        return Some(Seat::Away);
    }
    // Middle, reach seen from above, lowest and highest point.
    let extent = |(pose, mesh): &(Isometry3<f64>, &Mesh)| {
        let points: Vec<Vector3<f64>> = mesh.vertices.iter().map(|v| (pose * v).coords).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let reach = points.iter().map(|p| level(&(p - middle)).norm()).fold(0.0, f64::max);
        let heights = points.iter().map(|p| up.dot(p));
        let ends = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], h| [a.min(h), b.max(h)]);
        (middle, reach, ends)
    };
    let (low, high) = (extent(&one), extent(&other));
    let apart = level(&(high.0 - low.0)).norm();
    Some(if apart > low.1 + high.1 {
        Seat::Away
    } else if apart < low.1 && (high.2[0] - low.2[1]).abs() < SEATED {
        Seat::On
    } else {
        Seat::Beside
    })
}

/// Whether all of a link is above the middle of another, along gravity, at the first view; false where a shape is not known.
pub fn above(model: &Model, lower: &str, upper: &str) -> bool {
    let up = -nalgebra::Vector3::from(model.twin.gravity);
    let reach = |name: &str| -> Option<[f64; 2]> {
        let link = model.twin.link(name)?;
        let mesh = model.meshes.get(link.mesh.as_ref()?)?;
        let heights = mesh.vertices.iter().map(|v| (link.pose.0 * v).coords.dot(&up));
        let ends = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], h| [a.min(h), b.max(h)]);
        ends[0].is_finite().then_some(ends)
    };
    match (reach(lower), reach(upper)) {
        (Some([from, to]), Some([bottom, _])) => bottom > 0.5 * (from + to),
        _ => false,
    }
}
