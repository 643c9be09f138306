//! Writes every export of a model into a twin's folder.

use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

use super::ExportNote;
use super::layout::lay_out;
use super::{glb, mjcf, sdf, urdf, usd};
use crate::base::{Error, Result, StagedFolder, write_atomically};
use crate::twin::{Model, read_twin};

/// Bytes by path relative to the twin's folder.
pub type Files = BTreeMap<String, Vec<u8>>;

/// A format that a twin can be written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// `scene.urdf` and `urdf/NAME.urdf` for each body alone.
    Urdf,
    /// `scene.xml`.
    Mjcf,
    /// `scene.glb`.
    Gltf,
    /// `scene.sdf`.
    Sdf,
    /// `scene.usda`.
    Usd,
}

impl Format {
    /// What `reconstruct` writes.
    const USUAL: [Self; 3] = [Self::Urdf, Self::Mjcf, Self::Gltf];
}

impl FromStr for Format {
    type Err = Error;

    fn from_str(word: &str) -> Result<Self> {
        match word {
            "urdf" => Ok(Self::Urdf),
            "mjcf" => Ok(Self::Mjcf),
            "gltf" | "glb" => Ok(Self::Gltf),
            "sdf" => Ok(Self::Sdf),
            "usd" | "usda" => Ok(Self::Usd),
            _ => Err(Error::bad_input("--to", "format", word, "urdf, mjcf, gltf, sdf or usd")),
        }
    }
}

/// The exported files by path relative to the twin's folder, and what each cannot say.
///
/// `scene.urdf`, `scene.xml`, `scene.glb`, and `urdf/NAME.urdf` for each body alone. They name the meshes that
/// `twin::write_twin` puts beside them.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn exports(model: &Model) -> Result<(Files, Vec<ExportNote>)> {
    exports_as(model, &Format::USUAL)
}

/// As [`exports`], in the named formats.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn exports_as(model: &Model, formats: &[Format]) -> Result<(Files, Vec<ExportNote>)> {
    let scene = lay_out(model)?;
    let mut files = Files::new();
    for format in formats {
        let (name, bytes) = match format {
            Format::Urdf => ("scene.urdf", urdf::of_scene(&scene, model).into_bytes()),
            Format::Mjcf => ("scene.xml", mjcf::of_scene(&scene, model).into_bytes()),
            Format::Gltf => ("scene.glb", glb::of_scene(&scene, model)?),
            Format::Sdf => ("scene.sdf", sdf::of_scene(&scene, model).into_bytes()),
            Format::Usd => ("scene.usda", usd::of_scene(&scene, model).into_bytes()),
        };
        files.insert(name.to_string(), bytes);
        for tree in scene.trees.iter().filter(|_| *format == Format::Urdf) {
            let text = urdf::of_tree(&scene, model, tree, "../");
            files.insert(format!("urdf/{}.urdf", tree.name), text.into_bytes());
        }
    }
    Ok((files, scene.notes))
}

/// What each format cannot say of a model, or takes for granted.
///
/// # Errors
/// Where the joints of a body do not make one tree.
pub fn unsaid(model: &Model) -> Result<Vec<ExportNote>> {
    Ok(lay_out(model)?.notes)
}

/// Writes a twin that is there already in the named formats, beside its `twin.json`; returns the files' names.
///
/// # Errors
/// Where the twin cannot be read or a file cannot be written.
pub fn export_into(folder: &Path, formats: &[Format]) -> Result<Vec<String>> {
    let (model, _) = read_twin(folder)?;
    let (files, _) = exports_as(&model, formats)?;
    for (path, bytes) in &files {
        write_atomically(&folder.join(path), bytes)?;
    }
    Ok(files.into_keys().collect())
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
