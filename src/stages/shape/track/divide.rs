//! Divides a closed mesh between two parts of its surface, each closed again.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::geometry::{Mesh, SurfaceDistance, edge_defects, march_cell, submesh, vertex_components, weld};

/// Voxels beside the surface.
const PAD: i32 = 3;
/// Pieces smaller than this share of the triangles of the largest are dropped.
const LEAST_PIECE: f64 = 0.05;

/// The two solids of a closed mesh whose vertices are labelled; what lies inside goes to the nearer surface, which is
/// a conclusion and marked as not seen. Nothing where either comes out open or empty.
pub fn divide(mesh: &Mesh, labels: &[bool], voxel: f64) -> Option<[Mesh; 2]> {
    let whole = SurfaceDistance::new(mesh)?;
    let side = |which: bool| {
        let mine = |t: usize| mesh.triangles[t].iter().filter(|v| labels[**v as usize]).count() >= 2;
        SurfaceDistance::new(&submesh(mesh, |t| mine(t) == which).0)
    };
    let sides = [side(false)?, side(true)?];
    let (low, high) = mesh.bounds()?;
    let first: [i32; 3] = std::array::from_fn(|a| (low[a] / voxel).floor() as i32 - PAD);
    let size: [i32; 3] = std::array::from_fn(|a| (high[a] / voxel).ceil() as i32 + PAD - first[a]);
    let count = size.iter().product::<i32>() as usize;
    let within = within(mesh, first, size, voxel);
    let values: Vec<[f64; 2]> = (0..count)
        .into_par_iter()
        .map(|i| {
            let i = i as i32;
            let index = [i % size[0], i / size[0] % size[1], i / (size[0] * size[1])];
            let at = |a: usize| (f64::from(index[a] + first[a]) + 0.5) * voxel;
            let p = Point3::new(at(0), at(1), at(2));
            let far = whole.distance(&p);
            let inside = if within[i as usize] { -far } else { far };
            if inside > 2.0 * voxel {
                return [inside; 2];
            }
            let lead = 0.5 * (sides[0].distance(&p) - sides[1].distance(&p));
            [inside.max(lead), inside.max(-lead)].map(|f| if f.abs() < 1e-9 { 1e-9 } else { f })
        })
        .collect();
    let solid = |which: usize| {
        let value = |g: [i32; 3]| {
            let c: [i32; 3] = std::array::from_fn(|a| g[a] - first[a]);
            values[(c[0] + size[0] * (c[1] + size[1] * c[2])) as usize][which]
        };
        painted(extract(first, size, voxel, &value)?, mesh, &whole, voxel)
    };
    Some([solid(0)?, solid(1)?])
}

/// Which samples of a grid lie inside a closed mesh: the winding number along the column above each of them, which
/// small faults of the mesh do not spoil.
fn within(mesh: &Mesh, first: [i32; 3], size: [i32; 3], voxel: f64) -> Vec<bool> {
    // Columns stand a little off the samples, so that none runs through an edge.
    let off = [0.5 + 1.3e-6, 0.5 + 2.7e-6];
    let place = |a: usize, i: i32| (f64::from(first[a] + i) + off[a]) * voxel;
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); (size[0] * size[1]) as usize];
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let span = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            let index = |x: f64| (x / voxel - off[k]).ceil() as i32 - first[k];
            index(low).max(0)..index(high).min(size[k])
        };
        let normal = mesh.scaled_normal(t);
        for y in span(1) {
            for x in span(0) {
                let p = Point3::new(place(0, x), place(1, y), 0.0);
                let turn = |a: &Point3<f64>, b: &Point3<f64>| {
                    ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)) * normal.z > 0.0
                };
                if turn(&a, &b) && turn(&b, &c) && turn(&c, &a) {
                    let z = a.z - (normal.x * (p.x - a.x) + normal.y * (p.y - a.y)) / normal.z;
                    crossings[(x + size[0] * y) as usize].push((z, if normal.z > 0.0 { 1 } else { -1 }));
                }
            }
        }
    }
    let inside = |i: usize| {
        let z = (f64::from(first[2] + (i as i32) / (size[0] * size[1])) + 0.5) * voxel;
        let above = &crossings[i % (size[0] * size[1]) as usize];
        above.iter().filter(|c| c.0 > z).map(|c| c.1).sum::<i32>() > 0
    };
    (0..(size[0] * size[1] * size[2]) as usize).map(inside).collect()
}

fn extract(first: [i32; 3], size: [i32; 3], voxel: f64, value: &impl Fn([i32; 3]) -> f64) -> Option<Mesh> {
    let mut triangles = Vec::new();
    for z in 0..size[2] - 1 {
        for y in 0..size[1] - 1 {
            for x in 0..size[0] - 1 {
                let cell = [first[0] + x, first[1] + y, first[2] + z];
                let corners: [f64; 8] = std::array::from_fn(|m| {
                    let m = m as i32;
                    value([cell[0] + (m & 1), cell[1] + ((m >> 1) & 1), cell[2] + (m >> 2)])
                });
                march_cell(cell, &corners, &mut triangles);
            }
        }
    }
    let (mesh, _) = weld(&triangles, voxel, value);
    let (of, pieces) = vertex_components(&mesh);
    let mut sizes = vec![0usize; pieces];
    mesh.triangles
        .iter()
        .for_each(|t| sizes[of[t[0] as usize] as usize] += 1);
    let least = LEAST_PIECE * sizes.iter().copied().max()? as f64;
    let (mesh, _) = submesh(&mesh, |t| {
        sizes[of[mesh.triangles[t][0] as usize] as usize] as f64 >= least
    });
    (edge_defects(&mesh) == 0 && mesh.volume() > 0.0).then_some(mesh)
}

/// The vertices on the old surface drawn onto it, with its colours and what was seen of it.
fn painted(mut mesh: Mesh, old: &Mesh, surface: &SurfaceDistance, voxel: f64) -> Option<Mesh> {
    let near: Vec<Option<(u32, Point3<f64>, bool)>> = mesh
        .vertices
        .par_iter()
        .map(|p| {
            let nearest = surface.nearest(p)?;
            let corner = old.triangles[nearest.triangle].into_iter().min_by(|a, b| {
                let to = |v: &u32| (old.vertices[*v as usize] - p).norm();
                to(a).total_cmp(&to(b))
            })?;
            Some((corner, nearest.point, nearest.distance < 0.35 * voxel))
        })
        .collect();
    let all: Vec<_> = near.into_iter().collect::<Option<_>>()?;
    let moved: Vec<Vector3<f64>> = mesh.vertices.iter().zip(&all).map(|(p, n)| n.1 - p).collect();
    for ((p, shift), (_, _, on)) in mesh.vertices.iter_mut().zip(moved).zip(&all) {
        if *on {
            *p += shift * 0.8;
        }
    }
    if !old.colors.is_empty() {
        mesh.colors = all.iter().map(|n| old.colors[n.0 as usize]).collect();
    }
    mesh.seen = all
        .iter()
        .map(|n| n.2 && (old.seen.is_empty() || old.seen[n.0 as usize]))
        .collect();
    Some(mesh)
}
