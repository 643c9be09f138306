//! CPU time, memory and surface of the fusion of a sequence of range images:
//! `cargo bench --bench fusion -- [FOLDER] [--color] [--mesh OUT.ply] [--voxel 0.002] [--repeat 3] [--threads N]
//! [--one-by-one]`;
//! `benches/fusion_beside_open3d.py` runs it in turns with Open3D.
//!
//! FOLDER holds `capture.json` with `width`, `height`, `fx`, `fy`, `cx`, `cy`, `depth_scale` and `frames`, each with
//! `depth`, `color` (PNG) and `camera_to_world` (4 x 4, optical frame). Without one the lab renders a scene.
#![allow(
    missing_docs,
    clippy::expect_used,
    clippy::disallowed_macros,
    clippy::disallowed_methods,
    reason = "a program that measures stops at what it cannot read, and prints"
)]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use palpate::base::{Progress, Seed};
use palpate::capture::{Camera, ColorImage, DepthImage};
use palpate::geometry::Mesh;
use palpate::lab::{scene_named, synthesise};
use palpate::stages::shape::{Fusion, FusionConfig, Shot};

struct Frame {
    field_from_camera: Isometry3<f64>,
    depth: DepthImage,
    color: Option<ColorImage>,
}

struct Settings {
    folder: Option<String>,
    mesh: Option<String>,
    color: bool,
    /// Views are added one by one, as a live camera gives them, and not as a sequence.
    one_by_one: bool,
    repeat: usize,
    threads: Vec<usize>,
    fusion: FusionConfig,
}

fn main() {
    let settings = settings();
    let (camera, frames) = match &settings.folder {
        Some(folder) => read_frames(Path::new(folder)),
        None => lab_frames(),
    };
    println!(
        "{} frames of {} x {}, voxels of {} mm, truncation {} mm, colour {}",
        frames.len(),
        camera.width,
        camera.height,
        settings.fusion.voxel * 1e3,
        settings.fusion.truncation * 1e3,
        settings.color
    );
    let loaded = memory("VmRSS:");
    let mut first = None;
    for threads in settings.threads.iter().copied() {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a thread pool");
        let mesh = pool.install(|| measure(&camera, &frames, &settings, threads));
        assert!(
            first.get_or_insert_with(|| mesh.clone()) == &mesh,
            "the mesh depends on the number of threads"
        );
    }
    println!(
        "peak memory above the images {:.0} MB, of all {:.0} MB",
        memory("VmHWM:") - loaded,
        memory("VmHWM:")
    );
    if let (Some(path), Some(mesh)) = (&settings.mesh, &first) {
        fs::write(path, ply(mesh)).expect("a mesh file");
    }
}

fn settings() -> Settings {
    let mut found = Settings {
        folder: None,
        mesh: None,
        color: false,
        one_by_one: false,
        repeat: 3,
        threads: vec![1, 2],
        fusion: FusionConfig::default(),
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut number = || words.next().and_then(|w| w.parse::<f64>().ok()).expect("a number");
        match word.as_str() {
            "--bench" => {}
            "--color" => found.color = true,
            "--one-by-one" => found.one_by_one = true,
            "--voxel" => found.fusion = FusionConfig::with_voxel(number()),
            "--behind" => found.fusion.behind = number(),
            "--truncation" => found.fusion.truncation = number(),
            "--least-weight" => found.fusion.least_weight = number(),
            "--repeat" => found.repeat = number() as usize,
            "--threads" => found.threads = vec![number() as usize],
            "--mesh" => found.mesh = words.next(),
            _ => found.folder = Some(word),
        }
    }
    found
}

