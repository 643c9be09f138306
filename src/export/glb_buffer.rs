//! The binary half of a GLB: accessors over one buffer, and the container around both halves.

use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

use crate::geometry::{Mesh, Origin, Texture};

/// Accessors and buffer views as they are filled.
#[derive(Default)]
pub(super) struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;

impl Buffer {
    /// Adds a mesh with its image's places; returns its only primitive. The colours of its vertices are left out, for
    /// they would tint the image. Vertices stand once for each place: glTF has one list for both.
    pub(super) fn textured(&mut self, mesh: &Mesh, texture: &Texture, material: usize) -> Value {
        let vertices = texture.vertices(&mesh.triangles);
        let at = |v: &u32| *v as usize;
        let apart = Mesh {
            vertices: vertices.iter().map(|v| mesh.vertices[at(v)]).collect(),
            triangles: texture.corners.clone(),
            ..Mesh::default()
        };
        let normals = vertex_normals(mesh);
        let origins = mesh.origins();
        let mut attributes = json!({
            "POSITION": self.positions(&apart),
            "NORMAL": self.normals(vertices.iter().map(|v| normals[at(v)])),
            "TEXCOORD_0": self.places(&texture.places),
        });
        if mesh.seen.len() == mesh.vertices.len() {
            attributes["_SEEN"] = json!(self.origins(vertices.iter().map(|v| origins[at(v)])));
        }
        self.triangles(&apart, attributes, material)
    }

    /// Places from the image's upper left corner, as glTF has them.
    fn places(&mut self, places: &[[f64; 2]]) -> usize {
        let each = places.iter().flat_map(|p| [p[0] as f32, (1.0 - p[1]) as f32]);
        let bytes: Vec<u8> = each.flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        self.accessor(json!({ "bufferView": view, "componentType": FLOAT, "count": places.len(), "type": "VEC2" }))
    }

    /// Adds an image file; returns its view.
    pub(super) fn image(&mut self, png: &[u8]) -> usize {
        self.view(png, None)
    }

    /// Adds a mesh; returns its only primitive. `with_looks` adds normals and colours.
    pub(super) fn primitive(&mut self, mesh: &Mesh, with_looks: bool, material: usize) -> Value {
        let mut attributes = json!({ "POSITION": self.positions(mesh) });
        if with_looks {
            attributes["NORMAL"] = json!(self.normals(vertex_normals(mesh).into_iter()));
            if mesh.colors.len() == mesh.vertices.len() {
                attributes["COLOR_0"] = json!(self.colors(&mesh.colors));
            }
            if mesh.seen.len() == mesh.vertices.len() {
                attributes["_SEEN"] = json!(self.origins(mesh.origins().into_iter()));
            }
        }
        self.triangles(mesh, attributes, material)
    }

