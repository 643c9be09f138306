//! The one door for mesh files: picks the format by the name's ending and checks what comes out.

use std::path::Path;

use super::soup::Soup;
use super::{gltf, obj, ply, stl};
use crate::base::{Error, Result};
use crate::geometry::Mesh;

/// Reads an OBJ, STL, PLY or glTF mesh from the bytes of the file `path` (which is only named, not opened).
///
/// Units are taken as metres and axes as they stand (glTF's y-up is not turned). Polygons are cut into fans,
/// vertices at the same place are merged, unused vertices and triangles that use one vertex twice are dropped.
/// Vertex colours are kept; materials and textures are not, but for glTF's base colour.
///
/// # Errors
/// `BadInput`, naming the place, for an unknown ending, broken syntax, a vertex that is not finite, an index
/// that is out of range, or a mesh without triangles.
pub fn parse_mesh(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let soup = match ending.as_deref() {
        Some("obj") => obj::parse(path, bytes)?,
        Some("stl") => stl::parse(path, bytes)?,
        Some("ply") => ply::parse(path, bytes)?,
        Some("glb" | "gltf") => gltf::parse(path, bytes)?,
        other => {
            let found = other.map_or_else(|| "none".into(), |e| format!("`.{e}`"));
            return Err(Error::bad_input(
                path,
                "ending",
                found,
                "`.obj`, `.stl`, `.ply`, `.glb` or `.gltf`",
            ));
        }
    };
    check(path, &soup)?;
    let mesh = soup.merged();
    if mesh.triangles.is_empty() {
        return Err(Error::bad_input(
            path,
            "triangles",
            "none",
            "at least one with three distinct corners",
        ));
    }
    Ok(mesh)
}

fn check(path: &Path, soup: &Soup) -> Result<()> {
    if let Some(i) = soup
        .vertices
        .iter()
        .position(|v| !v.coords.iter().all(|c| c.is_finite()))
    {
        let v = soup.vertices[i];
        let found = format!("({}, {}, {})", v.x, v.y, v.z);
        return Err(Error::bad_input(
            path,
            format!("vertex {i}"),
            found,
            "finite coordinates",
        ));
    }
    for (i, t) in soup.triangles.iter().enumerate() {
        if let Some(v) = t.iter().find(|v| **v as usize >= soup.vertices.len()) {
            return Err(Error::bad_input(
                path,
                format!("triangle {i}"),
                format!("vertex {v}"),
                format!("an index below {}", soup.vertices.len()),
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::is_closed_manifold;

    const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";

    fn message(name: &str, text: &str) -> String {
        parse_mesh(Path::new(name), text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        for (name, text, part) in [
            ("a.xyz", "", "`.obj`"),
            ("a.obj", "", "triangles: found none"),
            (
                "a.obj",
                "v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n",
                "vertex 2: found (NaN, 1, 0)",
            ),
            ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: found `4`"),
            ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "line 4: found `0`"),
            ("a.obj", "v 0 0\n", "line 1"),
            ("a.obj", "v 0 0 zero\n", "line 1: found `zero`"),
            (
                "a.stl",
                "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop",
                "line 6",
            ),
            ("a.stl", "no mesh at all", "84"),
            (
                "a.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
                "property `y`",
            ),
            ("a.ply", "off\n", "line 1"),
            ("a.glb", "glTF", "glTF"),
        ] {
            let said = message(name, text);
            assert!(said.contains(part), "{name}: {said}");
        }
    }

    #[test]
    fn a_soup_becomes_a_closed_mesh() {
        let mesh = parse_mesh(Path::new("t.obj"), TETRAHEDRON.as_bytes()).unwrap();
        let mut ascii = String::from("solid t\n");
        for i in 0..4 {
            ascii += "facet normal 0 0 0\nouter loop\n";
            for c in mesh.corners(i) {
                ascii += &format!("vertex {} {} {}\n", c.x, c.y, c.z);
            }
            ascii += "endloop\nendfacet\n";
        }
        ascii += "endsolid t\n";
        let read = parse_mesh(Path::new("t.STL"), ascii.as_bytes()).unwrap();
        assert_eq!(is_closed_manifold(&read), Ok(()));
        assert!((read.volume() - 1.0 / 6.0).abs() < 1e-12);
        assert_eq!(read.vertices.len(), 4);
    }

    /// Real scans, where the data are at hand.
    #[test]
    fn scanned_things_are_read() {
        let Ok(data) = std::env::var("PALPATE_DATA") else {
            #[expect(clippy::disallowed_macros, reason = "a skipped test says so")]
            {
                println!("skipped: PALPATE_DATA is not set");
            }
            return;
        };
        for (file, triangles) in [
            ("ycb/obj/025_mug.obj", 16384),
            ("ycb/obj/003_cracker_box.obj", 16384),
            ("ycb/vhacd_stl/025_mug.stl", 1436),
        ] {
            let path = Path::new(&data).join(file);
            let bytes = crate::base::read_bytes(&path).unwrap();
            let mesh = parse_mesh(&path, &bytes).unwrap();
            assert!(
                mesh.triangles.len().abs_diff(triangles) <= triangles / 100,
                "{file}: {}",
                mesh.triangles.len()
            );
            let (lo, hi) = mesh.bounds().unwrap();
            assert!((0.05..0.4).contains(&(hi - lo).max()), "{file}");
        }
    }
}
