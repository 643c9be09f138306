//! Recover the truth: planes of shapes whose planes are known.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::Rng;

use super::{Config, Evidence, detect};
use crate::base::{Notices, Seed, rng_for};
use crate::geometry::solids::{cuboid, cylinder, revolve, sphere, subdivided, torus};
use crate::geometry::{Mesh, close_loops};
use crate::twin::{Symmetry, SymmetryPlane};

fn planes_of(mesh: &Mesh) -> Vec<SymmetryPlane> {
    found(mesh).planes
}

fn found(mesh: &Mesh) -> Symmetry {
    detect(
        "it",
        mesh,
        &Evidence::default(),
        &Config::default(),
        &mut Notices::default(),
    )
    .unwrap()
}

/// Angle, degrees, and distance, m, between a found plane and a true one through `point`.
fn misfit(found: &SymmetryPlane, normal: &Vector3<f64>, point: &Point3<f64>) -> (f64, f64) {
    let n = Vector3::from(found.normal);
    let angle = n.cross(normal).norm().atan2(n.dot(normal).abs()).to_degrees();
    (angle, (n.dot(&point.coords) - found.offset).abs())
}

fn check(name: &str, mesh: &Mesh, truth: &[Vector3<f64>], point: Point3<f64>, degrees: f64, metres: f64) {
    let found = planes_of(mesh);
    assert_eq!(found.len(), truth.len(), "{name}: {found:?}");
    for normal in truth {
        let ok = |p: &SymmetryPlane| {
            let (angle, offset) = misfit(p, normal, &point);
            angle < degrees && offset < metres
        };
        assert!(found.iter().any(ok), "{name}: {normal} is not among {found:?}");
    }
}

fn fine(mesh: Mesh, times: usize) -> Mesh {
    (0..times).fold(mesh, |m, _| subdivided(&m))
}

/// A cup of 8 cm with a ring for a handle on its +x side: one plane, y = 0.
fn mug() -> Mesh {
    let profile = [
        [0.0, 0.0],
        [0.04, 0.0],
        [0.04, 0.09],
        [0.036, 0.09],
        [0.036, 0.005],
        [0.0, 0.005],
    ];
    let mut mug = fine(revolve(&profile, 64), 1);
    let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let at = Isometry3::from_parts(Vector3::new(0.045, 0.0, 0.045).into(), upright);
    mug.append(&torus(0.025, 0.005, 48, 24).transformed(&at));
    mug
}

fn rough(mesh: &Mesh, sd: f64) -> Mesh {
    let mut rng = rng_for(Seed(11), "rough");
    let mut out = mesh.clone();
    for v in &mut out.vertices {
        // A sum of three uniform numbers, near enough to a bell.
        *v += Vector3::from_fn(|_, _| sd * 2.0 * ((0..3).map(|_| rng.random::<f64>()).sum::<f64>() - 1.5));
    }
    out
}

const POSE: [f64; 6] = [0.3, -0.2, 0.05, 0.0, 0.0, 0.6];

fn pose() -> Isometry3<f64> {
    Isometry3::new(
        Vector3::new(POSE[0], POSE[1], POSE[2]),
        Vector3::new(POSE[3], POSE[4], POSE[5]),
    )
}

#[test]
fn a_box_has_three_planes_and_a_cube_nine() {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|n| pose() * n);
    let center = Point3::from(pose().translation.vector);
    check(
        "box",
        &cuboid([0.06, 0.1, 0.2]).transformed(&pose()),
        &axes,
        center,
        0.5,
        5e-4,
    );
    let cube = planes_of(&cuboid([0.1; 3]).transformed(&pose()));
    assert_eq!(cube.len(), 9, "{cube:?}");
}

#[test]
fn a_mug_has_one_plane_clean_or_scanned() {
    let normal = [pose() * Vector3::y()];
    let point = pose() * Point3::new(0.0, 0.0, 0.045);
    check("clean", &mug().transformed(&pose()), &normal, point, 0.5, 5e-4);
    check(
        "scanned",
        &rough(&mug(), 5e-4).transformed(&pose()),
        &normal,
        point,
        1.0,
        1e-3,
    );
}

