//! Smoothing that does not shrink.

use nalgebra::Vector3;

use super::{Mesh, edges};

/// Pass-band frequency of 0.1 with lambda 0.5: `1/lambda + 1/mu = 0.1` (Taubin 1995, eq. 9).
const LAMBDA: f64 = 0.5;
const MU: f64 = -1.0 / (1.0 / LAMBDA - 0.1);

/// Taubin's lambda/mu smoothing with uniform weights ("A signal processing approach to fair surface design", 1995).
/// Vertices on open edges stay where they are.
pub fn smooth(mesh: &Mesh, iterations: usize) -> Mesh {
    let mut out = mesh.clone();
    let edges = edges(mesh);
    let mut fixed = vec![false; mesh.vertices.len()];
    for ([a, b], _) in edges.iter().filter(|(_, count)| *count != 2) {
        fixed[*a as usize] = true;
        fixed[*b as usize] = true;
    }
    for _ in 0..iterations {
        step(&mut out, &edges, &fixed, LAMBDA);
        step(&mut out, &edges, &fixed, MU);
    }
    out
}

fn step(mesh: &mut Mesh, edges: &[([u32; 2], usize)], fixed: &[bool], factor: f64) {
    let mut sum = vec![(Vector3::zeros(), 0.0); mesh.vertices.len()];
    for ([a, b], _) in edges {
        let (a, b) = (*a as usize, *b as usize);
        let along = mesh.vertices[b] - mesh.vertices[a];
        sum[a] = (sum[a].0 + along, sum[a].1 + 1.0);
        sum[b] = (sum[b].0 - along, sum[b].1 + 1.0);
    }
    for (v, (offset, count)) in sum.iter().enumerate() {
        if *count > 0.0 && !fixed[v] {
            mesh.vertices[v] += offset * (factor / count);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;
    use crate::base::{Seed, rng_for};
    use crate::geometry::solids::sphere;

    #[test]
    fn a_rough_ball_becomes_smoother_and_keeps_its_volume() {
        let clean = sphere(0.05, 4);
        let mut rng = rng_for(Seed(3), "rough");
        let mut rough = clean.clone();
        for v in &mut rough.vertices {
            v.coords *= 1.0 + 0.01 * (rng.random::<f64>() - 0.5);
        }
        let roughness = |m: &Mesh| {
            let squares = m.vertices.iter().map(|v| (v.coords.norm() - 0.05).powi(2));
            (squares.sum::<f64>() / m.vertices.len() as f64).sqrt()
        };
        let smoothed = smooth(&rough, 10);
        assert!(roughness(&smoothed) < 0.5 * roughness(&rough));
        assert!((smoothed.volume() / clean.volume() - 1.0).abs() < 0.005);
    }
}
