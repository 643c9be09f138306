//! Things of which the symmetry is known by how they are made.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use palpate::base::{Seed, rng_for};
use palpate::geometry::solids::{cuboid, cylinder, revolve, sphere, torus};
use palpate::geometry::{Mesh, close_loops, parse_mesh};
use rand::Rng;

/// A thing in its own frame, standing on z = 0, with its symmetry.
pub struct Thing {
    pub name: String,
    pub mesh: Mesh,
    /// Normals of the planes, all through `center`.
    pub planes: Vec<Vector3<f64>>,
    /// Direction and fold (0 = any turn) of the axis that matters most, through `center`.
    pub axis: Option<(Vector3<f64>, u32)>,
    pub center: Point3<f64>,
    /// A ball has a centre.
    pub ball: bool,
    /// Its foot is flat: the volume can be judged where no view saw it from below.
    pub flat: bool,
}

const X: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);
const Y: Vector3<f64> = Vector3::new(0.0, 1.0, 0.0);
const Z: Vector3<f64> = Vector3::new(0.0, 0.0, 1.0);

/// Lifted so that it stands on z = 0; `center` moves along.
fn thing(
    name: &str,
    mesh: Mesh,
    planes: &[Vector3<f64>],
    axis: Option<(Vector3<f64>, u32)>,
    center: [f64; 3],
) -> Thing {
    let low = mesh.bounds().expect("not empty").0.z;
    let up = Isometry3::translation(0.0, 0.0, -low);
    Thing {
        name: name.into(),
        mesh: mesh.transformed(&up),
        planes: planes.to_vec(),
        axis,
        center: up * Point3::from(center),
        ball: false,
        flat: true,
    }
}

fn round(mut thing: Thing) -> Thing {
    thing.flat = false;
    thing
}

/// An outline, counter-clockwise, drawn up from z = 0.
pub fn extruded(outline: &[[f64; 2]], height: f64) -> Mesh {
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
    assert!(mesh.volume() > 0.0);
    mesh
}

fn regular(n: usize, radius: f64) -> Vec<[f64; 2]> {
    (0..n)
        .map(|i| TAU * i as f64 / n as f64)
        .map(|a| [radius * a.cos(), radius * a.sin()])
        .collect()
}

/// Normals of the `n` planes through z that a regular polygon with a corner on x has.
fn fan(n: usize) -> Vec<Vector3<f64>> {
    (0..n)
        .map(|i| PI * i as f64 / n as f64 + FRAC_PI_2)
        .map(|a| Vector3::new(a.cos(), a.sin(), 0.0))
        .collect()
}

fn blades(n: usize) -> Vec<[f64; 2]> {
    (0..n)
        .flat_map(|i| {
            let a = TAU * i as f64 / n as f64;
            let at = move |r: f64, d: f64| [r * (a + d).cos(), r * (a + d).sin()];
            [at(0.022, 0.0), at(0.06, 0.35), at(0.055, 0.65)]
        })
        .collect()
}

const MUG: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [0.04, 0.0],
    [0.04, 0.09],
    [0.036, 0.09],
    [0.036, 0.005],
    [0.0, 0.005],
];

fn handle(angle: f64, at: [f64; 2]) -> Mesh {
    let upright = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), FRAC_PI_2);
    let place = Isometry3::from_parts(Vector3::new(at[0], 0.0, at[1]).into(), upright);
    let turn = Isometry3::rotation(Z * angle);
    torus(0.025, 0.005, 48, 24).transformed(&(turn * place))
}

fn joined(parts: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    parts.iter().for_each(|p| all.append(p));
    all
}

fn boxed(size: [f64; 3], at: [f64; 3]) -> Mesh {
    cuboid(size).transformed(&Isometry3::translation(at[0], at[1], at[2]))
}

/// A ball pulled about by smooth waves of no symmetry.
pub fn stone(seed: u64, size: [f64; 3]) -> Mesh {
    let mut rng = rng_for(Seed(seed), "stone");
    let waves: Vec<(Vector3<f64>, f64, f64)> = (0..6)
        .map(|_| {
            let mut one = || rng.random_range(-1.0..1.0);
            let direction = Vector3::new(one(), one(), one()) * 2.5;
            (direction, rng.random_range(0.0..TAU), rng.random_range(0.05..0.1))
        })
        .collect();
    let mut mesh = sphere(1.0, 4);
    for v in &mut mesh.vertices {
        let swell: f64 = waves
            .iter()
            .map(|(k, phase, a)| a * (k.dot(&v.coords) + phase).sin())
            .sum();
        *v = Point3::from(v.coords.component_mul(&Vector3::from(size)) * (1.0 + swell));
    }
    mesh
}

