//! Cutting a closed mesh flat and closing planar openings by constrained Delaunay triangulation.

use std::collections::BTreeMap;

use super::Mesh;
use super::components::directed_edges;
use nalgebra::{Matrix3, Point3, Vector3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

/// The part of a mesh with `z > 0`, cut exactly at `z = 0` and left open there. Vertices nearer to the plane
/// than `clearance` are first moved off it, so that no cut passes through a vertex. For each vertex of the
/// result: the vertex of the original, or the upper end of the edge that was cut.
pub fn cut_below(mesh: &Mesh, clearance: f64) -> (Mesh, Vec<u32>) {
    let height: Vec<f64> = mesh
        .vertices
        .iter()
        .map(|p| {
            if p.z.abs() < clearance {
                clearance.copysign(p.z)
            } else {
                p.z
            }
        })
        .collect();
    let mut cut = Cut {
        mesh,
        height: &height,
        out: Mesh::default(),
        source: Vec::new(),
        kept: BTreeMap::new(),
        crossed: BTreeMap::new(),
    };
    for t in &mesh.triangles {
        cut.triangle(*t);
    }
    (cut.out, cut.source)
}

struct Cut<'a> {
    mesh: &'a Mesh,
    height: &'a [f64],
    out: Mesh,
    source: Vec<u32>,
    kept: BTreeMap<u32, u32>,
    crossed: BTreeMap<(u32, u32), u32>,
}

impl Cut<'_> {
    fn above(&self, v: u32) -> bool {
        self.height[v as usize] > 0.0
    }

    fn push(&mut self, point: Point3<f64>, source: u32) -> u32 {
        self.out.vertices.push(point);
        self.source.push(source);
        (self.out.vertices.len() - 1) as u32
    }

    fn keep(&mut self, v: u32) -> u32 {
        if let Some(known) = self.kept.get(&v) {
            return *known;
        }
        let mut point = self.mesh.vertices[v as usize];
        point.z = self.height[v as usize];
        let new = self.push(point, v);
        self.kept.insert(v, new);
        new
    }

    fn cross(&mut self, up: u32, down: u32) -> u32 {
        if let Some(known) = self.crossed.get(&(up, down)) {
            return *known;
        }
        let (a, b) = (self.mesh.vertices[up as usize], self.mesh.vertices[down as usize]);
        let (ha, hb) = (self.height[up as usize], self.height[down as usize]);
        let mut point = a + (b - a) * (ha / (ha - hb));
        point.z = 0.0;
        let new = self.push(point, up);
        self.crossed.insert((up, down), new);
        new
    }

    fn triangle(&mut self, t: [u32; 3]) {
        let ups = t.iter().filter(|v| self.above(**v)).count();
        // Rotate so that the lone corner comes first.
        let lone = |up: bool| (0..3).find(|i| self.above(t[*i]) == up).unwrap_or(0);
        let turned = |i: usize| [t[i], t[(i + 1) % 3], t[(i + 2) % 3]];
        match ups {
            3 => {
                let whole = t.map(|v| self.keep(v));
                self.out.triangles.push(whole);
            }
            1 => {
                let [a, b, c] = turned(lone(true));
                let whole = [self.keep(a), self.cross(a, b), self.cross(a, c)];
                self.out.triangles.push(whole);
            }
            2 => {
                let [c, a, b] = turned(lone(false));
                let (p, q) = (self.cross(b, c), self.cross(a, c));
                let (a, b) = (self.keep(a), self.keep(b));
                self.out.triangles.push([a, b, p]);
                self.out.triangles.push([a, p, q]);
            }
            _ => {}
        }
    }
}

/// The boundary loops of an open mesh, each in the sense in which a cap must run through it. Loops that touch
/// at a vertex are left out.
pub fn boundary_loops(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut edges: Vec<(u32, u32)> = directed_edges(mesh).collect();
    edges.sort_unstable();
    let mut next: BTreeMap<u32, u32> = edges
        .iter()
        .filter(|(a, b)| edges.binary_search(&(*b, *a)).is_err())
        .map(|(a, b)| (*b, *a))
        .collect();
    let mut loops = Vec::new();
    while let Some((start, mut at)) = next.pop_first() {
        let mut ring = vec![start];
        while at != start {
            ring.push(at);
            match next.remove(&at) {
                Some(onward) => at = onward,
                None => break,
            }
        }
        if at == start {
            loops.push(ring);
        }
    }
    loops
}

/// Closes loops that lie in the plane `z = 0` together, so that a loop inside another stays a hole of the cap.
/// Returns whether it could be done; the mesh is unchanged otherwise. The cap faces down.
pub fn cap_at_zero(mesh: &mut Mesh) -> bool {
    let loops: Vec<Vec<u32>> = boundary_loops(mesh)
        .into_iter()
        .filter(|ring| ring.iter().all(|v| mesh.vertices[*v as usize].z == 0.0))
        .collect();
    let flat = |v: u32| [mesh.vertices[v as usize].x, mesh.vertices[v as usize].y];
    match triangulate_loops(&loops, flat) {
        // The plan is counter-clockwise seen from above; the cap is seen from below.
        Some(cap) => {
            mesh.triangles.extend(cap.into_iter().map(|[a, b, c]| [a, c, b]));
            true
        }
        None => false,
    }
}

