//! Feet: where the friction of a thing on the table acts, so that it resists turning as it was measured to.
//!
//! An engine lets a flat face rest on its outermost corners, and a thing that rests there resists turning far more than one
//! whose weight is spread out. What pushes tell is the torsional radius c of a patch (as `physics::Between` has it). A ring of equal
//! loads of radius r has the same largest torque where r = c; while it slides and hardly turns its torque is
//! `mu W r² omega / (2 v)` beside the patch's `0.44 mu W c² omega / v`, the same where r = 0.94 c. The ring is between the two.
//!
//! The ring stands out from the face by less than anybody could measure, so that a thing that tips still tips about its
//! own edge. Where the ring would reach that edge there is none: the corners do as well.

use nalgebra::{Point3, UnitVector3, Vector2, Vector3};

use super::scene::{Floor, Part};
use crate::twin::Model;

/// How many feet: fewer have a limit surface that depends on how they stand to the motion.
const FEET: usize = 8;
/// Radius of the ring over the torsional radius.
const RING: f64 = 0.97;
/// Directions in which the least rectangle is looked for.
const TURNS: usize = 90;
/// Share of the mean distance of the face's edge beyond which a ring says no more than the corners.
const EDGE: f64 = 0.95;
/// Radius of a foot, m, and how far it stands out of the face, m.
pub(super) const RADIUS: f64 = 3e-3;
const OUT: f64 = 1e-4;
/// Corners within this of the lowest one stand on the table, m; a thing stands on it where its lowest corner is as near.
const FACE: f64 = 2e-3;
/// No ring is smaller, m: it would not carry.
const SMALLEST: f64 = 5e-3;

/// What an engine makes of a face that rests on the table.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Corners {
    /// It rests on all its corners.
    All,
    /// It rests on a few of them.
    Few,
    /// As on all of them, but for a face of which no resistance to turning is known: MuJoCo rests a mesh on the lowest corner
    /// and its neighbours, others from step to step, and what bears a load beside its middle walks on them.
    Bearing,
}

/// Centres of the feet of a part in its frame; none where its torsional radius is not known, where it does not stand on the
/// table at the first view, or where it was pressed and found soft.
///
/// Where the ring would reach the edge there is none, unless `corners` says that the engine has no face with all its corners:
/// then the thing stands on the outermost ones, as it does in engines that have them all.
pub(super) fn feet(part: &Part, model: &Model, floor: Option<&Floor>, corners: Corners) -> Vec<Point3<f64>> {
    let (Some(floor), None) = (floor, part.surface.compliance) else {
        return Vec::new();
    };
    let known = part.surface.torsional_radius;
    let few = corners == Corners::Few || (corners == Corners::Bearing && known.is_none());
    let Some(radius) = known.or((corners == Corners::Bearing).then_some(f64::INFINITY)) else {
        return Vec::new();
    };
    let back = part.world_from_part.rotation.inverse();
    let up = UnitVector3::new_normalize(back * floor.normal.into_inner());
    let meshes = part.hulls.iter().filter_map(|path| model.meshes.get(path));
    let points: Vec<Vector3<f64>> = meshes
        .flat_map(|m| &m.vertices)
        .map(|v| v.coords + part.link_origin)
        .collect();
    let lowest = points.iter().map(|c| c.dot(&up)).fold(f64::INFINITY, f64::min);
    let table = (part.world_from_part.inverse() * Point3::from(floor.point))
        .coords
        .dot(&up);
    if radius < SMALLEST || (lowest - table).abs() > FACE {
        return Vec::new();
    }
    let across = up
        .cross(&if up.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() })
        .normalize();
    let third = up.cross(&across);
    let flat = |v: &Vector3<f64>| Vector2::new(v.dot(&across), v.dot(&third));
    let centre = flat(&part.com);
    let face = points
        .iter()
        .filter(|c| c.dot(&up) < lowest + FACE)
        .map(|c| flat(c) - centre);
    let Some(outline) = outline(face.collect()) else {
        return Vec::new();
    };
    let heading = |k: usize| {
        let angle = std::f64::consts::TAU * (k as f64 + 0.5) / FEET as f64;
        Vector2::new(angle.cos(), angle.sin())
    };
    let mean = (0..FEET).map(|k| edge(&outline, &heading(k))).sum::<f64>() / FEET as f64;
    let inside = |k: usize| heading(k) * (RING * radius).min(edge(&outline, &heading(k)));
    let feet: Vec<Vector2<f64>> = match RING * radius <= EDGE * mean {
        true => (0..FEET).map(inside).collect(),
        false if few => outermost(&outline),
        false => Vec::new(),
    };
    let foot = |at: &Vector2<f64>| {
        let at = centre + at;
        Point3::from(across * at.x + third * at.y + up.into_inner() * (lowest + RADIUS - OUT))
    };
    feet.iter().map(foot).collect()
}

