//! A triangle mesh with optional colour and, per vertex, where its surface comes from.

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
    /// Whether an unseen vertex is the image of a seen one (else it was closed); empty = none is. Where it is not
    /// empty, `seen` is not either, and no vertex is both.
    pub mirrored: Vec<bool>,
}

/// Where the surface at a vertex comes from, the surest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// A view showed it.
    #[default]
    Seen,
    /// It is the image of a seen surface in a plane, axis or centre of symmetry.
    Mirrored,
    /// It was concluded: closed against the support, or filled in.
    Closed,
}

impl Origin {
    /// The number that stands for it in files: 1 seen, 0.5 mirrored, 0 closed.
    pub fn trust(self) -> f32 {
        match self {
            Self::Seen => 1.0,
            Self::Mirrored => 0.5,
            Self::Closed => 0.0,
        }
    }
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

    /// Where the surface at a vertex comes from.
    pub fn origin(&self, vertex: usize) -> Origin {
        match (self.seen.get(vertex), self.mirrored.get(vertex)) {
            (None | Some(true), _) => Origin::Seen,
            (_, Some(true)) => Origin::Mirrored,
            _ => Origin::Closed,
        }
    }

    /// The origin of every vertex, or nothing where all was seen.
    pub fn origins(&self) -> Vec<Origin> {
        (0..self.seen.len()).map(|v| self.origin(v)).collect()
    }

    /// Writes down where the surface at each vertex comes from.
    pub fn set_origins(&mut self, origins: &[Origin]) {
        self.seen = origins.iter().map(|o| *o == Origin::Seen).collect();
        self.mirrored = origins.iter().map(|o| *o == Origin::Mirrored).collect();
        if !self.mirrored.contains(&true) {
            self.mirrored.clear();
        }
    }

    /// Shares of the area that were seen, mirrored and closed. A triangle is no surer than its least sure corner.
    pub fn origin_shares(&self) -> [f64; 3] {
        let mut areas = [0.0; 3];
        for (i, triangle) in self.triangles.iter().enumerate() {
            let origin = triangle.iter().map(|v| self.origin(*v as usize)).max();
            areas[origin.unwrap_or_default() as usize] += 0.5 * self.scaled_normal(i).norm();
        }
        let whole = areas.iter().sum::<f64>().max(1e-12);
        areas.map(|a| a / whole)
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
        if flagged && !(self.mirrored.is_empty() && other.mirrored.is_empty()) {
            self.mirrored.resize(base as usize, false);
            self.mirrored.extend(&other.mirrored);
            self.mirrored.resize(base as usize + other.vertices.len(), false);
        } else {
            self.mirrored.clear();
        }
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
            mirrored: if has(self.mirrored.len()) {
                kept.iter().map(|&v| self.mirrored[v]).collect()
            } else {
                Vec::new()
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four triangles of one area in a fan, of which one leans on a mirrored and one on a closed corner.
    fn fan() -> Mesh {
        let mut mesh = Mesh {
            vertices: (0..6)
                .map(|i| Point3::new(f64::from(i), f64::from(i % 2), 0.0))
                .collect(),
            triangles: vec![[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 5]],
            ..Mesh::default()
        };
        use Origin::{Closed, Mirrored, Seen};
        mesh.set_origins(&[Seen, Seen, Seen, Seen, Mirrored, Closed]);
        mesh
    }

    #[test]
    fn shares_of_the_surface_sum_to_one_and_doubt_wins() {
        assert_eq!(fan().origin_shares(), [0.5, 0.25, 0.25]);
        assert_eq!(
            Mesh {
                seen: Vec::new(),
                mirrored: Vec::new(),
                ..fan()
            }
            .origin_shares(),
            [1.0, 0.0, 0.0]
        );
    }

    #[test]
    fn origins_survive_parting_and_joining() {
        let (mesh, mut joined) = (fan(), fan().subset(|t| t < 2));
        assert_eq!(joined.origins(), [Origin::Seen; 4]);
        joined.append(&mesh.subset(|t| t == 3));
        assert_eq!(joined.origins()[4..], [Origin::Seen, Origin::Mirrored, Origin::Closed]);
    }
}
