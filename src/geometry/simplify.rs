//! Fewer triangles for the same surface: quadric error edge collapse.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use nalgebra::{Point3, Translation3, Vector3};

use super::Mesh;
use super::quadric::Quadric;

/// A collapsed triangle may turn by at most acos of this.
const MIN_NORMAL_DOT: f64 = 0.2;
/// Least `2 sqrt(3) area / longest edge²` of a new triangle, unless it was worse before.
const MIN_QUALITY: f64 = 0.01;

/// Collapses edges in the order of their quadric error (Garland & Heckbert 1997) until the next one would lie
/// farther than `max_error`, m, from the planes that it stands for (root of the area-weighted mean square); each
/// new vertex is placed so that the enclosed volume stays.
///
/// The link condition (Dey et al. 1999) keeps a closed manifold closed and its genus; no triangle is turned
/// over; open borders are held by planes of their own. Colours are mixed, `seen` is taken from the nearer end.
/// Ties are broken by index, so the same mesh gives the same result. Vertices are expected in use.
pub fn simplify(mesh: &Mesh, max_error: f64) -> Mesh {
    // Near the origin the quadrics do not lose digits.
    let center = mesh
        .bounds()
        .map_or_else(Vector3::zeros, |(lo, hi)| nalgebra::center(&lo, &hi).coords);
    let mut work = Work::new(&mesh.transformed(&Translation3::from(-center).into()));
    let mut heap: BinaryHeap<Reverse<Candidate>> = BinaryHeap::with_capacity(2 * mesh.triangles.len());
    let limit = max_error * max_error;
    for ([a, b], _) in super::edges(mesh) {
        heap.extend(work.candidate(a, b, limit).map(Reverse));
    }
    while let Some(Reverse(next)) = heap.pop() {
        if !work.is_current(&next) {
            continue;
        }
        // Neighbours may have moved since, and with them the plane that keeps the volume.
        let Some(next) = work.candidate(next.a, next.b, limit).filter(|c| work.may_collapse(c)) else {
            continue;
        };
        work.collapse(&next);
        for neighbor in work.neighbors(next.a) {
            let (a, b) = (next.a.min(neighbor), next.a.max(neighbor));
            heap.extend(work.candidate(a, b, limit).map(Reverse));
        }
    }
    work.finish().transformed(&Translation3::from(center).into())
}

struct Candidate {
    cost: f64,
    a: u32,
    b: u32,
    stamp: u32,
    target: Point3<f64>,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let key = |c: &Self| (c.a, c.b, c.stamp);
        self.cost
            .total_cmp(&other.cost)
            .then_with(|| key(self).cmp(&key(other)))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// The mesh while it shrinks.
struct Work {
    mesh: Mesh,
    quadrics: Vec<Quadric>,
    /// Living triangles around each vertex.
    around: Vec<Vec<u32>>,
    /// Raised when a vertex moves; a candidate of an older sum is stale.
    stamps: Vec<u32>,
    dead: Vec<bool>,
    border: Vec<bool>,
}

impl Work {
    fn new(mesh: &Mesh) -> Self {
        let count = mesh.vertices.len();
        let mut work = Self {
            mesh: mesh.clone(),
            quadrics: vec![Quadric::zero(); count],
            around: vec![Vec::new(); count],
            stamps: vec![0; count],
            dead: vec![false; mesh.triangles.len()],
            border: vec![false; count],
        };
        for (i, t) in mesh.triangles.iter().enumerate() {
            let scaled = mesh.scaled_normal(i);
            let quadric = scaled
                .try_normalize(0.0)
                .map(|n| Quadric::plane(&n, &mesh.vertices[t[0] as usize], 0.5 * scaled.norm() / 3.0));
            for &v in t {
                work.around[v as usize].push(i as u32);
                quadric.iter().for_each(|q| work.quadrics[v as usize].add(q));
            }
        }
        work.hold_borders();
        work
    }

    fn hold_borders(&mut self) {
        for ([a, b], _) in super::edges(&self.mesh).into_iter().filter(|(_, n)| *n == 1) {
            let Some(&t) = self.around[a as usize].iter().find(|t| self.corners(**t).contains(&b)) else {
                continue;
            };
            let (pa, pb) = (self.mesh.vertices[a as usize], self.mesh.vertices[b as usize]);
            let wall = (pb - pa).cross(&self.mesh.scaled_normal(t as usize));
            if let Some(normal) = wall.try_normalize(0.0) {
                let quadric = Quadric::plane(&normal, &pa, (pb - pa).norm_squared());
                self.quadrics[a as usize].add(&quadric);
                self.quadrics[b as usize].add(&quadric);
            }
            self.border[a as usize] = true;
            self.border[b as usize] = true;
        }
    }

    fn corners(&self, t: u32) -> [u32; 3] {
        self.mesh.triangles[t as usize]
    }

