//! The closed mesh of one body out of the volume around it.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use super::volume::Volume;
use crate::geometry::{
    GridEdge, Mesh, Origin, Plane, cap_at_zero, cut_below, edge_color, edge_defects, march_cell, submesh, unique_edges,
    vertex_components, weld,
};

/// Pieces smaller than this share of the largest are dropped.
const LEAST_PIECE: f64 = 0.05;
/// Depth below the seen surface to which its label decides whose a voxel is, voxels.
const SHALLOW: f64 = 1.5;
/// Passes of smoothing over all of the mesh, and over what was concluded rather than seen.
const FAIRING: [usize; 2] = [6, 20];

/// The part of a volume that is one body.
pub struct Part<'a> {
    pub volume: &'a Volume,
    pub body: u32,
    pub planes: &'a [(u32, u32, Plane)],
}

impl Part<'_> {
    /// Extracts the body, closed, in the field's frame; flat at `z = 0` where it reaches the support.
    /// Nothing where no volume is left.
    pub fn mesh(&self, on_support: bool) -> Option<Mesh> {
        let mut mesh = match on_support {
            true => self.standing().or_else(|| self.painted(true))?,
            false => self.painted(false)?,
        };
        fair(&mut mesh);
        (edge_defects(&mesh) == 0 && mesh.volume() > 0.0).then_some(mesh)
    }

    /// The body cut at the support, with its foot closed there by triangulation.
    fn standing(&self) -> Option<Mesh> {
        stand(&self.painted(false)?, 0.02 * self.volume.field.voxel).filter(|mesh| edge_defects(mesh) == 0)
    }

    /// The body as the grid has it. With `footed`, the layer under the support mirrors the one above it with
    /// the sign of the outside, so that the foot comes out at `z = 0` without any cut.
    fn painted(&self, footed: bool) -> Option<Mesh> {
        let (mesh, edges) = self.extract(footed);
        let (mesh, edges) = largest_pieces(mesh, edges)?;
        let mut mesh = self.paint(mesh, &edges);
        let mut origins = mesh.origins();
        for (p, origin) in mesh
            .vertices
            .iter_mut()
            .zip(&mut origins)
            .filter(|(p, _)| footed && p.z.abs() < 1e-9)
        {
            (p.z, *origin) = (0.0, Origin::Closed);
        }
        mesh.set_origins(&origins);
        Some(mesh)
    }

    fn footed(&self, index: [i32; 3]) -> f64 {
        match index[2] {
            0.. => self.value(index),
            below => self.value([index[0], index[1], -1 - below]).abs(),
        }
    }

    /// The distance to this body alone, at a global index. Outside the box there is nothing. The planes
    /// part the inside; near the surface, which was seen, another owner is not overruled.
    fn value(&self, index: [i32; 3]) -> f64 {
        let voxel = self.volume.field.voxel;
        let Some(at) = self.volume.at_global(index) else {
            return voxel;
        };
        let (distance, owner) = (f64::from(self.volume.distance[at]), self.volume.owner[at]);
        if distance >= 0.0 {
            return distance;
        }
        let parted = |a: u32, b: u32| self.planes.iter().any(|p| (p.0, p.1) == (a, b) || (p.0, p.1) == (b, a));
        let shallow = distance > -SHALLOW * voxel && self.volume.observed[at];
        if owner != self.body && (shallow || !parted(owner, self.body)) {
            return 0.5 * voxel;
        }
        let value = distance.max(self.side(index));
        if value.abs() < 1e-9 { 1e-9 } else { value }
    }

    /// How far a sample is on the wrong side of the planes that part this body from others.
    fn side(&self, index: [i32; 3]) -> f64 {
        let point = self.volume.point(index);
        let sides = self.planes.iter().filter_map(|(a, b, plane)| match self.body {
            body if body == *a => Some(plane.height(&point)),
            body if body == *b => Some(-plane.height(&point)),
            _ => None,
        });
        sides.fold(f64::NEG_INFINITY, f64::max)
    }

    fn extract(&self, footed: bool) -> (Mesh, Vec<GridEdge>) {
        let [nx, ny, nz] = self.volume.size.map(|n| n as i32);
        let low = self.volume.low;
        // One layer more on every side, which is outside, closes what reaches the end of the box.
        let wide = [nx + 2, ny + 2, nz + 2];
        let mut values = vec![0.0; wide.iter().map(|n| *n as usize).product()];
        let place = |x: i32, y: i32, z: i32| (x + wide[0] * (y + wide[1] * z)) as usize;
        for z in 0..wide[2] {
            for y in 0..wide[1] {
                for x in 0..wide[0] {
                    let index = [low[0] + x - 1, low[1] + y - 1, low[2] + z - 1];
                    values[place(x, y, z)] = if footed { self.footed(index) } else { self.value(index) };
                }
            }
        }
        let mut triangles = Vec::new();
        for z in 0..wide[2] - 1 {
            for y in 0..wide[1] - 1 {
                for x in 0..wide[0] - 1 {
                    let corners = std::array::from_fn(|m| {
                        let m = m as i32;
                        values[place(x + (m & 1), y + ((m >> 1) & 1), z + (m >> 2))]
                    });
                    march_cell(
                        [low[0] + x - 1, low[1] + y - 1, low[2] + z - 1],
                        &corners,
                        &mut triangles,
                    );
                }
            }
        }
        let value = |i: [i32; 3]| values[place(i[0] - low[0] + 1, i[1] - low[1] + 1, i[2] - low[2] + 1)];
        weld(&triangles, self.volume.field.voxel, value)
    }

    /// Whether the surface at a grid edge was seen: an observed distance near zero decides it.
    fn was_seen(&self, edge: &GridEdge) -> bool {
        let near = 1.5 * self.volume.field.voxel;
        let ends = [edge.corner, edge.end()];
        let plain = ends.iter().all(|i| {
            self.volume.at_global(*i).is_some_and(|at| {
                let distance = f64::from(self.volume.distance[at]);
                distance >= 0.0 || self.value(*i) == distance
            })
        });
        plain
            && ends.iter().any(|i| {
                self.volume
                    .at_global(*i)
                    .is_some_and(|at| self.volume.observed[at] && f64::from(self.volume.distance[at]).abs() < near)
            })
    }

    /// Where the surface at a grid edge comes from: where it was not seen, an image of what was may have made it.
    fn origin(&self, edge: &GridEdge) -> Origin {
        if self.was_seen(edge) {
            return Origin::Seen;
        }
        let near = 1.5 * self.volume.field.voxel;
        let is_image = |i: &[i32; 3]| {
            let at = self.volume.at_global(*i);
            at.is_some_and(|at| self.volume.mirrored[at] && f64::from(self.volume.distance[at]).abs() < near)
        };
        match [edge.corner, edge.end()].iter().any(is_image) {
            true => Origin::Mirrored,
            false => Origin::Closed,
        }
    }

    /// The grid edge at or above the layer down to which the thing was seen clear of the support.
    fn raised(&self, edge: &GridEdge) -> GridEdge {
        let mut raised = *edge;
        raised.corner[2] = raised.corner[2].max(self.volume.clear);
        raised
    }

    fn paint(&self, mut mesh: Mesh, edges: &[GridEdge]) -> Mesh {
        let origins: Vec<Origin> = edges.iter().map(|e| self.origin(e)).collect();
        mesh.set_origins(&origins);
        let own = edges.iter().zip(&mesh.seen);
        let colors: Vec<Option<[u8; 3]>> = own
            .map(|(e, seen)| seen.then(|| edge_color(&self.volume.field, &self.raised(e))).flatten())
            .collect();
        mesh.colors = spread_colors(&mesh, colors);
        mesh
    }
}

