//! A closed piece of a shape, and how a plane parts it.

use std::collections::BTreeMap;

use nalgebra::{Point3, UnitVector3, Vector3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use crate::geometry::closing::faces_inside;
use crate::geometry::{Mesh, Plane, UnionFind, convex_hull, number_sets};

/// Vertices within this distance of a plane lie on it, m.
const ON_PLANE: f64 = 1e-6;

/// A solid by its surface, cut faces included, with its hull.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub surface: Mesh,
    /// m³.
    pub volume: f64,
    pub hull: Mesh,
    /// m³.
    pub hull_volume: f64,
}

impl Piece {
    /// Nothing for a surface that spans no volume.
    pub fn new(surface: Mesh) -> Option<Self> {
        let hull = convex_hull(&surface.vertices)?;
        let reference = surface.vertices.first()?.coords;
        Some(Self {
            volume: volume_about(&surface, &reference),
            hull_volume: volume_about(&hull, &reference),
            surface,
            hull,
        })
    }

    /// How much of the hull is not of the piece, m³.
    pub fn excess(&self) -> f64 {
        self.hull_volume - self.volume
    }

    /// The connected pieces on either side of a plane. Empty where the plane misses it.
    pub fn cut(&self, plane: &Plane) -> Vec<Self> {
        let heights: Vec<f64> = self.surface.vertices.iter().map(|p| snapped(plane.height(p))).collect();
        if heights.iter().all(|h| *h >= 0.0) || heights.iter().all(|h| *h <= 0.0) {
            return Vec::new();
        }
        [1.0, -1.0]
            .into_iter()
            .flat_map(|side| {
                let outward = if side > 0.0 { -plane.normal } else { plane.normal };
                Half::of(&self.surface, &heights, plane, side).closed(&outward)
            })
            .filter_map(Self::new)
            .collect()
    }
}

fn snapped(height: f64) -> f64 {
    if height.abs() < ON_PLANE { 0.0 } else { height }
}

fn volume_about(mesh: &Mesh, reference: &Vector3<f64>) -> f64 {
    let six = |t: usize| {
        let [a, b, c] = mesh.corners(t).map(|p| p.coords - reference);
        a.dot(&b.cross(&c))
    };
    (0..mesh.triangles.len()).map(six).sum::<f64>() / 6.0
}

/// The surface on one side of a plane, open along the cut.
struct Half<'a> {
    source: &'a Mesh,
    heights: &'a [f64],
    surface: Mesh,
    moved: Vec<u32>,
    crossings: BTreeMap<(u32, u32), u32>,
}

impl<'a> Half<'a> {
    fn of(source: &'a Mesh, heights: &'a [f64], plane: &Plane, side: f64) -> Self {
        let mut half = Self {
            source,
            heights,
            surface: Mesh::default(),
            moved: vec![u32::MAX; source.vertices.len()],
            crossings: BTreeMap::new(),
        };
        for (t, corners) in source.triangles.iter().enumerate() {
            let h = corners.map(|v| side * heights[v as usize]);
            if h == [0.0; 3] {
                // The solid lies behind its surface, so a face in the plane belongs to that side.
                if side * source.scaled_normal(t).dot(&plane.normal) < 0.0 {
                    let face = corners.map(|v| half.take(v));
                    half.surface.triangles.push(face);
                }
            } else if h.iter().any(|h| *h > 0.0) {
                half.clip(corners, &h);
            }
        }
        half
    }

    fn take(&mut self, v: u32) -> u32 {
        let slot = &mut self.moved[v as usize];
        if *slot == u32::MAX {
            *slot = self.surface.vertices.len() as u32;
            self.surface.vertices.push(self.source.vertices[v as usize]);
        }
        *slot
    }

    fn crossing(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (a.min(b), a.max(b));
        let (ha, hb) = (self.heights[a as usize], self.heights[b as usize]);
        let (pa, pb) = (self.source.vertices[a as usize], self.source.vertices[b as usize]);
        let vertices = &mut self.surface.vertices;
        *self.crossings.entry((a, b)).or_insert_with(|| {
            vertices.push(pa + (pb - pa) * (ha / (ha - hb)));
            vertices.len() as u32 - 1
        })
    }

    fn clip(&mut self, corners: &[u32; 3], h: &[f64; 3]) {
        let mut polygon = Vec::with_capacity(4);
        for i in 0..3 {
            let j = (i + 1) % 3;
            if h[i] >= 0.0 {
                polygon.push(self.take(corners[i]));
            }
            if h[i] * h[j] < 0.0 {
                polygon.push(self.crossing(corners[i], corners[j]));
            }
        }
        for k in 1..polygon.len().saturating_sub(1) {
            self.surface.triangles.push([polygon[0], polygon[k], polygon[k + 1]]);
        }
    }

    /// The connected parts, closed along the cut; `outward` is the cut's normal away from this side.
    fn closed(mut self, outward: &UnitVector3<f64>) -> Vec<Mesh> {
        let cap = cap(&self.surface, &self.on_cut(), outward);
        self.surface.triangles.extend(cap);
        let count = self.surface.vertices.len();
        let mut sets = UnionFind::new(count);
        for t in &self.surface.triangles {
            sets.union(t[0], t[1]);
            sets.union(t[1], t[2]);
        }
        let (set, sets) = number_sets(&mut sets, count);
        let mut parts: Vec<Vec<[u32; 3]>> = vec![Vec::new(); sets];
        for t in &self.surface.triangles {
            parts[set[t[0] as usize] as usize].push(*t);
        }
        with_voids(parts.iter().map(|p| self.compact(p)).collect())
    }

