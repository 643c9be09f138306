//! The outline of a link at the height of a tool, or of what it stands on, as a polygon in the support plane.

use nalgebra::{Isometry2, Point2, Point3, Vector2};

use super::pockets::with_pockets;

/// Cosine of the turn at a corner below which, 24 degrees, the polygon stands for a curve there.
const CURVED: f64 = 0.913;

/// A polygon, counter-clockwise, in the plane frame of its link: a hull, with pockets where it is a cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Footprint {
    corners: Vec<Point2<f64>>,
}

/// Where a disc is against a polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Signed distance from the polygon to the point, m; negative inside.
    pub distance: f64,
    /// Outward normal of the polygon there.
    pub outward: Vector2<f64>,
    /// The nearest point of the outline.
    pub point: Point2<f64>,
}

impl Footprint {
    /// The convex hull of `points` (Andrew's monotone chain); nothing where they span no area.
    pub fn hull(mut points: Vec<Point2<f64>>) -> Option<Self> {
        points.retain(|p| p.coords.iter().all(|x| x.is_finite()));
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        points.dedup();
        let mut corners: Vec<Point2<f64>> = Vec::new();
        for pass in 0..2 {
            let floor = corners.len();
            let forward: Box<dyn Iterator<Item = &Point2<f64>>> = if pass == 0 {
                Box::new(points.iter())
            } else {
                Box::new(points.iter().rev())
            };
            for p in forward {
                while corners.len() >= floor + 2
                    && turn(&corners[corners.len() - 2], &corners[corners.len() - 1], p) <= 0.0
                {
                    corners.pop();
                }
                corners.push(*p);
            }
            corners.pop();
        }
        (corners.len() >= 3).then_some(Self { corners })
    }

    /// The cut through a triangle mesh at height `z`: its hull, with what is far inside of that cut out; nothing where the cut has
    /// no area.
    pub fn section(points: &[Point3<f64>], triangles: &[[u32; 3]], z: f64) -> Option<Self> {
        let crossed = |triangle: &[u32; 3]| {
            let ends = (0..3).filter_map(|k| {
                let (a, b) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
                // From one side of an edge as from the other.
                let (a, b) = (&points[a.min(b)], &points[a.max(b)]);
                let t = (z - a.z) / (b.z - a.z);
                ((a.z - z) * (b.z - z) < 0.0).then(|| (a + (b - a) * t).xy())
            });
            let ends: Vec<Point2<f64>> = ends.collect();
            (ends.len() == 2).then(|| (ends[0], ends[1]))
        };
        let cuts: Vec<(Point2<f64>, Point2<f64>)> = triangles.iter().filter_map(crossed).collect();
        let hull = Self::hull(cuts.iter().flat_map(|c| [c.0, c.1]).collect())?;
        Some(Self {
            corners: with_pockets(hull.corners, &cuts),
        })
    }

    /// The corners, counter-clockwise.
    pub fn corners(&self) -> &[Point2<f64>] {
        &self.corners
    }

