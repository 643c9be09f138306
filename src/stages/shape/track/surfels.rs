//! A surface as oriented points, with the nearest one looked up in a grid.

use nalgebra::{Isometry3, Point3, Vector3};

use crate::geometry::{Mesh, unique_edges, vertex_normals};

/// Distance around the surface in which the nearest point is known, m.
const BAND: f64 = 0.020;
/// Edge of a grid cell, m, where memory allows.
const CELL: f64 = 0.002;
/// Most cells of a grid.
const MOST_CELLS: f64 = 2.5e6;
/// Largest edge of a triangle that is not divided, m.
const LARGEST_EDGE: f64 = 0.004;

/// Rings of vertices beside what was not seen that make no outline.
const MARGIN: usize = 2;

/// Oriented points of a surface in the frame of its body.
#[derive(Clone, Debug)]
pub struct Surfels {
    /// m.
    pub points: Vec<Point3<f64>>,
    /// Unit, outward.
    pub normals: Vec<Vector3<f64>>,
    /// Middle of the points.
    pub center: Point3<f64>,
    /// Root mean square distance from the middle, m.
    pub radius: f64,
    /// The surface as triangles, with what was concluded rather than seen.
    pub skin: Mesh,
    low: Point3<f64>,
    cell: f64,
    size: [usize; 3],
    nearest: Vec<u32>,
}

impl Surfels {
    /// Of given points on a skin; nothing without any.
    pub fn new(points: Vec<Point3<f64>>, normals: Vec<Vector3<f64>>, mut skin: Mesh) -> Option<Self> {
        keep_from_unseen(&mut skin);
        let first = *points.first()?;
        let (low, high) = points.iter().fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
        let center = Point3::from(points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / points.len() as f64);
        let spread = points.iter().map(|p| (p - center).norm_squared()).sum::<f64>() / points.len() as f64;
        let low = low - Vector3::repeat(BAND);
        let extent = high + Vector3::repeat(BAND) - low;
        let cell = CELL.max((extent.product() / MOST_CELLS).cbrt());
        let size = std::array::from_fn(|a| (extent[a] / cell).ceil() as usize + 1);
        let mut surfels = Self {
            points,
            normals,
            center,
            radius: spread.sqrt().max(1e-3),
            skin,
            low,
            cell,
            size,
            nearest: Vec::new(),
        };
        surfels.fill();
        Some(surfels)
    }

    /// Of what was seen of a mesh whose vertices lie close, such as one from a grid; large triangles are divided.
    pub fn of_mesh(mesh: &Mesh) -> Option<Self> {
        let fine = divided(mesh);
        let normals = smooth_normals(&fine);
        let seen = |v: &usize| fine.seen.is_empty() || fine.seen[*v];
        let kept: Vec<usize> = (0..fine.vertices.len()).filter(seen).collect();
        Self::new(
            kept.iter().map(|v| fine.vertices[*v]).collect(),
            kept.iter().map(|v| normals[*v]).collect(),
            mesh.clone(),
        )
    }

    fn index(&self, c: [usize; 3]) -> usize {
        c[0] + self.size[0] * (c[1] + self.size[1] * c[2])
    }

    fn middle(&self, c: [usize; 3]) -> Point3<f64> {
        self.low + Vector3::new(c[0] as f64 + 0.5, c[1] as f64 + 0.5, c[2] as f64 + 0.5) * self.cell
    }

    fn cell_of(&self, p: &Point3<f64>) -> Option<[usize; 3]> {
        let at = (p - self.low) / self.cell;
        let fits = (0..3).all(|a| at[a] >= 0.0 && at[a] < self.size[a] as f64);
        fits.then(|| std::array::from_fn(|a| at[a] as usize))
    }

    /// Danielsson's vector distance transform (1980): candidates are handed on from cell to cell, forth and back.
    fn fill(&mut self) {
        self.nearest = vec![u32::MAX; self.size.iter().product()];
        for i in 0..self.points.len() {
            if let Some(c) = self.cell_of(&self.points[i]) {
                self.offer(c, i as u32);
            }
        }
        for _ in 0..2 {
            for forth in [true, false] {
                self.sweep(forth);
            }
        }
    }

    fn offer(&mut self, c: [usize; 3], candidate: u32) {
        if candidate == u32::MAX {
            return;
        }
        let (at, middle) = (self.index(c), self.middle(c));
        let held = self.nearest[at];
        let distance = |i: u32| (self.points[i as usize] - middle).norm_squared();
        if held == u32::MAX || held != candidate && distance(candidate) < distance(held) {
            self.nearest[at] = candidate;
        }
    }

