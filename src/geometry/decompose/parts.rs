//! From a mesh to convex parts.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::cut::{cut, points_per_part};
use super::merge::merge;
use super::split::{MAX_SPLITS, split};
use crate::base::{Seed, rng_for};
use crate::geometry::{Mesh, SurfaceDistance, convex_hull, is_closed_manifold, sample_surface, simplify, slim_hull};

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
    /// Edge of a voxel while cutting, m, as far as that gives neither too few nor too many of them.
    pub voxel: f64,
}

impl Default for DecompositionConfig {
    fn default() -> Self {
        Self {
            max_parts: 24,
            max_vertices: 64,
            max_protrusion: 0.002,
            convex_ratio: 1.03,
            voxel: 0.003,
        }
    }
}

/// Hulls may leave out points that stand out of them by less than this, m: a flat bottom stays flat to it.
pub(super) const HULL_TOLERANCE: f64 = 5e-5;

/// Convex closed meshes that together stand for `mesh`: V-HACD (Mamou & Ghorbel 2009) finds the cuts, hulls are
/// taken of the surface itself (not of voxels, so nothing stands out of the shape's own hull and a flat bottom
/// stays flat), and parts are merged in the order of the volume they add. A shape that is nearly convex gives
/// one part. Empty for a mesh without volume.
pub fn convex_parts(mesh: &Mesh, config: &DecompositionConfig) -> Vec<Mesh> {
    let Some(whole) = slim_hull(&mesh.vertices, config.max_vertices, HULL_TOLERANCE) else {
        return Vec::new();
    };
    let Some(surface) = SurfaceDistance::new(mesh) else {
        return Vec::new();
    };
    let full = convex_hull(&mesh.vertices).map_or(0.0, |h| h.volume());
    let closed = is_closed_manifold(mesh).is_ok();
    if closed && full <= config.convex_ratio * mesh.volume()
        || protrusion(&whole, &surface) <= 0.5 * config.max_protrusion
    {
        return vec![whole];
    }
    let turn = box_rotation(mesh);
    let turned = mesh.transformed(&turn);
    let slim = simplify(&turned, 0.1 * config.max_protrusion);
    let cut = cut(&slim, resolution(&turned, config.voxel));
    let margin = 0.25 * cut.voxel_parts().first().map_or(0.0, |p| p.scale);
    let turned_surface = SurfaceDistance::new(&turned);
    let hulls: Vec<Mesh> = points_per_part(&turned, &cut)
        .into_iter()
        .flat_map(|points| split(points, turned_surface.as_ref(), config, margin, MAX_SPLITS))
        .map(|hull| hull.transformed(&turn.inverse()))
        .collect();
    if hulls.is_empty() {
        return vec![whole];
    }
    merge(hulls, &surface, config)
}

/// How far a convex mesh stands out of a surface: largest distance of spread points that are outside, m.
pub(super) fn protrusion(hull: &Mesh, surface: &SurfaceDistance) -> f64 {
    let mut rng = rng_for(Seed(0), "protrusion");
    sample_surface(hull, 80, &mut rng)
        .iter()
        .map(|s| surface.signed_or_guessed(&s.point))
        .fold(0.0, f64::max)
}

/// Whether a convex mesh stands out of a surface by more than `limit`, m, at any of a few spread points.
pub(super) fn protrudes(hull: &Mesh, surface: &SurfaceDistance, limit: f64) -> bool {
    let mut rng = rng_for(Seed(0), "protrudes");
    sample_surface(hull, 80, &mut rng)
        .iter()
        .any(|s| surface.signed_or_guessed(&s.point) > limit)
}

/// Voxels along the longest side.
fn resolution(mesh: &Mesh, voxel: f64) -> u32 {
    let longest = mesh.bounds().map_or(0.0, |(lo, hi)| (hi - lo).max());
    (longest / voxel).clamp(40.0, 80.0) as u32
}

/// The turn that gives the mesh the smallest box: none if that is nearly as good, about z, or onto principal axes.
fn box_rotation(mesh: &Mesh) -> Isometry3<f64> {
    let volume = |r: &Rotation3<f64>| {
        let turned = mesh.vertices.iter().map(|v| (r * v).coords);
        let first = Vector3::repeat(f64::INFINITY);
        let (lo, hi) = turned.fold((first, -first), |(lo, hi), v| (lo.inf(&v), hi.sup(&v)));
        (hi - lo).product()
    };
    let yaw = |degrees: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    let least = |candidates: &[Rotation3<f64>]| {
        let rated = candidates.iter().map(|r| (volume(r), *r));
        rated
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, Rotation3::identity()))
    };
    let coarse: Vec<f64> = (0..30).map(|i| f64::from(3 * i)).collect();
    let start = coarse
        .iter()
        .copied()
        .min_by(|a, b| volume(&yaw(*a)).total_cmp(&volume(&yaw(*b))));
    let fine: Vec<_> = (-20..=20)
        .map(|i| yaw(start.unwrap_or(0.0) + 0.1 * f64::from(i)))
        .collect();
    let best = [least(&fine), least(&[principal_axes(mesh)])];
    let best = if best[1].0 < 0.98 * best[0].0 { best[1] } else { best[0] };
    let turn = if best.0 < 0.98 * volume(&Rotation3::identity()) {
        best.1
    } else {
        Rotation3::identity()
    };
    Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::from_rotation_matrix(&turn))
}

fn principal_axes(mesh: &Mesh) -> Rotation3<f64> {
    let count = mesh.vertices.len().max(1) as f64;
    let mean = mesh.vertices.iter().map(|v| v.coords).sum::<Vector3<f64>>() / count;
    let spread: Matrix3<f64> = mesh
        .vertices
        .iter()
        .map(|v| (v.coords - mean) * (v.coords - mean).transpose())
        .sum();
    let mut axes = spread.symmetric_eigen().eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    Rotation3::from_matrix_unchecked(axes.transpose())
}
