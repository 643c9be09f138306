//! A body as it stands on the table before a tool moves it: shapes, and what they stand on.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};

use super::Footprint;
use super::foot::Stand;
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
