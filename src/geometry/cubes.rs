//! Marching cubes whose table is derived, not typed in: loops around the inside corners of each face.
//!
//! On a face with two inside corners across from each other the outside is taken to hang together, seen from
//! either of the two cubes that share it; so neighbouring cubes always agree and the surface has no cracks
//! (Lorensen and Cline 1987, with the face rule of Montani et al. 1994).

use std::sync::LazyLock;

/// Triangles of each of the 256 cases, as edges of the cube.
///
/// Corner `m` lies at the bits of `m` (bit 0 = x). Edge `4 a + k` runs along axis `a` from the `k`-th corner whose
/// bit `a` is clear.
pub static CUBE_TRIANGLES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..=255).map(triangles).collect());

/// Lower corner and axis of an edge of the cube.
pub fn cube_edge(edge: u8) -> (u8, u8) {
    let (axis, k) = (edge / 4, edge % 4);
    let low = k & ((1 << axis) - 1);
    (low | ((k >> axis) << (axis + 1)), axis)
}

fn edge_between(a: u8, b: u8) -> u8 {
    let axis = (a ^ b).trailing_zeros() as u8;
    let low = a & b;
    let below = low & ((1 << axis) - 1);
    4 * axis + (below | ((low >> (axis + 1)) << axis))
}

/// Corners of a face in the order that is counter-clockwise seen from outside the cube.
fn face(axis: u8, upper: bool) -> [u8; 4] {
    let (b, c) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = if upper { 1 << axis } else { 0 };
    if upper {
        [base, base | b, base | b | c, base | c]
    } else {
        [base, base | c, base | b | c, base | b]
    }
}

fn triangles(case: u16) -> Vec<[u8; 3]> {
    let inside = |m: u8| case >> m & 1 == 1;
    let mut next = [u8::MAX; 12];
    for (axis, upper) in (0..3).flat_map(|a| [(a, false), (a, true)]) {
        let ring = face(axis, upper);
        // A run of inside corners along the ring is cut off by one segment.
        for i in 0..4 {
            if !inside(ring[i]) || inside(ring[(i + 3) % 4]) {
                continue;
            }
            let end = (0..4).map(|n| (i + n) % 4).find(|n| !inside(ring[(n + 1) % 4]));
            let Some(end) = end else { continue };
            let enter = edge_between(ring[(i + 3) % 4], ring[i]);
            let leave = edge_between(ring[end], ring[(end + 1) % 4]);
            next[enter as usize] = leave;
        }
    }
    let mut found = Vec::new();
    for start in 0..12 {
        let mut ring = Vec::new();
        let mut at = start;
        while next[at] != u8::MAX {
            ring.push(at as u8);
            at = std::mem::replace(&mut next[at], u8::MAX) as usize;
        }
        fan(&ring, &mut found);
    }
    found
}

/// Cuts a loop into triangles from the vertex that draws the fewest diagonals within a face of the cube.
fn fan(ring: &[u8], found: &mut Vec<[u8; 3]>) {
    let n = ring.len();
    if n < 3 {
        return;
    }
    let in_face = |a: u8, b: u8| {
        let corners = |e: u8| {
            let (low, axis) = cube_edge(e);
            [low, low | (1 << axis)]
        };
        let all = [corners(a), corners(b)].concat();
        (0..3).any(|axis| all.iter().all(|m| m >> axis & 1 == all[0] >> axis & 1))
    };
    let cost = |apex: usize| (2..n - 1).filter(|k| in_face(ring[apex], ring[(apex + k) % n])).count();
    let apex = (0..n).min_by_key(|a| cost(*a)).unwrap_or(0);
    found.extend((1..n - 1).map(|k| [ring[apex], ring[(apex + k) % n], ring[(apex + k + 1) % n]]));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_and_corners_agree() {
        for edge in 0..12 {
            let (low, axis) = cube_edge(edge);
            assert_eq!(edge_between(low, low | (1 << axis)), edge);
        }
    }

    #[test]
    fn one_inside_corner_gives_one_triangle_that_faces_away_from_it() {
        assert_eq!(CUBE_TRIANGLES[1].len(), 1);
        let middle = |e: u8| {
            let (low, axis) = cube_edge(e);
            let mut p = [0, 1, 2].map(|a| f64::from(low >> a & 1));
            p[axis as usize] += 0.5;
            nalgebra::Vector3::from(p)
        };
        let [a, b, c] = CUBE_TRIANGLES[1][0].map(middle);
        assert!((b - a).cross(&(c - a)).sum() > 0.0);
    }

    #[test]
    fn every_case_uses_each_crossing_edge_in_closed_loops() {
        for (case, triangles) in CUBE_TRIANGLES.iter().enumerate() {
            let crossing = (0..12).filter(|e| {
                let (low, axis) = cube_edge(*e);
                (case >> low ^ case >> (low | 1 << axis)) & 1 == 1
            });
            let mut used: Vec<u8> = triangles.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            assert_eq!(used, crossing.collect::<Vec<u8>>(), "case {case}");
        }
    }
}
