//! The zero set of a block grid as one mesh without cracks between the blocks, in time with the surface.

use nalgebra::Point3;
use rayon::prelude::*;

use super::blocks::{BLOCK, BLOCK_SAMPLES, Block, BlockGrid};
use super::cubes::{CUBE_TRIANGLES, cube_edge};
use super::{GridEdge, Mesh};

/// Samples along an edge of a block with the first layer of its upper neighbours.
const PAD: usize = BLOCK as usize + 1;
/// Cells beyond the block on the lower side also use the edges that the block owns.
const N: usize = BLOCK as usize;

/// A block made ready to be marched.
struct Piece {
    /// Vertex number of the edge along each axis at each sample, plus one; 0 = none.
    numbers: Vec<[u16; 3]>,
    vertices: Vec<Point3<f64>>,
    colors: Vec<[u8; 3]>,
    /// Cells that the surface passes, with their cases.
    cells: Vec<([u8; 3], u8)>,
}

/// Extracts the observed zero set; cells with a corner that was observed with a weight of `least_weight` or less
/// are left open. Vertices come in the order of the block keys. In the grid's frame.
pub fn grid_surface(grid: &BlockGrid, least_weight: f32) -> Mesh {
    let mut order: Vec<usize> = (0..grid.keys().len()).collect();
    order.sort_unstable_by_key(|at| grid.keys()[*at]);
    let mut rank = vec![0_u32; order.len()];
    for (n, at) in order.iter().enumerate() {
        rank[*at] = n as u32;
    }
    let colored = grid.blocks().iter().any(|b| b.color.is_some());
    let pieces: Vec<Piece> = order
        .par_iter()
        .map(|at| piece(grid, *at, least_weight, colored))
        .collect();
    let first: Vec<u32> = pieces
        .iter()
        .scan(0, |sum, p| {
            let before = *sum;
            *sum += p.vertices.len() as u32;
            Some(before)
        })
        .collect();
    let per_block: Vec<Vec<[u32; 3]>> = (0..order.len())
        .into_par_iter()
        .map(|n| triangles(grid, order[n], &pieces, &first, &rank))
        .collect();
    let mut mesh = Mesh {
        vertices: Vec::with_capacity(pieces.iter().map(|p| p.vertices.len()).sum()),
        triangles: Vec::with_capacity(per_block.iter().map(Vec::len).sum()),
        ..Mesh::default()
    };
    for piece in &pieces {
        mesh.vertices.extend_from_slice(&piece.vertices);
        mesh.colors.extend_from_slice(&piece.colors);
    }
    for part in &per_block {
        mesh.triangles.extend_from_slice(part);
    }
    without_strays(mesh)
}

/// Drops vertices that no triangle uses: crossings next to cells that were not wholly observed.
fn without_strays(mesh: Mesh) -> Mesh {
    let mut number = vec![u32::MAX; mesh.vertices.len()];
    for v in mesh.triangles.iter().flatten() {
        number[*v as usize] = 0;
    }
    let mut kept = Mesh::default();
    for (v, place) in number.iter_mut().enumerate().filter(|(_, n)| **n == 0) {
        *place = kept.vertices.len() as u32;
        kept.vertices.push(mesh.vertices[v]);
        if let Some(color) = mesh.colors.get(v) {
            kept.colors.push(*color);
        }
    }
    kept.triangles = mesh
        .triangles
        .into_iter()
        .map(|t| t.map(|v| number[v as usize]))
        .collect();
    kept
}

fn neighbours(grid: &BlockGrid, key: [i32; 3]) -> [Option<usize>; 8] {
    std::array::from_fn(|n| {
        let n = n as i32;
        grid.find([key[0] + (n & 1), key[1] + ((n >> 1) & 1), key[2] + (n >> 2)])
    })
}

