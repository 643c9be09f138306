//! From a mesh to convex parts.

use rayon::prelude::*;

use super::balance::balance;
use super::divide::divide;
use super::merge::{Part, merge};
use super::piece::Piece;
use super::planes::box_rotation;
use crate::base::{Seed, rng_for};
use crate::geometry::{Mesh, SurfaceDistance, is_closed_manifold, sample_surface, simplify, slim_hull};

/// How to cut a shape into convex parts.
#[derive(Clone, Debug)]
pub struct DecompositionConfig {
    /// At most so many parts.
    pub max_parts: usize,
    /// At most so many vertices per part.
    pub max_vertices: usize,
    /// Parts are merged while the merged one stands out of the shape by no more than this, m.
    pub max_protrusion: f64,
    /// One hull is enough where its volume exceeds the shape's by no more than this factor.
    pub convex_ratio: f64,
    /// So it is where it exceeds it by no more than this factor and nearly nowhere stands out by more than
    /// `max_protrusion`: the hull of a rough scan of a box.
    pub rough_ratio: f64,
    /// Merges may add so much volume in all, as a share of the shape's, below `max_parts`.
    pub budget: f64,
}

impl Default for DecompositionConfig {
    fn default() -> Self {
        Self {
            max_parts: 24,
            max_vertices: 64,
            max_protrusion: 0.002,
            convex_ratio: 1.03,
            rough_ratio: 1.15,
            budget: 0.02,
        }
    }
}

/// Hulls may leave out points that stand out of them by less than this, m: a flat bottom stays flat to it.
pub(super) const HULL_TOLERANCE: f64 = 5e-5;

/// Convex closed meshes that together stand for `mesh`: the shape is cut by planes (of its flat faces, of its box, and
/// through axes about which it was turned) into nearly convex pieces, exactly and with closed cuts; pieces are merged
/// in the order of the volume that their common hull adds (as Mamou & Ghorbel 2009 do with voxels, Wei et al. 2022
/// with cut meshes); and faces that bridge a hollow are moved to where they are right on the mean. Nothing stands out of
/// the shape's own hull, and flat bottoms stay flat. A shape that is nearly convex gives one part. Empty for a mesh
/// without volume.
pub fn convex_parts(mesh: &Mesh, config: &DecompositionConfig) -> Vec<Mesh> {
    let Some(whole) = slim_hull(&mesh.vertices, config.max_vertices, HULL_TOLERANCE) else {
        return Vec::new();
    };
    let Some(surface) = SurfaceDistance::new(mesh) else {
        return Vec::new();
    };
    let slim = simplify(mesh, 0.1 * config.max_protrusion);
    let Some(piece) = Piece::new(slim) else {
        return vec![whole];
    };
    let closed = is_closed_manifold(mesh).is_ok();
    let at_most = |ratio: f64| closed && piece.hull_volume <= ratio * piece.volume;
    if at_most(config.convex_ratio)
        || protrusion(&whole, &surface) <= 0.5 * config.max_protrusion
        || at_most(config.rough_ratio) && nearly_within(&whole, &surface, config.max_protrusion)
    {
        return vec![whole];
    }
    let volume = piece.volume;
    let pieces = divide(piece, &box_rotation(mesh), config.max_protrusion);
    let parts = pieces.into_iter().map(|p| Part {
        hull: p.hull,
        volume: p.hull_volume,
    });
    let fits = |hull: &Mesh| protrusion(hull, &surface) <= config.max_protrusion;
    let merged = merge(
        parts.collect(),
        config.max_parts,
        0.004 * volume,
        config.budget * volume,
        fits,
    );
    let limit = 0.5 * config.max_protrusion;
    let finished = merged.into_par_iter().map(|part| {
        let hull = balance(part.hull, &surface, limit);
        slim_hull(&hull.vertices, config.max_vertices, HULL_TOLERANCE)
    });
    finished.collect::<Vec<_>>().into_iter().flatten().collect()
}

/// Whether 98 of 100 points of a hull stand out of a surface by no more than `limit`, m.
fn nearly_within(hull: &Mesh, surface: &SurfaceDistance, limit: f64) -> bool {
    let mut rng = rng_for(Seed(0), "nearly within");
    let points = sample_surface(hull, 500, &mut rng);
    let out = points.iter().filter(|s| surface.signed_or_guessed(&s.point) > limit);
    out.count() * 50 <= points.len()
}

/// How far a convex mesh stands out of a surface: largest distance of spread points that are outside, m.
pub(super) fn protrusion(hull: &Mesh, surface: &SurfaceDistance) -> f64 {
    let mut rng = rng_for(Seed(0), "protrusion");
    sample_surface(hull, 80, &mut rng)
        .iter()
        .map(|s| surface.signed_or_guessed(&s.point))
        .fold(0.0, f64::max)
}
