//! Closed surfaces of the lab's plain shapes, in the shape's own frame, counter-clockwise seen from outside.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Point3, Vector3};

use super::ShapeSpec;
use super::lathe;
use crate::geometry::Mesh;

/// Sides of round things.
pub(super) const SIDES: usize = 96;
/// Times that the faces of the icosahedron are quartered.
const SPHERE_LEVELS: usize = 4;

/// The closed surface of `shape`; a mesh file has no surface of its own here and gives an empty mesh.
pub(super) fn surface(shape: &ShapeSpec) -> Mesh {
    match shape {
        ShapeSpec::Box { size } => cuboid(Vector3::from(*size) / 2.0),
        ShapeSpec::Cylinder { radius, height } => lathe::turned(&[
            [0.0, -height / 2.0],
            [*radius, -height / 2.0],
            [*radius, height / 2.0],
            [0.0, height / 2.0],
        ]),
        ShapeSpec::Sphere { radius } => sphere(*radius),
        ShapeSpec::Lathe { profile, handle } => {
            let mut mesh = lathe::turned(profile);
            if let Some(handle) = handle {
                append(&mut mesh, &lathe::handle(profile, *handle));
            }
            mesh
        }
        ShapeSpec::Tray { size, wall, open } => tray(Vector3::from(*size) / 2.0, *wall, open),
        ShapeSpec::Mesh { .. } => Mesh::default(),
    }
}

/// Adds the triangles of `other` to `mesh` as a component of its own.
pub(super) fn append(mesh: &mut Mesh, other: &Mesh) {
    let offset = mesh.vertices.len() as u32;
    mesh.vertices.extend_from_slice(&other.vertices);
    mesh.triangles
        .extend(other.triangles.iter().map(|t| t.map(|v| v + offset)));
}

