//! The points by which a body stands: spread over its underside so that forces and moments of a pressure come out right.

use nalgebra::{Isometry3, Vector2, Vector3};

use super::body::Frame;
use crate::lab::{ConvexPart, PartShape, Solid};

/// Gauss-Lobatto nodes and weights (sum 1) on [-1, 1], six points: the ends belong to the set, so that a body tips
/// about its true edges.
const LOBATTO: [(f64, f64); 6] = [
    (-1.0, 1.0 / 30.0),
    (-0.765_055_323_929_464_7, 0.189_237_478_148_923_5),
    (-0.285_231_516_480_645_1, 0.277_429_188_517_743_2),
    (0.285_231_516_480_645_1, 0.277_429_188_517_743_2),
    (0.765_055_323_929_464_7, 0.189_237_478_148_923_5),
    (1.0, 1.0 / 30.0),
];
/// Gauss-Radau nodes (as r²/R²) and weights of a disc, its rim included, with the number of points on each ring.
const RINGS: [(f64, f64, usize); 3] = [
    (0.155_051_025_721_682_2, 0.376_403_062_700_467_3, 8),
    (0.644_948_974_278_317_8, 0.512_485_826_188_421_6, 16),
    (1.0, 0.111_111_111_111_111_1, 16),
];
/// Faces this close to the lowest point belong to the underside, m.
const FLAT: f64 = 5e-5;
/// Cells of the grid over an underside of any outline, per side.
const CELLS: usize = 8;
/// Share of the pressure that rests on the outline of such an underside.
const OUTLINE: f64 = 0.06;

/// A point of contact, about the centre of mass, body axes.
#[derive(Clone, Debug)]
pub(crate) enum Foot {
    /// Fixed to the body, with a radius about it (0 = a point).
    Ball { at: Vector3<f64>, radius: f64 },
    /// The lowest point of a circle about `axis`: it wanders as the body rolls.
    Rim {
        at: Vector3<f64>,
        axis: Vector3<f64>,
        radius: f64,
    },
}

impl Foot {
    /// World centre and the radius about it.
    #[inline]
    pub fn place(&self, frame: &Frame) -> (Vector3<f64>, f64) {
        match self {
            Foot::Ball { at, radius } => (frame.point(at), *radius),
            Foot::Rim { at, axis, radius } => {
                let axis = frame.matrix * axis;
                let down = axis * axis.z - Vector3::z();
                (frame.point(at) + down * (radius / down.norm().max(1e-6)), 0.0)
            }
        }
    }
}

/// The feet of a body with their shares of its stiffness (they sum to 1 where the body stands on a face).
pub(crate) fn underside(solid: &Solid) -> Vec<(Foot, f64)> {
    let world_from_com = solid.world_from_body.0 * nalgebra::Translation3::from(solid.com.coords);
    let feet = match solid.parts.as_slice() {
        [part] if fits(part, solid) => of_part(solid, part),
        _ => of_mesh(solid, &world_from_com),
    };
    if !feet.is_empty() {
        return feet;
    }
    let lowest = solid
        .parts
        .iter()
        .map(|part| of_part(solid, part))
        .map(|feet| (lowest_of(&feet, &world_from_com), feet))
        .collect::<Vec<_>>();
    let floor = lowest.iter().map(|(z, _)| *z).fold(f64::INFINITY, f64::min);
    let mut feet: Vec<_> = lowest
        .into_iter()
        .filter(|(z, _)| *z < floor + FLAT)
        .flat_map(|(_, feet)| feet)
        .collect();
    let total: f64 = feet.iter().map(|(_, weight)| weight).sum();
    feet.iter_mut().for_each(|(_, weight)| *weight /= total.max(1.0));
    feet
}

/// Whether a lone piece is the shape itself (rather than the box around a surface of any form).
fn fits(part: &ConvexPart, solid: &Solid) -> bool {
    match &part.shape {
        PartShape::Box { half } => {
            let volume = 8.0 * half.product();
            solid.mesh.triangles.is_empty() || (solid.mesh.volume() - volume).abs() < 0.005 * volume
        }
        _ => true,
    }
}

/// Height of the lowest foot.
pub(crate) fn lowest_of(feet: &[(Foot, f64)], world_from_com: &Isometry3<f64>) -> f64 {
    let frame = Frame::at(world_from_com.translation.vector, world_from_com.rotation);
    feet.iter()
        .map(|(foot, _)| foot.place(&frame))
        .map(|(p, radius)| p.z - radius)
        .fold(f64::INFINITY, f64::min)
}

