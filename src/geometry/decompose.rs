//! Convex parts that keep cavities open.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d_f64::transformation::voxelization::{FillMode, VoxelSet};
use rand::Rng;

use super::hull::face_planes;
use super::{Mesh, SurfaceDistance, convex_hull, is_closed_manifold, sample_surface, simplify, slim_hull};
use crate::base::{Seed, rng_for};

/// How to cut a shape into convex parts.
#[derive(Clone, Debug)]
pub struct DecompositionConfig {
    /// At most so many parts.
    pub max_parts: usize,
    /// At most so many vertices per part.
    pub max_vertices: usize,
    /// Parts are merged while the merged one stands out of the shape by no more than this, m.
    pub max_protrusion: f64,
    /// One hull is enough where its volume exceeds the shape's by no more than this factor.
    pub convex_ratio: f64,
    /// Voxels along the longest side while cutting.
    pub resolution: u32,
}

impl Default for DecompositionConfig {
    fn default() -> Self {
        Self {
            max_parts: 24,
            max_vertices: 64,
            max_protrusion: 0.002,
            convex_ratio: 1.03,
            resolution: 64,
        }
    }
}

/// Hulls may leave out points that stand out of them by less than this, m: a flat bottom stays flat to it.
const HULL_TOLERANCE: f64 = 5e-5;
/// The concavity at which the first cut stops, as a share of the volume.
const CONCAVITY: f64 = 0.002;
/// A first cut into more parts than this is repeated more coarsely.
const MAX_CUTS: usize = 72;

/// Convex closed meshes that together stand for `mesh`: V-HACD (Mamou & Ghorbel 2009) finds the cuts, hulls are
/// taken of the surface itself (not of voxels, so nothing stands out of the shape's own hull and a flat bottom
/// stays flat), and parts are merged in the order of the volume they add. A shape that is nearly convex gives
/// one part. Empty for a mesh without volume.
pub fn convex_parts(mesh: &Mesh, config: &DecompositionConfig) -> Vec<Mesh> {
    let Some(whole) = slim_hull(&mesh.vertices, config.max_vertices, HULL_TOLERANCE) else {
        return Vec::new();
    };
    let Some(surface) = SurfaceDistance::new(mesh) else {
        return Vec::new();
    };
    let full = convex_hull(&mesh.vertices).map_or(0.0, |h| h.volume());
    let closed = is_closed_manifold(mesh).is_ok();
    if closed && full <= config.convex_ratio * mesh.volume()
        || protrusion(&whole, &surface) <= 0.5 * config.max_protrusion
    {
        return vec![whole];
    }
    let turn = box_rotation(mesh);
    let turned = mesh.transformed(&turn);
    let slim = simplify(&turned, 0.1 * config.max_protrusion);
    let cut = cut(&slim, config.resolution);
    let hulls: Vec<Mesh> = points_per_part(&turned, &cut)
        .iter()
        .filter_map(|points| slim_hull(points, config.max_vertices, HULL_TOLERANCE))
        .map(|hull| hull.transformed(&turn.inverse()))
        .collect();
    if hulls.is_empty() {
        return vec![whole];
    }
    merge(hulls, &surface, config)
}

/// How far a convex mesh stands out of a surface: largest distance of spread points that are outside, m.
fn protrusion(hull: &Mesh, surface: &SurfaceDistance) -> f64 {
    let mut rng = rng_for(Seed(0), "protrusion");
    sample_surface(hull, 150, &mut rng)
        .iter()
        .map(|s| surface.signed_or_guessed(&s.point))
        .fold(0.0, f64::max)
}