    /// Signed distance and outward normal at `point`, both in the polygon's frame moved by `pose`. Where corners hardly turn the
    /// polygon stands for a curve, whose normal turns steadily from the middle of one edge to that of the next.
    pub fn nearest(&self, pose: &Isometry2<f64>, point: &Point2<f64>) -> Nearest {
        let local = pose.inverse_transform_point(point);
        let inside = self.holds(&local);
        let (mut nearest, mut edge, mut foot) = (f64::INFINITY, 0, local);
        for (k, (a, b)) in self.edges().enumerate() {
            let along = ((local - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
            let at = a + (b - a) * along;
            let distance = (local - at).norm();
            if distance < nearest {
                (nearest, edge, foot) = (distance, k, at);
            }
        }
        let curved = self.curved_normal(edge, &foot);
        let outward = curved.unwrap_or_else(|| {
            if inside || nearest < 1e-9 {
                self.normal(edge)
            } else {
                (local - foot) / nearest
            }
        });
        let sign = if inside { -1.0 } else { 1.0 };
        Nearest {
            distance: sign * nearest,
            outward: pose.rotation * outward,
            point: pose.transform_point(&foot),
        }
    }

    /// Whether a point is within (even-odd rule).
    fn holds(&self, p: &Point2<f64>) -> bool {
        let crosses = |(a, b): &(&Point2<f64>, &Point2<f64>)| {
            (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)
        };
        self.edges().filter(crosses).count() % 2 == 1
    }

    /// Edge `k` as a vector.
    fn edge(&self, k: usize) -> Vector2<f64> {
        let n = self.corners.len();
        self.corners[(k + 1) % n] - self.corners[k % n]
    }

    fn normal(&self, k: usize) -> Vector2<f64> {
        let edge = self.edge(k);
        Vector2::new(edge.y, -edge.x).normalize()
    }

    /// The normal at a point of edge `k` near a corner that hardly turns, within half of the shorter edge there.
    fn curved_normal(&self, k: usize, at: &Point2<f64>) -> Option<Vector2<f64>> {
        let n = self.corners.len();
        for (corner, other) in [(k, (k + n - 1) % n), ((k + 1) % n, (k + 1) % n)] {
            let reach = 0.5 * self.edge(k).norm().min(self.edge(other).norm());
            let away = (at - self.corners[corner]).norm();
            let (own, beside) = (self.normal(k), self.normal(other));
            if away < reach && own.dot(&beside) > CURVED {
                let share = 0.5 * (1.0 - away / reach);
                return Some((own * (1.0 - share) + beside * share).normalize());
            }
        }
        None
    }

    fn edges(&self) -> impl Iterator<Item = (&Point2<f64>, &Point2<f64>)> {
        let n = self.corners.len();
        (0..n).map(move |i| (&self.corners[i], &self.corners[(i + 1) % n]))
    }

    /// The corners with the share of a whole turn that the outline takes there: of a box a quarter each, however finely its
    /// corners are rounded.
    pub fn turned(&self) -> Vec<(Point2<f64>, f64)> {
        let n = self.corners.len();
        let at = |i: usize| {
            let (before, here, after) = (
                &self.corners[(i + n - 1) % n],
                &self.corners[i],
                &self.corners[(i + 1) % n],
            );
            let (into, out) = (here - before, after - here);
            (*here, into.perp(&out).atan2(into.dot(&out)) / std::f64::consts::TAU)
        };
        (0..n).map(at).collect()
    }

    /// Area, m², and centroid.
    pub fn area_centroid(&self) -> (f64, Point2<f64>) {
        let (mut area, mut moment) = (0.0, Vector2::zeros());
        for (a, b) in self.edges() {
            let cross = a.x * b.y - a.y * b.x;
            area += 0.5 * cross;
            moment += (a.coords + b.coords) * cross / 6.0;
        }
        (area, Point2::from(moment / area))
    }

    /// The convex hull: itself but for pockets.
    pub fn rim(&self) -> Self {
        Self::hull(self.corners.clone()).unwrap_or_else(|| self.clone())
    }

    /// Points with their shares of the area, m²: some 200 over its hull, evenly in each triangle of the fan about the first corner,
    /// without those in pockets.
    pub fn quadrature(&self) -> Vec<(Point2<f64>, f64)> {
        let rim = self.rim();
        if rim.corners.len() == self.corners.len() {
            return self.fan();
        }
        rim.fan().into_iter().filter(|(p, _)| self.holds(p)).collect()
    }

    /// Points of the triangles between the first corner and the edges.
    fn fan(&self) -> Vec<(Point2<f64>, f64)> {
        let fan = self.corners.len().saturating_sub(2).max(1);
        let steps = ((QUADRATURE_POINTS / fan as f64).sqrt().ceil() as usize).max(2);
        let origin = self.corners[0];
        let mut points = Vec::new();
        for (a, b) in self.edges() {
            let weight = 0.5 * turn(&origin, a, b);
            if weight <= 0.0 {
                continue;
            }
            let cells = (steps * steps) as f64;
            let at = |u: f64, v: f64| origin + (a - origin) * (u / steps as f64) + (b - origin) * (v / steps as f64);
            let third = 1.0 / 3.0;
            for i in 0..steps {
                for j in 0..steps - i {
                    points.push((at(i as f64 + third, j as f64 + third), weight / cells));
                    if i + j + 1 < steps {
                        points.push((at(i as f64 + 2.0 * third, j as f64 + 2.0 * third), weight / cells));
                    }
                }
            }
        }
        points
    }

    /// Mean distance of the polygon's points from `centre`: the torsional radius of uniform pressure
    /// (friction torque over friction force, Goyal, Ruina and Papadopoulos 1991), by a fan of triangles.
    pub fn mean_distance(&self, centre: &Point2<f64>) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for (a, b) in self.edges() {
            let weight = 0.5 * turn(centre, a, b);
            let mut mean = 0.0;
            // Degree-2 midpoint rule on four sub-triangles of each fan triangle.
            for (u, v) in QUADRATURE {
                let p = a.coords * u + b.coords * v + centre.coords * (1.0 - u - v);
                mean += (Point2::from(p) - centre).norm() / QUADRATURE.len() as f64;
            }
            sum += weight * mean;
            area += weight;
        }
        sum / area
    }
}

/// About how many points stand for a footprint.
const QUADRATURE_POINTS: f64 = 200.0;

const QUADRATURE: [(f64, f64); 12] = [
    (0.25, 0.0),
    (0.25, 0.25),
    (0.0, 0.25),
    (0.75, 0.0),
    (0.75, 0.25),
    (0.5, 0.25),
    (0.25, 0.5),
    (0.25, 0.75),
    (0.0, 0.75),
    (0.5, 0.25),
    (0.25, 0.5),
    (0.25, 0.25),
];

fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Footprint {
        let s = 0.05;
        let points = [(-s, -s), (s, -s), (s, s), (-s, s), (0.0, 0.0)];
        Footprint::hull(points.iter().map(|(x, y)| Point2::new(*x, *y)).collect()).expect("a square")
    }

