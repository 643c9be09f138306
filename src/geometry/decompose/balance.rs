//! Faces that bridge a hollow are moved to where they leave out as much matter as they take in of the hollow.

use nalgebra::Point3;
use rand::Rng;

use super::piece::Piece;
use crate::base::{Seed, rng_for};
use crate::geometry::hull::face_planes;
use crate::geometry::{Mesh, Plane, SurfaceDistance};

/// Points by which a hull's matter and hollow are weighed.
const SAMPLES: usize = 2500;
/// Draws for them.
const DRAWS: usize = 20_000;
/// Faces that are moved, at most.
const MOVES: usize = 8;
/// Share of the points that a move must gain.
const LEAST_GAIN: f64 = 0.004;

/// Moves faces of a hull inward by up to `limit`, m, while the union of hull and matter loses less than it gains.
/// A face on the surface itself has no hollow behind it and stays.
pub(super) fn balance(hull: Mesh, surface: &SurfaceDistance, limit: f64) -> Mesh {
    let mut points = inside(&hull, surface);
    let least = LEAST_GAIN * points.len() as f64;
    let mut hull = hull;
    for _ in 0..MOVES {
        let Some(plane) = best_move(&hull, &points, limit, least) else {
            break;
        };
        let Some(smaller) = below(&hull, &plane) else { break };
        points.retain(|(p, _)| plane.height(p) < 0.0);
        hull = smaller;
    }
    hull
}

/// Points of the hull, each with whether it is of the matter.
fn inside(hull: &Mesh, surface: &SurfaceDistance) -> Vec<(Point3<f64>, bool)> {
    let Some((lo, hi)) = hull.bounds() else {
        return Vec::new();
    };
    let planes = face_planes(hull);
    let mut rng = rng_for(Seed(0), "balance");
    (0..DRAWS)
        .map(|_| lo + (hi - lo).map(|side| side * rng.random::<f64>()))
        .filter(|p| planes.iter().all(|(n, d)| n.dot(&p.coords) <= *d))
        .take(SAMPLES)
        .map(|p| (p, surface.signed_or_guessed(&p) < 0.0))
        .collect()
}

fn best_move(hull: &Mesh, points: &[(Point3<f64>, bool)], limit: f64, least: f64) -> Option<Plane> {
    let mut best: Option<(f64, Plane)> = None;
    for (normal, offset) in face_planes(hull) {
        let mut depths: Vec<(f64, bool)> = points
            .iter()
            .map(|(p, matter)| (offset - normal.dot(&p.coords), *matter))
            .filter(|(depth, _)| *depth < limit)
            .collect();
        depths.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut gain = 0.0;
        for (depth, matter) in depths {
            gain += if matter { -1.0 } else { 1.0 };
            if gain > best.map_or(least, |b| b.0) {
                let normal = nalgebra::UnitVector3::new_unchecked(normal);
                best = Some((
                    gain,
                    Plane {
                        normal,
                        offset: offset - depth,
                    },
                ));
            }
        }
    }
    best.map(|b| b.1)
}

fn below(hull: &Mesh, plane: &Plane) -> Option<Mesh> {
    let pieces = Piece::new(hull.clone())?.cut(plane);
    let under = |p: &&Piece| p.hull.vertices.iter().all(|v| plane.height(v) < 2e-6);
    pieces.iter().find(under).map(|p| p.hull.clone())
}