fn of_part(solid: &Solid, part: &ConvexPart) -> Vec<(Foot, f64)> {
    let place = part.body_from_part.0;
    let turn = solid.world_from_body.0.rotation * place.rotation;
    let down = turn.inverse_transform_vector(&-Vector3::z());
    let local = |p: Vector3<f64>| place.rotation * p + place.translation.vector - solid.com.coords;
    let point = |p: Vector3<f64>| Foot::Ball {
        at: local(p),
        radius: 0.0,
    };
    match &part.shape {
        PartShape::Sphere { radius } => vec![(
            Foot::Ball {
                at: local(Vector3::zeros()),
                radius: *radius,
            },
            1.0,
        )],
        PartShape::Cylinder { radius, half_height } if down.z.abs() < 0.05 => LOBATTO
            .iter()
            .map(|(x, weight)| {
                let at = local(Vector3::z() * (x * half_height));
                let axis = place.rotation * Vector3::z();
                (
                    Foot::Rim {
                        at,
                        axis,
                        radius: *radius,
                    },
                    *weight,
                )
            })
            .collect(),
        PartShape::Cylinder { radius, half_height } if down.z.abs() > 0.9998 => {
            disc(*radius, half_height * down.z.signum())
                .into_iter()
                .map(|(p, w)| (point(p), w))
                .collect()
        }
        PartShape::Box { half } if down.abs().max() > 0.9998 => {
            face(half, &down).into_iter().map(|(p, w)| (point(p), w)).collect()
        }
        shape => shell(shape).into_iter().map(|(p, _)| (point(p), 0.25)).collect(),
    }
}

fn disc(radius: f64, z: f64) -> Vec<(Vector3<f64>, f64)> {
    let mut points = Vec::new();
    for (ring, (square, weight, count)) in RINGS.iter().enumerate() {
        let r = radius * square.sqrt();
        for k in 0..*count {
            let angle = std::f64::consts::TAU * (k as f64 + 0.5 * ring as f64) / *count as f64;
            points.push((
                Vector3::new(r * angle.cos(), r * angle.sin(), z),
                weight / *count as f64,
            ));
        }
    }
    points
}

fn face(half: &Vector3<f64>, down: &Vector3<f64>) -> Vec<(Vector3<f64>, f64)> {
    let axis = down.iamax();
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut points = Vec::new();
    for (x, weight_x) in LOBATTO {
        for (y, weight_y) in LOBATTO {
            let mut p = Vector3::zeros();
            p[axis] = half[axis] * down[axis].signum();
            p[u] = half[u] * x;
            p[v] = half[v] * y;
            points.push((p, weight_x * weight_y));
        }
    }
    points
}