/// Distances of the block and of the first layer of its upper neighbours, NaN where not observed.
fn distances(blocks: &[Option<&Block>; 8], least_weight: f32, into: &mut [f32; PAD * PAD * PAD]) {
    into.fill(f32::NAN);
    for (which, block) in blocks.iter().enumerate() {
        let Some(block) = block else { continue };
        let span = |axis: usize| if which >> axis & 1 == 0 { 0..N } else { N..PAD };
        for z in span(2) {
            for y in span(1) {
                for x in span(0) {
                    let at = x % N + N * (y % N + N * (z % N));
                    into[x + PAD * (y + PAD * z)] = block.distance(at, least_weight);
                }
            }
        }
    }
}

fn piece(grid: &BlockGrid, at: usize, least_weight: f32, colored: bool) -> Piece {
    let key = grid.keys()[at];
    let blocks = neighbours(grid, key).map(|n| n.map(|n| &*grid.blocks()[n]));
    let mut values = [0.0; PAD * PAD * PAD];
    distances(&blocks, least_weight, &mut values);
    let mut piece = Piece {
        numbers: Vec::new(),
        vertices: Vec::new(),
        colors: Vec::new(),
        cells: Vec::new(),
    };
    let has = |negative: bool| values.iter().any(|v| if negative { *v < 0.0 } else { *v >= 0.0 });
    if !has(true) || !has(false) {
        return piece;
    }
    piece.numbers = vec![[0; 3]; BLOCK_SAMPLES];
    for z in 0..N {
        for y in 0..N {
            for x in 0..N {
                let low = x + PAD * (y + PAD * z);
                for (axis, step) in [1, PAD, PAD * PAD].into_iter().enumerate() {
                    let (a, b) = (values[low], values[low + step]);
                    if (a < 0.0 && b >= 0.0) || (a >= 0.0 && b < 0.0) {
                        piece.add_vertex(grid.voxel, key, [x, y, z], axis, (a / (a - b)).clamp(0.01, 0.99));
                        if colored {
                            piece.colors.push(color(&blocks, [x, y, z], axis));
                        }
                    }
                }
                piece.add_cell(&values, low, [x, y, z]);
            }
        }
    }
    piece
}

impl Piece {
    fn add_vertex(&mut self, voxel: f64, key: [i32; 3], place: [usize; 3], axis: usize, share: f32) {
        let mut p = [0, 1, 2].map(|a| f64::from(key[a] * BLOCK + place[a] as i32) + 0.5);
        p[axis] += f64::from(share);
        self.vertices.push(Point3::from(p.map(|x| x * voxel)));
        self.numbers[place[0] + N * (place[1] + N * place[2])][axis] = self.vertices.len() as u16;
    }

    fn add_cell(&mut self, values: &[f32; PAD * PAD * PAD], low: usize, place: [usize; 3]) {
        const STEPS: [usize; 8] = [
            0,
            1,
            PAD,
            PAD + 1,
            PAD * PAD,
            PAD * PAD + 1,
            PAD * PAD + PAD,
            PAD * PAD + PAD + 1,
        ];
        let corners = STEPS.map(|s| values[low + s]);
        let mut case = 0_u8;
        let mut known = true;
        for (m, v) in corners.iter().enumerate() {
            case |= u8::from(*v < 0.0) << m;
            known &= !v.is_nan();
        }
        if known && case != 0 && case != 255 {
            self.cells.push((place.map(|p| p as u8), case));
        }
    }
}

/// The colour where the surface crosses an edge, from the ends that have one.
fn color(blocks: &[Option<&Block>; 8], place: [usize; 3], axis: usize) -> [u8; 3] {
    let at = |p: [usize; 3]| {
        let which = p[0] / N + 2 * (p[1] / N) + 4 * (p[2] / N);
        blocks[which]?.rgb(p[0] % N + N * (p[1] % N + N * (p[2] % N)))
    };
    let mut end = place;
    end[axis] += 1;
    between(at(place), at(end)).unwrap_or([128; 3])
}