/// The turn that gives the mesh the smallest box: none if that is nearly as good, about z, or onto principal axes.
fn box_rotation(mesh: &Mesh) -> Isometry3<f64> {
    let volume = |r: &Rotation3<f64>| {
        let turned = mesh.vertices.iter().map(|v| (r * v).coords);
        let first = Vector3::repeat(f64::INFINITY);
        let (lo, hi) = turned.fold((first, -first), |(lo, hi), v| (lo.inf(&v), hi.sup(&v)));
        (hi - lo).product()
    };
    let yaw = |degrees: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
    let least = |candidates: &[Rotation3<f64>]| {
        let rated = candidates.iter().map(|r| (volume(r), *r));
        rated
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, Rotation3::identity()))
    };
    let coarse: Vec<f64> = (0..30).map(|i| f64::from(3 * i)).collect();
    let start = coarse
        .iter()
        .copied()
        .min_by(|a, b| volume(&yaw(*a)).total_cmp(&volume(&yaw(*b))));
    let fine: Vec<_> = (-20..=20)
        .map(|i| yaw(start.unwrap_or(0.0) + 0.1 * f64::from(i)))
        .collect();
    let best = [least(&fine), least(&[principal_axes(mesh)])];
    let best = if best[1].0 < 0.98 * best[0].0 { best[1] } else { best[0] };
    let turn = if best.0 < 0.98 * volume(&Rotation3::identity()) {
        best.1
    } else {
        Rotation3::identity()
    };
    Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::from_rotation_matrix(&turn))
}

fn principal_axes(mesh: &Mesh) -> Rotation3<f64> {
    let count = mesh.vertices.len().max(1) as f64;
    let mean = mesh.vertices.iter().map(|v| v.coords).sum::<Vector3<f64>>() / count;
    let spread: Matrix3<f64> = mesh
        .vertices
        .iter()
        .map(|v| (v.coords - mean) * (v.coords - mean).transpose())
        .sum();
    let mut axes = spread.symmetric_eigen().eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(2).neg_mut();
    }
    Rotation3::from_matrix_unchecked(axes.transpose())
}

fn cut(mesh: &Mesh, resolution: u32) -> VHACD {
    let points: Vec<Vector> = mesh.vertices.iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    let mut concavity = CONCAVITY;
    loop {
        let parameters = VHACDParameters {
            concavity,
            resolution,
            fill_mode: FillMode::FloodFill { detect_cavities: false },
            ..VHACDParameters::default()
        };
        let cut = VHACD::decompose(&parameters, &points, &mesh.triangles, false);
        if cut.voxel_parts().len() <= MAX_CUTS || concavity > 0.1 {
            return cut;
        }
        concavity *= 2.5;
    }
}

/// Which part holds each voxel, on a dense grid.
struct Grid {
    origin: Point3<f64>,
    scale: f64,
    low: [i64; 3],
    size: [i64; 3],
    part: Vec<u16>,
}

const NO_PART: u16 = u16::MAX;

impl Grid {
    fn new(parts: &[VoxelSet]) -> Option<Self> {
        let first = parts.first()?;
        let coords = |v: &parry3d_f64::transformation::voxelization::Voxel| {
            [i64::from(v.coords.x), i64::from(v.coords.y), i64::from(v.coords.z)]
        };
        let all = parts.iter().flat_map(|p| p.voxels()).map(coords);
        let (mut low, mut high) = ([i64::MAX; 3], [i64::MIN; 3]);
        for c in all {
            for axis in 0..3 {
                low[axis] = low[axis].min(c[axis]);
                high[axis] = high[axis].max(c[axis]);
            }
        }
        let size = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1).max(0));
        let mut grid = Self {
            origin: Point3::new(first.origin.x, first.origin.y, first.origin.z),
            scale: first.scale,
            low,
            size,
            part: vec![NO_PART; (size[0] * size[1] * size[2]) as usize],
        };
        for (i, part) in parts.iter().enumerate() {
            for c in part.voxels().iter().map(coords) {
                if let Some(at) = grid.index(c) {
                    grid.part[at] = i as u16;
                }
            }
        }
        Some(grid)
    }

    fn index(&self, c: [i64; 3]) -> Option<usize> {
        let [x, y, z] = [0, 1, 2].map(|axis| c[axis] - self.low[axis]);
        let inside = [x, y, z].iter().zip(self.size).all(|(c, n)| (0..n).contains(c));
        inside.then(|| ((x * self.size[1] + y) * self.size[2] + z) as usize)
    }

    /// The parts within `margin` voxels of a point; voxel centres lie on whole numbers.
    fn parts_near(&self, p: &Point3<f64>, margin: f64) -> BTreeSet<u16> {
        let place = (p - self.origin) / self.scale;
        let mut found = BTreeSet::new();
        for corner in 0..8 {
            let shift = |axis: usize| if corner >> axis & 1 == 1 { margin } else { -margin };
            let c = [0, 1, 2].map(|axis| (place[axis] + shift(axis)).round() as i64);
            found.extend(self.index(c).map(|i| self.part[i]).filter(|p| *p != NO_PART));
        }
        found
    }
}

