//! Shapes: meshes, distance fields, hulls, triangulations. No material, no camera.

mod mesh;

pub use mesh::Mesh;