/// Things with a symmetry.
pub fn symmetric() -> Vec<Thing> {
    let l = [
        [0.0, 0.0],
        [0.09, 0.0],
        [0.09, 0.03],
        [0.03, 0.03],
        [0.03, 0.09],
        [0.0, 0.09],
    ];
    let l_uneven = [
        [0.0, 0.0],
        [0.11, 0.0],
        [0.11, 0.025],
        [0.035, 0.025],
        [0.035, 0.07],
        [0.0, 0.07],
    ];
    let t = [
        [-0.015, 0.0],
        [0.015, 0.0],
        [0.015, 0.06],
        [0.05, 0.06],
        [0.05, 0.09],
        [-0.05, 0.09],
        [-0.05, 0.06],
        [-0.015, 0.06],
    ];
    let z = [
        [-0.06, 0.015],
        [-0.06, 0.045],
        [0.015, 0.045],
        [0.015, -0.015],
        [0.06, -0.015],
        [0.06, -0.045],
        [-0.015, -0.045],
        [-0.015, 0.015],
    ]
    .map(|[x, y]| [-x, y]);
    let bottle = [
        [0.0, 0.0],
        [0.035, 0.0],
        [0.035, 0.11],
        [0.03, 0.13],
        [0.014, 0.15],
        [0.013, 0.18],
        [0.0, 0.18],
    ];
    let bowl = [
        [0.0, 0.0],
        [0.03, 0.0],
        [0.055, 0.02],
        [0.07, 0.05],
        [0.066, 0.05],
        [0.051, 0.023],
        [0.028, 0.004],
        [0.0, 0.004],
    ];
    let tray = |[x, y, z]: [f64; 3], w: f64| {
        let outer = extruded(&[[-x, -y], [x, -y], [x, y], [-x, y]], z);
        let inner = extruded(&[[w - x, w - y], [x - w, w - y], [x - w, y - w], [w - x, y - w]], z - w);
        let mut open = joined(&[outer.subset(|t| outer.corners(t).iter().any(|p| p.z < 1e-9)), {
            let mut turned = inner.subset(|t| inner.corners(t).iter().any(|p| p.z < 1e-9));
            turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            turned.transformed(&Isometry3::translation(0.0, 0.0, w))
        }]);
        let top: Vec<u32> = (0..open.vertices.len() as u32)
            .filter(|v| open.vertices[*v as usize].z > z - 1e-9)
            .collect();
        for i in 0..4 {
            let j = (i + 1) % 4;
            open.triangles
                .extend([[top[i], top[j], top[4 + j]], [top[i], top[4 + j], top[4 + i]]]);
        }
        open
    };
    let mut ellipsoid = sphere(1.0, 4);
    for v in &mut ellipsoid.vertices {
        *v = Point3::from(v.coords.component_mul(&Vector3::new(0.05, 0.035, 0.025)));
    }
    let diagonal = Vector3::new(1.0, -1.0, 0.0).normalize();
    let mut pyramid = extruded(&regular(4, 0.06), 0.07);
    pyramid.vertices[4..]
        .iter_mut()
        .for_each(|v| *v = Point3::new(0.3 * v.x, 0.3 * v.y, v.z));
    let mut ball = round(thing("ball", sphere(0.04, 4), &[X, Y, Z], None, [0.0; 3]));
    ball.ball = true;
    let across = |mut planes: Vec<Vector3<f64>>| {
        planes.push(Z);
        planes
    };
    let cube = [X + Y, X - Y, X + Z, X - Z, Y + Z, Y - Z].map(|n| n.normalize());
    vec![
        thing("box", cuboid([0.06, 0.1, 0.14]), &[X, Y, Z], None, [0.0; 3]),
        thing("book", cuboid([0.15, 0.21, 0.03]), &[X, Y, Z], None, [0.0; 3]),
        thing(
            "cube",
            cuboid([0.08; 3]),
            &[&[X, Y, Z][..], &cube].concat(),
            None,
            [0.0; 3],
        ),
        thing(
            "cylinder",
            cylinder(0.035, 0.1, 128),
            &[X, Y, Z],
            Some((Z, 0)),
            [0.0; 3],
        ),
        thing(
            "frustum",
            revolve(&[[0.0, 0.0], [0.045, 0.0], [0.02, 0.08], [0.0, 0.08]], 128),
            &[X, Y],
            Some((Z, 0)),
            [0.0, 0.0, 0.04],
        ),
        thing("bottle", revolve(&bottle, 128), &[X, Y], Some((Z, 0)), [0.0, 0.0, 0.09]),
        thing(
            "mug",
            joined(&[revolve(&MUG, 128), handle(0.0, [0.045, 0.045])]),
            &[Y],
            None,
            [0.0, 0.0, 0.045],
        ),
        thing("cup", revolve(&MUG, 128), &[X, Y], Some((Z, 0)), [0.0, 0.0, 0.045]),
        thing("bowl", revolve(&bowl, 128), &[X, Y], Some((Z, 0)), [0.0, 0.0, 0.025]),
        ball,
        thing(
            "hexagon",
            extruded(&regular(6, 0.05), 0.06),
            &across(fan(6)),
            Some((Z, 6)),
            [0.0, 0.0, 0.03],
        ),
        thing(
            "triangle",
            extruded(&regular(3, 0.06), 0.05),
            &across(fan(3)),
            Some((Z, 3)),
            [0.0, 0.0, 0.025],
        ),
        thing(
            "octagon",
            extruded(&regular(8, 0.05), 0.05),
            &across(fan(8)),
            Some((Z, 8)),
            [0.0, 0.0, 0.025],
        ),
        thing("L", extruded(&l, 0.04), &[diagonal, Z], None, [0.0, 0.0, 0.02]),
        thing("L uneven", extruded(&l_uneven, 0.04), &[Z], None, [0.0, 0.0, 0.02]),
        thing("T", extruded(&t, 0.04), &[X, Z], None, [0.0, 0.0, 0.02]),
        thing("Z", extruded(&z, 0.04), &[Z], Some((Z, 2)), [0.0, 0.0, 0.02]),
        thing(
            "pinwheel",
            extruded(&blades(5), 0.03),
            &[Z],
            Some((Z, 5)),
            [0.0, 0.0, 0.015],
        ),
        round(thing("ellipsoid", ellipsoid, &[X, Y, Z], None, [0.0; 3])),
        thing("pyramid", pyramid, &fan(4), Some((Z, 4)), [0.0, 0.0, 0.035]),
        thing(
            "tray",
            tray([0.07, 0.05, 0.05], 0.008),
            &[X, Y],
            None,
            [0.0, 0.0, 0.025],
        ),
        round(thing(
            "torus",
            torus(0.045, 0.018, 128, 48),
            &[X, Y, Z],
            Some((Z, 0)),
            [0.0; 3],
        )),
    ]
}