/// A mesh of these vertices and triangles, turned inside out if its volume is negative.
pub(super) fn outward(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Mesh {
    let mut mesh = Mesh {
        vertices,
        triangles,
        ..Mesh::default()
    };
    if mesh.volume() < 0.0 {
        for t in &mut mesh.triangles {
            t.swap(1, 2);
        }
    }
    mesh
}

/// The two triangles of a quadrilateral.
pub(super) fn quad(a: usize, b: usize, c: usize, d: usize) -> [[u32; 3]; 2] {
    let [a, b, c, d] = [a, b, c, d].map(|v| v as u32);
    [[a, b, c], [a, c, d]]
}

/// The corners of a rectangle of half sizes `u`, `v`, counter-clockwise.
fn corners(u: f64, v: f64) -> [[f64; 2]; 4] {
    [[-u, -v], [u, -v], [u, v], [-u, v]]
}

fn cuboid(half: Vector3<f64>) -> Mesh {
    let vertices = [-half.z, half.z]
        .iter()
        .flat_map(|z| corners(half.x, half.y).map(|[x, y]| Point3::new(x, y, *z)))
        .collect();
    let mut triangles = Vec::with_capacity(12);
    triangles.extend(quad(0, 3, 2, 1));
    for i in 0..4 {
        let j = (i + 1) % 4;
        triangles.extend(quad(i, j, 4 + j, 4 + i));
    }
    triangles.extend(quad(4, 5, 6, 7));
    outward(vertices, triangles)
}

/// The axis (0, 1, 2) and the sign of a face name such as `+x`.
pub(super) fn face(name: &str) -> Option<(usize, f64)> {
    let axis = ["x", "y", "z"].iter().position(|axis| name.get(1..) == Some(axis))?;
    match name.get(..1)? {
        "+" => Some((axis, 1.0)),
        "-" => Some((axis, -1.0)),
        _ => None,
    }
}

/// A box without the face `open`: outer bottom, outer top, inner top and inner floor are four rings of corners.
fn tray(half: Vector3<f64>, wall: f64, open: &str) -> Mesh {
    let (axis, sign) = face(open).unwrap_or((2, 1.0));
    let [iu, iv] = [(axis + 1) % 3, (axis + 2) % 3];
    let (u, v, w) = (half[iu], half[iv], half[axis]);
    let rings = [
        (corners(u, v), -w),
        (corners(u, v), w),
        (corners(u - wall, v - wall), w),
        (corners(u - wall, v - wall), wall - w),
    ];
    let place = |[a, b]: [f64; 2], c: f64| {
        let mut p = Point3::origin();
        (p[iu], p[iv], p[axis]) = (a, b, sign * c);
        p
    };
    let vertices = rings
        .iter()
        .flat_map(|(ring, z)| ring.map(|corner| place(corner, *z)))
        .collect();
    let mut triangles = Vec::with_capacity(28);
    triangles.extend(quad(0, 3, 2, 1));
    for ring in [0, 4, 8] {
        for i in 0..4 {
            let j = (i + 1) % 4;
            triangles.extend(quad(ring + i, ring + j, ring + 4 + j, ring + 4 + i));
        }
    }
    triangles.extend(quad(12, 13, 14, 15));
    outward(vertices, triangles)
}

fn sphere(radius: f64) -> Mesh {
    let mut mesh = icosahedron();
    for _ in 0..SPHERE_LEVELS {
        mesh = quartered(&mesh);
    }
    for vertex in &mut mesh.vertices {
        *vertex = Point3::from(vertex.coords.normalize() * radius);
    }
    outward(mesh.vertices, mesh.triangles)
}

/// Two poles and two rings of five: triangles around each pole and between the rings.
fn icosahedron() -> Mesh {
    let (z, r) = (1.0 / 5.0_f64.sqrt(), 2.0 / 5.0_f64.sqrt());
    let ring = |shift: f64, z: f64| {
        (0..5).map(move |i| {
            let angle = TAU * (i as f64 + shift) / 5.0;
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        })
    };
    let mut vertices = vec![Point3::new(0.0, 0.0, 1.0), Point3::new(0.0, 0.0, -1.0)];
    vertices.extend(ring(0.0, z));
    vertices.extend(ring(0.5, -z));
    let mut triangles = Vec::with_capacity(20);
    for i in 0..5_u32 {
        let j = (i + 1) % 5;
        triangles.extend([[0, 2 + i, 2 + j], [1, 7 + j, 7 + i]]);
        triangles.extend([[2 + i, 7 + i, 2 + j], [7 + i, 7 + j, 2 + j]]);
    }
    outward(vertices, triangles)
}

fn quartered(mesh: &Mesh) -> Mesh {
    let mut vertices = mesh.vertices.clone();
    let mut middles: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let sum = vertices[a as usize].coords + vertices[b as usize].coords;
            vertices.push(Point3::from(sum.normalize()));
            vertices.len() as u32 - 1
        })
    };
    let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
    for &[a, b, c] in &mesh.triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Mesh {
        vertices,
        triangles,
        ..Mesh::default()
    }
}

/// True where each edge of the surface has exactly one neighbour that runs the other way.
pub(super) fn is_closed(mesh: &Mesh) -> bool {
    let mut edges: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for [a, b, c] in &mesh.triangles {
        for edge in [(*a, *b), (*b, *c), (*c, *a)] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    !edges.is_empty()
        && edges
            .iter()
            .all(|((a, b), n)| *n == 1 && edges.get(&(*b, *a)) == Some(&1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_is_closed_and_faces_outward() {
        let mug = vec![
            [0.0, 0.0],
            [0.04, 0.0],
            [0.04, 0.09],
            [0.036, 0.09],
            [0.036, 0.005],
            [0.0, 0.005],
        ];
        let tray = |open: &str| ShapeSpec::Tray {
            size: [0.12, 0.1, 0.06],
            wall: 0.006,
            open: open.into(),
        };
        let shapes = [
            ShapeSpec::Box { size: [0.1, 0.2, 0.3] },
            ShapeSpec::Cylinder {
                radius: 0.03,
                height: 0.1,
            },
            ShapeSpec::Sphere { radius: 0.03 },
            ShapeSpec::Lathe {
                profile: mug.clone(),
                handle: None,
            },
            ShapeSpec::Lathe {
                profile: mug,
                handle: Some([0.022, 0.005, 0.045]),
            },
            tray("+x"),
            tray("-y"),
            tray("+z"),
        ];
        for shape in shapes {
            let mesh = surface(&shape);
            assert!(is_closed(&mesh), "{shape:?} is open");
            assert!(mesh.volume() > 0.0, "{shape:?} is inside out");
        }
    }
}
