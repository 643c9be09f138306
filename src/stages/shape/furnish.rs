//! What simulators need of a shape: fewer triangles, convex parts, a superquadric.

use rayon::prelude::*;

use super::seat::seat_stacks;
use super::{Config, ShapedObject, Shapes};
use crate::base::Notices;
use crate::geometry::{DecompositionConfig, convex_parts, is_closed_manifold, simplify, superquadric_fit};
use crate::twin::Superquadric;

/// Triangles above which a mesh is simplified further, as far as noisy views allow.
const MOST_TRIANGLES: usize = 20_000;
/// How far such simplification may move a surface, voxels.
const MOST_ERROR: f64 = 0.75;
/// Simplifies every mesh within a fraction of a voxel and adds its convex parts and superquadric.
pub fn furnish(shapes: &mut Shapes, config: &Config, notices: &mut Notices) {
    shapes
        .objects
        .par_iter_mut()
        .for_each(|object| furnish_one(object, config));
    seat_stacks(shapes, config.voxel);
    for object in &shapes.objects {
        if let Err(fault) = is_closed_manifold(&object.mesh) {
            notices.warn("shape", &object.name, format!("its mesh is not closed: {fault}"));
        }
        if object.collision.is_empty() {
            notices.warn(
                "shape",
                &object.name,
                "no convex parts could be made: it has nothing to touch with",
            );
        }
    }
}

fn furnish_one(object: &mut ShapedObject, config: &Config) {
    let mut error = config.simplification * config.voxel;
    let mut fewer = simplify(&object.mesh, error);
    while fewer.triangles.len() > MOST_TRIANGLES && error < MOST_ERROR * config.voxel {
        error *= 1.5;
        fewer = simplify(&fewer, error);
    }
    if is_closed_manifold(&fewer).is_ok() || is_closed_manifold(&object.mesh).is_err() {
        object.mesh = fewer;
    }
    object.collision = convex_parts(&object.mesh, &DecompositionConfig::default());
    object.superquadric = superquadric_fit(&object.mesh).map(|fit| Superquadric {
        size: fit.size,
        exponents: fit.exponents,
        pose: fit.pose,
        residual: Some(fit.residual),
    });
}
