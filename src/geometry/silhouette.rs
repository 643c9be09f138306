//! Outlines: a solid's shadow along a direction.

use nalgebra::{Point2, Point3, Vector3};

use super::Mesh;

/// A binary picture of what a mesh covers, seen without perspective.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Silhouette {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Row by row from the top left: 255 covered, 0 not.
    pub mask: Vec<u8>,
}

/// Pixels left free around the shape.
const MARGIN: f64 = 2.0;

/// The shadow of `mesh` looked at along `direction`, with `up` upward in the picture; the longer side gets `pixels`.
/// Nothing where the mesh is empty, has no extent, or `up` runs along `direction`.
pub fn silhouette(mesh: &Mesh, direction: Vector3<f64>, up: Vector3<f64>, pixels: usize) -> Option<Silhouette> {
    let forward = direction.try_normalize(0.0)?;
    let right = forward.cross(&up).try_normalize(1e-9)?;
    let down = forward.cross(&right);
    let flat = |p: &Point3<f64>| Point2::new(p.coords.dot(&right), p.coords.dot(&down));
    let points: Vec<_> = mesh.vertices.iter().map(flat).collect();
    let first = *points.first()?;
    let (lo, hi) = points.iter().fold((first, first), |(lo, hi), p| (lo.inf(p), hi.sup(p)));
    let extent = hi - lo;
    let scale = (pixels as f64 - 2.0 * MARGIN) / extent.max();
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let side = |length: f64| ((length * scale + 2.0 * MARGIN).ceil() as usize).clamp(1, pixels);
    let mut picture = Silhouette {
        width: side(extent.x),
        height: side(extent.y),
        mask: Vec::new(),
    };
    picture.mask = vec![0; picture.width * picture.height];
    for t in &mesh.triangles {
        let corners = t.map(|v| (points[v as usize] - lo) * scale);
        fill(&mut picture, corners.map(|c| [c.x + MARGIN, c.y + MARGIN]));
    }
    Some(picture)
}

/// Marks the pixels whose centres lie in a triangle (either way round), by edge functions (Pineda 1988).
fn fill(picture: &mut Silhouette, [a, b, c]: [[f64; 2]; 3]) {
    let range = |axis: usize, limit: usize| {
        let lo = a[axis].min(b[axis]).min(c[axis]).floor().max(0.0) as usize;
        let hi = a[axis].max(b[axis]).max(c[axis]).ceil().max(0.0) as usize;
        lo..hi.min(limit)
    };
    let edge = |p: [f64; 2], q: [f64; 2], x: f64, y: f64| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
    for row in range(1, picture.height) {
        for column in range(0, picture.width) {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let sides = [edge(a, b, x, y), edge(b, c, x, y), edge(c, a, x, y)];
            if sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0) {
                picture.mask[row * picture.width + column] = 255;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::{cuboid, torus};

    fn covered(s: &Silhouette) -> f64 {
        s.mask.iter().filter(|m| **m > 0).count() as f64
    }

    #[test]
    fn a_box_fills_its_rectangle_and_a_ring_keeps_its_hole() {
        let front = silhouette(&cuboid([0.1, 0.3, 0.2]), Vector3::y(), Vector3::z(), 204).unwrap();
        assert_eq!((front.width, front.height), (104, 204));
        assert!((covered(&front) / 20_000.0 - 1.0).abs() < 0.02);
        let top = silhouette(&torus(0.05, 0.01, 64, 32), -Vector3::z(), Vector3::y(), 124).unwrap();
        assert_eq!(top.mask[62 * top.width + 62], 0);
        let ring = std::f64::consts::PI * (60.0 * 60.0 - 40.0 * 40.0);
        assert!((covered(&top) / ring - 1.0).abs() < 0.02);
    }

    #[test]
    fn the_picture_is_upright() {
        let mut mesh = cuboid([0.1, 0.1, 0.1]);
        mesh.vertices.iter_mut().filter(|v| v.z > 0.0).for_each(|v| v.x *= 0.2);
        let s = silhouette(&mesh, Vector3::y(), Vector3::z(), 100).unwrap();
        let row = |y: usize| {
            s.mask[y * s.width..(y + 1) * s.width]
                .iter()
                .filter(|m| **m > 0)
                .count()
        };
        assert!(row(10) < row(90));
    }
}
