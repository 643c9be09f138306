//! Known shapes, made ready for many trials: the thing as a convex solid of uniform density, the tool as convex parts.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};

use crate::geometry::{Mesh, convex_hull, slim_hull};

/// Corners that a hull keeps at most, and how far it may stay inside the full one, m.
const MOST_CORNERS: usize = 40;
const SLIM: f64 = 2e-4;
/// A hull is a ball where its corners keep the same distance from the middle, to this share.
const BALL: f64 = 0.035;
/// Faces whose normals differ by less than this (sine) are one.
const FLAT: f64 = 0.02;
/// Corners of a face lie within this share of the reach of its plane.
const EVEN: f64 = 5e-3;

/// Faces (unit outward normal, offset) and edges of a convex hull.
#[derive(Clone, Debug, Default)]
pub(super) struct Polytope {
    pub points: Vec<[f32; 3]>,
    pub planes: Vec<([f32; 3], f32)>,
    pub edges: Vec<([f32; 3], [f32; 3])>,
}

/// A thing of known convex shape and uniform density.
///
/// Its own frame is at the centroid, axes along the principal axes of inertia; [`Solid::mesh_from_solid`] leads to the
/// frame of the mesh that it was made from. Its inertia is for a mass of 1 kg, and so is everything that is simulated
/// with it: a tool on a prescribed path moves a heavy thing and a light one in the same way.
#[derive(Clone, Debug)]
pub struct Solid {
    pub(super) hull: Polytope,
    /// Principal moments of inertia per mass, m².
    pub(super) inertia: [f32; 3],
    /// Largest distance of a point from the centroid, m.
    pub(super) reach: f32,
    /// Radius, where it is a ball.
    pub(super) ball: Option<f32>,
    /// Frame of the mesh from the frame of the solid.
    pub mesh_from_solid: Isometry3<f64>,
}

impl Solid {
    /// The convex hull of a mesh (m); nothing where it spans no volume.
    pub fn of(mesh: &Mesh) -> Option<Self> {
        let full = convex_hull(&mesh.vertices)?;
        let (volume, centroid, inertia) = integrals(&full)?;
        let eigen = (inertia / volume).symmetric_eigen();
        let mut axes = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.set_column(2, &-axes.column(2).into_owned());
        }
        let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let mesh_from_solid = Isometry3::from_parts(centroid.coords.into(), turn);
        let ball = ball_radius(&full, &centroid);
        let slim = slim_hull(&full.vertices, MOST_CORNERS, SLIM)?;
        let hull = polytope(&slim, &mesh_from_solid.inverse());
        let reach = full.vertices.iter().map(|p| (p - centroid).norm()).fold(0.0, f64::max);
        let least = 1e-6 * reach * reach;
        Some(Self {
            hull,
            inertia: std::array::from_fn(|k| eigen.eigenvalues[k].max(least) as f32),
            reach: reach as f32,
            ball: ball.map(|r| r as f32),
            mesh_from_solid,
        })
    }

    /// Whether it is taken for a ball.
    pub fn is_ball(&self) -> bool {
        self.ball.is_some()
    }

    /// Principal moments of inertia for a mass of 1 kg, m².
    pub fn moments(&self) -> [f64; 3] {
        self.inertia.map(f64::from)
    }

    /// Corners of its hull as it is simulated.
    pub fn corners(&self) -> usize {
        self.hull.points.len()
    }

    /// Height of the origin of the mesh's frame over the support where the thing stands turned like this
    /// (support-from-mesh), m.
    pub fn standing_height(&self, turn: &UnitQuaternion<f64>) -> f64 {
        let solid = turn * self.mesh_from_solid.rotation;
        let low = match self.ball {
            Some(radius) => -f64::from(radius),
            None => {
                let height = |p: &[f32; 3]| (solid * to_f64(p)).z;
                self.hull.points.iter().map(height).fold(f64::INFINITY, f64::min)
            }
        };
        -low - (turn * self.mesh_from_solid.translation.vector).z
    }

    /// Turns (support-from-mesh, up to yaw) in which it can come to rest: a face below under the centroid; with the
    /// share of random orientations from which it would land there, by the face's solid angle. Largest share first.
    pub fn resting_turns(&self) -> Vec<(UnitQuaternion<f64>, f64)> {
        if self.is_ball() {
            return vec![(UnitQuaternion::identity(), 1.0)];
        }
        let mut found = Vec::new();
        for (normal, offset) in &self.hull.planes {
            let n = to_f64(normal);
            let on = |p: &Vector3<f64>| (n.dot(p) - f64::from(*offset)).abs() < EVEN * f64::from(self.reach);
            let face: Vec<Vector3<f64>> = self.hull.points.iter().map(to_f64).filter(on).collect();
            let Some(share) = footing(&n, &face) else { continue };
            let down = self.mesh_from_solid.rotation * n;
            let turn = UnitQuaternion::rotation_between(&down, &-Vector3::z())
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
            found.push((turn, share));
        }
        let total: f64 = found.iter().map(|f| f.1).sum();
        found.iter_mut().for_each(|f| f.1 /= total.max(1e-12));
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found
    }
}

