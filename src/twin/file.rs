//! A twin's folder: `twin.json`, `diagnosis.json` and the meshes that they name.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::obj::{parse_obj, write_obj};
use super::{DIAGNOSIS_FORMAT, Diagnosis, FORMAT, Model, SCENE_MESH, Truth, Twin};
use crate::base::{Error, Result, StagedFolder, read_text};
use crate::geometry::Mesh;

/// Name of the file that holds the twin; the sign that a folder is one.
pub const TWIN_FILE: &str = "twin.json";
/// Name of the file that holds the diagnosis.
pub const DIAGNOSIS_FILE: &str = "diagnosis.json";

/// Writes `twin.json`, `diagnosis.json` and every mesh of `model` into `folder`.
///
/// # Errors
/// Where a file cannot be written.
pub fn write_twin(folder: &StagedFolder, model: &Model, diagnosis: &Diagnosis) -> Result<()> {
    folder.write(TWIN_FILE, &pretty(&model.twin)?)?;
    folder.write(DIAGNOSIS_FILE, &pretty(diagnosis)?)?;
    for (path, mesh) in &model.meshes {
        folder.write(path, write_obj(mesh).as_bytes())?;
    }
    Ok(())
}

/// Reads a folder that [`write_twin`] wrote, and checks that the twin makes sense.
///
/// # Errors
/// Where a file is missing, is not of the format, or says something impossible; the error names the place.
pub fn read_twin(folder: &Path) -> Result<(Model, Diagnosis)> {
    let twin_path = folder.join(TWIN_FILE);
    let twin: Twin = read_json(&twin_path, FORMAT)?;
    let diagnosis = read_json(&folder.join(DIAGNOSIS_FILE), DIAGNOSIS_FORMAT)?;
    let mut meshes = BTreeMap::new();
    for (_, link) in twin.links() {
        for path in link.mesh.iter().chain(&link.collision) {
            meshes.insert(path.clone(), read_mesh(&twin_path, folder, path)?);
        }
    }
    if folder.join(SCENE_MESH).is_file() {
        meshes.insert(SCENE_MESH.into(), read_mesh(&twin_path, folder, SCENE_MESH)?);
    }
    let model = Model { twin, meshes };
    model
        .twin
        .sanity_check()
        .and_then(|()| model.sanity_check())
        .map_err(|e| Error::bad_input(&twin_path, "content", e.to_string(), "a twin that makes sense"))?;
    Ok((model, diagnosis))
}

/// Reads a file with the right answers, and the meshes that it names, by their paths in it.
///
/// # Errors
/// Where a file is missing or damaged, or a path leaves the folder.
pub fn read_truth(path: &Path) -> Result<(Truth, BTreeMap<String, Mesh>)> {
    let truth: Truth = parse_json(path, &read_text(path)?)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut meshes = BTreeMap::new();
    for mesh in truth.bodies.values().filter_map(|b| b.mesh.as_ref()) {
        meshes.insert(mesh.clone(), read_mesh(path, folder, mesh)?);
    }
    Ok((truth, meshes))
}

fn read_mesh(named_in: &Path, folder: &Path, path: &str) -> Result<Mesh> {
    let inside = !Path::new(path).is_absolute() && path.split(['/', '\\']).all(|part| part != "..");
    if !inside {
        return Err(Error::bad_input(named_in, "mesh", path, "a path inside the folder"));
    }
    let file = folder.join(path);
    if !file.is_file() {
        return Err(Error::bad_input(
            named_in,
            "mesh",
            format!("{path}, which is not there"),
            "a mesh file",
        ));
    }
    parse_obj(&file, &read_text(&file)?)
}

fn pretty(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut text = serde_json::to_string_pretty(value).map_err(|e| Error::Failed(e.to_string()))?;
    text.push('\n');
    Ok(text.into_bytes())
}

fn read_json<T: DeserializeOwned>(path: &Path, format: &str) -> Result<T> {
    let text = read_text(path)?;
    let value: serde_json::Value = parse_json(path, &text)?;
    let found = value["format"].as_str().unwrap_or("none");
    if found != format {
        return Err(Error::bad_input(path, "format", found, format));
    }
    parse_json(path, &text)
}

fn parse_json<T: DeserializeOwned>(path: &Path, text: &str) -> Result<T> {
    serde_json::from_str(text).map_err(|e| {
        let place = format!("row {}, column {}", e.line(), e.column());
        Error::bad_input(path, place, e.to_string(), "valid content")
    })
}