/// The corners of an outline that lie outermost along the diagonals of the least rectangle about it.
fn outermost(outline: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let extent = |axis: &Vector2<f64>| {
        let along = outline.iter().map(|p| p.dot(axis));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    let turned = |k: usize| {
        let angle = std::f64::consts::FRAC_PI_2 * k as f64 / TURNS as f64;
        let axis = Vector2::new(angle.cos(), angle.sin());
        (axis, Vector2::new(-axis.y, axis.x))
    };
    let rectangles = (0..TURNS).map(turned).map(|(a, b)| (a, b, extent(&a), extent(&b)));
    let Some((a, b, long, wide)) = rectangles.min_by(|p, q| (p.2 * p.3).total_cmp(&(q.2 * q.3))) else {
        return Vec::new();
    };
    let mut found: Vec<Vector2<f64>> = Vec::new();
    for (u, v) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
        let towards = a * (u / long) + b * (v / wide);
        let far = outline
            .iter()
            .max_by(|p, q| p.dot(&towards).total_cmp(&q.dot(&towards)));
        found.extend(far.filter(|p| !found.contains(p)).copied());
    }
    found
}

/// The convex outline of points, counterclockwise (Andrew 1979); nothing unless the origin lies within it.
fn outline(mut points: Vec<Vector2<f64>>) -> Option<Vec<Vector2<f64>>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for p in points {
            while let [.., a, b] = chain.as_slice() {
                if (b - a).perp(&(p - b)) > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut outline = half(&mut points.iter().copied());
    outline.extend(half(&mut points.iter().rev().copied()));
    let next = |i: usize| outline[(i + 1) % outline.len()];
    let within = (0..outline.len()).all(|i| outline[i].perp(&next(i)) > 0.0);
    (outline.len() > 2 && within).then_some(outline)
}

/// How far it is from the origin to the outline, m.
fn edge(outline: &[Vector2<f64>], heading: &Vector2<f64>) -> f64 {
    let reach = |i: usize| {
        let (a, b) = (outline[i], outline[(i + 1) % outline.len()]);
        let side = b - a;
        let speed = heading.perp(&side);
        (speed > 0.0).then(|| a.perp(&side) / speed)
    };
    (0..outline.len()).filter_map(reach).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_of_a_square_is_found_and_a_centre_beside_it_refused() {
        let corners = |x: f64| {
            let at = |a: f64, b: f64| Vector2::new(x + a, b);
            vec![at(-1.0, -1.0), at(1.0, -1.0), at(0.3, 0.2), at(1.0, 1.0), at(-1.0, 1.0)]
        };
        let square = outline(corners(0.0)).expect("the origin is within");
        assert_eq!(square.len(), 4);
        assert!((edge(&square, &Vector2::x()) - 1.0).abs() < 1e-12);
        let diagonal = Vector2::new(0.5, 0.5).normalize();
        assert!((edge(&square, &diagonal) - 2f64.sqrt()).abs() < 1e-12);
        assert!(outline(corners(3.0)).is_none());
        let found = outermost(&square);
        assert!(found.len() == 4 && found.iter().all(|p| (p.norm() - 2f64.sqrt()).abs() < 1e-12));
    }
}