    fn stamp(&self, a: u32, b: u32) -> u32 {
        self.stamps[a as usize].wrapping_add(self.stamps[b as usize])
    }

    fn candidate(&self, a: u32, b: u32, limit: f64) -> Option<Candidate> {
        let mut q = self.quadrics[a as usize];
        q.add(&self.quadrics[b as usize]);
        let (pa, pb) = (self.mesh.vertices[a as usize], self.mesh.vertices[b as usize]);
        let target = q.minimum(&nalgebra::center(&pa, &pb), &self.volume_plane(a, b));
        let error = q.error(&target);
        let short = 1e-9 * q.weight * (pb - pa).norm_squared();
        (error <= limit * q.weight).then(|| Candidate {
            cost: error + short,
            a,
            b,
            stamp: self.stamp(a, b),
            target,
        })
    }

    /// The plane `normal · x = offset` on which the merged vertex leaves the enclosed volume as it is
    /// (Lindstrom & Turk 1998, eq. 2); a zero normal where there is a border.
    fn volume_plane(&self, a: u32, b: u32) -> (Vector3<f64>, f64) {
        if self.border[a as usize] || self.border[b as usize] {
            return (Vector3::zeros(), 0.0);
        }
        let apex = self.mesh.vertices[a as usize];
        let mut normal = Vector3::zeros();
        let mut six_volumes = 0.0;
        for (v, other) in [(a, b), (b, a)] {
            for &t in &self.around[v as usize] {
                let corners = self.corners(t);
                let k = corners.iter().position(|w| *w == v).unwrap_or(0);
                let [p, q, r] = [0, 1, 2].map(|i| self.mesh.vertices[corners[(k + i) % 3] as usize] - apex);
                let opposite = q.cross(&r);
                if !corners.contains(&other) {
                    normal += opposite;
                    six_volumes += p.dot(&opposite);
                } else if v == a {
                    six_volumes += p.dot(&opposite);
                }
            }
        }
        (normal, six_volumes + normal.dot(&apex.coords))
    }

    fn is_current(&self, c: &Candidate) -> bool {
        let alive = |v: u32| !self.around[v as usize].is_empty();
        alive(c.a) && alive(c.b) && c.stamp == self.stamp(c.a, c.b)
    }

