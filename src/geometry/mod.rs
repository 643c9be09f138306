//! Shapes: meshes, distance fields, hulls, triangulations. No material, no camera.

mod decompose;
mod distance;
mod formats;
mod gap;
mod hull;
mod mesh;
mod properties;
mod quadric;
mod sampling;
mod silhouette;
mod simplify;
mod smooth;
pub mod solids;
mod superquadric;
mod topology;

pub use decompose::{DecompositionConfig, convex_parts, decomposition_overlap};
pub use distance::{Nearest, SurfaceDistance, SurfaceError, mean_surface_error};
pub use formats::{parse_mesh, write_obj};
pub use gap::gap;
pub use hull::{convex_hull, slim_hull};
pub use mesh::Mesh;
pub use properties::{SolidProperties, mass_properties};
pub use sampling::{SurfaceSample, sample_surface, sample_triangles};
pub use silhouette::{Silhouette, silhouette};
pub use simplify::simplify;
pub use smooth::smooth;
pub use superquadric::{SuperquadricFit, superquadric_fit};
pub use topology::{TopologyFault, components, edges, euler_characteristic, is_closed_manifold};
