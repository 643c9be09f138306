//! Wavefront OBJ for the twin's own meshes: triangles, with colours behind the vertices, and, where not all of
//! the surface was seen, comment rows `# closed …` and `# mirrored …` that number the vertices which were concluded or
//! mirrored, not seen.
//! Groups would say the same, but simulators take the first group for the whole mesh.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Point3;

use crate::base::{Error, Result};
use crate::geometry::{Mesh, Origin};

/// Words that, after `#`, open a comment row that numbers unseen vertices, from 1.
const UNSEEN: [(&str, Origin); 2] = [("closed", Origin::Closed), ("mirrored", Origin::Mirrored)];
/// Vertices in one such row.
const ROW: usize = 64;

/// The text of `mesh`, nanometres kept.
pub(super) fn write_obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    let colored = mesh.colors.len() == mesh.vertices.len();
    for (i, v) in mesh.vertices.iter().enumerate() {
        let _ = write!(text, "v {:.9} {:.9} {:.9}", v.x + 0.0, v.y + 0.0, v.z + 0.0);
        if colored {
            let [r, g, b] = mesh.colors[i].map(|c| f64::from(c) / 255.0);
            let _ = write!(text, " {r:.4} {g:.4} {b:.4}");
        }
        text.push('\n');
    }
    for t in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1);
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

/// Reads what [`write_obj`] writes. Polygons are cut into fans, texture and normal indices passed over.
pub(super) fn parse_obj(file: &Path, text: &str) -> Result<Mesh> {
    let mut mesh = Mesh::default();
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
            Some("f") => {
                let count = mesh.vertices.len();
                let parsed: Option<Vec<u32>> = words.map(|w| corner(w, count)).collect();
                let corners = parsed
                    .filter(|c| c.len() >= 3)
                    .ok_or_else(|| bad("indices of vertices above"))?;
                for k in 1..corners.len() - 1 {
                    mesh.triangles.push([corners[0], corners[k], corners[k + 1]]);
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
    mark_unseen(file, &mut mesh, &unseen)?;
    Ok(mesh)
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

fn corner(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let absolute = if index < 0 { count as i64 + index } else { index - 1 };
    u32::try_from(absolute).ok().filter(|i| (*i as usize) < count)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let text = write_obj(&mesh);
        assert!(text.contains("# closed 5") && text.contains("# mirrored 4"), "{text}");
        assert_eq!(
            parse_obj(Path::new("a.obj"), &text).expect("a mesh").origins(),
            mesh.origins()
        );
        mesh.set_origins(&[Origin::Closed; 5]);
        assert_eq!(
            parse_obj(Path::new("a.obj"), &write_obj(&mesh))
                .expect("a mesh")
                .origins(),
            mesh.origins()
        );
        assert!(parse_obj(Path::new("a.obj"), "v 0 0 0\n# closed 2\n").is_err());
    }
}
