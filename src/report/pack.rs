//! Meshes packed for the page: positions in 16 bits, colours in 8, all as base64.

use nalgebra::Point3;
use serde_json::{Value, json};

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Base64 with padding (RFC 4648, section 4).
pub fn base64(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = ALPHABET[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

/// A surface as the viewer reads it. Positions are counts of 1/65535 of the box around the mesh, so that a
/// thing of 200 mm is off by less than 2 µm. `seen`: which vertices were seen, and which mirrored.
pub fn surface(
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    colors: &[[u8; 3]],
    seen: [&[bool]; 2],
) -> Option<Value> {
    let first = *vertices.first()?;
    let (low, high) = vertices.iter().fold((first, first), |(l, h), v| (l.inf(v), h.sup(v)));
    let span = high - low;
    let mut positions = Vec::with_capacity(vertices.len() * 6);
    for v in vertices {
        for k in 0..3 {
            let share = if span[k] > 0.0 { (v[k] - low[k]) / span[k] } else { 0.0 };
            positions.extend(((share * 65535.0).round() as u16).to_le_bytes());
        }
    }
    let wide = vertices.len() > 65535;
    let each = triangles.iter().flatten();
    let indices: Vec<u8> = if wide {
        each.flat_map(|i| i.to_le_bytes()).collect()
    } else {
        each.flat_map(|i| (*i as u16).to_le_bytes()).collect()
    };
    let flags = |all: &[bool]| (all.len() == vertices.len()).then(|| base64(&bits(all)));
    Some(json!({
        "vertices": vertices.len(),
        "low": ([low.x, low.y, low.z].map(short)),
        "span": ([span.x, span.y, span.z].map(short)),
        "positions": base64(&positions),
        "wide": wide,
        "indices": base64(&indices),
        "colors": (colors.len() == vertices.len()).then(|| base64(colors.as_flattened())),
        "seen": flags(seen[0]),
        "mirrored": flags(seen[1]),
    }))
}

/// A number to a tenth of a micrometre.
pub fn short(x: f64) -> f64 {
    (x * 1e7).round() / 1e7
}

fn bits(flags: &[bool]) -> Vec<u8> {
    flags
        .chunks(8)
        .map(|chunk| chunk.iter().enumerate().map(|(i, f)| u8::from(*f) << i).sum())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        let cases = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, coded) in cases {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn a_flat_mesh_packs_and_no_mesh_does_not() {
        let vertices = [
            Point3::new(0.0, 0.0, 1.0),
            Point3::new(1.0, 0.0, 1.0),
            Point3::new(0.0, 1.0, 1.0),
        ];
        let packed = surface(&vertices, &[[0, 1, 2]], &[], [&[true, false, true], &[]]).expect("a mesh");
        assert_eq!(packed["indices"], "AAABAAIA");
        assert_eq!(packed["seen"], "BQ==");
        assert!(surface(&[], &[], &[], [&[], &[]]).is_none());
    }
}
