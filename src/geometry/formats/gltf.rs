//! glTF 2.0, binary (`.glb`) or text with buffers inside it.

use std::path::Path;

use gltf::mesh::Mode;
use gltf::mesh::util::ReadColors;
use gltf::{Node, Primitive, buffer};
use nalgebra::{Matrix4, Point3};

use super::soup::{Soup, srgb_from_linear};
use crate::base::{Error, Result};

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Soup> {
    let wrong = |place: String, e: gltf::Error| Error::bad_input(path, place, e.to_string(), "glTF 2.0");
    let mut file = gltf::Gltf::from_slice(bytes).map_err(|e| wrong("file".into(), e))?;
    let mut blob = file.blob.take();
    let mut buffers = Vec::new();
    for b in file.buffers() {
        let data = buffer::Data::from_source_and_blob(b.source(), None, &mut blob)
            .map_err(|e| wrong(format!("buffer {} (external buffers are not opened)", b.index()), e))?;
        if data.len() < b.length() {
            let found = format!("{} bytes", data.len());
            return Err(Error::bad_input(
                path,
                format!("buffer {}", b.index()),
                found,
                format!("{}", b.length()),
            ));
        }
        buffers.push(data);
    }
    let scene = file.default_scene().or_else(|| file.scenes().next());
    let missing = || Error::bad_input(path, "scenes", "none", "at least one");
    let mut walk = Walk {
        path,
        buffers: &buffers,
        soup: Soup::default(),
    };
    for node in scene.ok_or_else(missing)?.nodes() {
        walk.node(&node, Matrix4::identity(), 0)?;
    }
    Ok(walk.soup)
}

struct Walk<'a> {
    path: &'a Path,
    buffers: &'a [buffer::Data],
    soup: Soup,
}

/// Deeper nesting than this is taken for a circle.
const MAX_DEPTH: usize = 256;

impl Walk<'_> {
    fn node(&mut self, node: &Node, scene_from_parent: Matrix4<f64>, depth: usize) -> Result<()> {
        if depth > MAX_DEPTH {
            let place = format!("node {}", node.index());
            return Err(Error::bad_input(
                self.path,
                place,
                "nodes that hold themselves",
                "a tree",
            ));
        }
        let columns = node.transform().matrix().map(|column| column.map(f64::from));
        let scene_from_node = scene_from_parent * Matrix4::from(columns);
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            self.primitive(&primitive, &scene_from_node)?;
        }
        node.children()
            .try_for_each(|child| self.node(&child, scene_from_node, depth + 1))
    }

    fn primitive(&mut self, primitive: &Primitive, scene_from_node: &Matrix4<f64>) -> Result<()> {
        let place = || format!("primitive {}", primitive.index());
        let buffers = self.buffers;
        let reader = primitive.reader(|b| buffers.get(b.index()).map(|d| d.0.as_slice()));
        let missing = || Error::bad_input(self.path, place(), "none", "positions");
        let base = self.soup.vertices.len() as u32;
        for p in reader.read_positions().ok_or_else(missing)? {
            let local = Point3::from(p.map(f64::from));
            self.soup.vertices.push(scene_from_node.transform_point(&local));
        }
        let count = self.soup.vertices.len() as u32 - base;
        let color = base_color(primitive);
        match reader.read_colors(0) {
            Some(colors) => self.soup.colors.extend(vertex_colors(colors, color)),
            None => self.soup.colors.extend((0..count).map(|_| color.map(srgb_from_linear))),
        }
        self.soup
            .colors
            .resize(self.soup.vertices.len(), color.map(srgb_from_linear));
        let indices: Vec<u32> = match reader.read_indices() {
            Some(indices) => indices.into_u32().map(|i| base.saturating_add(i)).collect(),
            None => (base..base + count).collect(),
        };
        let mirrored = scene_from_node.determinant() < 0.0;
        self.triangles(primitive.mode(), &indices, mirrored, &place())
    }

    fn triangles(&mut self, mode: Mode, indices: &[u32], mirrored: bool, place: &str) -> Result<()> {
        let first = self.soup.triangles.len();
        let new = &mut self.soup.triangles;
        match mode {
            Mode::Triangles => new.extend(indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])),
            Mode::TriangleFan => new.extend(indices.windows(2).skip(1).map(|t| [indices[0], t[0], t[1]])),
            Mode::TriangleStrip => new.extend(indices.windows(3).enumerate().map(|(i, t)| {
                if i % 2 == 0 {
                    [t[0], t[1], t[2]]
                } else {
                    [t[1], t[0], t[2]]
                }
            })),
            other => {
                return Err(Error::bad_input(
                    self.path,
                    place,
                    format!("{other:?}"),
                    "triangles, a strip or a fan",
                ));
            }
        }
        if mirrored {
            new[first..].iter_mut().for_each(|t| t.swap(1, 2));
        }
        Ok(())
    }
}

fn base_color(primitive: &Primitive) -> [f64; 3] {
    let [r, g, b, _] = primitive.material().pbr_metallic_roughness().base_color_factor();
    [r, g, b].map(f64::from)
}

/// Vertex colours are linear and are multiplied with the base colour (glTF 2.0, 3.9.2).
fn vertex_colors(colors: ReadColors, factor: [f64; 3]) -> Vec<[u8; 3]> {
    let mix = |c: [f32; 3]| [0, 1, 2].map(|i| srgb_from_linear(f64::from(c[i]) * factor[i]));
    colors.into_rgb_f32().map(mix).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::parse_mesh;

    /// One triangle (indices 0, 1, 2) in a data URI under a node that is moved and doubled.
    const TRIANGLE: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0.5, 1]}}],
        "buffers": [{"uri": "data:application/octet-stream;base64,AAABAAIAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAA=", "byteLength": 44}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 6}, {"buffer": 0, "byteOffset": 8, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]}"#;

    #[test]
    fn nodes_are_applied_and_the_base_colour_is_kept() {
        let mesh = parse_mesh(Path::new("a.gltf"), TRIANGLE.as_bytes()).unwrap();
        assert_eq!(
            mesh.corners(0).map(|p| [p.x, p.y, p.z]),
            [[1.0, 2.0, 3.0], [3.0, 2.0, 3.0], [1.0, 4.0, 3.0]]
        );
        assert_eq!(mesh.colors[0], [255, 0, 188]);
    }

    #[test]
    fn an_external_buffer_is_refused() {
        let text = TRIANGLE.replace("data:application/octet-stream;base64,", "../elsewhere/");
        let said = parse_mesh(Path::new("a.gltf"), text.as_bytes())
            .unwrap_err()
            .to_string();
        assert!(said.contains("buffer 0"), "{said}");
    }
}