/// Points all over a piece (with a radius each), for contacts other than by the underside.
pub(crate) fn shell(shape: &PartShape) -> Vec<(Vector3<f64>, f64)> {
    match shape {
        PartShape::Sphere { radius } => vec![(Vector3::zeros(), *radius)],
        PartShape::Cylinder { radius, half_height } => (0..36)
            .map(|k| {
                let angle = std::f64::consts::TAU * f64::from(k % 12) / 12.0;
                let z = half_height * (f64::from(k / 12) - 1.0);
                (Vector3::new(radius * angle.cos(), radius * angle.sin(), z), 0.0)
            })
            .collect(),
        PartShape::Box { half } => (0..27)
            .filter(|k| *k != 13)
            .map(|k| {
                let (x, y, z) = (k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
                (
                    half.component_mul(&Vector3::new(f64::from(x), f64::from(y), f64::from(z))),
                    0.0,
                )
            })
            .collect(),
    }
}

/// The flat underside of a surface of any outline: cells of a grid weighted by their area, and the outline itself.
fn of_mesh(solid: &Solid, world_from_com: &Isometry3<f64>) -> Vec<(Foot, f64)> {
    let vertices: Vec<Vector3<f64>> = solid
        .mesh
        .vertices
        .iter()
        .map(|p| (solid.world_from_body.0 * p).coords)
        .collect();
    let floor = vertices.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    let faces: Vec<[Vector2<f64>; 3]> = (0..solid.mesh.triangles.len())
        .map(|i| solid.mesh.triangles[i].map(|v| vertices[v as usize]))
        .filter(|corners| corners.iter().all(|p| p.z < floor + FLAT))
        .map(|corners| corners.map(|p| p.xy()))
        .collect();
    let cells = cells_of(&faces);
    let corners = outline(faces.iter().flatten().copied().collect());
    if cells.is_empty() || corners.is_empty() {
        return Vec::new();
    }
    let area: f64 = cells.iter().map(|(_, area)| area).sum();
    let inner = cells.into_iter().map(|(p, a)| (p, a / area * (1.0 - OUTLINE)));
    let share = OUTLINE / corners.len() as f64;
    inner
        .chain(corners.into_iter().map(|p| (p, share)))
        .map(|(p, weight)| {
            let at = world_from_com.inverse() * nalgebra::Point3::new(p.x, p.y, floor);
            (
                Foot::Ball {
                    at: at.coords,
                    radius: 0.0,
                },
                weight,
            )
        })
        .collect()
}

/// Centroid and area of each grid cell's share of the faces, by a fine regular sample.
fn cells_of(faces: &[[Vector2<f64>; 3]]) -> Vec<(Vector2<f64>, f64)> {
    const FINE: usize = 6;
    let Some(first) = faces.first().map(|f| f[0]) else {
        return Vec::new();
    };
    let (low, high) = faces
        .iter()
        .flatten()
        .fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
    let step = (high - low) / (CELLS * FINE) as f64;
    let mut cells = vec![(Vector2::zeros(), 0.0); CELLS * CELLS];
    for i in 0..CELLS * FINE {
        for j in 0..CELLS * FINE {
            let p = low + step.component_mul(&Vector2::new(i as f64 + 0.5, j as f64 + 0.5));
            if faces.iter().any(|face| covers(face, &p)) {
                let cell = &mut cells[i / FINE * CELLS + j / FINE];
                cell.0 += p;
                cell.1 += 1.0;
            }
        }
    }
    cells.retain(|(_, count)| *count > 0.0);
    cells.into_iter().map(|(sum, count)| (sum / count, count)).collect()
}

fn covers(face: &[Vector2<f64>; 3], p: &Vector2<f64>) -> bool {
    let side = |a: &Vector2<f64>, b: &Vector2<f64>| (b - a).perp(&(p - a));
    let s = [
        side(&face[0], &face[1]),
        side(&face[1], &face[2]),
        side(&face[2], &face[0]),
    ];
    s.iter().all(|x| *x >= 0.0) || s.iter().all(|x| *x <= 0.0)
}

/// Convex hull (Andrew's monotone chain), thinned to at most 24 corners.
fn outline(mut points: Vec<Vector2<f64>>) -> Vec<Vector2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup_by(|a, b| (*a - *b).norm() < 1e-6);
    let mut hull: Vec<Vector2<f64>> = Vec::new();
    for pass in 0..2 {
        let start = hull.len();
        for p in &points {
            while hull.len() >= start + 2
                && (hull[hull.len() - 1] - hull[hull.len() - 2]).perp(&(p - hull[hull.len() - 1])) <= 1e-12
            {
                hull.pop();
            }
            hull.push(*p);
        }
        hull.pop();
        if pass == 0 {
            points.reverse();
        }
    }
    let every = hull.len().div_ceil(24).max(1);
    hull.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressure_moments_of_face_and_disc_are_exact() {
        let half = Vector3::new(0.03, 0.05, 0.02);
        let square: f64 = face(&half, &-Vector3::z()).iter().map(|(p, w)| w * p.y * p.y).sum();
        assert!((square - 0.05f64.powi(2) / 3.0).abs() < 1e-12);
        let points = disc(0.04, 0.0);
        let mean: f64 = points.iter().map(|(p, w)| w * p.norm()).sum();
        let square: f64 = points.iter().map(|(p, w)| w * p.norm_squared()).sum();
        assert!((mean / 0.04 - 2.0 / 3.0).abs() < 0.005);
        assert!((square - 0.04f64.powi(2) / 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_outline_of_a_square_has_its_corners() {
        let points = [(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (1.0, 1.0), (0.0, 1.0), (0.5, 0.0)];
        let hull = outline(points.iter().map(|(x, y)| Vector2::new(*x, *y)).collect());
        assert_eq!(hull.len(), 4);
    }
}
