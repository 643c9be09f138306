//! Things turned about z, such as mugs and bowls, and the handle of a mug.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::Point3;

use super::surface::{SIDES, outward, quad};
use crate::geometry::Mesh;

/// A radius below this lies on the axis, m.
const ON_AXIS: f64 = 1e-9;
/// Rings along a handle and sides of its tube.
const RINGS: usize = 32;
const TUBE_SIDES: usize = 20;

/// A profile of (radius, z) that starts and ends on the axis, turned about z.
pub(super) fn turned(profile: &[[f64; 2]]) -> Mesh {
    let mut vertices = Vec::new();
    let mut rings = Vec::with_capacity(profile.len());
    for &[r, z] in profile {
        let sides = if r < ON_AXIS { 1 } else { SIDES };
        rings.push((vertices.len(), sides));
        vertices.extend((0..sides).map(|i| {
            let angle = TAU * i as f64 / SIDES as f64;
            Point3::new(r * angle.cos(), r * angle.sin(), z)
        }));
    }
    let mut triangles = Vec::new();
    for pair in rings.windows(2) {
        triangles.extend(band(pair[0], pair[1]));
    }
    outward(vertices, triangles)
}

/// The triangles between two rings, each (first vertex, number of vertices); a ring of one is a pole.
fn band(lower: (usize, usize), upper: (usize, usize)) -> Vec<[u32; 3]> {
    let at = |(start, sides): (usize, usize), i: usize| (start + i % sides) as u32;
    let mut triangles = Vec::new();
    for i in 0..SIDES {
        let [a, b, c, d] = [at(lower, i), at(lower, i + 1), at(upper, i + 1), at(upper, i)];
        if a != b {
            triangles.push([a, b, c]);
        }
        if c != d {
            triangles.push([a, c, d]);
        }
    }
    triangles
}

/// Outer and inner radius of the wall at height `z`; the inner one is 0 where it is filled, both are 0 outside.
pub(super) fn wall(profile: &[[f64; 2]], z: f64) -> (f64, f64) {
    let mut radii: Vec<f64> = profile
        .windows(2)
        .filter(|w| (w[0][1] <= z) != (w[1][1] <= z))
        .map(|w| w[0][0] + (w[1][0] - w[0][0]) * (z - w[0][1]) / (w[1][1] - w[0][1]))
        .collect();
    radii.sort_by(f64::total_cmp);
    let outer = radii.pop().unwrap_or(0.0);
    (outer, radii.pop().unwrap_or(0.0))
}

/// Where the centre line of a handle is at `angle` (π/2 = its upper root, -π/2 = its lower one), frame of the mug.
fn center_line(profile: &[[f64; 2]], [ring, _, height]: [f64; 3], angle: f64) -> Point3<f64> {
    let (outer, _) = wall(profile, height);
    Point3::new(outer + ring * angle.cos(), 0.0, height + ring * angle.sin())
}

/// A half ring of tube on the +x side whose ends are rooted in the middle of the wall, so that nothing of it shows
/// inside the mug.
pub(super) fn handle(profile: &[[f64; 2]], spec: [f64; 3]) -> Mesh {
    let mut vertices = Vec::new();
    for k in 0..=RINGS {
        let angle = FRAC_PI_2 - PI * k as f64 / RINGS as f64;
        let section = tube_section(center_line(profile, spec, angle), spec[1], angle);
        if k == 0 {
            vertices.extend(section.iter().map(|p| rooted(profile, spec[1], *p)));
        }
        vertices.extend(&section);
        if k == RINGS {
            vertices.extend(section.iter().map(|p| rooted(profile, spec[1], *p)));
        }
    }
    let last = vertices.len() - TUBE_SIDES;
    let mut triangles = Vec::new();
    for start in (0..last).step_by(TUBE_SIDES) {
        for i in 0..TUBE_SIDES {
            let j = (i + 1) % TUBE_SIDES;
            triangles.extend(quad(
                start + i,
                start + j,
                start + TUBE_SIDES + j,
                start + TUBE_SIDES + i,
            ));
        }
    }
    for i in 1..TUBE_SIDES - 1 {
        triangles.push([0, (i + 1) as u32, i as u32]);
        triangles.push([last as u32, (last + i) as u32, (last + i + 1) as u32]);
    }
    outward(vertices, triangles)
}

fn tube_section(center: Point3<f64>, tube: f64, angle: f64) -> Vec<Point3<f64>> {
    (0..TUBE_SIDES)
        .map(|i| {
            let (s, c) = (TAU * i as f64 / TUBE_SIDES as f64).sin_cos();
            center + nalgebra::Vector3::new(c * angle.cos(), s, c * angle.sin()) * tube
        })
        .collect()
}

/// The point moved along x into the middle of the wall (or a tube's radius deep where the wall is thick).
fn rooted(profile: &[[f64; 2]], tube: f64, p: Point3<f64>) -> Point3<f64> {
    let (outer, inner) = wall(profile, p.z);
    let radius = outer - (0.5 * (outer - inner)).min(tube);
    let x = (radius * radius - p.y * p.y).max(0.0).sqrt();
    Point3::new(x.min(p.x), p.y, p.z)
}

/// The centre line of a handle as short straight pieces, for contact.
pub(super) fn handle_pieces(profile: &[[f64; 2]], spec: [f64; 3], pieces: usize) -> Vec<[Point3<f64>; 2]> {
    let at = |k: usize| center_line(profile, spec, FRAC_PI_2 - PI * k as f64 / pieces as f64);
    (0..pieces).map(|k| [at(k), at(k + 1)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_handle_shows_outside_the_wall_only() {
        let profile = [
            [0.0, 0.0],
            [0.04, 0.0],
            [0.04, 0.09],
            [0.036, 0.09],
            [0.036, 0.005],
            [0.0, 0.005],
        ];
        let mesh = handle(&profile, [0.022, 0.005, 0.045]);
        for p in &mesh.vertices {
            assert!(p.x.hypot(p.y) > 0.0375, "{p} shows inside");
        }
        let (_, high) = mesh.bounds().expect("not empty");
        assert!((high.x - 0.067).abs() < 1e-9);
    }

    #[test]
    fn the_wall_of_a_mug_has_two_radii() {
        let profile = [
            [0.0, 0.0],
            [0.04, 0.0],
            [0.04, 0.09],
            [0.036, 0.09],
            [0.036, 0.005],
            [0.0, 0.005],
        ];
        assert_eq!(wall(&profile, 0.05), (0.04, 0.036));
        assert_eq!(wall(&profile, 0.002), (0.04, 0.0));
        assert_eq!(wall(&profile, 0.2), (0.0, 0.0));
    }
}
