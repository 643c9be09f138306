//! Wavefront OBJ for the twin's own meshes: triangles, with colours behind the vertices.
//!
//! To be replaced by the reader and writer of `geometry`, once it has one.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::Point3;

use crate::base::{Error, Result};
use crate::geometry::Mesh;

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
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

/// Reads what [`write_obj`] writes; polygons are cut into fans, texture and normal indices passed over.
pub(super) fn parse_obj(file: &Path, text: &str) -> Result<Mesh> {
    let mut mesh = Mesh::default();
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
            _ => {}
        }
    }
    if mesh.colors.len() != mesh.vertices.len() {
        mesh.colors.clear();
    }
    Ok(mesh)
}

fn corner(word: &str, count: usize) -> Option<u32> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let absolute = if index < 0 { count as i64 + index } else { index - 1 };
    u32::try_from(absolute).ok().filter(|i| (*i as usize) < count)
}
