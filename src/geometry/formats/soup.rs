//! What a mesh file says before it is put in order.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::geometry::Mesh;

/// Triangles as they stand in a file: vertices may repeat, indices and numbers are unchecked.
#[derive(Clone, Debug, Default)]
pub(super) struct Soup {
    pub vertices: Vec<Point3<f64>>,
    pub triangles: Vec<[u32; 3]>,
    /// One per vertex, or empty.
    pub colors: Vec<[u8; 3]>,
}

impl Soup {
    /// A polygon as a fan around its first corner.
    pub fn add_polygon(&mut self, corners: &[u32]) {
        for pair in corners.windows(2).skip(1) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
        }
    }

    /// Vertices at exactly the same place become one (the first one's colour stays); triangles that use one
    /// vertex twice, and vertices without a triangle, go.
    pub fn merged(self) -> Mesh {
        let mut at = BTreeMap::new();
        let first: Vec<u32> = (0..self.vertices.len() as u32)
            .map(|i| {
                // Adding zero makes -0.0 and 0.0 the same place.
                let place = self.vertices[i as usize].coords.map(|c| (c + 0.0).to_bits());
                *at.entry([place.x, place.y, place.z]).or_insert(i)
            })
            .collect();
        let triangles: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.map(|v| first[v as usize])).collect();
        let mesh = Mesh {
            vertices: self.vertices,
            triangles,
            colors: self.colors,
            ..Mesh::default()
        };
        mesh.subset(|i| {
            let [a, b, c] = mesh.triangles[i];
            a != b && b != c && c != a
        })
    }
}

/// A linear intensity 0 to 1 as an sRGB byte (IEC 61966-2-1).
pub(super) fn srgb_from_linear(x: f64) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let s = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (s * 255.0).round() as u8
}