/// Surface points of each part: vertices, and a lattice on each triangle of half a voxel. Points near a cut go to
/// both sides, so that parts meet; points that lie in no voxel are tried again more widely.
fn points_per_part(mesh: &Mesh, cut: &VHACD) -> Vec<Vec<Point3<f64>>> {
    let Some(grid) = Grid::new(cut.voxel_parts()) else {
        return Vec::new();
    };
    let mut points = vec![Vec::new(); cut.voxel_parts().len()];
    let mut give = |p: Point3<f64>| {
        let mut near = grid.parts_near(&p, 0.25);
        if near.is_empty() {
            near = grid.parts_near(&p, 1.0);
        }
        near.iter().for_each(|i| points[*i as usize].push(p));
    };
    mesh.vertices.iter().for_each(|v| give(*v));
    for t in 0..mesh.triangles.len() {
        lattice(&mesh.corners(t), 0.5 * grid.scale).for_each(&mut give);
    }
    points
}

/// Points of a triangle on a barycentric lattice no coarser than `spacing`, corners left out.
fn lattice([a, b, c]: &[Point3<f64>; 3], spacing: f64) -> impl Iterator<Item = Point3<f64>> + use<> {
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    let steps = (longest / spacing).ceil().clamp(1.0, 400.0) as usize;
    let (a, b, c) = (*a, *b, *c);
    (0..=steps)
        .flat_map(move |i| (0..=steps - i).map(move |j| (i, j)))
        .filter(move |&(i, j)| i != steps && j != steps && i + j != 0)
        .map(move |(i, j)| a + (b - a) * (i as f64 / steps as f64) + (c - a) * (j as f64 / steps as f64))
}

/// A pair of parts, what they would add in volume, and the part they would make.
struct Pair {
    a: usize,
    b: usize,
    added: f64,
    hull: Mesh,
    protrudes: bool,
}

/// Merges the pair that adds the least volume, again and again: all that stand out little enough, then more
/// until there are few enough.
fn merge(hulls: Vec<Mesh>, surface: &SurfaceDistance, config: &DecompositionConfig) -> Vec<Mesh> {
    let mut parts: Vec<Option<Mesh>> = hulls.into_iter().map(Some).collect();
    let mut pairs = Vec::new();
    for b in 0..parts.len() {
        for a in 0..b {
            pairs.extend(pair(&parts, a, b, config));
        }
    }
    loop {
        let alive = parts.iter().flatten().count();
        pairs.sort_by(|x, y| x.added.total_cmp(&y.added).then((x.a, x.b).cmp(&(y.a, y.b))));
        let Some(next) = choose(&mut pairs, surface, config, alive > config.max_parts) else {
            break;
        };
        let Pair { a, b, hull, .. } = pairs.remove(next);
        parts[a] = Some(hull);
        parts[b] = None;
        pairs.retain(|p| ![a, b].contains(&p.a) && ![a, b].contains(&p.b));
        for other in (0..parts.len()).filter(|i| *i != a) {
            pairs.extend(pair(&parts, a.min(other), a.max(other), config));
        }
    }
    let slim = |part: &Mesh| slim_hull(&part.vertices, config.max_vertices, HULL_TOLERANCE);
    parts.iter().flatten().filter_map(slim).collect()
}

