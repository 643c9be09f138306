//! Writes every export of a model into a twin's folder.

use std::collections::BTreeMap;

use super::ExportNote;
use super::layout::lay_out;
use super::{glb, mjcf, urdf};
use crate::base::{Result, StagedFolder};
use crate::twin::Model;

/// Bytes by path relative to the twin's folder.
pub type Files = BTreeMap<String, Vec<u8>>;

/// The exported files by path relative to the twin's folder, and what each cannot say.
///
/// `scene.urdf`, `scene.xml`, `scene.glb`, and `urdf/NAME.urdf` for each body alone. They name the meshes that
/// `twin::write_twin` puts beside them.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn exports(model: &Model) -> Result<(Files, Vec<ExportNote>)> {
    let scene = lay_out(model)?;
    let mut files = Files::new();
    files.insert("scene.urdf".to_string(), urdf::of_scene(&scene).into_bytes());
    files.insert("scene.xml".to_string(), mjcf::of_scene(&scene, model).into_bytes());
    files.insert("scene.glb".to_string(), glb::of_scene(&scene, model)?);
    for tree in &scene.trees {
        let text = urdf::of_tree(&scene, tree, "../");
        files.insert(format!("urdf/{}.urdf", tree.name), text.into_bytes());
    }
    Ok((files, scene.notes))
}

/// Writes every export into `folder`; returns what the formats cannot say.
///
/// # Errors
/// As [`exports`], or where a file cannot be written.
pub fn export_all(model: &Model, folder: &StagedFolder) -> Result<Vec<ExportNote>> {
    let (files, notes) = exports(model)?;
    for (path, bytes) in &files {
        folder.write(path, bytes)?;
    }
    Ok(notes)
}
