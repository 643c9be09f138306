//! Cups stay open, trays are cut along their walls, boxes stay whole.

use nalgebra::{Isometry3, Point3, Vector3};
use rand::Rng;

use super::parts::protrusion;
use super::{DecompositionConfig, convex_parts, decomposition_overlap};
use crate::base::{Seed, rng_for};
use crate::geometry::hull::face_planes;
use crate::geometry::solids::{cuboid, cylinder, revolve, sphere, subdivided};
use crate::geometry::{Mesh, SurfaceDistance, is_closed_manifold};

fn parts_of(mesh: &Mesh) -> Vec<Mesh> {
    convex_parts(mesh, &DecompositionConfig::default())
}

fn cup() -> Mesh {
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
        (
            "very rough board",
            rough(
                &subdivided(&subdivided(&subdivided(&cuboid([0.13, 0.018, 0.04])))),
                8e-4,
            ),
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
        // Walls of 4 mm may grow by the 2 mm that a part may stand out: that much of the overlap is given away.
        let overlap = decomposition_overlap(mesh, &parts, 20_000, Seed(1)).unwrap();
        assert!(overlap > 0.68, "{name}: {overlap}");
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
    assert!(parts.len() <= 24, "{}", parts.len());
    let overlap = decomposition_overlap(&tray.transformed(&yaw), &parts, 40_000, Seed(1)).unwrap();
    assert!(overlap > 0.6, "{overlap} {}", parts.len());
}
