//! How well convex parts fill a shape.

use rand::Rng;

use crate::base::{Seed, rng_for};
use crate::geometry::hull::face_planes;
use crate::geometry::{Mesh, SurfaceDistance};

/// Volume in both over volume in either (intersection over union) of a closed mesh and convex parts, from
/// `samples` points in the box around them. Nothing for an empty mesh.
pub fn decomposition_overlap(mesh: &Mesh, parts: &[Mesh], samples: usize, seed: Seed) -> Option<f64> {
    let surface = SurfaceDistance::new(mesh)?;
    let (lo, hi) = mesh.bounds()?;
    let (lo, hi) = parts
        .iter()
        .filter_map(Mesh::bounds)
        .fold((lo, hi), |(a, b), (c, d)| (a.inf(&c), b.sup(&d)));
    let planes: Vec<_> = parts.iter().map(face_planes).collect();
    let mut rng = rng_for(seed, "decomposition-overlap");
    let (mut both, mut either) = (0usize, 0usize);
    for _ in 0..samples {
        let p = lo + (hi - lo).map(|side| side * rng.random::<f64>());
        let in_mesh = surface.signed_or_guessed(&p) < 0.0;
        let in_parts = planes
            .iter()
            .any(|part| part.iter().all(|(n, d)| n.dot(&p.coords) <= *d));
        both += usize::from(in_mesh && in_parts);
        either += usize::from(in_mesh || in_parts);
    }
    (either > 0).then(|| both as f64 / either as f64)
}
