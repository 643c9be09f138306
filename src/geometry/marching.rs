//! Surface extraction by marching tetrahedra on the Kuhn subdivision of the voxel grid.
//!
//! Every cube is cut into six tetrahedra along its main diagonal, the same way everywhere, so that the zero
//! set of the piecewise linear field is a manifold without any table of ambiguous cases (Doi and Koide 1991).

use super::Mesh;
use nalgebra::Point3;

/// An edge of the subdivision: its lower grid corner and its direction (a set of axes, as bits).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct GridEdge {
    /// Lower grid corner.
    pub corner: [i32; 3],
    /// Bit `a` set: the edge goes one step along axis `a`.
    pub direction: u8,
}

impl GridEdge {
    /// The grid corner at the upper end.
    pub fn end(&self) -> [i32; 3] {
        let d = i32::from(self.direction);
        let [x, y, z] = self.corner;
        [x + (d & 1), y + ((d >> 1) & 1), z + ((d >> 2) & 1)]
    }
}

/// Corner masks of the six tetrahedra, each positively oriented.
const TETRAHEDRA: [[u8; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 5, 1, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 4, 5, 7],
    [0, 6, 4, 7],
];

/// Adds the triangles inside one cube whose lower corner is `cell`; `values` by corner mask (bit 0 = x),
/// negative inside. Triangles face the positive side.
pub fn march_cell(cell: [i32; 3], values: &[f64; 8], triangles: &mut Vec<[GridEdge; 3]>) {
    let inside = |m: u8| values[m as usize] < 0.0;
    if (0..8).all(inside) || !(0..8).any(inside) {
        return;
    }
    let edge = |a: u8, b: u8| {
        let low = a & b;
        let l = i32::from(low);
        GridEdge {
            corner: [cell[0] + (l & 1), cell[1] + ((l >> 1) & 1), cell[2] + ((l >> 2) & 1)],
            direction: a ^ b,
        }
    };
    for tetrahedron in TETRAHEDRA {
        march_tetrahedron(tetrahedron, inside, edge, triangles);
    }
}

fn march_tetrahedron(
    corners: [u8; 4],
    inside: impl Fn(u8) -> bool,
    edge: impl Fn(u8, u8) -> GridEdge,
    triangles: &mut Vec<[GridEdge; 3]>,
) {
    // Even permutations of the corners that bring the odd one, or the inner pair, to the front.
    const FRONT: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
    const PAIRS: [[usize; 4]; 6] = [
        [0, 1, 2, 3],
        [0, 2, 3, 1],
        [0, 3, 1, 2],
        [1, 2, 0, 3],
        [1, 3, 2, 0],
        [2, 3, 0, 1],
    ];
    let flags = corners.map(&inside);
    let count = flags.iter().filter(|f| **f).count();
    match count {
        1 | 3 => {
            let odd = count == 1;
            if let Some(p) = FRONT.iter().find(|p| flags[p[0]] == odd) {
                let [i, j, k, l] = p.map(|n| corners[n]);
                let (k, l) = if odd { (k, l) } else { (l, k) };
                triangles.push([edge(i, j), edge(i, k), edge(i, l)]);
            }
        }
        2 => {
            if let Some(p) = PAIRS.iter().find(|p| flags[p[0]] && flags[p[1]]) {
                let [i, j, k, l] = p.map(|n| corners[n]);
                triangles.push([edge(i, k), edge(i, l), edge(j, l)]);
                triangles.push([edge(i, k), edge(j, l), edge(j, k)]);
            }
        }
        _ => {}
    }
}

/// Makes shared vertices out of triangles over grid edges; `value` gives the field at a grid corner that some
/// edge ends at. Returns the mesh (samples at `(i + 0.5) * voxel`) and the grid edge of each vertex.
pub fn weld(triangles: &[[GridEdge; 3]], voxel: f64, value: impl Fn([i32; 3]) -> f64) -> (Mesh, Vec<GridEdge>) {
    let mut edges: Vec<GridEdge> = triangles.iter().flatten().copied().collect();
    edges.sort_unstable();
    edges.dedup();
    let vertices = edges.iter().map(|e| crossing(e, voxel, &value)).collect();
    let find = |e: &GridEdge| edges.binary_search(e).unwrap_or(0) as u32;
    let triangles = triangles
        .iter()
        .map(|t| [find(&t[0]), find(&t[1]), find(&t[2])])
        .collect();
    let mesh = Mesh {
        vertices,
        triangles,
        ..Mesh::default()
    };
    (mesh, edges)
}

/// Where the linear field crosses zero on an edge, kept a little off the ends so that no triangle collapses.
fn crossing(edge: &GridEdge, voxel: f64, value: &impl Fn([i32; 3]) -> f64) -> Point3<f64> {
    let (a, b) = (edge.corner, edge.end());
    let (va, vb) = (value(a), value(b));
    let t = if va == vb {
        0.5
    } else {
        (va / (va - vb)).clamp(0.02, 0.98)
    };
    let at = |n: usize| (f64::from(a[n]) + 0.5 + t * f64::from(b[n] - a[n])) * voxel;
    Point3::new(at(0), at(1), at(2))
}

#[cfg(test)]
mod tests {
    use super::super::components::edge_defects;
    use super::*;

    fn extract(size: i32, value: impl Fn([i32; 3]) -> f64) -> Mesh {
        let mut triangles = Vec::new();
        for x in 0..size {
            for y in 0..size {
                for z in 0..size {
                    let values = std::array::from_fn(|m| {
                        let m = m as i32;
                        value([x + (m & 1), y + ((m >> 1) & 1), z + ((m >> 2) & 1)])
                    });
                    march_cell([x, y, z], &values, &mut triangles);
                }
            }
        }
        weld(&triangles, 0.1, value).0
    }

    #[test]
    fn a_ball_comes_out_closed_with_its_volume() {
        let ball = |i: [i32; 3]| {
            let p = i.map(|x| (f64::from(x) + 0.5) * 0.1 - 1.6);
            (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 1.0
        };
        let mesh = extract(32, ball);
        assert_eq!(edge_defects(&mesh), 0);
        let truth = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((mesh.volume() / truth - 1.0).abs() < 0.01, "{}", mesh.volume());
    }

    #[test]
    fn noise_of_any_kind_gives_a_manifold() {
        let noise = |i: [i32; 3]| {
            if i.iter().any(|x| *x <= 0 || *x >= 11) {
                return 1.0;
            }
            let h = (i[0] * 73 + i[1] * 151 + i[2] * 283) as f64;
            (h * 12.9898).sin() * 0.7 + 0.01
        };
        let mesh = extract(12, noise);
        assert_eq!(edge_defects(&mesh), 0);
        assert!(mesh.volume() > 0.0);
    }
}
