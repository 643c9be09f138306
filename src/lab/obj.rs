//! Wavefront OBJ in and out, for the lab alone.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;

use nalgebra::Point3;

use crate::base::{Error, Result, read_text};
use crate::geometry::Mesh;

/// `mesh` as the text of an OBJ file, 0.1 µm fine.
pub(super) fn write_obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::new();
    for v in &mesh.vertices {
        // Adding zero turns -0 into 0.
        let [x, y, z] = [v.x, v.y, v.z].map(|c| (c * 1e7).round() / 1e7 + 0.0);
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text.into_bytes()
}

/// The triangles of an OBJ file; vertices at the same place are one vertex.
///
/// # Errors
/// A file that is missing or is no OBJ.
pub(super) fn read_obj(path: &Path) -> Result<Mesh> {
    let text = read_text(path)?;
    let options = tobj::LoadOptions {
        triangulate: true,
        ..tobj::LoadOptions::default()
    };
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(text.as_bytes()), &options, |_| {
        Ok((Vec::new(), Default::default()))
    })
    .map_err(|e| Error::bad_input(path, "the file", e.to_string(), "triangles or polygons in OBJ"))?;
    let mut mesh = Mesh::default();
    let mut places: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    for model in &models {
        let mut weld = |corner: u32| {
            let at = 3 * corner as usize;
            let xyz = [0, 1, 2].map(|k| model.mesh.positions[at + k] + 0.0);
            *places.entry(xyz.map(f32::to_bits)).or_insert_with(|| {
                mesh.vertices.push(Point3::from(xyz.map(f64::from)));
                mesh.vertices.len() as u32 - 1
            })
        };
        let triangles: Vec<[u32; 3]> = model
            .mesh
            .indices
            .chunks_exact(3)
            .map(|t| [weld(t[0]), weld(t[1]), weld(t[2])])
            .collect();
        mesh.triangles.extend(triangles);
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::super::surface::{is_closed, surface};
    use super::*;
    use crate::lab::ShapeSpec;

    #[test]
    fn a_surface_comes_back_from_its_file() {
        let mesh = surface(&ShapeSpec::Tray {
            size: [0.12, 0.1, 0.06],
            wall: 0.006,
            open: "+x".into(),
        });
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("tray.obj");
        crate::base::write_atomically(&path, &write_obj(&mesh)).expect("written");
        let back = read_obj(&path).expect("read");
        assert!(is_closed(&back));
        assert!((back.volume() - mesh.volume()).abs() < 1e-6 * mesh.volume());
    }
}