fn bent(name: &str, mesh: Mesh) -> Thing {
    let low = mesh.bounds().expect("not empty").0.z;
    round(thing(name, mesh, &[], None, [0.0, 0.0, low]))
}

/// Things without any plane of reflection.
pub fn asymmetric() -> Vec<Thing> {
    let sizes = [
        [0.05, 0.035, 0.025],
        [0.045, 0.04, 0.03],
        [0.06, 0.04, 0.02],
        [0.04, 0.04, 0.04],
        [0.05, 0.03, 0.03],
        [0.07, 0.05, 0.03],
        [0.04, 0.03, 0.02],
    ];
    let mut all: Vec<Thing> = sizes
        .iter()
        .enumerate()
        .map(|(i, size)| bent(&format!("stone {i}"), stone(i as u64 + 1, *size)))
        .collect();
    let skewed = |mut mesh: Mesh, by: f64| {
        let top = mesh.bounds().expect("not empty").1.z;
        for v in &mut mesh.vertices {
            v.z *= 1.0 + by * v.x / 0.05 + 0.6 * by * v.y / 0.05;
            v.z = v.z.min(2.0 * top);
        }
        mesh
    };
    let wedge = [[0.0, 0.0], [0.1, 0.0], [0.03, 0.07]];
    let j = [
        [0.0, 0.0],
        [0.07, 0.0],
        [0.07, 0.1],
        [0.045, 0.1],
        [0.045, 0.03],
        [0.0, 0.03],
    ];
    let mut tetra = extruded(&wedge, 0.07);
    tetra.vertices[3..]
        .iter_mut()
        .for_each(|v| *v = Point3::new(0.02 + 0.2 * v.x, 0.01 + 0.15 * v.y, v.z));
    let mut cut = cuboid([0.06, 0.09, 0.12]);
    cut.vertices[7] += Vector3::new(-0.03, -0.02, -0.04);
    let helix = |turns: f64, shrink: f64| {
        let mut tube = torus(0.04, 0.01, 96, 20);
        for v in &mut tube.vertices {
            let angle = v.y.atan2(v.x);
            let along = angle / TAU;
            let r = v.x.hypot(v.y);
            let out = (r - 0.04) + 0.04 * (1.0 + shrink * along);
            *v = Point3::new(
                out * (turns * angle).cos(),
                out * (turns * angle).sin(),
                v.z * (1.0 + 0.3 * along) + 0.07 * along,
            );
        }
        // Cut where the ends of the coil would be joined.
        let mut open = tube.subset(|t| {
            let heights = tube.corners(t).map(|p| p.z);
            heights.iter().fold(f64::MIN, |a, b| a.max(*b)) - heights.iter().fold(f64::MAX, |a, b| a.min(*b)) < 0.03
        });
        close_loops(&mut open);
        open
    };
    let spout = boxed([0.03, 0.016, 0.02], [0.0, 0.05, 0.075]);
    let mug = revolve(&MUG, 128);
    all.extend([
        bent(
            "crooked",
            joined(&[
                cuboid([0.1, 0.04, 0.03]),
                boxed([0.03, 0.03, 0.08], [0.035, 0.005, 0.055]),
                boxed([0.02, 0.07, 0.02], [-0.02, 0.055, 0.003]),
            ]),
        ),
        bent("tetrahedron", tetra),
        bent("cut box", cut),
        bent("slanted wedge", skewed(extruded(&wedge, 0.05), 0.25)),
        bent("slanted J", skewed(extruded(&j, 0.05), 0.25)),
        bent(
            "mug with spout",
            joined(&[
                mug.clone(),
                handle(0.0, [0.045, 0.045]),
                spout.transformed(&Isometry3::rotation(Z * -0.3)),
            ]),
        ),
        bent(
            "mug, two handles",
            joined(&[mug.clone(), handle(0.0, [0.045, 0.045]), handle(1.9, [0.045, 0.06])]),
        ),
        bent(
            "camera",
            joined(&[
                cuboid([0.11, 0.04, 0.07]),
                cylinder(0.025, 0.04, 64)
                    .transformed(&Isometry3::new(Vector3::new(0.02, 0.035, -0.004), X * FRAC_PI_2)),
                boxed([0.02, 0.012, 0.012], [-0.035, 0.004, 0.04]),
            ]),
        ),
        bent("coil", helix(0.8, 0.5)),
        bent(
            "bracket",
            joined(&[
                cuboid([0.1, 0.03, 0.03]),
                boxed([0.03, 0.07, 0.02], [0.035, 0.05, 0.002]),
                boxed([0.02, 0.024, 0.09], [-0.036, 0.002, 0.06]),
            ]),
        ),
        bent(
            "box with knob",
            joined(&[
                cuboid([0.07, 0.1, 0.06]),
                sphere(0.015, 3).transformed(&Isometry3::translation(0.02, 0.03, 0.032)),
            ]),
        ),
        bent(
            "bottle with label",
            joined(&[
                revolve(
                    &[[0.0, 0.0], [0.035, 0.0], [0.035, 0.12], [0.012, 0.15], [0.0, 0.15]],
                    96,
                ),
                boxed([0.02, 0.04, 0.03], [0.035, 0.0, 0.04]),
                boxed([0.03, 0.014, 0.014], [-0.01, 0.035, 0.09]),
            ]),
        ),
        bent("bean", skewed(stone(77, [0.06, 0.03, 0.03]), 0.2)),
    ]);
    all
}

/// Scans of real things, where they are at hand: none is claimed to be symmetric or not.
pub fn scans() -> Vec<(String, Mesh)> {
    let Some(root) = std::env::var_os("PALPATE_DATA") else {
        println!("scans of real things are left out: PALPATE_DATA is not set");
        return Vec::new();
    };
    let folder = std::path::Path::new(&root).join("ycb/obj");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        return Vec::new();
    };
    let mut files: Vec<_> = entries.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    let mesh = |p: &std::path::PathBuf| parse_mesh(p, &std::fs::read(p).ok()?).ok();
    files
        .iter()
        .filter(|p| p.extension().is_some_and(|e| e == "obj"))
        .filter_map(|p| Some((p.file_stem()?.to_string_lossy().into_owned(), mesh(p)?)))
        .collect()
}
