//! STL, binary and ASCII: a soup of triangles without shared vertices or colours.

use std::path::Path;

use nalgebra::Point3;

use super::obj::number;
use super::soup::Soup;
use crate::base::{Error, Result};

/// Header and count, and the length of one facet.
const HEAD: usize = 84;
const FACET: usize = 50;

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Soup> {
    // Some binary files begin with `solid` too: the length decides.
    if binary_count(bytes).is_some_and(|n| bytes.len() == HEAD + FACET * n) {
        return Ok(binary(bytes));
    }
    if bytes.trim_ascii_start().starts_with(b"solid") {
        return ascii(path, bytes);
    }
    let expected = match binary_count(bytes) {
        Some(n) => format!("{} for the {n} facets that its header promises", HEAD + FACET * n),
        None => format!("`solid` or at least {HEAD} bytes"),
    };
    Err(Error::bad_input(
        path,
        "length",
        format!("{} bytes", bytes.len()),
        expected,
    ))
}

fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEAD - 4..HEAD)?;
    Some(u32::from_le_bytes([count[0], count[1], count[2], count[3]]) as usize)
}

fn binary(bytes: &[u8]) -> Soup {
    let mut soup = Soup::default();
    for facet in bytes[HEAD..].chunks_exact(FACET) {
        let numbers: Vec<f64> = facet[12..48]
            .chunks_exact(4)
            .map(|b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])))
            .collect();
        push_facet(
            &mut soup,
            numbers.chunks_exact(3).map(|c| Point3::new(c[0], c[1], c[2])),
        );
    }
    soup
}

fn push_facet(soup: &mut Soup, corners: impl Iterator<Item = Point3<f64>>) {
    let first = soup.vertices.len() as u32;
    soup.vertices.extend(corners);
    let corners: Vec<u32> = (first..soup.vertices.len() as u32).collect();
    soup.add_polygon(&corners);
}

fn ascii(path: &Path, bytes: &[u8]) -> Result<Soup> {
    let text = String::from_utf8_lossy(bytes);
    let mut soup = Soup::default();
    let mut corners: Vec<Point3<f64>> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let place = format!("line {}", i + 1);
        let mut words = line.split_whitespace();
        match words.next() {
            Some("vertex") => {
                let c = words.map(|w| number(path, &place, w)).collect::<Result<Vec<f64>>>()?;
                if c.len() != 3 {
                    return Err(Error::bad_input(path, place, format!("{} numbers", c.len()), "three"));
                }
                corners.push(Point3::new(c[0], c[1], c[2]));
            }
            Some("endloop") => {
                if corners.len() < 3 {
                    let found = format!("a loop of {} vertices", corners.len());
                    return Err(Error::bad_input(path, place, found, "three"));
                }
                push_facet(&mut soup, corners.drain(..));
            }
            _ => {}
        }
    }
    Ok(soup)
}