#[test]
fn lathe_shapes_get_two_planes_through_the_axis() {
    let notes = |mesh: &Mesh| {
        let mut notices = Notices::default();
        let planes = detect("it", mesh, &Evidence::default(), &Config::default(), &mut notices)
            .unwrap()
            .planes;
        (planes, notices.0.len())
    };
    let tilt = Isometry3::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.5, 0.2, 0.0));
    for (name, mesh, across) in [
        ("cylinder", cylinder(0.035, 0.1, 96), 1),
        (
            "cone",
            revolve(&[[0.0, 0.0], [0.04, 0.0], [0.02, 0.08], [0.0, 0.08]], 96),
            0,
        ),
    ] {
        let (planes, notices) = notes(&mesh.transformed(&tilt));
        assert_eq!((planes.len(), notices), (2 + across, 1), "{name}: {planes:?}");
        let axis = tilt * Vector3::z();
        let upright = |p: &&SymmetryPlane| Vector3::from(p.normal).dot(&axis).abs() < 0.01;
        let through: Vec<_> = planes.iter().filter(upright).collect();
        assert_eq!(through.len(), 2, "{name}: {planes:?}");
        let dot = Vector3::from(through[0].normal).dot(&Vector3::from(through[1].normal));
        assert!(dot.abs() < 0.02, "{name}: {planes:?}");
        for p in through {
            assert!(
                misfit(p, &p.normal.into(), &(tilt * Point3::origin())).1 < 5e-4,
                "{name}: {planes:?}"
            );
        }
    }
    let (ball, notices) = notes(&sphere(0.05, 4).transformed(&tilt));
    assert_eq!((ball.len(), notices), (3, 1), "{ball:?}");
}

#[test]
fn a_crooked_thing_has_none() {
    let mut mesh = cuboid([0.1, 0.04, 0.03]);
    mesh.append(&cuboid([0.03, 0.03, 0.08]).transformed(&Isometry3::translation(0.035, 0.005, 0.055)));
    mesh.append(&cuboid([0.02, 0.07, 0.02]).transformed(&Isometry3::translation(-0.02, 0.055, 0.003)));
    assert_eq!(planes_of(&mesh).len(), 0, "{:?}", planes_of(&mesh));
    assert_eq!(planes_of(&Mesh::default()).len(), 0);
}

#[test]
fn the_plane_of_a_half_seen_mug_is_found_from_what_was_seen() {
    let mut mesh = fine(mug(), 1);
    // Looked at along (1, 1, -1): the far side was closed by something flatter.
    let toward = Vector3::new(-1.0, -0.4, 1.0).normalize();
    let center = Vector3::new(0.0, 0.0, 0.045);
    mesh.seen = mesh
        .vertices
        .iter()
        .map(|v| (v.coords - center).dot(&toward) > -0.01)
        .collect();
    for i in 0..mesh.vertices.len() {
        if !mesh.seen[i] {
            let depth = (mesh.vertices[i].coords - center).dot(&toward) + 0.01;
            mesh.vertices[i] -= toward * (0.4 * depth);
        }
    }
    let found = planes_of(&mesh.transformed(&pose()));
    let (angle, offset) = misfit(
        &found[0],
        &(pose() * Vector3::y()),
        &(pose() * Point3::new(0.0, 0.0, 0.045)),
    );
    assert!(angle < 2.0 && offset < 2e-3, "{angle} {offset} {found:?}");
}

/// An outline drawn up from z = 0.
fn extruded(outline: &[[f64; 2]], height: f64) -> Mesh {
    let n = outline.len() as u32;
    let ring = |z: f64| outline.iter().map(move |p| Point3::new(p[0], p[1], z));
    let mut mesh = Mesh {
        vertices: ring(0.0).chain(ring(height)).collect(),
        ..Mesh::default()
    };
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.extend([[i, j, n + j], [i, n + j, n + i]]);
    }
    assert_eq!(close_loops(&mut mesh), 0);
    mesh
}

fn star(corners: usize, radii: [f64; 2], twist: f64) -> Vec<[f64; 2]> {
    let step = std::f64::consts::TAU / corners as f64;
    let place = |r: f64, a: f64| [r * a.cos(), r * a.sin()];
    (0..corners)
        .flat_map(|i| {
            [
                place(radii[0], i as f64 * step),
                place(radii[1], (i as f64 + twist) * step),
            ]
        })
        .collect()
}

