//! A triangle mesh with optional colour and, per vertex, whether it was seen.

use nalgebra::{Point3, Vector3};

/// Triangles over shared vertices, counter-clockwise seen from outside. Metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub vertices: Vec<Point3<f64>>,
    /// Triangles as vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// sRGB colour per vertex; empty where none was seen.
    pub colors: Vec<[u8; 3]>,
    /// Whether the surface at a vertex was seen (else closed or mirrored); empty = all seen.
    pub seen: Vec<bool>,
}

impl Mesh {
    /// The three corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [Point3<f64>; 3] {
        self.triangles[i].map(|v| self.vertices[v as usize])
    }

    /// Twice the area of triangle `i` times its unit normal.
    pub fn scaled_normal(&self, i: usize) -> Vector3<f64> {
        let [a, b, c] = self.corners(i);
        (b - a).cross(&(c - a))
    }

    /// Total area, m².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|i| 0.5 * self.scaled_normal(i).norm())
            .sum()
    }

    /// Signed volume by the divergence theorem, m³; the volume of the solid where the mesh is closed.
    pub fn volume(&self) -> f64 {
        (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                a.coords.dot(&b.coords.cross(&c.coords)) / 6.0
            })
            .sum()
    }

    /// Smallest and largest corner of the axis-aligned box around it, or nothing for an empty mesh.
    pub fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        let first = *self.vertices.first()?;
        Some(
            self.vertices
                .iter()
                .fold((first, first), |(lo, hi), v| (lo.inf(v), hi.sup(v))),
        )
    }
}
