//! The shape pass against scenes of which the truth is known, and against recorded ones.

#[cfg(test)]
mod synthetic;

use std::path::PathBuf;

use super::*;
use crate::base::{Notices, Stopwatch, write_atomically};
use crate::capture::{Capture, read_capture};
use crate::geometry::{Mesh, edge_defects};

/// The recorded capture of that name, where the data is at hand.
fn recorded(name: &str) -> Option<Capture> {
    let Some(root) = std::env::var_os("PALPATE_DATA") else {
        eprintln!("skipped: PALPATE_DATA is not set");
        return None;
    };
    Some(read_capture(&PathBuf::from(root).join(name)).unwrap())
}

fn shaped(capture: &Capture) -> Shapes {
    let mut notices = Notices::default();
    let watch = Stopwatch::start();
    let shapes = reconstruct(capture, &Config::default(), &mut notices).unwrap();
    eprintln!(
        "{}: {:.2} s, support {:?}",
        capture.name,
        watch.seconds(),
        shapes.support
    );
    for o in &shapes.objects {
        let (low, high) = o.mesh.bounds().unwrap();
        eprintln!(
            "  {} at {:.4?} size {:.4?} low {:.4?} volume {:.2} cm3, {} triangles, seen {:.3}, defects {}",
            o.name,
            o.world_from_link.translation.vector.as_slice(),
            (high - low).as_slice(),
            low.coords.as_slice(),
            o.mesh.volume() * 1e6,
            o.mesh.triangles.len(),
            o.seen,
            edge_defects(&o.mesh)
        );
        write_ply(&capture.name, &o.name, &o.mesh, &o.world_from_link);
    }
    for n in &notices.0 {
        eprintln!("  {:?} {}: {}", n.severity, n.about, n.message);
    }
    for o in &shapes.objects {
        assert_eq!(edge_defects(&o.mesh), 0, "{}", o.name);
        assert!(o.mesh.volume() > 0.0);
        assert_eq!(o.mesh.seen.len(), o.mesh.vertices.len());
    }
    shapes
}

/// For the eye: PALPATE_SHAPE_OUT names a folder that the meshes are written to.
fn write_ply(scene: &str, name: &str, mesh: &Mesh, pose: &crate::base::Pose) {
    use std::fmt::Write;
    let Some(folder) = std::env::var_os("PALPATE_SHAPE_OUT") else {
        return;
    };
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar seen\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    for (i, v) in mesh.vertices.iter().enumerate() {
        let v = pose.0 * *v;
        let [r, g, b] = mesh.colors.get(i).copied().unwrap_or([128; 3]);
        let seen = u8::from(mesh.seen.get(i).copied().unwrap_or(true));
        writeln!(text, "{:.6} {:.6} {:.6} {r} {g} {b} {seen}", v.x, v.y, v.z).unwrap();
    }
    for t in &mesh.triangles {
        writeln!(text, "3 {} {} {}", t[0], t[1], t[2]).unwrap();
    }
    write_atomically(
        &PathBuf::from(folder).join(format!("{scene}.{}.ply", name.replace('/', "_"))),
        text.as_bytes(),
    )
    .unwrap();
}

#[test]
fn recorded_tin_is_one_body() {
    let Some(capture) = recorded("mujoco-tin") else { return };
    let shapes = shaped(&capture);
    assert_eq!(shapes.objects.len(), 1);
    assert_eq!(shapes.objects[0].name, "tin");
}

#[test]
fn recorded_stack_is_two_bodies() {
    let Some(capture) = recorded("mujoco-stack") else {
        return;
    };
    let names: Vec<String> = shaped(&capture).objects.into_iter().map(|o| o.name).collect();
    assert_eq!(names, ["low", "top"]);
}

#[test]
fn recorded_hinge_is_two_bodies() {
    let Some(capture) = recorded("mujoco-hinge") else {
        return;
    };
    let names: Vec<String> = shaped(&capture).objects.into_iter().map(|o| o.name).collect();
    assert_eq!(names, ["base", "arm"]);
}

#[test]
fn recorded_pad_is_one_body() {
    let Some(capture) = recorded("mujoco-pad") else { return };
    assert_eq!(shaped(&capture).objects.len(), 1);
}

#[test]
fn recorded_shelf_gives_things() {
    let Some(capture) = recorded("shelf-views") else { return };
    let mut notices = Notices::default();
    let scene = seen_surface(&capture, &Config::default(), &mut notices).unwrap();
    write_ply("shelf-views", "scene", &scene, &crate::base::Pose::identity());
    assert!(!shaped(&capture).objects.is_empty());
}