/// Solid angle (sr, seen from the centroid) of a face that holds the centroid's foot, else nothing.
fn footing(n: &Vector3<f64>, face: &[Vector3<f64>]) -> Option<f64> {
    let foot = n * n.dot(face.first()?);
    let side = if n.x.abs() < 0.7 { Vector3::x() } else { Vector3::y() };
    let e1: Vector3<f64> = n.cross(&side).normalize();
    let e2 = n.cross(&e1);
    let mut round: Vec<(f64, Vector3<f64>)> = face
        .iter()
        .map(|p| ((p - foot).dot(&e2).atan2((p - foot).dot(&e1)), *p))
        .collect();
    round.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut angle = 0.0;
    for (k, (_, a)) in round.iter().enumerate() {
        let b = round[(k + 1) % round.len()].1;
        if (a - foot).cross(&(b - foot)).dot(n) < -1e-12 {
            return None;
        }
        // Van Oosterom and Strackee (1983): solid angle of the triangle (foot, a, b).
        let (x, y, z) = (foot.norm(), a.norm(), b.norm());
        let top = foot.dot(&a.cross(&b)).abs();
        let bottom = x * y * z + foot.dot(a) * z + foot.dot(&b) * y + a.dot(&b) * x;
        angle += 2.0 * top.atan2(bottom);
    }
    // Where consecutive corners do not go round the foot by less than half a turn, it lies outside.
    let gaps = (0..round.len()).all(|k| {
        let next = round[(k + 1) % round.len()].0
            + if k + 1 == round.len() {
                std::f64::consts::TAU
            } else {
                0.0
            };
        next - round[k].0 < std::f64::consts::PI
    });
    (round.len() > 2 && gaps).then_some(angle)
}

/// Volume, centroid and inertia about the centroid at density 1 (divergence theorem).
fn integrals(hull: &Mesh) -> Option<(f64, Point3<f64>, Matrix3<f64>)> {
    let (low, high) = hull.bounds()?;
    let apex = nalgebra::center(&low, &high);
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for i in 0..hull.triangles.len() {
        let [a, b, c] = hull.corners(i).map(|p| p - apex);
        let six = a.dot(&b.cross(&c));
        let sum = a + b + c;
        volume += six / 6.0;
        first += six / 24.0 * sum;
        second += six / 120.0 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
    }
    if volume.is_nan() || volume <= 0.0 {
        return None;
    }
    let offset = first / volume;
    let covariance = second - volume * offset * offset.transpose();
    Some((
        volume,
        apex + offset,
        Matrix3::identity() * covariance.trace() - covariance,
    ))
}

/// The radius, where all corners of a many-cornered hull keep it.
fn ball_radius(hull: &Mesh, centre: &Point3<f64>) -> Option<f64> {
    let distances: Vec<f64> = hull.vertices.iter().map(|p| (p - centre).norm()).collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    let round = distances.iter().all(|d| (d - mean).abs() < BALL * mean);
    let flat = (0..hull.triangles.len()).any(|i| {
        let n = hull.scaled_normal(i);
        n.dot(&(hull.corners(i)[0] - centre)) < (1.0 - 2.0 * BALL) * mean * n.norm()
    });
    (distances.len() >= 24 && round && !flat).then_some(mean)
}

fn to_f64(v: &[f32; 3]) -> Vector3<f64> {
    Vector3::new(v[0].into(), v[1].into(), v[2].into())
}

fn to_f32(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// The planes of a hull (unit outward normal, offset), and which of them each triangle belongs to. Triangles join the face of
/// a larger one: on the rim of a face a sliver may point anywhere, and a face that took its normal would hold no foot.
fn faces(hull: &Mesh, points: &[Vector3<f64>]) -> (Vec<(Vector3<f64>, f64)>, Vec<usize>) {
    let scaled: Vec<Vector3<f64>> = hull
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            (b - a).cross(&(c - a))
        })
        .collect();
    let mut order: Vec<usize> = (0..scaled.len()).collect();
    order.sort_by(|i, j| scaled[*j].norm().total_cmp(&scaled[*i].norm()));
    let mut planes: Vec<(Vector3<f64>, f64)> = Vec::new();
    let mut face_of = vec![usize::MAX; scaled.len()];
    for i in order {
        let Some(n) = scaled[i].try_normalize(1e-14) else {
            continue;
        };
        let a = points[hull.triangles[i][0] as usize];
        let same = planes
            .iter()
            .position(|(m, d)| m.cross(&n).norm() < FLAT && m.dot(&n) > 0.0 && (d - n.dot(&a)).abs() < 5e-4);
        face_of[i] = same.unwrap_or(planes.len());
        if same.is_none() {
            planes.push((n, n.dot(&a)));
        }
    }
    (planes, face_of)
}