    fn sweep(&mut self, forth: bool) {
        let [nx, ny, nz] = self.size;
        let turn = |i: usize, n: usize| if forth { i } else { n - 1 - i };
        for (z, y, x) in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| (z, y, x)))) {
            let c = [turn(x, nx), turn(y, ny), turn(z, nz)];
            for axis in 0..3 {
                let mut from = c;
                if forth && c[axis] > 0 {
                    from[axis] -= 1;
                } else if !forth && c[axis] + 1 < self.size[axis] {
                    from[axis] += 1;
                } else {
                    continue;
                }
                let candidate = self.nearest[self.index(from)];
                self.offer(c, candidate);
            }
        }
    }

    /// The point nearest to `p`, to about a cell; nothing far away.
    pub fn nearest(&self, p: &Point3<f64>) -> Option<usize> {
        let at = self.index(self.cell_of(p)?);
        Some(self.nearest[at] as usize)
    }

    /// Distance from a point of the body frame to the nearest surfel's plane, and that surfel, if nearer than
    /// `band` m.
    pub fn within(&self, p: &Point3<f64>, band: f64) -> Option<(usize, f64)> {
        let i = self.nearest(p)?;
        let off = p - self.points[i];
        (off.norm_squared() < band * band).then(|| (i, self.normals[i].dot(&off)))
    }

    /// Corners of the box around the points, moved by `pose`.
    pub fn corners(&self, pose: &Isometry3<f64>) -> [Point3<f64>; 8] {
        let low = self.low + Vector3::repeat(BAND);
        let extent = Vector3::from_fn(|a, _| self.size[a] as f64 * self.cell - 2.0 * BAND);
        std::array::from_fn(|m| {
            let part = |bit: usize| if m & bit == 0 { 0.0 } else { 1.0 };
            pose * (low + extent.component_mul(&Vector3::new(part(1), part(2), part(4))))
        })
    }
}

/// Where what was seen of a surface ends, the surface may go on: no outline of a body is looked for there.
fn keep_from_unseen(skin: &mut Mesh) {
    if skin.seen.is_empty() {
        return;
    }
    let edges = unique_edges(skin);
    for _ in 0..MARGIN {
        let before = skin.seen.clone();
        for (a, b) in edges.iter().map(|(a, b)| (*a as usize, *b as usize)) {
            if !before[a] || !before[b] {
                (skin.seen[a], skin.seen[b]) = (false, false);
            }
        }
    }
}

/// Normals of the vertices, averaged over their neighbours against the grain of the grid.
pub fn smooth_normals(mesh: &Mesh) -> Vec<Vector3<f64>> {
    let mut normals = vertex_normals(mesh);
    let edges = unique_edges(mesh);
    for _ in 0..2 {
        let mut sum = normals.clone();
        for (a, b) in edges.iter().map(|(a, b)| (*a as usize, *b as usize)) {
            if normals[a].dot(&normals[b]) > 0.7 {
                sum[a] += normals[b];
                sum[b] += normals[a];
            }
        }
        normals = sum
            .iter()
            .zip(&normals)
            .map(|(s, o)| s.try_normalize(1e-9).unwrap_or(*o))
            .collect();
    }
    normals
}

/// Splits triangles at the middle of edges that are too long; corners are no longer shared there.
fn divided(mesh: &Mesh) -> Mesh {
    let long = |i: usize| {
        let [a, b, c] = mesh.corners(i);
        (a - b).norm().max((b - c).norm()).max((c - a).norm()) > LARGEST_EDGE
    };
    if mesh.triangles.len() > 200 && (0..mesh.triangles.len()).filter(|i| long(*i)).count() * 20 < mesh.triangles.len()
    {
        return mesh.clone();
    }
    let mut out = Mesh::default();
    for i in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(i);
        let n = (((a - b).norm().max((b - c).norm()).max((c - a).norm())) / LARGEST_EDGE).ceil() as u32;
        let first = out.vertices.len() as u32;
        let place = |r: u32, k: u32| first + r * (r + 1) / 2 + k;
        for r in 0..=n {
            for k in 0..=r {
                let (s, t) = (f64::from(r - k) / f64::from(n), f64::from(k) / f64::from(n));
                out.vertices.push(a + (b - a) * s + (c - a) * t);
            }
        }
        let seen = mesh.seen.is_empty() || mesh.triangles[i].iter().all(|v| mesh.seen[*v as usize]);
        out.seen.resize(out.vertices.len(), seen);
        for r in 0..n {
            for k in 0..=r {
                out.triangles.push([place(r, k), place(r + 1, k), place(r + 1, k + 1)]);
                if k < r {
                    out.triangles.push([place(r, k), place(r + 1, k + 1), place(r, k + 1)]);
                }
            }
        }
    }
    out
}