    /// Which vertices lie in the plane.
    fn on_cut(&self) -> Vec<bool> {
        let mut on = vec![false; self.surface.vertices.len()];
        for v in self.crossings.values() {
            on[*v as usize] = true;
        }
        for (old, new) in self.moved.iter().enumerate().filter(|(_, new)| **new != u32::MAX) {
            on[*new as usize] = self.heights[old] == 0.0;
        }
        on
    }

    fn compact(&self, triangles: &[[u32; 3]]) -> Mesh {
        let whole = Mesh {
            vertices: Vec::new(),
            triangles: triangles.to_vec(),
            ..Mesh::default()
        };
        let mut old: Vec<u32> = triangles.iter().flatten().copied().collect();
        old.sort_unstable();
        old.dedup();
        let place = |v: u32| old.binary_search(&v).unwrap_or(0) as u32;
        Mesh {
            vertices: old.iter().map(|v| self.surface.vertices[*v as usize]).collect(),
            triangles: whole.triangles.iter().map(|t| t.map(place)).collect(),
            ..Mesh::default()
        }
    }
}

/// Triangles over what the open edges in the plane of a cut enclose: constrained Delaunay, or, where the edges cross,
/// a fan, of which at least the signed area is right.
fn cap(surface: &Mesh, on_cut: &[bool], outward: &UnitVector3<f64>) -> Vec<[u32; 3]> {
    let mut open = open_edges(&surface.triangles);
    open.retain(|(a, b)| on_cut[*a as usize] && on_cut[*b as usize]);
    let u = outward.cross(&Vector3::ith(outward.iamin(), 1.0)).normalize();
    let v = outward.cross(&u);
    let plan = |i: u32| {
        let p = surface.vertices[i as usize].coords;
        Point2::new(p.dot(&u), p.dot(&v))
    };
    triangulated(&open, plan).unwrap_or_else(|| {
        let apex = open.first().map_or(0, |e| e.0);
        let fan = open.iter().filter(|(a, b)| *a != apex && *b != apex);
        fan.map(|(a, b)| [apex, *b, *a]).collect()
    })
}

fn triangulated(open: &[(u32, u32)], plan: impl Fn(u32) -> Point2<f64>) -> Option<Vec<[u32; 3]>> {
    let mut corners: Vec<u32> = open.iter().flat_map(|(a, b)| [*a, *b]).collect();
    corners.sort_unstable();
    corners.dedup();
    let mut plane = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    for (i, v) in corners.iter().enumerate() {
        if plane.insert(plan(*v)).ok()?.index() != i {
            return None;
        }
    }
    for (a, b) in open {
        let [a, b] = [a, b].map(|v| corners.binary_search(v).map(FixedVertexHandle::from_index));
        let (a, b) = (a.ok()?, b.ok()?);
        if !plane.can_add_constraint(a, b) {
            return None;
        }
        plane.add_constraint(a, b);
    }
    let inside = faces_inside(&plane);
    let faces = plane.inner_faces().filter(|face| inside[face.fix().index()]);
    Some(
        faces
            .map(|face| face.vertices().map(|v| corners[v.fix().index()]))
            .collect(),
    )
}

/// Directed edges that no opposite edge meets.
fn open_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let directed = triangles
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
    let mut edges: Vec<(u32, u32, i32)> = directed
        .map(|(a, b)| if a < b { (a, b, 1) } else { (b, a, -1) })
        .collect();
    edges.sort_unstable();
    let mut open = Vec::new();
    for group in edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        let sum: i32 = group.iter().map(|e| e.2).sum();
        let (a, b, _) = group[0];
        let edge = if sum > 0 { (a, b) } else { (b, a) };
        open.extend(std::iter::repeat_n(edge, sum.unsigned_abs() as usize));
    }
    open
}

/// Surfaces that enclose a void join the part around them.
fn with_voids(parts: Vec<Mesh>) -> Vec<Mesh> {
    let (mut solids, voids): (Vec<Mesh>, Vec<Mesh>) = parts
        .into_iter()
        .filter(|p| !p.triangles.is_empty())
        .partition(|p| p.volume() >= 0.0);
    for void in voids {
        let holds = |s: &Mesh| match (s.bounds(), void.bounds()) {
            (Some((lo, hi)), Some((l, h))) => (0..3).all(|k| lo[k] <= l[k] + ON_PLANE && h[k] <= hi[k] + ON_PLANE),
            _ => false,
        };
        if let Some(around) = solids.iter_mut().find(|s| holds(s)) {
            around.append(&void);
        }
    }
    solids
}

/// The hull of two hulls.
pub(super) fn joint_hull(a: &Mesh, b: &Mesh) -> Option<Mesh> {
    let points: Vec<Point3<f64>> = a.vertices.iter().chain(&b.vertices).copied().collect();
    convex_hull(&points)
}
