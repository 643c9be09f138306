//! Where no support is given the scene may be a room: its walls are told from the things in it.

use nalgebra::{Point3, UnitVector3, Vector3};
use rand::Rng;

use super::range::Range;
use crate::base::{Notices, Seed, rng_for};
use crate::geometry::{Mesh, Plane, submesh, vertex_normals};

/// Least area, m², and least length both ways, m, of a wall.
const LEAST_AREA: f64 = 0.0225;
const LEAST_LENGTH: f64 = 0.15;
/// Half thickness in which a wall's plane is looked for, and in which its surface is taken away, m.
const TOLERANCE: f64 = 0.006;
const THICKNESS: f64 = 0.014;
/// Triples of points that are tried per plane; few of them are plumb.
const TRIALS: usize = 60_000;
/// Points on which the planes are tried.
const SAMPLE: usize = 4000;
/// Largest sine of the angle by which a wall is off the plumb.
const UPRIGHT: f64 = 0.08;
/// Least cosine between a wall's normal and that of its surface.
const ALIGNED: f64 = 0.6;
/// What lies so near to a wall for the most part is left over of it, m.
const REMAINS: f64 = 0.016;
/// Most walls, and most planes that are looked at.
const MOST: usize = 12;
/// Farthest from a wall at which a named frame makes a thing of it, m.
const CLAIM: f64 = 0.05;

/// A surface cut into what may be things and the room around them.
pub struct Room {
    /// Surface of things, in the field's frame.
    pub inner: Mesh,
    /// Walls, and everything behind them.
    pub outer: Mesh,
    walls: Vec<Plane>,
}

impl Room {
    /// Whether most of a piece of surface is what is left of a wall.
    pub fn is_remains(&self, piece: &Mesh) -> bool {
        let near = |p: &&Point3<f64>| self.walls.iter().any(|w| w.height(p).abs() < REMAINS);
        piece.vertices.iter().filter(near).count() * 7 > piece.vertices.len() * 6
    }
}

/// Takes away the large plumb planes of a surface above the support (iterated random sample consensus; what
/// leans is no wall, and a ceiling does not stand on the support), and what lies beyond them as seen from the
/// place that the cameras look at. A plane near one of the frames `named` is a thing. `up` is against gravity.
pub fn clear_walls(
    surface: Mesh,
    ranges: &[Range],
    up: &Vector3<f64>,
    named: &[Point3<f64>],
    notices: &mut Notices,
) -> Room {
    let focus = focus(ranges);
    let normals = vertex_normals(&surface);
    let areas = vertex_areas(&surface);
    let mut state: Vec<bool> = vec![true; surface.vertices.len()];
    let mut rng = rng_for(Seed(0), "walls");
    let (mut walls, mut off) = (Vec::new(), vec![false; surface.vertices.len()]);
    for _ in 0..MOST {
        let left: Vec<usize> = (0..state.len()).filter(|v| state[*v] && !off[*v]).collect();
        let step = (left.len() / SAMPLE).max(1);
        let sample: Vec<(Point3<f64>, Vector3<f64>)> = left
            .iter()
            .step_by(step)
            .map(|v| (surface.vertices[*v], normals[*v]))
            .collect();
        let Some(plane) = plumb_plane(&sample, up, &mut rng) else {
            break;
        };
        let on = |v: &usize| {
            plane.height(&surface.vertices[*v]).abs() < THICKNESS && plane.normal.dot(&normals[*v]).abs() > ALIGNED
        };
        let lies: Vec<usize> = left.into_iter().filter(on).collect();
        let is_wall = is_large(&surface, &areas, &lies, &plane, up)
            && !named.iter().any(|p| is_claimed(&surface, &lies, &plane, p));
        for v in lies {
            off[v] = true;
            state[v] = !is_wall;
        }
        if is_wall {
            walls.push(facing(&plane, &focus));
        }
    }
    if !walls.is_empty() {
        let words = format!("{} large planes are walls and not things", walls.len());
        notices.note("shape", "views", words);
    }
    let inside = |p: &Point3<f64>| walls.iter().all(|w| w.height(p) > 0.0);
    let keep = |v: &u32| state[*v as usize] && inside(&surface.vertices[*v as usize]);
    Room {
        inner: submesh(&surface, |t| surface.triangles[t].iter().all(keep)).0,
        outer: submesh(&surface, |t| !surface.triangles[t].iter().all(keep)).0,
        walls,
    }
}

