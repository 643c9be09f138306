//! Contact faces of stacked things, made flat: range views round off the seam between two things by a voxel,
//! and convex parts that overlap there would throw a stack over.

use nalgebra::{Point3, Vector3};

use super::{ShapedObject, Shapes};
use crate::geometry::{Mesh, convex_hull};

/// Parts within this distance of a seam are brought to it, voxels.
const REACH: f64 = 1.75;
/// Things whose faces are closer than this may be stacked, voxels.
const NEAR: f64 = 4.0;

/// Brings the convex parts on both sides of every level seam between two things to one plane, and the feet of
/// what stands on the support to its plane.
pub fn seat_stacks(shapes: &mut Shapes, voxel: f64) {
    let up = shapes
        .support
        .as_ref()
        .map_or_else(Vector3::z, |s| Vector3::from(s.normal));
    if let Some(ground) = shapes.support.as_ref().map(|s| Vector3::from(s.point).dot(&up)) {
        for object in &mut shapes.objects {
            if (heights(object, &up).0 - ground).abs() < voxel {
                level(object, &up, ground, REACH * voxel, Side::Above);
            }
        }
    }
    for lower in 0..shapes.objects.len() {
        for upper in 0..shapes.objects.len() {
            if let Some(height) = seam(&shapes.objects[lower], &shapes.objects[upper], &up, voxel) {
                level(&mut shapes.objects[lower], &up, height, REACH * voxel, Side::Below);
                level(&mut shapes.objects[upper], &up, height, REACH * voxel, Side::Above);
            }
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Below,
    Above,
}

fn world(object: &ShapedObject) -> impl Iterator<Item = Point3<f64>> + '_ {
    object.mesh.vertices.iter().map(|v| object.world_from_link.0 * v)
}

fn heights(object: &ShapedObject, up: &Vector3<f64>) -> (f64, f64) {
    world(object)
        .map(|p| p.coords.dot(up))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)))
}

/// The height of the seam where `upper` stands on the top of `lower`.
fn seam(lower: &ShapedObject, upper: &ShapedObject, up: &Vector3<f64>, voxel: f64) -> Option<f64> {
    let ((foot, top), (bottom, head)) = (heights(lower, up), heights(upper, up));
    let stacked = (bottom - top).abs() < NEAR * voxel && head > top && bottom > foot + NEAR * voxel;
    if !stacked {
        return None;
    }
    let centre = |o: &ShapedObject| {
        o.mesh
            .bounds()
            .map(|(lo, hi)| o.world_from_link.0 * nalgebra::center(&lo, &hi))
    };
    let apart = centre(upper)? - centre(lower)?;
    let aside = (apart - up * apart.dot(up)).norm();
    let reach = world(lower).map(|p| {
        let arm = p - centre(lower).unwrap_or_default();
        (arm - up * arm.dot(up)).norm()
    });
    (aside < reach.fold(0.0, f64::max)).then_some(0.5 * (bottom + top))
}

/// Moves the points of the convex parts that are near or beyond the seam onto it.
fn level(object: &mut ShapedObject, up: &Vector3<f64>, height: f64, reach: f64, side: Side) {
    let into_link = object.world_from_link.0.inverse();
    let parts = std::mem::take(&mut object.collision);
    object.collision = parts
        .into_iter()
        .map(|part| {
            let moved = part.vertices.iter().map(|v| {
                let p = object.world_from_link.0 * v;
                let above = p.coords.dot(up) - height;
                let near = if side == Side::Below {
                    above > -reach
                } else {
                    above < reach
                };
                into_link * (if near { p - up * above } else { p })
            });
            // A part that lies wholly in the seam has no body left: it stays as it was.
            convex_hull(&moved.collect::<Vec<_>>()).unwrap_or(part)
        })
        .collect::<Vec<Mesh>>();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Pose;
    use crate::geometry::solids::cuboid;

    fn thing(name: &str, size: [f64; 3], z: f64) -> ShapedObject {
        let mesh = cuboid(size);
        ShapedObject {
            name: name.into(),
            world_from_link: Pose(nalgebra::Isometry3::translation(0.0, 0.0, z)),
            collision: vec![mesh.clone()],
            mesh,
            seen: 1.0,
            superquadric: None,
        }
    }

    #[test]
    fn overlapping_parts_of_a_stack_meet_in_one_plane() {
        let objects = vec![
            thing("low", [0.1, 0.1, 0.061], 0.0305),
            thing("top", [0.06, 0.06, 0.04], 0.079),
        ];
        let mut shapes = Shapes {
            objects,
            ..Shapes::default()
        };
        seat_stacks(&mut shapes, 0.002);
        let heights = |i: usize| {
            let o: &ShapedObject = &shapes.objects[i];
            let z = o.collision[0]
                .vertices
                .iter()
                .map(|v| v.z + o.world_from_link.translation.z);
            z.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)))
        };
        assert!((heights(0).1 - 0.06).abs() < 1e-9 && (heights(1).0 - 0.06).abs() < 1e-9);
        assert!(heights(0).0.abs() < 1e-9 && (heights(1).1 - 0.099).abs() < 1e-9);
    }
}
