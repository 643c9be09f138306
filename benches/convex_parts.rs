//! How well convex parts fill a shape, how many, and how long they take:
//! `cargo bench --bench convex_parts -- [MESH …] [--out FOLDER]`.
#![allow(
    clippy::expect_used,
    clippy::disallowed_macros,
    reason = "a benchmark prints what it measured"
)]

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use palpate::base::Seed;
use palpate::geometry::{
    DecompositionConfig, Mesh, convex_parts, decomposition_overlap, parse_mesh, solids, write_obj,
};

/// A lathe cup of the lab's measures.
fn cup() -> Mesh {
    let profile = [
        [0.0, 0.0],
        [0.04, 0.0],
        [0.04, 0.095],
        [0.036, 0.095],
        [0.036, 0.005],
        [0.0, 0.005],
    ];
    solids::revolve(&profile, 96)
}

fn bowl() -> Mesh {
    let profile = [
        [0.0, 0.0],
        [0.025, 0.0],
        [0.035, 0.006],
        [0.055, 0.030],
        [0.062, 0.050],
        [0.059, 0.050],
        [0.052, 0.031],
        [0.032, 0.010],
        [0.0, 0.008],
    ];
    solids::revolve(&profile, 96)
}

/// A prism over a polygon in x and y, walls along z.
fn prism(outline: &[[f64; 2]], faces: &[[u32; 3]], height: f64) -> Mesh {
    let n = outline.len() as u32;
    let level = |z: f64| outline.iter().map(move |p| Point3::new(p[0], p[1], z));
    let mut mesh = Mesh {
        vertices: level(0.0).chain(level(height)).collect(),
        ..Mesh::default()
    };
    for f in faces {
        mesh.triangles.push([f[0], f[2], f[1]]);
        mesh.triangles.push(f.map(|v| v + n));
    }
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.push([i, j, j + n]);
        mesh.triangles.push([i, j + n, i + n]);
    }
    mesh
}

fn angle_bracket() -> Mesh {
    let outline = [
        [0.0, 0.0],
        [0.1, 0.0],
        [0.1, 0.02],
        [0.02, 0.02],
        [0.02, 0.08],
        [0.0, 0.08],
    ];
    prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]], 0.04)
}

/// An open box with walls and bottom of `wall`, m.
fn open_box([x, y, z]: [f64; 3], wall: f64) -> Mesh {
    let mut mesh = solids::cuboid([x, y, z]);
    mesh.triangles.retain(|t| !t.iter().all(|v| *v >= 4));
    let mut inner = solids::cuboid([x - 2.0 * wall, y - 2.0 * wall, z]);
    for v in &mut inner.vertices {
        v.z = if v.z < 0.0 { wall - 0.5 * z } else { 0.5 * z };
    }
    let base = mesh.vertices.len() as u32;
    mesh.vertices.extend(&inner.vertices);
    let walls = inner.triangles.iter().filter(|t| !t.iter().all(|v| *v >= 4));
    mesh.triangles
        .extend(walls.map(|t| [t[0] + base, t[2] + base, t[1] + base]));
    for (a, b) in [(4, 5), (5, 7), (7, 6), (6, 4)] {
        mesh.triangles.push([a, b, b + base]);
        mesh.triangles.push([a, b + base, a + base]);
    }
    mesh
}

/// CPU seconds of this process, all threads, from the system's account of it.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|t| t.parse::<f64>().ok()).unwrap_or(f64::NAN);
    (ticks(11) + ticks(12)) / 100.0
}

fn judge(name: &str, mesh: &Mesh, out: Option<&Path>) {
    let start = cpu_seconds();
    let parts = convex_parts(mesh, &DecompositionConfig::default());
    let seconds = cpu_seconds() - start;
    let overlap = decomposition_overlap(mesh, &parts, 40_000, Seed(0)).unwrap_or(0.0);
    let most = parts.iter().map(|p| p.vertices.len()).max().unwrap_or(0);
    println!(
        "{name:24} triangles {:6}  overlap {overlap:.3}  parts {:2}  vertices at most {most:2}  cpu {seconds:.2} s",
        mesh.triangles.len(),
        parts.len()
    );
    for (k, part) in parts.iter().enumerate() {
        if let Some(folder) = out {
            std::fs::create_dir_all(folder).expect("a folder");
            std::fs::write(folder.join(format!("{name}.{k}.obj")), write_obj(part)).expect("written");
        }
    }
}

fn main() {
    let mut files: Vec<PathBuf> = Vec::new();
    let mut out = None;
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        if argument == "--out" {
            out = arguments.next().map(PathBuf::from);
        } else {
            files.push(argument.into());
        }
    }
    for file in &files {
        let mesh = parse_mesh(file, &std::fs::read(file).expect("a mesh file")).expect("a mesh");
        let name = file.file_stem().map_or("mesh".into(), |s| s.to_string_lossy());
        judge(&name, &mesh, out.as_deref());
    }
    for (name, mesh) in [
        ("lathe cup", cup()),
        ("bowl", bowl()),
        ("angle bracket", angle_bracket()),
        ("open box", open_box([0.3, 0.2, 0.06], 0.005)),
        ("drawer", open_box([0.25, 0.3, 0.1], 0.008)),
        ("torus", solids::torus(0.045, 0.014, 96, 48)),
    ] {
        judge(name, &mesh, out.as_deref());
    }
}
