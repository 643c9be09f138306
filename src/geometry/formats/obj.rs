//! Wavefront OBJ. Read by hand, because line numbers belong into messages and 64-bit numbers into meshes.

use std::fmt::Write;
use std::path::Path;
use std::str::FromStr;

use nalgebra::Point3;

use super::soup::Soup;
use crate::base::{Error, Result};
use crate::geometry::Mesh;

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Soup> {
    let text = String::from_utf8_lossy(bytes);
    let mut soup = Soup::default();
    let mut colored = true;
    for (i, line) in text.lines().enumerate() {
        let place = format_args!("line {}", i + 1).to_string();
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers = words.map(|w| number(path, &place, w)).collect::<Result<Vec<f64>>>()?;
                if numbers.len() < 3 {
                    let found = format!("{} numbers", numbers.len());
                    return Err(Error::bad_input(path, place, found, "x, y and z"));
                }
                soup.vertices.push(Point3::new(numbers[0], numbers[1], numbers[2]));
                colored &= numbers.len() >= 6;
                soup.colors.push(color(&numbers));
            }
            Some("f") => {
                let corners = words
                    .map(|w| corner(path, &place, w, soup.vertices.len()))
                    .collect::<Result<Vec<u32>>>()?;
                if corners.len() < 3 {
                    let found = format!("{} corners", corners.len());
                    return Err(Error::bad_input(path, place, found, "at least three"));
                }
                soup.add_polygon(&corners);
            }
            _ => {}
        }
    }
    if !colored {
        soup.colors.clear();
    }
    Ok(soup)
}

pub(super) fn number<T: FromStr>(path: &Path, place: &str, word: &str) -> Result<T> {
    word.parse()
        .map_err(|_| Error::bad_input(path, place, format!("`{word}`"), "a number"))
}

fn color(numbers: &[f64]) -> [u8; 3] {
    let byte = |i: usize| (numbers.get(i).copied().unwrap_or(0.0).clamp(0.0, 1.0) * 255.0).round() as u8;
    [byte(3), byte(4), byte(5)]
}

/// `7`, `7/2`, `7//3`, `7/2/3`, or counted from the end, `-1`.
fn corner(path: &Path, place: &str, word: &str, vertices: usize) -> Result<u32> {
    let index: i64 = number(path, place, word.split('/').next().unwrap_or(word))?;
    let count = vertices as i64;
    let zero_based = if index < 0 { count + index } else { index - 1 };
    if (0..count).contains(&zero_based) {
        return Ok(zero_based as u32);
    }
    Err(Error::bad_input(
        path,
        place,
        format!("`{word}`"),
        format!("a vertex of the {count} before it"),
    ))
}

/// A mesh as OBJ text, to 0.1 micrometre; colours follow the coordinates as `v x y z r g b`, 0 to 1.
pub fn write_obj(mesh: &Mesh) -> String {
    let colored = mesh.colors.len() == mesh.vertices.len();
    let mut text = String::with_capacity(48 * (mesh.vertices.len() + mesh.triangles.len()));
    for (i, v) in mesh.vertices.iter().enumerate() {
        text.push('v');
        for c in v.iter() {
            // Rounding first keeps "-0.0000000" out.
            let _ = write!(text, " {:.7}", (c * 1e7).round() / 1e7 + 0.0);
        }
        if colored {
            for c in mesh.colors[i] {
                let _ = write!(text, " {:.4}", f64::from(c) / 255.0);
            }
        }
        text.push('\n');
    }
    for [a, b, c] in &mesh.triangles {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::parse_mesh;
    use crate::geometry::solids::torus;

    #[test]
    fn what_is_written_is_read_back_by_us_and_by_another_reader() {
        let mut mesh = torus(0.05, 0.01, 24, 12);
        mesh.colors = (0..mesh.vertices.len()).map(|i| [i as u8, 255 - i as u8, 7]).collect();
        let text = write_obj(&mesh);
        let back = parse_mesh(Path::new("a.obj"), text.as_bytes()).unwrap();
        assert_eq!((&back.triangles, &back.colors), (&mesh.triangles, &mesh.colors));
        for (a, b) in back.vertices.iter().zip(&mesh.vertices) {
            assert!((a - b).norm() < 1e-7);
        }
        assert_eq!(write_obj(&back), text);
        let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), |_| {
            Err(tobj::LoadError::GenericFailure)
        })
        .unwrap();
        let other = &models[0].mesh;
        assert_eq!(other.indices.len(), 3 * mesh.triangles.len());
        for (theirs, &ours) in other.indices.iter().zip(mesh.triangles.iter().flatten()) {
            for axis in 0..3 {
                let at = 3 * *theirs as usize + axis;
                assert!((f64::from(other.positions[at]) - mesh.vertices[ours as usize][axis]).abs() < 1e-7);
                assert!((other.vertex_color[at] * 255.0 - f32::from(mesh.colors[ours as usize][axis])).abs() < 0.1);
            }
        }
    }

    #[test]
    fn polygons_negative_indices_and_comments_are_understood() {
        let text = "# a square\nv 0 0 0 # here\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf -4//1 -3//1 -2//1 -1//1\n";
        let mesh = parse_mesh(Path::new("a.obj"), text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3]]);
    }
}
