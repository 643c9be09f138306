//! Shapes: meshes, distance fields, hulls, triangulations. No material, no camera.

mod distance;
mod gap;
mod hull;
mod mesh;
mod properties;
mod sampling;
mod silhouette;
mod smooth;
pub mod solids;
mod topology;

pub use distance::{Nearest, SurfaceDistance, SurfaceError, mean_surface_error};
pub use gap::gap;
pub use hull::{convex_hull, slim_hull};
pub use mesh::Mesh;
pub use properties::{SolidProperties, mass_properties};
pub use sampling::{SurfaceSample, sample_surface, sample_triangles};
pub use silhouette::{Silhouette, silhouette};
pub use smooth::smooth;
pub use topology::{TopologyFault, components, edges, euler_characteristic, is_closed_manifold};
