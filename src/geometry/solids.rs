//! Closed solids with known answers: boxes, cylinders, spheres, tori and anything turned on a lathe.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::Point3;

use super::Mesh;

/// A box of side lengths `size`, m, centred at the origin: 12 triangles.
pub fn cuboid(size: [f64; 3]) -> Mesh {
    let half = size.map(|s| 0.5 * s);
    let corner = |i: usize, axis: usize| if i >> axis & 1 == 1 { half[axis] } else { -half[axis] };
    Mesh {
        vertices: (0..8)
            .map(|i| Point3::new(corner(i, 0), corner(i, 1), corner(i, 2)))
            .collect(),
        triangles: vec![
            [0, 2, 3],
            [0, 3, 1],
            [4, 5, 7],
            [4, 7, 6],
            [0, 1, 5],
            [0, 5, 4],
            [2, 6, 7],
            [2, 7, 3],
            [0, 4, 6],
            [0, 6, 2],
            [1, 3, 7],
            [1, 7, 5],
        ],
        ..Mesh::default()
    }
}

/// A cylinder around z, centred at the origin, m; its sides have `segments` faces.
pub fn cylinder(radius: f64, height: f64, segments: usize) -> Mesh {
    let h = 0.5 * height;
    revolve(&[[0.0, -h], [radius, -h], [radius, h], [0.0, h]], segments)
}

/// A torus around z: a tube of radius `tube` whose centre runs at `radius`, m.
pub fn torus(radius: f64, tube: f64, segments: usize, tube_segments: usize) -> Mesh {
    let profile: Vec<[f64; 2]> = (0..tube_segments)
        .map(|i| TAU * i as f64 / tube_segments as f64)
        .map(|angle| [radius + tube * angle.cos(), tube * angle.sin()])
        .collect();
    revolve(&profile, segments)
}

/// What a lathe makes of a profile of (radius, z), m, run counter-clockwise (outward along the bottom,
/// up the outside). A profile from axis to axis is closed by the axis, any other by its first point.
pub fn revolve(profile: &[[f64; 2]], segments: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let rings: Vec<Vec<u32>> = profile.iter().map(|p| ring(&mut mesh, *p, segments)).collect();
    let on_axis = |p: Option<&[f64; 2]>| p.is_some_and(|p| p[0] == 0.0);
    let open = on_axis(profile.first()) && on_axis(profile.last());
    let edges = if open {
        rings.len().saturating_sub(1)
    } else {
        rings.len()
    };
    for i in 0..edges {
        band(&mut mesh, &rings[i], &rings[(i + 1) % rings.len()]);
    }
    mesh
}

fn ring(mesh: &mut Mesh, [radius, z]: [f64; 2], segments: usize) -> Vec<u32> {
    let first = mesh.vertices.len() as u32;
    if radius == 0.0 {
        mesh.vertices.push(Point3::new(0.0, 0.0, z));
        return vec![first; segments];
    }
    for k in 0..segments {
        let (sin, cos) = (TAU * k as f64 / segments as f64).sin_cos();
        mesh.vertices.push(Point3::new(radius * cos, radius * sin, z));
    }
    (first..first + segments as u32).collect()
}

fn band(mesh: &mut Mesh, from: &[u32], to: &[u32]) {
    for k in 0..from.len() {
        let next = (k + 1) % from.len();
        let (a, b, c, d) = (from[k], to[k], to[next], from[next]);
        if a != d {
            mesh.triangles.push([a, d, c]);
        }
        if b != c {
            mesh.triangles.push([a, c, b]);
        }
    }
}

/// A sphere around the origin, m: an icosahedron whose faces are split `subdivisions` times.
pub fn sphere(radius: f64, subdivisions: usize) -> Mesh {
    let mut mesh = icosahedron();
    for _ in 0..subdivisions {
        mesh = subdivided(&mesh);
    }
    for v in &mut mesh.vertices {
        *v = Point3::from(v.coords.normalize() * radius);
    }
    mesh
}

fn icosahedron() -> Mesh {
    let g = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push(Point3::new(a, b, 0.0));
    }
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push(Point3::new(0.0, a, b));
    }
    for (a, b) in [(g, -1.0), (g, 1.0), (-g, -1.0), (-g, 1.0)] {
        vertices.push(Point3::new(a, 0.0, b));
    }
    let triangles = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    Mesh {
        vertices,
        triangles,
        ..Mesh::default()
    }
}

/// Every triangle split into four at the middles of its edges; colours and `seen` flags are dropped.
pub fn subdivided(mesh: &Mesh) -> Mesh {
    let mut vertices = mesh.vertices.clone();
    let mut middles = BTreeMap::new();
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            vertices.push(nalgebra::center(&vertices[a as usize], &vertices[b as usize]));
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

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::geometry::is_closed_manifold;

    #[test]
    fn every_solid_is_closed_faces_outward_and_has_its_volume() {
        let cup = [
            [0.0, 0.0],
            [0.04, 0.0],
            [0.04, 0.09],
            [0.037, 0.09],
            [0.037, 0.005],
            [0.0, 0.005],
        ];
        for (name, mesh, volume) in [
            ("box", cuboid([0.1, 0.2, 0.3]), 0.006),
            ("cylinder", cylinder(0.05, 0.1, 256), PI * 0.0025 * 0.1),
            ("sphere", sphere(0.05, 4), 4.0 / 3.0 * PI * 0.05f64.powi(3)),
            ("torus", torus(0.05, 0.01, 256, 128), 2.0 * PI * PI * 0.05 * 0.0001),
            ("cup", revolve(&cup, 256), PI * (0.0016 * 0.09 - 0.001369 * 0.085)),
        ] {
            assert_eq!(is_closed_manifold(&mesh), Ok(()), "{name}");
            assert!(
                (mesh.volume() / volume - 1.0).abs() < 0.005,
                "{name}: {}",
                mesh.volume()
            );
        }
    }
}
