//! Wavefront OBJ for the twin's own meshes: triangles, with colours behind the vertices, and, where not all of
//! the surface was seen, comment rows `# closed …` and `# mirrored …` that number the vertices which were concluded or
//! mirrored, not seen. A textured mesh names a material library beside it, which names the image.
//! Groups would say the same, but simulators take the first group for the whole mesh.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Point3;

use crate::base::{Error, Result};
use crate::geometry::{Mesh, Origin, Texture};

/// Words that, after `#`, open a comment row that numbers unseen vertices, from 1.
const UNSEEN: [(&str, Origin); 2] = [("closed", Origin::Closed), ("mirrored", Origin::Mirrored)];
/// Vertices in one such row.
const ROW: usize = 64;

/// Name of the material in a library.
const MATERIAL: &str = "seen";

/// What a mesh's file says of its colours.
#[derive(Debug, Default)]
pub(super) struct Looks {
    /// The material library that it names.
    pub(super) library: Option<String>,
    /// Where its triangles lie in the image; empty where they lie nowhere.
    pub(super) texture: Texture,
}

/// The material library of an image.
pub(super) fn write_mtl(image: &str) -> String {
    format!("newmtl {MATERIAL}\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {image}\n")
}

/// The image that a material library names.
pub(super) fn parse_mtl(text: &str) -> Option<&str> {
    text.lines()
        .find_map(|line| line.trim().strip_prefix("map_Kd "))
        .map(str::trim)
}

/// The text of `mesh`, nanometres kept; with a texture, its places and the library that names its image.
pub(super) fn write_obj(mesh: &Mesh, textured: Option<(&Texture, &str)>) -> String {
    let mut text = String::new();
    if let Some((_, library)) = textured {
        let _ = writeln!(text, "mtllib {library}");
    }
    let colored = mesh.colors.len() == mesh.vertices.len();
    for (i, v) in mesh.vertices.iter().enumerate() {
        let _ = write!(text, "v {:.9} {:.9} {:.9}", v.x + 0.0, v.y + 0.0, v.z + 0.0);
        if colored {
            let [r, g, b] = mesh.colors[i].map(|c| f64::from(c) / 255.0);
            let _ = write!(text, " {r:.4} {g:.4} {b:.4}");
        }
        text.push('\n');
    }
    let places = textured.map_or(&[][..], |(texture, _)| &texture.corners);
    if let Some((texture, _)) = textured {
        for [u, v] in &texture.places {
            let _ = writeln!(text, "vt {u:.6} {v:.6}");
        }
        let _ = writeln!(text, "usemtl {MATERIAL}");
    }
    for (i, t) in mesh.triangles.iter().enumerate() {
        let _ = match places.get(i) {
            Some(p) => writeln!(
                text,
                "f {}/{} {}/{} {}/{}",
                t[0] + 1,
                p[0] + 1,
                t[1] + 1,
                p[1] + 1,
                t[2] + 1,
                p[2] + 1
            ),
            None => writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1),
        };
    }
    let origins = mesh.origins();
    for (word, origin) in UNSEEN {
        let numbered = origins.iter().enumerate().filter(|(_, o)| **o == origin);
        let numbers: Vec<String> = numbered.map(|(i, _)| (i + 1).to_string()).collect();
        for row in numbers.chunks(ROW) {
            let _ = writeln!(text, "# {word} {}", row.join(" "));
        }
    }
    text
}

