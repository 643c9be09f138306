//! A triangle mesh with optional colour and, per vertex, whether it was seen.

use nalgebra::{Isometry3, Point3, Vector3};

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

    /// The same mesh with every vertex moved by `target_from_source`.
    pub fn transformed(&self, target_from_source: &Isometry3<f64>) -> Self {
        Self {
            vertices: self.vertices.iter().map(|v| target_from_source * v).collect(),
            ..self.clone()
        }
    }

    /// Adds the triangles of `other`; colours and `seen` flags stay only where both meshes have them.
    pub fn append(&mut self, other: &Self) {
        let base = self.vertices.len() as u32;
        let was_empty = self.vertices.is_empty();
        let colored = (was_empty || !self.colors.is_empty()) && !other.colors.is_empty();
        let flagged = (was_empty || !self.seen.is_empty()) && !other.seen.is_empty();
        self.vertices.extend(&other.vertices);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
        if colored {
            self.colors.extend(&other.colors);
        } else {
            self.colors.clear();
        }
        if flagged {
            self.seen.extend(&other.seen);
        } else {
            self.seen.clear();
        }
    }

    /// The triangles for which `keep` holds, with the vertices that they use, in their old order.
    pub fn subset(&self, keep: impl Fn(usize) -> bool) -> Self {
        let triangles: Vec<_> = (0..self.triangles.len())
            .filter(|&i| keep(i))
            .map(|i| self.triangles[i])
            .collect();
        let mut new_index = vec![u32::MAX; self.vertices.len()];
        for v in triangles.iter().flatten() {
            new_index[*v as usize] = 0;
        }
        let kept: Vec<usize> = (0..self.vertices.len()).filter(|&v| new_index[v] == 0).collect();
        for (new, &old) in kept.iter().enumerate() {
            new_index[old] = new as u32;
        }
        let has = |flags: usize| flags == self.vertices.len();
        Self {
            vertices: kept.iter().map(|&v| self.vertices[v]).collect(),
            triangles: triangles.iter().map(|t| t.map(|v| new_index[v as usize])).collect(),
            colors: if has(self.colors.len()) {
                kept.iter().map(|&v| self.colors[v]).collect()
            } else {
                Vec::new()
            },
            seen: if has(self.seen.len()) {
                kept.iter().map(|&v| self.seen[v]).collect()
            } else {
                Vec::new()
            },
        }
    }
}
