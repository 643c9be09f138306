//! The open surface that was seen, as a coloured mesh out of the fused field.

use rayon::prelude::*;

use crate::geometry::{BLOCK, Field, GridEdge, Mesh, march_cell, weld};

/// Extracts the observed zero set; cells with an unobserved corner are left open. In the field's frame.
pub fn open_surface(field: &Field) -> Mesh {
    let per_block: Vec<Vec<[GridEdge; 3]>> = (0..field.keys().len())
        .into_par_iter()
        .map(|at| march_block(field, at))
        .collect();
    let triangles: Vec<[GridEdge; 3]> = per_block.into_iter().flatten().collect();
    let value = |i: [i32; 3]| field.get(i).and_then(|v| v.observed()).unwrap_or(0.0);
    let (mut mesh, edges) = weld(&triangles, field.voxel, value);
    mesh.colors = edges.iter().map(|e| edge_color(field, e).unwrap_or([128; 3])).collect();
    mesh
}

fn march_block(field: &Field, at: usize) -> Vec<[GridEdge; 3]> {
    let key = field.keys()[at];
    let samples: Vec<Option<f64>> = field
        .gather(at)
        .into_iter()
        .map(|v| v.and_then(|v| v.observed()))
        .collect();
    let mut triangles = Vec::new();
    for z in 0..BLOCK {
        for y in 0..BLOCK {
            for x in 0..BLOCK {
                let corner =
                    |m: i32| samples[((x + (m & 1)) + 9 * ((y + ((m >> 1) & 1)) + 9 * (z + (m >> 2)))) as usize];
                let mut values = [0.0; 8];
                let known = (0..8).all(|m| {
                    corner(m).is_some_and(|v| {
                        values[m as usize] = v;
                        true
                    })
                });
                if known {
                    let cell = [key[0] * BLOCK + x, key[1] * BLOCK + y, key[2] * BLOCK + z];
                    march_cell(cell, &values, &mut triangles);
                }
            }
        }
    }
    triangles
}

/// The colour where the surface crosses a grid edge, from the ends that have one.
pub fn edge_color(field: &Field, edge: &GridEdge) -> Option<[u8; 3]> {
    let ends = [edge.corner, edge.end()].map(|i| field.get(i).and_then(|v| Some((v.rgb()?, v.color_weight))));
    match ends {
        [Some((a, wa)), Some((b, wb))] => {
            let share = f64::from(wb / (wa + wb));
            Some(std::array::from_fn(|i| {
                (f64::from(a[i]) + (f64::from(b[i]) - f64::from(a[i])) * share).round() as u8
            }))
        }
        [a, b] => a.or(b).map(|(rgb, _)| rgb),
    }
}
