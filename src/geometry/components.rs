//! What hangs together in a mesh, and whether it is closed.

use super::Mesh;
use nalgebra::Vector3;

/// Sets that merge (Tarjan 1975), with the smallest member as the name of a set.
#[derive(Clone, Debug)]
pub struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// `n` sets of one member each.
    pub fn new(n: usize) -> Self {
        Self {
            parent: (0..n as u32).collect(),
        }
    }

    /// The name of the set of `a`.
    pub fn find(&mut self, mut a: u32) -> u32 {
        while self.parent[a as usize] != a {
            let up = self.parent[self.parent[a as usize] as usize];
            self.parent[a as usize] = up;
            a = up;
        }
        a
    }

    /// Merges the sets of `a` and `b` and returns the name of the result.
    pub fn union(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high as usize] = low;
        low
    }
}

/// The connected component of each vertex, numbered from 0 in the order of the vertices; and their number.
pub fn vertex_components(mesh: &Mesh) -> (Vec<u32>, usize) {
    let mut sets = UnionFind::new(mesh.vertices.len());
    for t in &mesh.triangles {
        sets.union(t[0], t[1]);
        sets.union(t[1], t[2]);
    }
    number_sets(&mut sets, mesh.vertices.len())
}

/// Numbers the sets from 0 in the order of their first members.
pub fn number_sets(sets: &mut UnionFind, n: usize) -> (Vec<u32>, usize) {
    let mut number = vec![u32::MAX; n];
    let mut count = 0;
    let labels = (0..n as u32)
        .map(|v| {
            let root = sets.find(v) as usize;
            if number[root] == u32::MAX {
                number[root] = count;
                count += 1;
            }
            number[root]
        })
        .collect();
    (labels, count as usize)
}

/// The part of a mesh whose triangles `keep` accepts, with unused vertices dropped; and for each new vertex
/// the old one.
pub fn submesh(mesh: &Mesh, keep: impl Fn(usize) -> bool) -> (Mesh, Vec<u32>) {
    let mut new_index = vec![u32::MAX; mesh.vertices.len()];
    let mut old = Vec::new();
    let mut out = Mesh::default();
    for (i, t) in mesh.triangles.iter().enumerate().filter(|(i, _)| keep(*i)) {
        debug_assert!(i < mesh.triangles.len());
        out.triangles.push(t.map(|v| {
            let slot = &mut new_index[v as usize];
            if *slot == u32::MAX {
                *slot = old.len() as u32;
                old.push(v);
            }
            *slot
        }));
    }
    let pick = |v: &u32| *v as usize;
    out.vertices = old.iter().map(|v| mesh.vertices[pick(v)]).collect();
    if !mesh.colors.is_empty() {
        out.colors = old.iter().map(|v| mesh.colors[pick(v)]).collect();
    }
    if !mesh.seen.is_empty() {
        out.seen = old.iter().map(|v| mesh.seen[pick(v)]).collect();
    }
    if !mesh.mirrored.is_empty() {
        out.mirrored = old.iter().map(|v| mesh.mirrored[pick(v)]).collect();
    }
    (out, old)
}

/// The number of directed edges that are not met by exactly one opposite edge: 0 for a closed, consistently
/// oriented mesh in which each edge has two triangles.
pub fn edge_defects(mesh: &Mesh) -> usize {
    let mut edges: Vec<(u32, u32)> = directed_edges(mesh).collect();
    edges.sort_unstable();
    let repeated = edges.windows(2).filter(|w| w[0] == w[1]).count();
    let lonely = edges
        .iter()
        .filter(|(a, b)| edges.binary_search(&(*b, *a)).is_err())
        .count();
    repeated + lonely
}

/// Every edge of every triangle in its sense of rotation.
pub fn directed_edges(mesh: &Mesh) -> impl Iterator<Item = (u32, u32)> + '_ {
    mesh.triangles
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
}

/// Unit normals at the vertices, triangles weighted by area.
pub fn vertex_normals(mesh: &Mesh) -> Vec<Vector3<f64>> {
    let mut normals = vec![Vector3::zeros(); mesh.vertices.len()];
    for (i, t) in mesh.triangles.iter().enumerate() {
        let n = mesh.scaled_normal(i);
        for v in t {
            normals[*v as usize] += n;
        }
    }
    normals
        .into_iter()
        .map(|n| n.try_normalize(0.0).unwrap_or_else(Vector3::z))
        .collect()
}

/// Undirected edges, each once, ascending.
pub fn unique_edges(mesh: &Mesh) -> Vec<(u32, u32)> {
    let mut edges: Vec<(u32, u32)> = directed_edges(mesh).map(|(a, b)| (a.min(b), a.max(b))).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}