/// The plumb plane that most points lie on and face along, by random sample consensus over triples that agree
/// with it in their normals, refitted to them.
fn plumb_plane(sample: &[(Point3<f64>, Vector3<f64>)], up: &Vector3<f64>, rng: &mut impl Rng) -> Option<Plane> {
    let faces = |plane: &Plane, n: &Vector3<f64>| plane.normal.dot(n).abs() > ALIGNED;
    let lies =
        |plane: &Plane, (p, n): &(Point3<f64>, Vector3<f64>)| plane.height(p).abs() < TOLERANCE && faces(plane, n);
    let mut best: Option<(usize, Plane)> = None;
    for _ in 0..if sample.len() < 3 { 0 } else { TRIALS } {
        let [a, b, c] = [0; 3].map(|_| sample[rng.random_range(0..sample.len())]);
        let Some(normal) = UnitVector3::try_new((b.0 - a.0).cross(&(c.0 - a.0)), 1e-6) else {
            continue;
        };
        let plane = Plane::through(&a.0, normal);
        if normal.dot(up).abs() > UPRIGHT || ![a, b, c].iter().all(|s| faces(&plane, &s.1)) {
            continue;
        }
        let votes = sample.iter().filter(|s| lies(&plane, s)).count();
        if best.is_none_or(|(most, _)| votes > most) {
            best = Some((votes, plane));
        }
    }
    let plane = best?.1;
    let on: Vec<Point3<f64>> = sample.iter().filter(|s| lies(&plane, s)).map(|s| s.0).collect();
    Some(plane.refit(&on, TOLERANCE))
}

/// The middle of what the views show at their middles.
fn focus(ranges: &[Range]) -> Point3<f64> {
    let mut sum = Vector3::zeros();
    for range in ranges {
        let mut depths: Vec<f64> = range.points(8).map(|p| (range.camera_from_field() * p).z).collect();
        depths.sort_by(f64::total_cmp);
        let depth = depths.get(depths.len() / 2).copied().unwrap_or_default();
        sum += (range.camera_from_field().inverse() * Point3::new(0.0, 0.0, depth)).coords;
    }
    Point3::from(sum / ranges.len().max(1) as f64)
}

fn facing(plane: &Plane, focus: &Point3<f64>) -> Plane {
    if plane.height(focus) >= 0.0 {
        return *plane;
    }
    Plane {
        normal: -plane.normal,
        offset: -plane.offset,
    }
}

/// A third of the area around each vertex, m².
fn vertex_areas(mesh: &Mesh) -> Vec<f64> {
    let mut areas = vec![0.0; mesh.vertices.len()];
    for (i, t) in mesh.triangles.iter().enumerate() {
        let share = mesh.scaled_normal(i).norm() / 6.0;
        for v in t {
            areas[*v as usize] += share;
        }
    }
    areas
}

/// Whether the vertices cover enough of a plane, both in area and along two axes of it.
fn is_large(mesh: &Mesh, areas: &[f64], on: &[usize], plane: &Plane, up: &Vector3<f64>) -> bool {
    let area: f64 = on.iter().map(|v| areas[*v]).sum();
    let level = plane.normal.cross(up).try_normalize(0.3).unwrap_or_else(Vector3::x);
    let across = plane.normal.cross(&level).normalize();
    area > LEAST_AREA
        && [level, across].iter().all(|axis| {
            let mut along: Vec<f64> = on.iter().map(|v| axis.dot(&mesh.vertices[*v].coords)).collect();
            along.sort_by(f64::total_cmp);
            let at = |share: f64| along[(share * (along.len() - 1) as f64) as usize];
            !along.is_empty() && at(0.95) - at(0.05) > LEAST_LENGTH
        })
}

fn is_claimed(mesh: &Mesh, on: &[usize], plane: &Plane, frame: &Point3<f64>) -> bool {
    plane.height(frame).abs() < CLAIM && on.iter().any(|v| (mesh.vertices[*v] - frame).norm() < 2.0 * CLAIM)
}