/// The colour where the surface crosses a grid edge, from the ends that have one.
pub fn edge_color(grid: &BlockGrid, edge: &GridEdge) -> Option<[u8; 3]> {
    let [a, b] = [edge.corner, edge.end()].map(|index| {
        let (block, at) = grid.sample(index)?;
        block.rgb(at)
    });
    between(a, b)
}

/// The mean of two colours by their weights.
fn between(a: Option<([f32; 3], f32)>, b: Option<([f32; 3], f32)>) -> Option<[u8; 3]> {
    let mean = match (a, b) {
        (Some((a, wa)), Some((b, wb))) => std::array::from_fn(|i| (a[i] * wa + b[i] * wb) / (wa + wb)),
        (a, b) => a.or(b)?.0,
    };
    Some(mean.map(|c: f32| (c + 0.5).clamp(0.0, 255.0) as u8))
}

fn triangles(grid: &BlockGrid, at: usize, pieces: &[Piece], first: &[u32], rank: &[u32]) -> Vec<[u32; 3]> {
    let own = &pieces[rank[at] as usize];
    if own.cells.is_empty() {
        return Vec::new();
    }
    let around = neighbours(grid, grid.keys()[at]).map(|n| n.map(|n| rank[n] as usize));
    let table = &*CUBE_TRIANGLES;
    let mut found = Vec::with_capacity(own.cells.len() * 2);
    for (place, case) in &own.cells {
        let number = |edge: u8| -> Option<u32> {
            let (low, axis) = cube_edge(edge);
            let p: [usize; 3] = std::array::from_fn(|a| usize::from(place[a] + (low >> a & 1)));
            let which = around[p[0] / N + 2 * (p[1] / N) + 4 * (p[2] / N)]?;
            let local = pieces[which].numbers.get(p[0] % N + N * (p[1] % N + N * (p[2] % N)))?[axis as usize];
            (local > 0).then(|| first[which] + u32::from(local) - 1)
        };
        for t in &table[usize::from(*case)] {
            if let [Some(a), Some(b), Some(c)] = t.map(number) {
                found.push([a, b, c]);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::components::edge_defects;
    use super::*;

    #[test]
    fn a_ball_over_many_blocks_is_closed_and_has_its_volume() {
        let mut grid = BlockGrid::new(0.1);
        for n in 0..64 {
            grid.touch([n % 4 - 2, n / 4 % 4 - 2, n / 16 - 2]);
        }
        let (keys, blocks) = grid.parts_mut();
        for (key, block) in keys.iter().zip(blocks) {
            for at in 0..BLOCK_SAMPLES {
                let i = [at % 8, at / 8 % 8, at / 64];
                let p = [0, 1, 2].map(|a| (f64::from(key[a] * BLOCK + i[a] as i32) + 0.5) * 0.1);
                block.set(at, ((p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 1.0) as f32);
            }
        }
        let mesh = grid_surface(&grid, 0.0);
        assert_eq!(edge_defects(&mesh), 0);
        let truth = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((mesh.volume() / truth - 1.0).abs() < 0.02, "{}", mesh.volume());
    }

    #[test]
    fn noise_of_any_kind_is_closed() {
        let mut grid = BlockGrid::new(0.1);
        for n in 0..27 {
            grid.touch([n % 3, n / 3 % 3, n / 9]);
        }
        let (keys, blocks) = grid.parts_mut();
        for (key, block) in keys.iter().zip(blocks) {
            for at in 0..BLOCK_SAMPLES {
                let i: [i32; 3] = [at % 8, at / 8 % 8, at / 64].map(|i| i as i32);
                let i: [i32; 3] = std::array::from_fn(|a| key[a] * BLOCK + i[a]);
                let hash = f64::from(i[0] * 73 + i[1] * 151 + i[2] * 283);
                let inner = i.iter().all(|x| *x > 0 && *x < 23);
                let wave = ((hash * 12.9898).sin() * 0.7 + 0.01) as f32;
                block.set(at, if inner { wave } else { 1.0 });
            }
        }
        assert_eq!(edge_defects(&grid_surface(&grid, 0.0)), 0);
    }
}