    /// Neighbours of `v`, ascending.
    fn neighbors(&self, v: u32) -> Vec<u32> {
        let corners = self.around[v as usize].iter().flat_map(|t| self.corners(*t));
        let mut all: Vec<u32> = corners.filter(|w| *w != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn may_collapse(&self, c: &Candidate) -> bool {
        let shared = |t: &&u32| self.corners(**t).contains(&c.b);
        let triangles = self.around[c.a as usize].iter().filter(shared).count();
        if triangles == 0 || triangles > 2 {
            return false;
        }
        if triangles == 2 && self.border[c.a as usize] && self.border[c.b as usize] {
            return false;
        }
        let near_b = self.neighbors(c.b);
        let near_a = self.neighbors(c.a);
        let common = near_a.iter().filter(|v| near_b.binary_search(v).is_ok()).count();
        // Fewer than three other neighbours left would fold the surface onto itself.
        let left = near_a.len() + near_b.len() - common - 2;
        common == triangles
            && left >= 3
            && self.keeps_sides(c.a, c.b, &c.target)
            && self.keeps_sides(c.b, c.a, &c.target)
    }

    /// Whether no triangle around `v` (but those that vanish with `gone`) turns over or becomes a sliver.
    fn keeps_sides(&self, v: u32, gone: u32, target: &Point3<f64>) -> bool {
        self.around[v as usize].iter().all(|&t| {
            let corners = self.corners(t);
            if corners.contains(&gone) {
                return true;
            }
            let old = corners.map(|w| self.mesh.vertices[w as usize]);
            let new = corners.map(|w| {
                if w == v {
                    *target
                } else {
                    self.mesh.vertices[w as usize]
                }
            });
            let (old_normal, old_quality) = normal_and_quality(&old);
            let (new_normal, new_quality) = normal_and_quality(&new);
            let turned = new_normal.dot(&old_normal) < MIN_NORMAL_DOT * new_normal.norm() * old_normal.norm();
            new_quality > 0.0 && !turned && new_quality >= MIN_QUALITY.min(old_quality)
        })
    }

    fn collapse(&mut self, c: &Candidate) {
        let (a, b) = (c.a as usize, c.b as usize);
        self.mix(a, b, &c.target);
        self.mesh.vertices[a] = c.target;
        let other = self.quadrics[b];
        self.quadrics[a].add(&other);
        self.border[a] |= self.border[b];
        for t in std::mem::take(&mut self.around[b]) {
            if self.corners(t).contains(&c.a) {
                self.kill(t);
            } else {
                let moved = self.corners(t).map(|v| if v == c.b { c.a } else { v });
                self.mesh.triangles[t as usize] = moved;
                self.around[a].push(t);
            }
        }
        self.stamps[a] = self.stamps[a].max(self.stamps[b]) + 1;
    }

    fn kill(&mut self, t: u32) {
        self.dead[t as usize] = true;
        for v in self.corners(t) {
            self.around[v as usize].retain(|u| *u != t);
        }
    }

    fn mix(&mut self, a: usize, b: usize, target: &Point3<f64>) {
        let along = self.mesh.vertices[b] - self.mesh.vertices[a];
        let share = (target - self.mesh.vertices[a]).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
        let share = share.clamp(0.0, 1.0);
        if !self.mesh.colors.is_empty() {
            let (ca, cb) = (self.mesh.colors[a], self.mesh.colors[b]);
            let lerp = |x: u8, y: u8| (f64::from(x) * (1.0 - share) + f64::from(y) * share).round() as u8;
            self.mesh.colors[a] = [0, 1, 2].map(|i| lerp(ca[i], cb[i]));
        }
        if !self.mesh.seen.is_empty() && share > 0.5 {
            self.mesh.seen[a] = self.mesh.seen[b];
        }
        if !self.mesh.mirrored.is_empty() && share > 0.5 {
            self.mesh.mirrored[a] = self.mesh.mirrored[b];
        }
    }

    fn finish(self) -> Mesh {
        self.mesh.subset(|t| !self.dead[t])
    }
}

fn normal_and_quality([a, b, c]: &[Point3<f64>; 3]) -> (Vector3<f64>, f64) {
    let normal = (b - a).cross(&(c - a));
    let longest = (b - a)
        .norm_squared()
        .max((c - b).norm_squared())
        .max((a - c).norm_squared());
    (normal, 3f64.sqrt() * normal.norm() / longest.max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Seed;
    use crate::geometry::solids::{cuboid, cylinder, revolve, sphere, subdivided, torus};
    use crate::geometry::{euler_characteristic, is_closed_manifold, mean_surface_error};

    #[test]
    fn flat_faces_come_down_to_almost_nothing() {
        let mut fine = cuboid([0.1, 0.2, 0.05]);
        for _ in 0..4 {
            fine = subdivided(&fine);
        }
        let slim = simplify(&fine, 1e-5);
        assert!(slim.triangles.len() <= 24, "{}", slim.triangles.len());
        assert!((slim.volume() / 0.001 - 1.0).abs() < 1e-3);
        assert_eq!(is_closed_manifold(&slim), Ok(()));
    }

    #[test]
    fn round_things_keep_their_topology_volume_and_surface() {
        let cup = [
            [0.0, 0.0],
            [0.04, 0.0],
            [0.04, 0.09],
            [0.037, 0.09],
            [0.037, 0.005],
            [0.0, 0.005],
        ];
        for (name, mesh) in [
            ("sphere", sphere(0.05, 5)),
            ("torus", torus(0.05, 0.015, 128, 64)),
            ("cylinder", subdivided(&subdivided(&cylinder(0.03, 0.1, 96)))),
            ("cup", subdivided(&revolve(&cup, 128))),
        ] {
            let slim = simplify(&mesh, 2e-4);
            assert!(
                slim.triangles.len() < mesh.triangles.len() / 4,
                "{name}: {}",
                slim.triangles.len()
            );
            assert_eq!(is_closed_manifold(&slim), Ok(()), "{name}");
            assert_eq!(euler_characteristic(&slim), euler_characteristic(&mesh), "{name}");
            assert!(
                (slim.volume() / mesh.volume() - 1.0).abs() < 1e-3,
                "{name}: {}",
                slim.volume() / mesh.volume()
            );
            for (from, to) in [(&mesh, &slim), (&slim, &mesh)] {
                let error = mean_surface_error(from, to, 3000, Seed(1)).unwrap();
                assert!(error.p95 < 4e-4, "{name}: {error:?}");
            }
        }
    }

    #[test]
    fn colours_and_flags_stay_on_their_side_and_the_result_is_always_the_same() {
        let mut mesh = sphere(0.05, 4);
        mesh.seen = mesh.vertices.iter().map(|v| v.z > 0.0).collect();
        mesh.colors = mesh
            .vertices
            .iter()
            .map(|v| if v.z > 0.0 { [200, 0, 0] } else { [0, 0, 200] })
            .collect();
        let slim = simplify(&mesh, 1e-3);
        assert_eq!(slim, simplify(&mesh, 1e-3));
        assert_eq!(
            (slim.seen.len(), slim.colors.len()),
            (slim.vertices.len(), slim.vertices.len())
        );
        for (i, v) in slim.vertices.iter().enumerate().filter(|(_, v)| v.z.abs() > 0.03) {
            assert_eq!(slim.seen[i], v.z > 0.0);
            assert_eq!(slim.colors[i][0] > slim.colors[i][2], v.z > 0.0);
        }
    }
}