/// The first pair that may be merged; where there are too many parts, else the cheapest one.
fn choose(pairs: &mut [Pair], surface: &SurfaceDistance, config: &DecompositionConfig, forced: bool) -> Option<usize> {
    for (i, p) in pairs.iter_mut().enumerate().filter(|(_, p)| !p.protrudes) {
        p.protrudes = protrusion(&p.hull, surface) > config.max_protrusion;
        if !p.protrudes {
            return Some(i);
        }
    }
    (forced && !pairs.is_empty()).then_some(0)
}

/// Nothing for parts that are far apart: they are never merged.
fn pair(parts: &[Option<Mesh>], a: usize, b: usize, config: &DecompositionConfig) -> Option<Pair> {
    let (x, y) = (parts[a].as_ref()?, parts[b].as_ref()?);
    if boxes_apart(x, y)? > config.max_protrusion {
        return None;
    }
    let points: Vec<Point3<f64>> = x.vertices.iter().chain(&y.vertices).copied().collect();
    let hull = convex_hull(&points)?;
    Some(Pair {
        a,
        b,
        added: hull.volume() - x.volume() - y.volume(),
        hull,
        protrudes: false,
    })
}

/// Gap between two boxes, m.
fn boxes_apart(x: &Mesh, y: &Mesh) -> Option<f64> {
    let ((xl, xh), (yl, yh)) = (x.bounds()?, y.bounds()?);
    let gap = (yl - xh).sup(&(xl - yh));
    Some(gap.sup(&Vector3::zeros()).norm())
}

