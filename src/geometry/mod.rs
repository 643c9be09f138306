//! Shapes: meshes, distance fields, hulls, triangulations. No material, no camera.

mod closing;
mod components;
mod field;
mod marching;
mod mesh;
mod plane;

pub use closing::{boundary_loops, cap_at_zero, close_loops, cut_below};
pub use components::{
    UnionFind, directed_edges, edge_defects, number_sets, submesh, unique_edges, vertex_components, vertex_normals,
};
pub use field::{BLOCK, Field, Voxel, offset_in_block};
pub use marching::{GridEdge, march_cell, weld};
pub use mesh::Mesh;
pub use plane::Plane;