/// Vertices without a colour take the one of the coloured vertex that is the fewest edges away.
fn spread_colors(mesh: &Mesh, mut colors: Vec<Option<[u8; 3]>>) -> Vec<[u8; 3]> {
    let neighbours = adjacency(mesh);
    let mut queue: VecDeque<usize> = (0..colors.len()).filter(|v| colors[*v].is_some()).collect();
    if queue.is_empty() {
        return Vec::new();
    }
    while let Some(v) = queue.pop_front() {
        for w in &neighbours[v] {
            if colors[*w as usize].is_none() {
                colors[*w as usize] = colors[v];
                queue.push_back(*w as usize);
            }
        }
    }
    colors.into_iter().map(|c| c.unwrap_or([128; 3])).collect()
}

fn adjacency(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut neighbours = vec![Vec::new(); mesh.vertices.len()];
    for (a, b) in unique_edges(mesh) {
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }
    neighbours
}

/// Fairs the mesh without shrinking it (Taubin 1995): a little everywhere against the grain of the sensor
/// noise, more where the surface was concluded rather than seen.
fn fair(mesh: &mut Mesh) {
    let neighbours = adjacency(mesh);
    for (round, only_unseen) in [(FAIRING[0], false), (FAIRING[1], true)] {
        for factor in [0.5, -0.53].into_iter().cycle().take(round) {
            let old = mesh.vertices.clone();
            for (v, around) in neighbours
                .iter()
                .enumerate()
                .filter(|(v, _)| !(only_unseen && mesh.seen[*v]))
            {
                mesh.vertices[v] = old[v] + pull(&old, v, around) * factor;
            }
        }
    }
}

