//! Rays shot into the scene as it stands at the first view: what they hit, and its colour.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::query::Ray;
use parry3d_f64::shape::{CompositeShapeRef, TriMesh};

use super::surface::append;
use super::{Scene, Solid};
use crate::base::{Error, Pose, Result};
use crate::geometry::Mesh;

/// Half the edge length of the table top, m.
const TABLE_HALF: f64 = 0.5;
/// Where the light comes from, and how much of it is everywhere.
const LIGHT: [f64; 3] = [0.35, -0.45, 0.82];
const AMBIENT: f64 = 0.45;
/// sRGB of a tool.
const TOOL_COLOR: [u8; 3] = [60, 60, 64];

/// All surfaces in one tree, with what is needed to shade them.
pub(super) struct Stage {
    surfaces: Option<TriMesh>,
    normals: Vec<Vector3<f64>>,
    owners: Vec<u16>,
    colors: Vec<[u8; 3]>,
    table_center: [f64; 2],
}

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// In lengths of the ray's direction.
    pub distance: f64,
    /// Unit normal of the surface, world.
    pub normal: Vector3<f64>,
    /// Place of the body in the scene from 1; 0 = the table.
    pub owner: u16,
    /// sRGB, shaded.
    pub color: [f64; 3],
}

impl Stage {
    /// The scene at its first view.
    pub fn new(scene: &Scene, solids: &BTreeMap<String, Solid>) -> Result<Self> {
        let poses = solids.values().map(|s| (s.name.clone(), s.world_from_body)).collect();
        Self::posed(scene, solids, &poses, None)
    }

    /// The scene with its bodies where `poses` says, and a further surface, in world coordinates, of a tool.
    pub fn posed(
        scene: &Scene,
        solids: &BTreeMap<String, Solid>,
        poses: &BTreeMap<String, Pose>,
        tool: Option<Mesh>,
    ) -> Result<Self> {
        let mut whole = Mesh::default();
        let mut owners = Vec::new();
        for (i, body) in scene.body.iter().enumerate() {
            let (Some(solid), Some(world_from_body)) = (solids.get(&body.name), poses.get(&body.name)) else {
                continue;
            };
            let offset = whole.vertices.len() as u32;
            whole
                .vertices
                .extend(solid.mesh.vertices.iter().map(|v| world_from_body.0 * v));
            whole
                .triangles
                .extend(solid.mesh.triangles.iter().map(|t| t.map(|v| v + offset)));
            owners.resize(whole.triangles.len(), i as u16 + 1);
        }
        if let Some(tool) = tool {
            append(&mut whole, &tool);
            owners.resize(whole.triangles.len(), scene.body.len() as u16 + 1);
        }
        let normals = (0..whole.triangles.len())
            .map(|i| whole.scaled_normal(i).normalize())
            .collect();
        let vertices = whole.vertices.iter().map(|v| Vector::new(v.x, v.y, v.z)).collect();
        let surfaces = (!whole.triangles.is_empty())
            .then(|| TriMesh::new(vertices, whole.triangles))
            .transpose()
            .map_err(|e| Error::Failed(format!("{}: the surfaces cannot be ray-cast: {e}", scene.name)))?;
        Ok(Self {
            surfaces,
            normals,
            owners,
            colors: scene.body.iter().map(|b| b.color).chain([TOOL_COLOR]).collect(),
            table_center: [scene.camera.target[0], scene.camera.target[1]],
        })
    }

    /// The nearest surface along `origin + t direction`, t > 0, up to t = `far`.
    pub fn shoot(&self, origin: &Point3<f64>, direction: &Vector3<f64>, far: f64) -> Option<Hit> {
        let table = self.table(origin, direction).filter(|hit| hit.distance < far);
        let far = table.map_or(far, |hit| hit.distance);
        let ray = Ray::new(
            Vector::new(origin.x, origin.y, origin.z),
            Vector::new(direction.x, direction.y, direction.z),
        );
        let body = self
            .surfaces
            .as_ref()
            .and_then(|surfaces| CompositeShapeRef(surfaces).cast_local_ray(&ray, far, false))
            .map(|(triangle, distance)| {
                let normal = self.normals[triangle as usize];
                let owner = self.owners[triangle as usize];
                let color = shade(self.colors[usize::from(owner) - 1].map(f64::from), &normal);
                Hit {
                    distance,
                    normal,
                    owner,
                    color,
                }
            });
        body.or(table)
    }

    fn table(&self, origin: &Point3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let distance = -origin.z / direction.z;
        if !(distance.is_finite() && distance > 0.0) {
            return None;
        }
        let spot = origin + direction * distance;
        let [x, y] = [spot.x - self.table_center[0], spot.y - self.table_center[1]];
        if x.abs().max(y.abs()) > TABLE_HALF {
            return None;
        }
        let normal = Vector3::z();
        Some(Hit {
            distance,
            normal,
            owner: 0,
            color: shade(wood(x, y), &normal),
        })
    }
}

/// Lambert's law with one far light.
fn shade(color: [f64; 3], normal: &Vector3<f64>) -> [f64; 3] {
    let light = Vector3::from(LIGHT).normalize();
    color.map(|c| c * (AMBIENT + (1.0 - AMBIENT) * normal.dot(&light).max(0.0)))
}

/// Boards 60 mm wide with a grain along x.
fn wood(x: f64, y: f64) -> [f64; 3] {
    let board = (y / 0.06).floor();
    let grain = (170.0 * y + 2.0 * (9.0 * x + 1.7 * board).sin()).sin();
    let tone = 1.0 + 0.05 * (2.3 * board).sin() + 0.04 * grain;
    [188.0, 150.0, 108.0].map(|c| c * tone)
}
