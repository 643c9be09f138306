//! Shapes: meshes, distance fields, hulls, triangulations. No material, no camera.

mod atlas;
mod block_keys;
mod blocks;
mod closing;
mod components;
mod cubes;
mod decompose;
mod distance;
mod extract;
mod formats;
mod gap;
mod hull;
mod marching;
mod mesh;
mod plane;
mod properties;
mod quadric;
mod sampling;
mod silhouette;
mod simplify;
mod smooth;
pub mod solids;
mod superquadric;
mod texture;
mod topology;

pub use atlas::{Atlas, Texel, cover_triangle};
pub use block_keys::{BlockKeys, KEY_REACH};
pub use blocks::{BLOCK, BLOCK_SAMPLES, Block, BlockGrid, UNIT_SAMPLES, Unit, unit_of};
pub use closing::{boundary_loops, cap_at_zero, close_loops, cut_below};
pub use components::{
    UnionFind, directed_edges, edge_defects, number_sets, submesh, unique_edges, vertex_components, vertex_normals,
};
pub use decompose::{DecompositionConfig, convex_parts, decomposition_overlap};
pub use distance::{Nearest, SurfaceDistance, SurfaceError, mean_surface_error};
pub use extract::{edge_color, grid_surface};
pub use formats::{parse_mesh, write_obj};
pub use gap::gap;
pub use hull::{convex_hull, slim_hull};
pub use marching::{GridEdge, march_cell, weld};
pub use mesh::{Mesh, Origin};
pub use plane::Plane;
pub use properties::{SolidProperties, mass_properties};
pub use sampling::{SurfaceSample, sample_surface, sample_triangles};
pub use silhouette::{Silhouette, silhouette};
pub use simplify::simplify;
pub use smooth::smooth;
pub use superquadric::{SuperquadricFit, superquadric_fit};
pub use texture::Texture;
pub use topology::{TopologyFault, components, edges, euler_characteristic, is_closed_manifold};
