//! Mesh files as bytes: OBJ, STL, PLY and glTF in, OBJ out.

mod gltf;
mod obj;
mod parse;
mod ply;
mod soup;
mod stl;

pub use obj::write_obj;
pub use parse::parse_mesh;
