//! Principal views: front, side and top in the frame that a thing's symmetry and its posture give it.

use nalgebra::Vector3;

use crate::geometry::{Mesh, Silhouette, silhouette};
use crate::twin::SymmetryPlane;

/// Pixels of the longer side of a silhouette.
const PIXELS: usize = 256;
/// Largest cosine between a plane's normal and the upward direction at which the plane still stands upright.
const UPRIGHT: f64 = 0.2;

/// Silhouettes of `mesh`, standing with `up` (link frame) upward: `front` looks along the best upright plane of
/// `symmetry`, so that both halves of the picture are alike, `side` looks square onto that plane, `top` looks down with
/// the front below. Without such a plane `front` looks along `ahead` (link frame).
pub fn principal_views(
    mesh: &Mesh,
    up: Vector3<f64>,
    ahead: Vector3<f64>,
    symmetry: &[SymmetryPlane],
) -> Vec<(&'static str, Silhouette)> {
    let front = front_of(up, ahead, symmetry);
    let side = up.cross(&front);
    let looks = [("front", front, up), ("side", side, up), ("top", -up, front)];
    let drawn = looks.map(|(name, look, upward)| Some((name, silhouette(mesh, look, upward, PIXELS)?)));
    drawn.into_iter().flatten().collect()
}

/// The level direction of the front view.
fn front_of(up: Vector3<f64>, ahead: Vector3<f64>, symmetry: &[SymmetryPlane]) -> Vector3<f64> {
    let upright = symmetry
        .iter()
        .map(|plane| Vector3::from(plane.normal))
        .find(|normal| normal.dot(&up).abs() < UPRIGHT);
    let Some(normal) = upright else { return ahead };
    let along = normal.cross(&up).normalize();
    // Of the two ways along the plane the one that is nearer to the way given.
    if along.dot(&ahead) < 0.0 { -along } else { along }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::cuboid;

    #[test]
    fn a_turned_box_is_drawn_square_to_its_own_plane() {
        let (s, c) = 0.5_f64.sin_cos();
        let turn = nalgebra::Isometry3::rotation(Vector3::z() * 0.5);
        let mesh = cuboid([0.2, 0.1, 0.05]).transformed(&turn);
        let plane = |normal: [f64; 3]| SymmetryPlane {
            normal,
            ..serde_json::from_str(r#"{"normal": [1, 0, 0], "offset": 0, "score": 1}"#).expect("a plane")
        };
        // The level plane of the box comes first and does not serve.
        let planes = [plane([0.0, 0.0, 1.0]), plane([c, s, 0.0])];
        let views = principal_views(&mesh, Vector3::z(), Vector3::y(), &planes);
        let sizes: Vec<_> = views.iter().map(|(name, v)| (*name, v.width, v.height)).collect();
        // Front sees 200 x 50, side 100 x 50, top 200 x 100, in a picture of 256 with 2 free on each side.
        for ((name, width, height), wanted) in sizes.iter().zip([("front", 67), ("side", 130), ("top", 130)]) {
            assert!(
                *name == wanted.0 && *width == 256 && height.abs_diff(wanted.1) <= 1,
                "{sizes:?}"
            );
        }
        let loose = principal_views(&mesh, Vector3::z(), Vector3::y(), &[]);
        assert!(loose[2].1.height > 150, "without a plane the picture is askew");
    }
}
