//! PLY, ASCII and binary (either byte order), with or without vertex colours.

use std::path::Path;

use nalgebra::Point3;

use super::soup::Soup;
use crate::base::{Error, Result};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// From `size()` little-endian bytes, padded with zeros to eight.
    fn decode(self, b: [u8; 8]) -> f64 {
        let four = [b[0], b[1], b[2], b[3]];
        match self {
            Self::I8 => f64::from(i8::from_le_bytes([b[0]])),
            Self::U8 => f64::from(b[0]),
            Self::I16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
            Self::U16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
            Self::I32 => f64::from(i32::from_le_bytes(four)),
            Self::U32 => f64::from(u32::from_le_bytes(four)),
            Self::F32 => f64::from(f32::from_le_bytes(four)),
            Self::F64 => f64::from_le_bytes(b),
        }
    }
}

struct Property {
    name: String,
    kind: Kind,
    /// The kind of the count, for a list.
    list: Option<Kind>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Soup> {
    let (encoding, elements, start) = header(path, bytes)?;
    let mut reader = Reader {
        path,
        bytes,
        at: start,
        encoding,
    };
    let mut soup = Soup::default();
    for element in &elements {
        match element.name.as_str() {
            "vertex" => vertices(&mut reader, element, &mut soup)?,
            "face" => faces(&mut reader, element, &mut soup)?,
            _ => {
                for i in 0..element.count {
                    reader.row(element, i)?;
                }
            }
        }
    }
    Ok(soup)
}

fn header(path: &Path, bytes: &[u8]) -> Result<(Encoding, Vec<Element>, usize)> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    let mut line_number = 0;
    loop {
        let rest = &bytes[at..];
        let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        let line = String::from_utf8_lossy(&rest[..length]).trim().to_string();
        at = (at + length + 1).min(bytes.len());
        line_number += 1;
        let wrong =
            |expected: &str| Error::bad_input(path, format!("line {line_number}"), format!("`{line}`"), expected);
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["ply"] if line_number == 1 => {}
            _ if line_number == 1 => return Err(wrong("`ply`")),
            ["format", "ascii", _] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::LittleEndian),
            ["format", "binary_big_endian", _] => encoding = Some(Encoding::BigEndian),
            ["element", name, count] => elements.push(Element {
                name: (*name).into(),
                count: count.parse().map_err(|_| wrong("a count"))?,
                properties: Vec::new(),
            }),
            ["property", kinds @ .., name] => {
                let property = property(kinds, name).ok_or_else(|| wrong("a known kind of number"))?;
                let element = elements.last_mut().ok_or_else(|| wrong("an `element` before it"))?;
                element.properties.push(property);
            }
            ["end_header"] => break,
            [] if at >= bytes.len() => return Err(wrong("`end_header`")),
            ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(wrong("a line of a PLY header")),
        }
    }
    let missing = || Error::bad_input(path, "header", "no format", "`format ascii 1.0` or a binary one");
    Ok((encoding.ok_or_else(missing)?, elements, at))
}

fn property(kinds: &[&str], name: &str) -> Option<Property> {
    let (list, kind) = match kinds {
        [kind] => (None, Kind::named(kind)?),
        ["list", count, kind] => (Some(Kind::named(count)?), Kind::named(kind)?),
        _ => return None,
    };
    Some(Property {
        name: name.into(),
        kind,
        list,
    })
}

struct Reader<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
}

impl Reader<'_> {
    /// The values of each property in one row.
    fn row(&mut self, element: &Element, i: usize) -> Result<Vec<Vec<f64>>> {
        let one = |p: &Property, reader: &mut Self| {
            let count = match p.list {
                Some(kind) => reader.number(kind)? as usize,
                None => 1,
            };
            (0..count).map(|_| reader.number(p.kind)).collect::<Option<Vec<f64>>>()
        };
        let place = || format!("{} {i}", element.name);
        element
            .properties
            .iter()
            .map(|p| {
                one(p, self).ok_or_else(|| {
                    let found = format!("no number at byte {}", self.at);
                    Error::bad_input(self.path, place(), found, format!("`{}`", p.name))
                })
            })
            .collect()
    }

    fn number(&mut self, kind: Kind) -> Option<f64> {
        if self.encoding == Encoding::Ascii {
            return self.word()?.parse().ok();
        }
        let mut padded = [0; 8];
        let raw = self.bytes.get(self.at..self.at + kind.size())?;
        padded[..kind.size()].copy_from_slice(raw);
        if self.encoding == Encoding::BigEndian {
            padded[..kind.size()].reverse();
        }
        self.at += kind.size();
        Some(kind.decode(padded))
    }

    fn word(&mut self) -> Option<&str> {
        let rest = self.bytes.get(self.at..)?;
        let skip = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[skip..]
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len() - skip);
        self.at += skip + length;
        std::str::from_utf8(&rest[skip..skip + length]).ok()
    }
}