    fn triangles(&mut self, mesh: &Mesh, attributes: Value, material: usize) -> Value {
        let indices: Vec<u8> = mesh.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&indices, Some(ELEMENT_ARRAY_BUFFER));
        let count = mesh.triangles.len() * 3;
        let indices = self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": count, "type": "SCALAR"
        }));
        json!({ "attributes": attributes, "indices": indices, "material": material, "mode": 4 })
    }

    fn positions(&mut self, mesh: &Mesh) -> usize {
        let points: Vec<[f32; 3]> = mesh.vertices.iter().map(single).collect();
        let bound = |pick: fn(f32, f32) -> f32| {
            let first = points.first().copied().unwrap_or_default();
            points
                .iter()
                .fold(first, |m, p| std::array::from_fn(|k| pick(m[k], p[k])))
        };
        let (min, max) = (bound(f32::min), bound(f32::max));
        let view = self.view(&flat(&points), Some(ARRAY_BUFFER));
        self.accessor(json!({
            "bufferView": view, "componentType": FLOAT, "count": points.len(), "type": "VEC3", "min": min, "max": max
        }))
    }

    fn normals(&mut self, normals: impl Iterator<Item = Vector3<f64>>) -> usize {
        let normals: Vec<[f32; 3]> = normals.map(|n| [n.x as f32, n.y as f32, n.z as f32]).collect();
        let view = self.view(&flat(&normals), Some(ARRAY_BUFFER));
        self.accessor(json!({ "bufferView": view, "componentType": FLOAT, "count": normals.len(), "type": "VEC3" }))
    }

    /// Linear colour in 16 bits: 8 would band in the dark.
    fn colors(&mut self, colors: &[[u8; 3]]) -> usize {
        let bytes: Vec<u8> = colors
            .iter()
            .flat_map(|c| [linear(c[0]), linear(c[1]), linear(c[2]), u16::MAX])
            .flat_map(u16::to_le_bytes)
            .collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        self.accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_SHORT, "normalized": true, "count": colors.len(), "type": "VEC4"
        }))
    }

    /// 1 where the surface was seen, 0.5 where it was mirrored, 0 where it was closed.
    fn origins(&mut self, origins: impl Iterator<Item = Origin>) -> usize {
        let bytes: Vec<u8> = origins.flat_map(|o| o.trust().to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let count = bytes.len() / 4;
        self.accessor(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": "SCALAR" }))
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds the keys of an animation, with their bounds; returns their accessor.
    pub(super) fn keys<const N: usize>(&mut self, keys: &[[f32; N]], kind: &str) -> usize {
        let bound = |pick: fn(f32, f32) -> f32, from: f32| {
            let each = |m: [f32; N], k: &[f32; N]| std::array::from_fn(|i| pick(m[i], k[i]));
            keys.iter().fold([from; N], each).to_vec()
        };
        let (min, max) = (bound(f32::min, f32::INFINITY), bound(f32::max, f32::NEG_INFINITY));
        let bytes: Vec<u8> = keys.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, None);
        self.accessor(json!({
            "bufferView": view, "componentType": FLOAT, "count": keys.len(), "type": kind, "min": min, "max": max
        }))
    }

    /// The finished file around `document`, which gets the buffer, views and accessors added.
    pub(super) fn container(mut self, mut document: Value) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        if !self.bytes.is_empty() {
            document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
            document["bufferViews"] = Value::Array(self.views);
            document["accessors"] = Value::Array(self.accessors);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut chunks = chunk(*b"JSON", &text);
        if !self.bytes.is_empty() {
            chunks.extend(chunk(*b"BIN\0", &self.bytes));
        }
        let mut file = b"glTF".to_vec();
        file.extend(2u32.to_le_bytes());
        file.extend((chunks.len() as u32 + 12).to_le_bytes());
        file.extend(chunks);
        file
    }
}

fn chunk(kind: [u8; 4], bytes: &[u8]) -> Vec<u8> {
    let mut out = (bytes.len() as u32).to_le_bytes().to_vec();
    out.extend(kind);
    out.extend_from_slice(bytes);
    out
}

fn single(p: &Point3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

fn flat(points: &[[f32; 3]]) -> Vec<u8> {
    points.iter().flatten().flat_map(|v| v.to_le_bytes()).collect()
}

/// Normals weighted by area; where a vertex has none, upwards, since a normal must be a unit vector.
fn vertex_normals(mesh: &Mesh) -> Vec<Vector3<f64>> {
    let mut sums = vec![Vector3::zeros(); mesh.vertices.len()];
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let normal = mesh.scaled_normal(i);
        for v in triangle {
            sums[*v as usize] += normal;
        }
    }
    sums.into_iter()
        .map(|n| n.try_normalize(1e-30).unwrap_or_else(Vector3::z))
        .collect()
}

/// IEC 61966-2-1, to 16 bits.
fn linear(srgb: u8) -> u16 {
    let c = f64::from(srgb) / 255.0;
    let l = if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    };
    (l * 65535.0).round() as u16
}