/// Faces, edges and corners of a hull in another frame.
pub(super) fn polytope(hull: &Mesh, frame_from_hull: &Isometry3<f64>) -> Polytope {
    let points: Vec<Vector3<f64>> = hull.vertices.iter().map(|p| (frame_from_hull * p).coords).collect();
    let (mut planes, face_of) = faces(hull, &points);
    // A merged face must not cut a corner off.
    for (n, d) in &mut planes {
        *d = points.iter().map(|p| n.dot(p)).fold(*d, f64::max);
    }
    let mut edges = Vec::new();
    for (i, triangle) in hull.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            let other = hull
                .triangles
                .iter()
                .position(|t| (0..3).any(|j| t[j] == b && t[(j + 1) % 3] == a));
            if a < b && other.is_some_and(|o| face_of[o] != face_of[i]) {
                edges.push((to_f32(&points[a as usize]), to_f32(&points[b as usize])));
            }
        }
    }
    Polytope {
        points: points.iter().map(to_f32).collect(),
        planes: planes.iter().map(|(n, d)| (to_f32(n), *d as f32)).collect(),
        edges,
    }
}

/// A convex part of a tool, in a frame of its own.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Radius.
    Ball(f32),
    /// Half extents.
    Box([f32; 3]),
    /// Along z: radius, half height.
    Cylinder(f32, f32),
    /// Corners and faces.
    Hull(Polytope),
}

impl Shape {
    /// A length that it reaches from its origin in every direction at least, m.
    pub(super) fn narrowest(&self) -> f32 {
        match self {
            Self::Ball(radius) => *radius,
            Self::Box(h) => h[0].min(h[1]).min(h[2]),
            Self::Cylinder(radius, half) => radius.min(*half),
            Self::Hull(hull) => {
                let least = hull.planes.iter().map(|(_, d)| *d).fold(f32::INFINITY, f32::min);
                // Outside of it no such length is known; faces that were merged leave a little less than they say.
                if least > 0.0 { 0.9 * least } else { f32::NEG_INFINITY }
            }
        }
    }
}

/// A tool of known shape: convex parts in its frame.
#[derive(Clone, Debug)]
pub struct Tool {
    pub(super) parts: Vec<Shape>,
    /// Largest distance of a point of it from its origin, m.
    pub(super) reach: f32,
}

impl Tool {
    /// A ball about the tool's origin.
    pub fn ball(radius: f64) -> Self {
        Self {
            parts: vec![Shape::Ball(radius as f32)],
            reach: radius as f32,
        }
    }

    /// A box with these half extents.
    pub fn cuboid(half: &Vector3<f64>) -> Self {
        Self {
            parts: vec![Shape::Box(to_f32(half))],
            reach: half.norm() as f32,
        }
    }

    /// A cylinder along the tool's z.
    pub fn cylinder(radius: f64, half_height: f64) -> Self {
        Self {
            parts: vec![Shape::Cylinder(radius as f32, half_height as f32)],
            reach: radius.hypot(half_height) as f32,
        }
    }

    /// The convex hulls of these meshes, in the tool's frame; nothing where none spans a volume.
    pub fn of_parts(meshes: &[Mesh]) -> Option<Self> {
        let hulls: Vec<Mesh> = meshes
            .iter()
            .filter_map(|m| slim_hull(&m.vertices, MOST_CORNERS, SLIM))
            .collect();
        let reach = hulls
            .iter()
            .flat_map(|h| &h.vertices)
            .map(|p| p.coords.norm())
            .fold(0.0, f64::max);
        let parts: Vec<Shape> = hulls
            .iter()
            .map(|h| Shape::Hull(polytope(h, &Isometry3::identity())))
            .collect();
        (!parts.is_empty()).then_some(Self {
            parts,
            reach: reach as f32,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_can_whose_rim_is_not_quite_even_rests_on_its_ends() {
        let (radius, half) = (0.027, 0.0476);
        let uneven = |k: usize| 2e-5 * ((k * 7919 % 13) as f64 / 6.0 - 1.0);
        let vertices = (0..64)
            .map(|k| {
                let turn = (k / 2) as f64 * std::f64::consts::TAU / 32.0;
                let z = if k % 2 == 0 { half } else { -half };
                Point3::new(radius * turn.cos(), radius * turn.sin(), z + uneven(k))
            })
            .collect();
        let can = Solid::of(&Mesh {
            vertices,
            ..Mesh::default()
        })
        .expect("a solid");
        let resting = can.resting_turns();
        let upright = resting.iter().filter(|(t, _)| (t * Vector3::z()).z.abs() > 0.999);
        assert_eq!(upright.count(), 2, "{resting:?}");
    }
}
