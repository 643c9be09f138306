//! What hangs together: edges, closedness, Euler characteristic, connected components.

use std::collections::BTreeMap;
use std::fmt;

use super::Mesh;

/// Why a mesh is not the boundary of a solid.
#[derive(Clone, Debug, PartialEq)]
pub enum TopologyFault {
    /// It has no triangles.
    Empty,
    /// A triangle names a vertex that does not exist.
    IndexOutOfRange(usize),
    /// A triangle uses one vertex twice, or has no area.
    DegenerateTriangle(usize),
    /// An edge that only one triangle uses.
    OpenEdge(u32, u32),
    /// A directed edge that more than one triangle uses: three sheets meet, or two are turned against each other.
    RepeatedEdge(u32, u32),
    /// A vertex whose triangles form more than one fan.
    PinchedVertex(u32),
}

impl fmt::Display for TopologyFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the mesh has no triangles"),
            Self::IndexOutOfRange(t) => write!(f, "triangle {t} names a vertex that does not exist"),
            Self::DegenerateTriangle(t) => write!(f, "triangle {t} has no area"),
            Self::OpenEdge(a, b) => write!(f, "the edge {a}-{b} is open"),
            Self::RepeatedEdge(a, b) => write!(f, "the edge {a}-{b} is used more than once in one direction"),
            Self::PinchedVertex(v) => write!(f, "the surface is pinched at vertex {v}"),
        }
    }
}

/// Undirected edges (smaller index first) in ascending order, each with the number of its triangles.
pub fn edges(mesh: &Mesh) -> Vec<([u32; 2], usize)> {
    let mut all: Vec<[u32; 2]> = directed(mesh).iter().map(|&(a, b, _)| [a.min(b), a.max(b)]).collect();
    all.sort_unstable();
    let mut counted: Vec<([u32; 2], usize)> = Vec::with_capacity(all.len() / 2 + 1);
    for edge in all {
        match counted.last_mut() {
            Some((last, n)) if *last == edge => *n += 1,
            _ => counted.push((edge, 1)),
        }
    }
    counted
}

/// Directed edges with their triangles, in the order of the triangles.
fn directed(mesh: &Mesh) -> Vec<(u32, u32, usize)> {
    let around = |(i, t): (usize, &[u32; 3])| [(t[0], t[1], i), (t[1], t[2], i), (t[2], t[0], i)];
    mesh.triangles.iter().enumerate().flat_map(around).collect()
}

/// Whether the mesh bounds a solid: every edge is used exactly twice and in opposite directions, every
/// vertex has one fan of triangles, no triangle is degenerate. It may have several components.
pub fn is_closed_manifold(mesh: &Mesh) -> Result<(), TopologyFault> {
    if mesh.triangles.is_empty() {
        return Err(TopologyFault::Empty);
    }
    for (i, t) in mesh.triangles.iter().enumerate() {
        if t.iter().any(|&v| v as usize >= mesh.vertices.len()) {
            return Err(TopologyFault::IndexOutOfRange(i));
        }
        let repeated = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
        if repeated || mesh.scaled_normal(i).norm_squared() <= 0.0 {
            return Err(TopologyFault::DegenerateTriangle(i));
        }
    }
    check_edges(mesh)?;
    check_fans(mesh)
}

fn check_edges(mesh: &Mesh) -> Result<(), TopologyFault> {
    let mut all = directed(mesh);
    all.sort_unstable();
    for pair in all.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            return Err(TopologyFault::RepeatedEdge(pair[0].0, pair[0].1));
        }
    }
    for &(a, b, _) in &all {
        if all.binary_search_by(|e| (e.0, e.1).cmp(&(b, a))).is_err() {
            return Err(TopologyFault::OpenEdge(a, b));
        }
    }
    Ok(())
}

/// Walks around every vertex: the fan that starts at its first triangle must hold all its triangles.
fn check_fans(mesh: &Mesh) -> Result<(), TopologyFault> {
    let mut spokes: BTreeMap<u32, Vec<(u32, u32)>> = BTreeMap::new();
    for &[a, b, c] in &mesh.triangles {
        for (v, from, to) in [(a, b, c), (b, c, a), (c, a, b)] {
            spokes.entry(v).or_default().push((from, to));
        }
    }
    for (&v, fan) in &spokes {
        let first = fan[0].0;
        let mut at = fan[0].1;
        let mut steps = 1;
        while at != first && steps <= fan.len() {
            match fan.iter().find(|(from, _)| *from == at) {
                Some(&(_, to)) => at = to,
                None => break,
            }
            steps += 1;
        }
        if steps != fan.len() {
            return Err(TopologyFault::PinchedVertex(v));
        }
    }
    Ok(())
}

/// Vertices in use minus edges plus triangles: 2 per sphere-like component, 0 per handle-like one (a mug).
pub fn euler_characteristic(mesh: &Mesh) -> i64 {
    let mut used: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    used.len() as i64 - edges(mesh).len() as i64 + mesh.triangles.len() as i64
}

/// The parts that share no vertex, largest area first.
pub fn components(mesh: &Mesh) -> Vec<Mesh> {
    let mut parent: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for &[a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (x, y) = (root(&mut parent, a), root(&mut parent, other));
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    let label: Vec<u32> = mesh.triangles.iter().map(|t| root(&mut parent, t[0])).collect();
    let mut distinct = label.clone();
    distinct.sort_unstable();
    distinct.dedup();
    let mut parts: Vec<Mesh> = distinct.iter().map(|&l| mesh.subset(|i| label[i] == l)).collect();
    parts.sort_by(|a, b| b.area().total_cmp(&a.area()));
    parts
}

fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::geometry::solids::{cuboid, sphere, torus};

    #[test]
    fn each_fault_is_named() {
        let good = cuboid([1.0; 3]);
        assert_eq!(is_closed_manifold(&good), Ok(()));
        let mut open = good.clone();
        open.triangles.pop();
        assert!(matches!(is_closed_manifold(&open), Err(TopologyFault::OpenEdge(..))));
        let mut turned = good.clone();
        turned.triangles[0].swap(0, 1);
        assert!(matches!(
            is_closed_manifold(&turned),
            Err(TopologyFault::RepeatedEdge(..))
        ));
        let mut flat = good.clone();
        flat.triangles[3] = [1, 1, 2];
        assert_eq!(is_closed_manifold(&flat), Err(TopologyFault::DegenerateTriangle(3)));
        assert_eq!(is_closed_manifold(&Mesh::default()), Err(TopologyFault::Empty));
    }

    #[test]
    fn two_boxes_that_touch_in_a_corner_are_pinched() {
        let mut pair = cuboid([2.0; 3]);
        let moved = pair.transformed(&Isometry3::translation(2.0, 2.0, 2.0));
        pair.append(&moved);
        // The far corner of the first box (7) is the near corner of the second (8).
        for t in &mut pair.triangles {
            *t = t.map(|v| if v == 8 { 7 } else { v });
        }
        assert_eq!(is_closed_manifold(&pair), Err(TopologyFault::PinchedVertex(7)));
    }

    #[test]
    fn components_and_handles_are_counted() {
        let mut scene = sphere(0.1, 2);
        assert_eq!(euler_characteristic(&scene), 2);
        let ring = torus(0.5, 0.1, 24, 12);
        assert_eq!(euler_characteristic(&ring), 0);
        scene.append(&ring);
        let parts = components(&scene);
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], ring);
    }
}
