//! Somebody else's model as a twin: a URDF with its meshes, or the mesh of one rigid thing.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Vector3};

use super::adopt_urdf::adopt_urdf;
use super::drag::drag;
use crate::base::{Error, Estimate, Pose, Result, Status, Value, read_bytes};
use crate::geometry::{DecompositionConfig, Mesh, convex_parts, is_closed_manifold, parse_mesh};
use crate::twin::{Body, FORMAT, Link, Model, Provenance, SupportPlane, Twin};

/// Standard gravity, m/s².
pub(super) const GRAVITY: f64 = 9.80665;

/// What the numbers of a file are taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trust {
    /// Somebody's guess, to be judged.
    Assumed,
    /// Given: weighed, or from a drawing.
    Known,
}

impl Trust {
    /// A number of the file with this status; it says nothing of its doubt.
    pub(super) fn estimate<T: Value>(self, value: T, unit: &str) -> Estimate<T> {
        Estimate {
            status: match self {
                Self::Assumed => Status::Assumed,
                Self::Known => Status::Known,
            },
            method: "imported".into(),
            ..Estimate::known(value, None, unit)
        }
    }
}

/// Reads a `.urdf`, or a `.obj`, `.stl`, `.ply`, `.glb` or `.gltf` as one rigid body in metres, as it stands; puts it on a
/// level table at z = 0 with the root's axes along the world's.
///
/// # Errors
/// Where the file or one of its meshes cannot be read, or says what no twin can.
pub fn adopt(file: &Path, trust: Trust) -> Result<Model> {
    let ending = file.extension().map(|e| e.to_string_lossy().to_lowercase());
    let mut model = match ending.as_deref() {
        Some("urdf") => adopt_urdf(file, trust)?,
        _ => adopt_mesh(file)?,
    };
    set_down(&mut model);
    drag(&mut model, trust);
    model
        .twin
        .sanity_check()
        .and_then(|()| model.sanity_check())
        .map_err(|e| Error::bad_input(file, "content", e.to_string(), "a model that makes sense"))?;
    Ok(model)
}

fn adopt_mesh(file: &Path) -> Result<Model> {
    let mesh = parse_mesh(file, &read_bytes(file)?)?;
    let name = stem(file);
    let mut model = empty(&name);
    let mut link = Link::new(name.clone(), Pose::identity());
    shape(&mut model, &mut link, &[mesh], &[]);
    model.twin.bodies.push(Body::rigid(link));
    Ok(model)
}

/// The name of a file without its ending.
pub(super) fn stem(file: &Path) -> String {
    file.file_stem()
        .map_or_else(|| "twin".into(), |s| s.to_string_lossy().into_owned())
}

/// A twin of nothing on a level table.
pub(super) fn empty(name: &str) -> Model {
    Model {
        twin: Twin {
            format: FORMAT.into(),
            name: name.into(),
            gravity: [0.0, 0.0, -GRAVITY],
            support: Some(SupportPlane {
                point: [0.0; 3],
                normal: [0.0, 0.0, 1.0],
                material: None,
                gravity: None,
            }),
            bodies: Vec::new(),
            relations: Vec::new(),
            provenance: Provenance {
                version: env!("CARGO_PKG_VERSION").into(),
                ..Provenance::default()
            },
            effects: Vec::new(),
            notices: Vec::new(),
        },
        meshes: BTreeMap::new(),
        textures: BTreeMap::new(),
    }
}

/// Gives a link its visual mesh, merged of all that is seen, and convex parts of all that touches (of what is seen, where
/// nothing is said to touch).
pub(super) fn shape(model: &mut Model, link: &mut Link, seen: &[Mesh], touching: &[Mesh]) {
    let file: String = link
        .name
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() || c == '-' || c == '_' {
                c
            } else {
                '_'
            }
        })
        .collect();
    let looks = merged(if seen.is_empty() { touching } else { seen });
    if looks.triangles.is_empty() {
        return;
    }
    let path = format!("meshes/{file}.obj");
    model.meshes.insert(path.clone(), looks);
    link.mesh = Some(path);
    let solids = if touching.is_empty() { seen } else { touching };
    let parts = solids.iter().flat_map(|mesh| match is_closed_manifold(mesh) {
        Ok(()) => convex_parts(mesh, &DecompositionConfig::default()),
        Err(_) => crate::geometry::convex_hull(&mesh.vertices).into_iter().collect(),
    });
    for (k, part) in parts.enumerate() {
        let path = format!("meshes/{file}.collision-{k}.obj");
        model.meshes.insert(path.clone(), part);
        link.collision.push(path);
    }
}

fn merged(meshes: &[Mesh]) -> Mesh {
    let colored = meshes.iter().all(|m| m.colors.len() == m.vertices.len());
    meshes.iter().fold(Mesh::default(), |mut all, mesh| {
        let base = all.vertices.len() as u32;
        all.vertices.extend(&mesh.vertices);
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + base)));
        if colored {
            all.colors.extend(&mesh.colors);
        }
        all
    })
}

/// A mesh moved and stretched.
pub(super) fn placed(mesh: &Mesh, pose: &Isometry3<f64>, scale: &Vector3<f64>) -> Mesh {
    let mut out = mesh.clone();
    for v in &mut out.vertices {
        *v = pose * Point3::from(v.coords.component_mul(scale));
    }
    if scale.product() < 0.0 {
        out.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    out
}

/// Raises every body until its lowest point is on the table.
fn set_down(model: &mut Model) {
    let meshes = &model.meshes;
    for body in &mut model.twin.bodies {
        let solid = |link: &Link| {
            let paths = link.mesh.iter().filter_map(|p| meshes.get(p));
            let pose = link.pose.0;
            paths
                .flat_map(|m| &m.vertices)
                .map(|v| (pose * v).z)
                .fold(f64::INFINITY, f64::min)
        };
        let lowest = body.links.iter().map(solid).fold(f64::INFINITY, f64::min);
        if !lowest.is_finite() {
            continue;
        }
        for link in &mut body.links {
            link.pose.0.translation.vector.z -= lowest;
        }
        for joint in &mut body.joints {
            joint.origin.value[2] -= lowest;
        }
    }
}