fn vertices(reader: &mut Reader, element: &Element, soup: &mut Soup) -> Result<()> {
    let find = |name: &str| {
        element
            .properties
            .iter()
            .position(|p| p.name == name && p.list.is_none())
    };
    let need = |name: &str| {
        let missing = || Error::bad_input(reader.path, "element vertex", "none", format!("a property `{name}`"));
        find(name).ok_or_else(missing)
    };
    let place = [need("x")?, need("y")?, need("z")?];
    let color = match (find("red"), find("green"), find("blue")) {
        (Some(r), Some(g), Some(b)) => Some([r, g, b]),
        _ => None,
    };
    for i in 0..element.count {
        let row = reader.row(element, i)?;
        soup.vertices.push(Point3::from(place.map(|p| row[p][0])));
        if let Some(columns) = color {
            soup.colors
                .push(columns.map(|c| byte(row[c][0], element.properties[c].kind)));
        }
    }
    Ok(())
}

fn byte(value: f64, kind: Kind) -> u8 {
    let scale = match kind {
        Kind::F32 | Kind::F64 => 255.0,
        Kind::U16 => 255.0 / 65535.0,
        _ => 1.0,
    };
    (value * scale).round().clamp(0.0, 255.0) as u8
}

fn faces(reader: &mut Reader, element: &Element, soup: &mut Soup) -> Result<()> {
    let is_list = |p: &Property| p.list.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    let missing = || Error::bad_input(reader.path, "element face", "none", "a list `vertex_indices`");
    let column = element.properties.iter().position(is_list).ok_or_else(missing)?;
    for i in 0..element.count {
        let row = reader.row(element, i)?;
        if let Some(bad) = row[column].iter().find(|v| v.fract() != 0.0 || **v < 0.0) {
            return Err(Error::bad_input(
                reader.path,
                format!("face {i}"),
                format!("vertex {bad}"),
                "an index",
            ));
        }
        let corners: Vec<u32> = row[column].iter().map(|v| *v as u32).collect();
        soup.add_polygon(&corners);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::parse_mesh;

    const HEADER: &str = "comment a square\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n";
    const PLACES: [[f32; 3]; 4] = [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.5]];

    fn binary(big: bool) -> Vec<u8> {
        let format = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let mut bytes = format!("ply\nformat {format} 1.0\n{HEADER}").into_bytes();
        for (i, place) in PLACES.iter().enumerate() {
            for c in place {
                bytes.extend(if big { c.to_be_bytes() } else { c.to_le_bytes() });
            }
            bytes.extend([10 * i as u8, 7, 255]);
        }
        bytes.push(4);
        for i in 0..4i32 {
            bytes.extend(if big { i.to_be_bytes() } else { i.to_le_bytes() });
        }
        bytes
    }

    #[test]
    fn text_and_both_byte_orders_say_the_same() {
        let mut text = format!("ply\nformat ascii 1.0\n{HEADER}");
        for (i, [x, y, z]) in PLACES.iter().enumerate() {
            text += &format!("{x} {y} {z} {} 7 255\n", 10 * i);
        }
        text += "4 0 1 2 3\n";
        for bytes in [text.into_bytes(), binary(false), binary(true)] {
            let mesh = parse_mesh(Path::new("a.ply"), &bytes).unwrap();
            assert_eq!(mesh.triangles, vec![[0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.vertices[2], Point3::new(1.0, 1.0, 0.5));
            assert_eq!(mesh.colors[3], [30, 7, 255]);
        }
    }

    #[test]
    fn a_file_that_breaks_off_is_refused() {
        let bytes = binary(false);
        let said = parse_mesh(Path::new("a.ply"), &bytes[..bytes.len() - 3])
            .unwrap_err()
            .to_string();
        assert!(said.contains("face 0"), "{said}");
    }
}
