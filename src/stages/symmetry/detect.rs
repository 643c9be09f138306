//! The verb of the symmetry pass.

use nalgebra::{Matrix3, Unit, Vector3};

use super::Config;
use super::mirror::{Mirror, Plane};
use super::revolution::{axes, representatives};
use crate::base::{Notices, Result};
use crate::geometry::{Mesh, simplify};
use crate::twin::SymmetryPlane;

/// Points and widening of the tolerance while directions are compared.
const COARSE_POINTS: usize = 100;
const COARSE_WIDTH: f64 = 4.0;
/// Local best directions that are followed up.
const FOLLOWED: usize = 14;
/// Planes whose normals are nearer than this (cosine of 5°) are one.
const SAME: f64 = 0.9962;
/// Never more planes than a cube has.
const MAX_PLANES: usize = 9;

/// Planes of reflection of `mesh`, best first; none for a shape that has none.
///
/// Directions over the half sphere and principal axes are rated by mirroring the seen surface onto the whole one
/// (after Podolak et al. 2006 and, for the unseen part, Thrun & Wegbreit 2005), the best are refined by ICP. A
/// shape from the lathe has a family of planes through its axis, of which two stand for all; a ball gets three.
/// At equal score upright planes (in the mesh's frame) come first.
///
/// # Errors
/// `Usage` for settings that cannot work.
pub fn detect(mesh: &Mesh, config: &Config, notices: &mut Notices) -> Result<Vec<SymmetryPlane>> {
    config.check()?;
    // Tens of thousands of triangles slow every query down and say nothing more about symmetry.
    let slim = (mesh.triangles.len() > 20_000).then(|| simplify(mesh, 1e-4));
    let Some(mirror) = Mirror::new(slim.as_ref().unwrap_or(mesh), config) else {
        return Ok(Vec::new());
    };
    let planes = accepted(&mirror, config);
    let axes = axes(&mirror, &planes, config.min_score);
    if !axes.is_empty() {
        let turned = if axes.len() == 1 { "turned on a lathe" } else { "a ball" };
        notices.note(
            "symmetry",
            "shape",
            format!("it looks like {turned}: its planes stand for a whole family"),
        );
    }
    let mut scored: Vec<(f64, Plane)> = representatives(&axes, &planes)
        .iter()
        .map(|p| mirror.refined(p, usize::MAX, 5, 2.0))
        .map(|p| (mirror.reflection_score(&p, 600, 1.0), p))
        .filter(|(score, _)| *score >= config.min_score)
        .collect();
    // Scores are compared in steps, so that noise does not put a lying plane before an upright one.
    scored.sort_by_key(|(score, p)| {
        (
            -(score * 25.0).round() as i64,
            p.normal.z.abs() > 0.1,
            -(score * 1e6) as i64,
        )
    });
    Ok(scored
        .iter()
        .take(MAX_PLANES)
        .map(|(score, p)| in_mesh(&mirror, p, *score))
        .collect())
}

/// Refined planes over the score, no two alike, best first.
fn accepted(mirror: &Mirror, config: &Config) -> Vec<Plane> {
    let mut rated: Vec<(f64, Plane)> = candidates(mirror, config)
        .iter()
        .map(|p| mirror.refined(p, 250, 7, 2.0 * COARSE_WIDTH))
        .map(|p| (mirror.reflection_score(&p, 250, 1.0), p))
        .filter(|(score, _)| *score >= 0.8 * config.min_score)
        .map(|(_, p)| mirror.refined(&p, 600, 3, 2.0))
        .map(|p| (mirror.reflection_score(&p, 600, 1.0), p))
        .filter(|(score, _)| *score >= config.min_score)
        .collect();
    rated.sort_by(|a, b| b.0.total_cmp(&a.0));
    distinct(rated.into_iter().map(|(_, p)| p), SAME, usize::MAX)
}

/// Keeps the first of planes whose normals are alike, up to `most`.
fn distinct(planes: impl Iterator<Item = Plane>, same: f64, most: usize) -> Vec<Plane> {
    let mut kept: Vec<Plane> = Vec::new();
    for p in planes {
        if kept.len() < most && kept.iter().all(|k| k.normal.dot(&p.normal).abs() < same) {
            kept.push(p);
        }
    }
    kept
}

/// Principal axes and frame axes, then the best of the directions over the half sphere, through the center.
fn candidates(mirror: &Mirror, config: &Config) -> Vec<Plane> {
    let through_center = |n: Vector3<f64>| Plane {
        normal: Unit::new_normalize(n),
        offset: 0.0,
    };
    let score = |p: &Plane| mirror.reflection_score(p, COARSE_POINTS, COARSE_WIDTH);
    let mut sampled: Vec<(f64, Plane)> = half_sphere(config.directions)
        .map(through_center)
        .map(|p| (score(&p), p))
        .collect();
    sampled.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best = distinct(sampled.into_iter().map(|(_, p)| p), 0.97, FOLLOWED);
    let principal = mirror.spread().symmetric_eigen().eigenvectors;
    let named = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter();
    let named = named
        .chain((0..3).map(|i| principal.column(i).into_owned()))
        .map(through_center);
    distinct(named.chain(best), SAME, usize::MAX)
}

/// Evenly spread directions with z not negative (Fibonacci lattice).
fn half_sphere(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |i| {
        let z = (i as f64 + 0.5) / count as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    })
}

fn in_mesh(mirror: &Mirror, plane: &Plane, score: f64) -> SymmetryPlane {
    // The normal's largest component is made positive, so that the same plane is always written alike.
    let n = plane.normal.into_inner();
    let sign = n[n.iamax()].signum();
    SymmetryPlane {
        normal: (n * sign).into(),
        offset: sign * (plane.offset + n.dot(&mirror.center.coords)),
        score,
    }
}

impl Mirror {
    /// Second moments of the points about the center.
    fn spread(&self) -> Matrix3<f64> {
        self.points().map(|p| p * p.transpose()).sum()
    }
}