/// Fuses and extracts some times over, and prints the least of each time.
fn measure(camera: &Camera, frames: &[Frame], settings: &Settings, threads: usize) -> Mesh {
    let mut best = [f64::MAX; 4];
    let mut mesh = Mesh::default();
    let mut blocks = 0;
    let shots: Vec<Shot> = frames
        .iter()
        .map(|frame| Shot {
            field_from_camera: frame.field_from_camera,
            depth: &frame.depth,
            color: frame.color.as_ref().filter(|_| settings.color),
        })
        .collect();
    for _ in 0..settings.repeat.max(1) {
        let (wall, cpu) = (palpate::base::Stopwatch::start(), cpu_seconds());
        let mut fusion = Fusion::new(settings.fusion.clone()).expect("settings that work");
        for shots in shots.chunks(if settings.one_by_one { 1 } else { shots.len() }) {
            fusion.integrate_all(camera, shots).expect("frames that fit");
        }
        let (fused_wall, fused_cpu) = (wall.seconds(), cpu_seconds());
        mesh = fusion.extract();
        blocks = fusion.grid().keys().len();
        let times = [
            (fused_cpu - cpu) / frames.len() as f64,
            fused_wall / frames.len() as f64,
            cpu_seconds() - fused_cpu,
            wall.seconds() - fused_wall,
        ];
        best = std::array::from_fn(|i| best[i].min(times[i]));
    }
    println!(
        "{threads} threads: fusion {:.2} ms CPU a frame, {:.2} ms wall; extraction {:.3} s CPU, {:.3} s wall; {blocks} blocks, {} triangles",
        best[0] * 1e3,
        best[1] * 1e3,
        best[2],
        best[3],
        mesh.triangles.len()
    );
    mesh
}

/// User and system time of this process and of its threads that have ended, s, as Linux tells it in ticks of 10 ms.
fn cpu_seconds() -> f64 {
    let text = fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2);
    ticks.filter_map(|w| w.parse::<f64>().ok()).sum::<f64>() * 0.01
}

/// A line of `/proc/self/status`, MB.
fn memory(key: &str) -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with(key)).unwrap_or_default();
    let kilobytes: f64 = line
        .split_whitespace()
        .nth(1)
        .and_then(|w| w.parse().ok())
        .unwrap_or(0.0);
    kilobytes / 1024.0
}

fn read_frames(folder: &Path) -> (Camera, Vec<Frame>) {
    let text = fs::read_to_string(folder.join("capture.json")).expect("capture.json");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |key: &str| json[key].as_f64().expect("a number");
    let camera = Camera {
        name: "camera".into(),
        width: number("width") as u32,
        height: number("height") as u32,
        fx: number("fx"),
        fy: number("fy"),
        cx: number("cx"),
        cy: number("cy"),
        distortion: [0.0; 5],
        depth_unit: 1.0 / number("depth_scale"),
        depth_min: 0.1,
        depth_max: 3.0,
        depth_sd: None,
    };
    let frames = json["frames"].as_array().expect("frames");
    let frames = frames.iter().map(|f| read_frame(folder, f)).collect();
    (camera, frames)
}

fn read_frame(folder: &Path, json: &serde_json::Value) -> Frame {
    let open = |key: &str| image::open(folder.join(json[key].as_str().expect("a path"))).expect("an image");
    let (depth, color) = (open("depth").into_luma16(), open("color").into_rgb8());
    let entry = |r: usize, c: usize| json["camera_to_world"][r][c].as_f64().expect("a number");
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(entry));
    let (width, height) = depth.dimensions();
    Frame {
        field_from_camera: Isometry3::from_parts(
            Translation3::new(entry(0, 3), entry(1, 3), entry(2, 3)),
            UnitQuaternion::from_rotation_matrix(&rotation),
        ),
        depth: DepthImage {
            width,
            height,
            counts: depth.into_raw(),
        },
        color: Some(ColorImage {
            width,
            height,
            rgb: color.pixels().map(|p| p.0).collect(),
        }),
    }
}

/// The views of the lab's mug.
fn lab_frames() -> (Camera, Vec<Frame>) {
    let scene = scene_named("mug").expect("a scene of the lab");
    let made = synthesise(&scene, Path::new("."), Seed(1), &Progress::silent()).expect("a capture");
    let capture = made.capture;
    let frames = capture
        .views
        .into_iter()
        .map(|v| Frame {
            field_from_camera: v.world_from_camera.0,
            depth: v.depth,
            color: v.color,
        })
        .collect();
    (capture.cameras[0].clone(), frames)
}

fn ply(mesh: &Mesh) -> Vec<u8> {
    let mut head = String::from("ply\nformat binary_little_endian 1.0\n");
    let _ = write!(
        head,
        "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    let mut bytes = head.into_bytes();
    for x in mesh.vertices.iter().flat_map(|p| p.coords.iter()) {
        bytes.extend_from_slice(&(*x as f32).to_le_bytes());
    }
    for t in &mesh.triangles {
        bytes.push(3);
        for v in t {
            bytes.extend_from_slice(&v.to_le_bytes());
        }
    }
    bytes
}