/// Closes every open loop in its own best-fit plane. Returns the number of loops that could not be closed.
pub fn close_loops(mesh: &mut Mesh) -> usize {
    let mut left = 0;
    for ring in boundary_loops(mesh) {
        let (origin, [u, v, normal]) = best_plane(ring.iter().map(|i| mesh.vertices[*i as usize]));
        let plan = |i: u32| {
            let d = mesh.vertices[i as usize] - origin;
            [d.dot(&u), d.dot(&v)]
        };
        let turns_left = signed_area(&ring, plan) > 0.0;
        debug_assert!((u.cross(&v) - normal).norm() < 1e-6);
        match triangulate_loops(std::slice::from_ref(&ring), plan) {
            Some(cap) => {
                let oriented = cap
                    .into_iter()
                    .map(|[a, b, c]| if turns_left { [a, b, c] } else { [a, c, b] });
                mesh.triangles.extend(oriented);
            }
            None => left += 1,
        }
    }
    left
}

/// The centre of some points, and right-handed axes of which the third is their best-fit plane's normal.
pub fn best_plane(points: impl Iterator<Item = Point3<f64>> + Clone) -> (Point3<f64>, [Vector3<f64>; 3]) {
    let n = points.clone().count().max(1) as f64;
    let centre = Point3::from(points.clone().map(|p| p.coords).sum::<Vector3<f64>>() / n);
    let scatter: Matrix3<f64> = points.map(|p| (p - centre) * (p - centre).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let normal: Vector3<f64> = eigen.eigenvectors.column(least).into_owned();
    let u: Vector3<f64> = eigen.eigenvectors.column((least + 1) % 3).into_owned();
    (centre, [u, normal.cross(&u), normal])
}

fn signed_area(ring: &[u32], plan: impl Fn(u32) -> [f64; 2]) -> f64 {
    (0..ring.len())
        .map(|i| {
            let (a, b) = (plan(ring[i]), plan(ring[(i + 1) % ring.len()]));
            0.5 * (a[0] * b[1] - a[1] * b[0])
        })
        .sum()
}

/// Constrained Delaunay triangulation of what lies inside an odd number of loops, counter-clockwise in the
/// plan; nothing where the loops cross or touch.
fn triangulate_loops(loops: &[Vec<u32>], plan: impl Fn(u32) -> [f64; 2]) -> Option<Vec<[u32; 3]>> {
    let mut plane = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut name = Vec::new();
    for ring in loops {
        let mut handles = Vec::with_capacity(ring.len());
        for v in ring {
            let [x, y] = plan(*v);
            let handle = plane.insert(Point2::new(x, y)).ok()?;
            if handle.index() != name.len() {
                return None;
            }
            name.push(*v);
            handles.push(handle);
        }
        for i in 0..ring.len() {
            let (a, b) = (handles[i], handles[(i + 1) % ring.len()]);
            if !plane.can_add_constraint(a, b) {
                return None;
            }
            plane.add_constraint(a, b);
        }
    }
    let inside = faces_inside(&plane);
    let faces = plane.inner_faces().filter(|face| inside[face.fix().index()]);
    Some(
        faces
            .map(|face| face.vertices().map(|v| name[v.fix().index()]))
            .collect(),
    )
}

/// Which faces an odd number of constraint edges parts from the outside, walking from face to face: no
/// coordinates are compared, so that slivers along straight loops fall on the right side.
pub(super) fn faces_inside(plane: &ConstrainedDelaunayTriangulation<Point2<f64>>) -> Vec<bool> {
    let mut side: Vec<Option<bool>> = vec![None; plane.num_all_faces()];
    let outer = plane.outer_face().fix().index();
    side[outer] = Some(false);
    let mut across: Vec<Vec<(usize, bool)>> = vec![Vec::new(); side.len()];
    for edge in plane.undirected_edges() {
        let [a, b] = [edge.as_directed(), edge.as_directed().rev()].map(|e| e.face().fix().index());
        across[a].push((b, edge.is_constraint_edge()));
        across[b].push((a, edge.is_constraint_edge()));
    }
    let mut queue = vec![outer];
    while let Some(face) = queue.pop() {
        for (next, border) in &across[face] {
            if side[*next].is_none() {
                side[*next] = side[face].map(|s| s != *border);
                queue.push(*next);
            }
        }
    }
    side.into_iter().map(|s| s.unwrap_or(false)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::components::{edge_defects, submesh};
    use super::*;

    fn cube() -> Mesh {
        let vertices = (0..8)
            .map(|i| Point3::new(f64::from(i & 1), f64::from((i >> 1) & 1), f64::from((i >> 2) & 1) - 0.5))
            .collect();
        let triangles = vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ];
        Mesh {
            vertices,
            triangles,
            ..Mesh::default()
        }
    }

    #[test]
    fn a_cut_cube_is_closed_again_with_half_its_volume() {
        let (mut half, _) = cut_below(&cube(), 1e-6);
        assert!(edge_defects(&half) > 0);
        assert!(cap_at_zero(&mut half));
        assert_eq!(edge_defects(&half), 0);
        assert!((half.volume() - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_missing_side_is_closed_in_its_own_plane() {
        let (mut open, _) = submesh(&cube(), |i| i != 4 && i != 5);
        assert_eq!(close_loops(&mut open), 0);
        assert_eq!(edge_defects(&open), 0);
        assert!((open.volume() - 1.0).abs() < 1e-12);
    }
}
