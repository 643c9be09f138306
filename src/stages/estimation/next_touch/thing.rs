//! A thing as a planner of touches sees it, in the plane frame (z along the support's normal).

use nalgebra::{Isometry3, Point2, Point3, Vector2};

use crate::geometry::Mesh;
use crate::physics::Footprint;

/// What the planner needs to know of a thing's shape.
#[derive(Clone, Debug)]
pub(super) struct Thing {
    pub name: String,
    pub low: Point3<f64>,
    pub high: Point3<f64>,
    points: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// Where a push meets a thing: the point of its outline, its outward normal.
pub(super) struct Meeting {
    pub point: Point2<f64>,
    pub outward: Vector2<f64>,
}

/// How near the lowest point counts as underside, m.
const UNDER: f64 = 0.003;

impl Thing {
    /// `mesh` at `pose` in the plane frame; nothing where it has no extent.
    pub fn new(name: &str, mesh: &Mesh, pose: &Isometry3<f64>) -> Option<Self> {
        let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|v| pose * v).collect();
        let first = *points.first()?;
        let (low, high) = points.iter().fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
        Some(Self {
            name: name.to_owned(),
            low,
            high,
            points,
            triangles: mesh.triangles.clone(),
        })
    }

    pub fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    pub fn height(&self) -> f64 {
        self.high.z - self.low.z
    }

    pub fn radius(&self) -> f64 {
        0.5 * (self.high - self.low).xy().norm()
    }

    /// The hull of the cut at height `z`.
    pub fn outline(&self, z: f64) -> Option<Footprint> {
        Footprint::section(&self.points, &self.triangles, z)
    }

    /// The hull of what is nearest to the support.
    pub fn underside(&self) -> Option<Footprint> {
        let near = self.points.iter().filter(|p| p.z < self.low.z + UNDER);
        Footprint::hull(near.map(Point3::xy).collect())
    }

    /// How far a line along `way` through `point` passes off the middle of an outline, as a share of half its width.
    pub fn aside(&self, outline: &Footprint, way: &Vector2<f64>, point: &Point2<f64>) -> f64 {
        let (low, high) = across(outline, way);
        let line = point.coords.dot(&Vector2::new(-way.y, way.x));
        (line - 0.5 * (low + high)) / (0.5 * (high - low)).max(1e-9)
    }

    /// Where a tool that goes along `way` and passes `aside` of the middle first meets `outline`.
    pub fn meet(&self, outline: &Footprint, way: &Vector2<f64>, aside: f64) -> Option<Meeting> {
        let (low, high) = across(outline, way);
        let across = Vector2::new(-way.y, way.x);
        let corners = outline.corners();
        let line = 0.5 * (low + high) + aside * 0.5 * (high - low);
        let mut first: Option<(f64, Meeting)> = None;
        for k in 0..corners.len() {
            let (a, b) = (&corners[k], &corners[(k + 1) % corners.len()]);
            let (sa, sb) = (a.coords.dot(&across) - line, b.coords.dot(&across) - line);
            if sa * sb > 0.0 || (sa - sb).abs() < 1e-12 {
                continue;
            }
            let point = a + (b - a) * (sa / (sa - sb));
            let along = point.coords.dot(way);
            if first.as_ref().is_none_or(|(best, _)| along < *best) {
                let edge = (b - a).normalize();
                let outward = Vector2::new(edge.y, -edge.x);
                first = Some((along, Meeting { point, outward }));
            }
        }
        first.map(|(_, meeting)| meeting)
    }

    /// Distance along `way` from `centre` to the edge over which the thing would topple, m.
    pub fn lever(&self, centre: &Point2<f64>, way: &Vector2<f64>) -> f64 {
        let reach = |p: &Point2<f64>| (p - centre).dot(way);
        self.underside()
            .map_or(0.0, |u| u.corners().iter().map(reach).fold(0.0, f64::max))
    }
}

/// Extent of an outline across `way`, m.
fn across(outline: &Footprint, way: &Vector2<f64>) -> (f64, f64) {
    let across = Vector2::new(-way.y, way.x);
    let each = outline.corners().iter().map(|c| c.coords.dot(&across));
    each.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
}

/// Room along `way` ahead of a thing, and behind it for the tool, m; at most 1.
pub(super) fn clearance(thing: &Thing, things: &[Thing], way: &Vector2<f64>) -> f64 {
    let room = |other: &Thing| {
        let off = (other.middle() - thing.middle()).xy();
        let along = off.dot(way);
        let aside = (off.norm_squared() - along * along).max(0.0).sqrt();
        let gap = other.radius() + thing.radius();
        if aside > gap {
            return 1.0;
        }
        // Behind, only the tool must fit.
        if along > 0.0 { along - gap } else { -along - gap + 0.02 }
    };
    let others = things.iter().filter(|o| o.name != thing.name);
    others.map(room).fold(1.0, f64::min)
}