    #[test]
    fn a_square_knows_its_faces() {
        let near = square().nearest(&Isometry2::identity(), &Point2::new(-0.08, 0.01));
        assert!((near.distance - 0.03).abs() < 1e-12);
        assert!((near.outward - Vector2::new(-1.0, 0.0)).norm() < 1e-12);
        let inside = square().nearest(&Isometry2::identity(), &Point2::new(0.04, 0.0));
        assert!((inside.distance + 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_polygon_of_many_sides_has_the_normals_of_a_circle() {
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / 40.0;
            Point2::new(0.05 * angle.cos(), 0.05 * angle.sin())
        };
        let round = Footprint::hull((0..40).map(corner).collect()).expect("a polygon");
        for k in 0..200 {
            let angle = std::f64::consts::TAU * f64::from(k) / 200.0;
            let way = Vector2::new(angle.cos(), angle.sin());
            let near = round.nearest(&Isometry2::identity(), &Point2::from(0.06 * way));
            assert!(near.outward.perp(&way).abs() < 0.01, "{k}: {:?}", near.outward);
        }
    }

    #[test]
    fn a_square_turns_a_quarter_at_each_corner() {
        let turned = square().turned();
        assert!(
            turned.len() == 4 && turned.iter().all(|t| (t.1 - 0.25).abs() < 1e-12),
            "{turned:?}"
        );
    }

    #[test]
    fn the_torsional_radius_of_a_square_is_right() {
        // Mean distance from the centre of a square of side a: a (sqrt 2 + asinh 1) / 6.
        let exact = 0.1 * (2f64.sqrt() + 1f64.asinh()) / 6.0;
        let got = square().mean_distance(&Point2::origin());
        assert!((got / exact - 1.0).abs() < 0.02, "{got} against {exact}");
    }
}
