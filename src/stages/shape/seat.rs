//! Contact faces of stacked things, made flat: range views round off the seam between two things by a voxel,
//! and convex parts that overlap there would throw a stack over.

use nalgebra::{Point3, UnitQuaternion, Vector3};

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
    let count = shapes.objects.len();
    let pairs = (0..count).flat_map(|lower| (0..count).map(move |upper| (lower, upper)));
    let seams: Vec<(usize, usize, f64)> = pairs
        .filter_map(|(lower, upper)| {
            let height = seam(&shapes.objects[lower], &shapes.objects[upper], &up, voxel)?;
            Some((lower, upper, height))
        })
        .collect();
    if let Some(ground) = shapes.support.as_ref().map(|s| Vector3::from(s.point).dot(&up)) {
        for (i, object) in shapes.objects.iter_mut().enumerate() {
            let carries = seams.iter().any(|(lower, _, _)| *lower == i);
            if (heights(object, &up).0 - ground).abs() < voxel {
                let side = if carries { Side::Above } else { Side::OnSupport };
                level(object, &up, ground, REACH * voxel, side);
            }
        }
    }
    for (lower, upper, height) in seams {
        level(&mut shapes.objects[lower], &up, height, REACH * voxel, Side::Below);
        level(&mut shapes.objects[upper], &up, height, REACH * voxel, Side::Above);
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Below,
    Above,
    /// Above the support, and nothing stands on it.
    OnSupport,
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
            let world = part.vertices.iter().map(|v| object.world_from_link.0 * v);
            let above = |p: &Point3<f64>| p.coords.dot(up) - height;
            let (near, far): (Vec<Point3<f64>>, Vec<Point3<f64>>) = world.partition(|p| match side {
                Side::Below => above(p) > -reach,
                Side::Above | Side::OnSupport => above(p) < reach,
            });
            let face: Vec<Point3<f64>> = near.iter().map(|p| p - up * above(p)).collect();
            let face = if side == Side::OnSupport {
                face
            } else {
                corners(&face, up)
            };
            let points = face.into_iter().chain(far).map(|p| into_link * p);
            // A part that lies wholly in the seam has no body left: it stays as it was.
            convex_hull(&points.collect::<Vec<_>>()).unwrap_or(part)
        })
        .collect::<Vec<Mesh>>();
}

/// The points of a level face that reach furthest in eight directions: where two hulls meet an engine takes any four of
/// many nearly collinear points for contacts, and what stands on three of them rocks and creeps.
fn corners(face: &[Point3<f64>], up: &Vector3<f64>) -> Vec<Point3<f64>> {
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), up).unwrap_or_else(UnitQuaternion::identity);
    let mut kept: Vec<usize> = (0..8)
        .filter_map(|k| {
            let angle = (f64::from(k) + 0.5) * std::f64::consts::FRAC_PI_4;
            let way = turn * Vector3::new(angle.cos(), angle.sin(), 0.0);
            let reach = |i: &usize| face[*i].coords.dot(&way);
            (0..face.len()).max_by(|a, b| reach(a).total_cmp(&reach(b)))
        })
        .collect();
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|i| face[i]).collect()
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
            texture: None,
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