/// Reads what [`write_obj`] writes. Polygons are cut into fans, indices of normals passed over.
pub(super) fn parse_obj(file: &Path, text: &str) -> Result<(Mesh, Looks)> {
    let (mut mesh, mut looks) = (Mesh::default(), Looks::default());
    let mut unseen: Vec<(usize, Origin)> = Vec::new();
    for (row, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let bad = |expected: &str| Error::bad_input(file, format!("row {}", row + 1), line, expected);
        match words.next() {
            Some("v") => {
                let parsed: Option<Vec<f64>> = words.map(|w| w.parse().ok().filter(|v: &f64| v.is_finite())).collect();
                let numbers = parsed.filter(|n| n.len() >= 3).ok_or_else(|| bad("three numbers"))?;
                mesh.vertices.push(Point3::new(numbers[0], numbers[1], numbers[2]));
                if let [_, _, _, r, g, b] = numbers[..] {
                    mesh.colors
                        .push([r, g, b].map(|c| (c * 255.0).round().clamp(0.0, 255.0) as u8));
                }
            }
            Some("vt") => {
                let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).collect();
                let place = numbers.first_chunk().ok_or_else(|| bad("two numbers"))?;
                looks.texture.places.push(*place);
            }
            Some("mtllib") => looks.library = words.next().map(Into::into),
            Some("f") => {
                let words: Vec<&str> = words.collect();
                let of = |field: usize, count: usize| -> Option<Vec<u32>> {
                    words.iter().map(|w| corner(w, field, count)).collect()
                };
                let corners = of(0, mesh.vertices.len())
                    .filter(|c| c.len() >= 3)
                    .ok_or_else(|| bad("indices of vertices above"))?;
                let fan = |c: &[u32], k: usize| [c[0], c[k], c[k + 1]];
                mesh.triangles.extend((1..corners.len() - 1).map(|k| fan(&corners, k)));
                if let Some(places) = of(1, looks.texture.places.len()) {
                    looks
                        .texture
                        .corners
                        .extend((1..places.len() - 1).map(|k| fan(&places, k)));
                }
            }
            Some("#") => {
                let mark = words.next().and_then(|w| UNSEEN.iter().find(|(word, _)| *word == w));
                let numbers = words.filter_map(|w| w.parse::<usize>().ok());
                unseen.extend(mark.into_iter().flat_map(|(_, o)| numbers.clone().map(|i| (i, *o))));
            }
            _ => {}
        }
    }
    if mesh.colors.len() != mesh.vertices.len() {
        mesh.colors.clear();
    }
    if looks.texture.corners.len() != mesh.triangles.len() {
        looks = Looks::default();
    }
    mark_unseen(file, &mut mesh, &unseen)?;
    Ok((mesh, looks))
}

/// Marks the vertices of those numbers, from 1.
fn mark_unseen(file: &Path, mesh: &mut Mesh, unseen: &[(usize, Origin)]) -> Result<()> {
    if unseen.is_empty() {
        return Ok(());
    }
    let count = mesh.vertices.len();
    let mut origins = vec![Origin::Seen; count];
    for (i, origin) in unseen {
        let place = origins.get_mut(i.wrapping_sub(1)).ok_or_else(|| {
            Error::bad_input(
                file,
                "# closed or # mirrored",
                i.to_string(),
                format!("a vertex from 1 to {count}"),
            )
        })?;
        *place = *origin;
    }
    mesh.set_origins(&origins);
    Ok(())
}

/// The index in that field of a corner, `vertex/place/normal`, from 0.
fn corner(word: &str, field: usize, count: usize) -> Option<u32> {
    let index: i64 = word.split('/').nth(field)?.parse().ok()?;
    let absolute = if index < 0 { count as i64 + index } else { index - 1 };
    u32::try_from(absolute).ok().filter(|i| (*i as usize) < count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Mesh, Looks) {
        parse_obj(Path::new("a.obj"), text).expect("a mesh")
    }

    #[test]
    fn a_texture_is_read_back() {
        let mesh = crate::geometry::solids::cuboid([1.0; 3]);
        let texture = Texture {
            places: (0..36).map(|i| [f64::from(i) / 64.0, 0.25]).collect(),
            corners: (0..12).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Texture::default()
        };
        let (back, looks) = read(&write_obj(&mesh, Some((&texture, "a.mtl"))));
        assert_eq!((back, looks.texture), (mesh, texture));
        assert_eq!(looks.library.as_deref(), Some("a.mtl"));
        assert_eq!(parse_mtl(&write_mtl("a.png")), Some("a.png"));
    }

    #[test]
    fn what_was_seen_is_read_back() {
        let mut mesh = Mesh {
            vertices: (0..5)
                .map(|i| Point3::new(f64::from(i), f64::from(i * i), 0.0))
                .collect(),
            triangles: vec![[0, 1, 2], [1, 2, 3], [2, 3, 4]],
            ..Mesh::default()
        };
        mesh.set_origins(&[
            Origin::Seen,
            Origin::Seen,
            Origin::Seen,
            Origin::Mirrored,
            Origin::Closed,
        ]);
        let text = write_obj(&mesh, None);
        assert!(text.contains("# closed 5") && text.contains("# mirrored 4"), "{text}");
        assert_eq!(read(&text).0.origins(), mesh.origins());
        mesh.set_origins(&[Origin::Closed; 5]);
        assert_eq!(read(&write_obj(&mesh, None)).0.origins(), mesh.origins());
        assert!(parse_obj(Path::new("a.obj"), "v 0 0 0\n# closed 2\n").is_err());
    }
}
