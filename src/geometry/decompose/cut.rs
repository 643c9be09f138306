//! Cuts: V-HACD on voxels, and which points of the surface belong to which side.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d_f64::transformation::voxelization::{FillMode, Voxel, VoxelSet};

use crate::geometry::Mesh;

/// The concavity at which the first cut stops, as a share of the volume.
const CONCAVITY: f64 = 0.01;
/// A first cut into more parts than this is repeated more coarsely.
const MAX_CUTS: usize = 72;

pub(super) fn cut(mesh: &Mesh, resolution: u32) -> VHACD {
    let points: Vec<Vector> = mesh.vertices.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    let mut concavity = CONCAVITY;
    loop {
        let parameters = VHACDParameters {
            concavity,
            resolution,
            fill_mode: FillMode::FloodFill { detect_cavities: false },
            ..VHACDParameters::default()
        };
        let cut = VHACD::decompose(&parameters, &points, &mesh.triangles, false);
        if cut.voxel_parts().len() <= MAX_CUTS || concavity > 0.1 {
            return cut;
        }
        concavity *= 2.5;
    }
}

/// Which part holds each voxel, on a dense grid.
struct Grid {
    origin: Point3<f64>,
    scale: f64,
    low: [i64; 3],
    size: [i64; 3],
    part: Vec<u16>,
}

const NO_PART: u16 = u16::MAX;

impl Grid {
    fn new(parts: &[VoxelSet]) -> Option<Self> {
        let first = parts.first()?;
        let coords = |v: &Voxel| [v.coords.x, v.coords.y, v.coords.z];
        let all = parts.iter().flat_map(|p| p.voxels()).map(coords);
        let (mut low, mut high) = ([i64::MAX; 3], [i64::MIN; 3]);
        for c in all {
            for axis in 0..3 {
                low[axis] = low[axis].min(c[axis]);
                high[axis] = high[axis].max(c[axis]);
            }
        }
        let size = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1).max(0));
        let mut grid = Self {
            origin: Point3::new(first.origin.x, first.origin.y, first.origin.z),
            scale: first.scale,
            low,
            size,
            part: vec![NO_PART; (size[0] * size[1] * size[2]) as usize],
        };
        for (i, part) in parts.iter().enumerate() {
            for c in part.voxels().iter().map(coords) {
                if let Some(at) = grid.index(c) {
                    grid.part[at] = i as u16;
                }
            }
        }
        Some(grid)
    }

    fn index(&self, c: [i64; 3]) -> Option<usize> {
        let [x, y, z] = [0, 1, 2].map(|axis| c[axis] - self.low[axis]);
        let inside = [x, y, z].iter().zip(self.size).all(|(c, n)| (0..n).contains(c));
        inside.then(|| ((x * self.size[1] + y) * self.size[2] + z) as usize)
    }

    fn part_at(&self, c: [i64; 3]) -> Option<u16> {
        self.index(c).map(|i| self.part[i]).filter(|p| *p != NO_PART)
    }

    /// Gives each part the corners of its voxels that lie wholly inside the solid and touch another part: the
    /// surface alone does not span the faces where the solid was cut.
    fn give_cut_faces(&self, points: &mut [Vec<Point3<f64>>]) {
        for i in 0..self.part.len() as i64 {
            let [ny, nz] = [self.size[1], self.size[2]];
            let c = [
                i / (ny * nz) + self.low[0],
                i / nz % ny + self.low[1],
                i % nz + self.low[2],
            ];
            let Some(part) = self.part_at(c) else {
                continue;
            };
            let mut near = (0..27).map(|k| [c[0] + k / 9 - 1, c[1] + k / 3 % 3 - 1, c[2] + k % 3 - 1]);
            let mut cut = false;
            let inside = near.all(|n| {
                let other = self.part_at(n);
                cut |= other != Some(part);
                other.is_some()
            });
            if !(inside && cut) {
                continue;
            }
            for corner in 0..8 {
                let at = |axis: usize| c[axis] as f64 + if corner >> axis & 1 == 1 { 0.5 } else { -0.5 };
                points[part as usize].push(self.origin + Vector3::new(at(0), at(1), at(2)) * self.scale);
            }
        }
    }

    /// The parts within `margin` voxels of a point; voxel centres lie on whole numbers.
    fn parts_near(&self, p: &Point3<f64>, margin: f64) -> BTreeSet<u16> {
        let place = (p - self.origin) / self.scale;
        let mut found = BTreeSet::new();
        for corner in 0..8 {
            let shift = |axis: usize| if corner >> axis & 1 == 1 { margin } else { -margin };
            let c = [0, 1, 2].map(|axis| (place[axis] + shift(axis)).round() as i64);
            found.extend(self.index(c).map(|i| self.part[i]).filter(|p| *p != NO_PART));
        }
        found
    }
}

/// Surface points of each part: vertices, and a lattice on each triangle of half a voxel. Points near a cut go to
/// both sides, so that parts meet; points that lie in no voxel are tried again more widely.
pub(super) fn points_per_part(mesh: &Mesh, cut: &VHACD) -> Vec<Vec<Point3<f64>>> {
    let Some(grid) = Grid::new(cut.voxel_parts()) else {
        return Vec::new();
    };
    let mut points = vec![Vec::new(); cut.voxel_parts().len()];
    let mut give = |p: Point3<f64>| {
        let mut near = grid.parts_near(&p, 0.25);
        if near.is_empty() {
            near = grid.parts_near(&p, 1.0);
        }
        near.iter().for_each(|i| points[*i as usize].push(p));
    };
    mesh.vertices.iter().for_each(|v| give(*v));
    for t in 0..mesh.triangles.len() {
        lattice(&mesh.corners(t), 0.5 * grid.scale).for_each(&mut give);
    }
    grid.give_cut_faces(&mut points);
    points
}

/// Points of a triangle on a barycentric lattice no coarser than `spacing`, corners left out.
fn lattice([a, b, c]: &[Point3<f64>; 3], spacing: f64) -> impl Iterator<Item = Point3<f64>> + use<> {
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let steps = (longest / spacing).ceil().clamp(1.0, 400.0) as usize;
    let (a, b, c) = (*a, *b, *c);
    (0..=steps)
        .flat_map(move |i| (0..=steps - i).map(move |j| (i, j)))
        .filter(move |&(i, j)| i != steps && j != steps && i + j != 0)
        .map(move |(i, j)| a + (b - a) * (i as f64 / steps as f64) + (c - a) * (j as f64 / steps as f64))
}
