//! A body as it stands on the table before a tool moves it: shapes, and what they stand on.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

use super::Footprint;
use super::foot::{Foot, Stand};
use crate::base::Pose;
use crate::geometry::Mesh;
use crate::twin::{Body, Model};

/// What does not change while other numbers of the same body are tried. The plane frame has z along the support's normal.
#[derive(Clone, Debug)]
pub struct Stance {
    pub(super) plane_from_world: UnitQuaternion<f64>,
    pub(super) links: Vec<Placed>,
}

/// One link, plane frame at the start.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub pose: Isometry3<f64>,
    pub stand: Stand,
    /// At the height of the tool.
    pub outline: Option<Arc<Footprint>>,
}

impl Stance {
    /// Of `body` with its links at `start`; `height` is the tool's, along the normal. Nothing where a link has no pose.
    pub fn of(
        model: &Model,
        body: &Body,
        start: &BTreeMap<String, Pose>,
        normal: &Vector3<f64>,
        height: f64,
    ) -> Option<Self> {
        let plane_from_world = UnitQuaternion::rotation_between(normal, &Vector3::z())?;
        let turn = Isometry3::from_parts(Translation3::identity(), plane_from_world);
        let placed = |link: &crate::twin::Link| {
            let pose = turn * start.get(&link.name)?.0;
            let mesh = link.mesh.as_ref().and_then(|m| model.meshes.get(m));
            Some(Placed {
                stand: Stand::of(link, mesh, &pose),
                outline: mesh.and_then(|m| slice(m, &pose, height)).map(Arc::new),
                pose,
            })
        };
        let links = body.links.iter().map(placed).collect::<Option<Vec<Placed>>>()?;
        Some(Self {
            plane_from_world,
            links,
        })
    }

    /// A world point in the plane frame.
    pub fn flatten(&self, point: &Point3<f64>) -> Point2<f64> {
        (self.plane_from_world * point).xy()
    }
}

/// The hull of the cut at `height`.
fn slice(mesh: &Mesh, pose: &Isometry3<f64>, height: f64) -> Option<Footprint> {
    let points: Vec<_> = mesh.vertices.iter().map(|v| pose * v).collect();
    Footprint::section(&points, &mesh.triangles, height)
}

/// Height above the lower of two that are glued from which the upper one bears on nothing, m.
const CLEAR: f64 = 5e-3;

/// Of two that are held to each other the lower one bears what was given to the upper one, where that is clear of the support.
pub(super) fn on_the_lower(a: Option<Foot>, b: Option<Foot>) -> (Option<Foot>, Option<Foot>) {
    let (mut a, mut b) = match (a, b) {
        (Some(a), Some(b)) if (a.ground - b.ground).abs() >= CLEAR => (a, b),
        other => return other,
    };
    let force = a.force + b.force;
    let mass = a.mass.zip(b.mass).map(|(a, b)| a + b);
    let lower = if a.ground < b.ground { &mut a } else { &mut b };
    (lower.force, lower.mass) = (force, mass);
    if a.ground < b.ground {
        (Some(a), None)
    } else {
        (None, Some(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_that_are_glued_the_lower_one_bears_both() {
        let of = |force: f64, mass: Option<f64>, ground: f64| Foot {
            force,
            radius: 0.04,
            centre: Point2::origin(),
            creep: 0.0,
            creep_ratio: 0.0,
            mass,
            ground,
            under: None,
        };
        let (low, top) = (of(1.2, Some(0.5), 0.0), of(0.8, Some(0.3), 0.06));
        let (upper, lower) = on_the_lower(Some(top.clone()), Some(low.clone()));
        let lower = lower.expect("a foot");
        assert!(upper.is_none());
        assert!((lower.force - 2.0).abs() < 1e-12 && (lower.mass.expect("both are known") - 0.8).abs() < 1e-12);
        // Side by side each stands on its own foot; and a foot alone stays as it is.
        let (a, b) = on_the_lower(Some(low.clone()), Some(of(0.8, None, 0.001)));
        assert!(a.is_some_and(|f| f.force == 1.2) && b.is_some_and(|f| f.force == 0.8));
        assert!(matches!(on_the_lower(Some(top), None), (Some(f), None) if f.force == 0.8));
    }
}