#[test]
fn turns_are_counted_with_and_without_planes() {
    let z = [
        [0.06, 0.015],
        [0.06, 0.045],
        [-0.015, 0.045],
        [-0.015, -0.015],
        [-0.06, -0.015],
        [-0.06, -0.045],
        [0.015, -0.045],
        [0.015, 0.015],
    ];
    for (name, outline, planes, fold) in [
        ("hexagon", star(6, [0.05, 0.05 * 0.75f64.sqrt()], 0.5), 7, 6),
        ("pinwheel of five", star(5, [0.022, 0.06], 0.6), 1, 5),
        ("Z", z.to_vec(), 1, 2),
    ] {
        let symmetry = found(&extruded(&outline, 0.04).transformed(&pose()));
        assert_eq!(symmetry.planes.len(), planes, "{name}: {:?}", symmetry.planes);
        let best = &symmetry.axes[0];
        assert_eq!(best.fold, fold, "{name}: {:?}", symmetry.axes);
        let d = Vector3::from(best.direction);
        let off = (Point3::from(best.point) - pose().translation.vector)
            .coords
            .cross(&d)
            .norm();
        let tilt = d.cross(&(pose() * Vector3::z())).norm().to_degrees();
        assert!(tilt < 0.5 && off < 5e-4, "{name}: {tilt} {off}");
    }
}

#[test]
fn a_ball_has_a_centre_and_a_notice_names_the_thing() {
    let at = Isometry3::translation(0.1, -0.2, 0.05);
    let mut notices = Notices::default();
    let mesh = sphere(0.04, 4).transformed(&at);
    let ball = detect("marble", &mesh, &Evidence::default(), &Config::default(), &mut notices).unwrap();
    let center = Point3::from(ball.center.expect("a centre").point);
    assert!((center - at.translation.vector).coords.norm() < 1e-4, "{center}");
    assert_eq!(notices.0[0].about, "marble");
}

/// Noise of every vertex on its own: the intervals must hold the truth at about their rate, and not be idle.
#[test]
fn intervals_hold_over_noise() {
    let (mut held, mut idle, runs) = (0, 0, 16);
    for seed in 0..runs {
        let mut rng = rng_for(Seed(seed), "noise");
        let mut mesh = fine(cuboid([0.06, 0.1, 0.14]), 4).transformed(&pose());
        for v in &mut mesh.vertices {
            *v += Vector3::from_fn(|_, _| 2e-4 * 2.0 * ((0..3).map(|_| rng.random::<f64>()).sum::<f64>() - 1.5));
        }
        let known = Evidence {
            noise: 2e-4,
            ..Evidence::default()
        };
        let symmetry = detect("it", &mesh, &known, &Config::default(), &mut Notices::default()).unwrap();
        assert_eq!(symmetry.planes.len(), 3);
        for p in &symmetry.planes {
            let truth = Vector3::from(p.normal).dot(&pose().translation.vector);
            let off = (p.offset - truth).abs() / p.offset_sd.expect("a deviation");
            held += usize::from(off < 1.96);
            idle += usize::from(p.offset_sd.is_some_and(|sd| sd > 3e-4));
        }
    }
    assert!(held >= 44 && idle == 0, "{held} of 48 hold, {idle} say nothing");
}

/// The mirrored half lands where views saw that nothing is.
#[test]
fn free_space_vetoes_a_plane() {
    let mut half = fine(cuboid([0.1, 0.06, 0.04]), 4);
    half.append(&fine(cuboid([0.02, 0.02, 0.03]), 3).transformed(&Isometry3::translation(0.035, 0.0, 0.035)));
    // Only the +x half was seen.
    half.seen = half.vertices.iter().map(|v| v.x > 0.0).collect();
    let across = |known: &Evidence| {
        let planes = detect("it", &half, known, &Config::default(), &mut Notices::default())
            .unwrap()
            .planes;
        planes.iter().any(|p| p.normal[0].abs() > 0.99 && p.offset.abs() < 0.01)
    };
    let free = |p: &Point3<f64>| p.z > 0.0215 && (p.x - 0.035).abs() > 0.011;
    let known = Evidence {
        free: Some(&free),
        ..Evidence::default()
    };
    assert!(!across(&known));
}