/// From a vertex to the middle of its neighbours. A vertex of the foot stays in its plane and follows the wall
/// above it.
fn pull(vertices: &[Point3<f64>], v: usize, around: &[u32]) -> Vector3<f64> {
    let foot = vertices[v].z == 0.0;
    let count = around
        .iter()
        .filter(|w| !foot || vertices[**w as usize].z > 0.0)
        .count();
    let wall = around
        .iter()
        .map(|w| vertices[*w as usize])
        .filter(|p| !foot || p.z > 0.0);
    if count == 0 {
        return Vector3::zeros();
    }
    let mut pull = wall.map(|p| p.coords).sum::<Vector3<f64>>() / count as f64 - vertices[v].coords;
    if foot {
        pull.z = 0.0;
    }
    pull
}

/// Drops crumbs and inner voids.
fn largest_pieces(mesh: Mesh, edges: Vec<GridEdge>) -> Option<(Mesh, Vec<GridEdge>)> {
    let (piece, count) = vertex_components(&mesh);
    let mut volume = vec![0.0; count];
    for (i, t) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(i);
        volume[piece[t[0] as usize] as usize] += a.coords.dot(&b.coords.cross(&c.coords)) / 6.0;
    }
    let largest = volume.iter().copied().fold(0.0, f64::max);
    if largest <= 0.0 {
        return None;
    }
    let keep = |t: usize| volume[piece[mesh.triangles[t][0] as usize] as usize] > LEAST_PIECE * largest;
    let (kept, old) = submesh(&mesh, keep);
    Some((kept, old.iter().map(|v| edges[*v as usize]).collect()))
}

/// Cuts the mesh at the support and closes its foot there.
fn stand(mesh: &Mesh, clearance: f64) -> Option<Mesh> {
    let (mut cut, source) = cut_below(mesh, clearance);
    if cut.triangles.is_empty() || !cap_at_zero(&mut cut) {
        return None;
    }
    let from = |v: &u32| *v as usize;
    if !mesh.colors.is_empty() {
        cut.colors = source.iter().map(|v| mesh.colors[from(v)]).collect();
    }
    let above = cut.vertices.iter().map(|p| p.z > 0.0);
    let origins: Vec<Origin> = source
        .iter()
        .zip(above)
        .map(|(v, above)| if above { mesh.origin(from(v)) } else { Origin::Closed })
        .collect();
    cut.set_origins(&origins);
    Some(cut)
}