/// Volume in both over volume in either (intersection over union) of a closed mesh and convex parts, from
/// `samples` points in the box around them. Nothing for an empty mesh.
pub fn decomposition_overlap(mesh: &Mesh, parts: &[Mesh], samples: usize, seed: Seed) -> Option<f64> {
    let surface = SurfaceDistance::new(mesh)?;
    let (lo, hi) = mesh.bounds()?;
    let (lo, hi) = parts
        .iter()
        .filter_map(Mesh::bounds)
        .fold((lo, hi), |(a, b), (c, d)| (a.inf(&c), b.sup(&d)));
    let planes: Vec<_> = parts.iter().map(face_planes).collect();
    let mut rng = rng_for(seed, "decomposition-overlap");
    let (mut both, mut either) = (0usize, 0usize);
    for _ in 0..samples {
        let p = lo + (hi - lo).map(|side| side * rng.random::<f64>());
        let in_mesh = surface.signed_or_guessed(&p) < 0.0;
        let in_parts = planes
            .iter()
            .any(|part| part.iter().all(|(n, d)| n.dot(&p.coords) <= *d));
        both += usize::from(in_mesh && in_parts);
        either += usize::from(in_mesh || in_parts);
    }
    (either > 0).then(|| both as f64 / either as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solids::{cuboid, cylinder, revolve, sphere, subdivided};

    fn parts_of(mesh: &Mesh) -> Vec<Mesh> {
        convex_parts(mesh, &DecompositionConfig::default())
    }

    pub(super) fn cup() -> Mesh {
        revolve(
            &[
                [0.0, 0.0],
                [0.04, 0.0],
                [0.04, 0.09],
                [0.036, 0.09],
                [0.036, 0.005],
                [0.0, 0.005],
            ],
            64,
        )
    }

    fn rough(mesh: &Mesh, amplitude: f64) -> Mesh {
        let mut rng = rng_for(Seed(5), "rough");
        let mut out = mesh.clone();
        for v in out.vertices.iter_mut().filter(|v| v.z > 1e-6) {
            *v += Vector3::from_fn(|_, _| amplitude * (2.0 * rng.random::<f64>() - 1.0));
        }
        out
    }

    #[test]
    fn convex_things_are_one_part() {
        for (name, mesh) in [
            ("box", cuboid([0.1, 0.2, 0.05])),
            ("cylinder", cylinder(0.04, 0.1, 64)),
            ("sphere", sphere(0.05, 4)),
            (
                "rough box",
                rough(&subdivided(&subdivided(&subdivided(&cuboid([0.1, 0.2, 0.05])))), 2e-4),
            ),
        ] {
            let parts = parts_of(&mesh);
            assert_eq!(parts.len(), 1, "{name}");
            assert!(parts[0].vertices.len() <= 64, "{name}");
        }
    }

    #[test]
    fn a_cup_stays_open_and_stands_flat() {
        let clean = cup();
        let scanned = rough(&subdivided(&subdivided(&clean)), 3e-4);
        for (name, mesh) in [("clean", &clean), ("scanned", &scanned)] {
            let parts = parts_of(mesh);
            assert!((4..=24).contains(&parts.len()), "{name}: {}", parts.len());
            let probes = (1..9).flat_map(|i| (0..12).map(move |k| (f64::from(i), f64::from(k))));
            for (i, k) in probes {
                let (sin, cos) = (std::f64::consts::TAU * k / 12.0).sin_cos();
                let p = Point3::new(0.031 * cos, 0.031 * sin, 0.01 * i);
                let inside = |m: &Mesh| face_planes(m).iter().all(|(n, d)| n.dot(&p.coords) < *d);
                assert!(!parts.iter().any(inside), "{name}: {p} is filled");
            }
            let lowest = |m: &Mesh| m.vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
            for z in parts.iter().map(lowest).filter(|z| *z < 0.004) {
                assert!(z.abs() < 1e-4, "{name}: {z}");
            }
            let surface = SurfaceDistance::new(mesh).unwrap();
            let worst = parts.iter().map(|p| protrusion(p, &surface)).fold(0.0, f64::max);
            assert!(worst < 0.004, "{name}: {worst}");
            let overlap = decomposition_overlap(mesh, &parts, 20_000, Seed(1)).unwrap();
            assert!(overlap > 0.75, "{name}: {overlap}");
        }
    }

    #[test]
    fn a_turned_tray_is_cut_along_its_walls() {
        let outer = cuboid([0.3, 0.2, 0.06]);
        let mut tray = outer.clone();
        // An inner box whose top is the rim: the tray's cavity, 5 mm from every wall.
        let inner = cuboid([0.29, 0.19, 0.06]).transformed(&Isometry3::translation(0.0, 0.0, 0.005));
        tray.triangles.retain(|t| !t.iter().all(|v| *v >= 4));
        let base = tray.vertices.len() as u32;
        tray.vertices
            .extend(inner.vertices.iter().map(|v| Point3::new(v.x, v.y, v.z.min(0.03))));
        let open = inner.triangles.iter().filter(|t| !t.iter().all(|v| *v >= 4));
        tray.triangles
            .extend(open.map(|t| [t[0] + base, t[2] + base, t[1] + base]));
        for (a, b) in [(4, 5), (5, 7), (7, 6), (6, 4)] {
            tray.triangles.push([a, b, b + base]);
            tray.triangles.push([a, b + base, a + base]);
        }
        assert_eq!(is_closed_manifold(&tray), Ok(()));
        let yaw = Isometry3::new(Vector3::zeros(), Vector3::z() * 0.5);
        let parts = parts_of(&tray.transformed(&yaw));
        assert!(parts.len() <= 9, "{}", parts.len());
        let overlap = decomposition_overlap(&tray.transformed(&yaw), &parts, 40_000, Seed(1)).unwrap();
        assert!(overlap > 0.9, "{overlap}");
    }
}
