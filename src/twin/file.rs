//! A twin's folder: `twin.json`, `diagnosis.json` and the meshes that they name.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::obj::{Looks, parse_mtl, parse_obj, write_mtl, write_obj};
use super::{DIAGNOSIS_FORMAT, Diagnosis, FORMAT, Model, SCENE_MESH, Truth, Twin};
use crate::base::{Error, Result, StagedFolder, read_bytes, read_text};
use crate::geometry::{Mesh, Texture};

/// Name of the file that holds the twin; the sign that a folder is one.
pub const TWIN_FILE: &str = "twin.json";
/// Name of the file that holds the diagnosis.
pub const DIAGNOSIS_FILE: &str = "diagnosis.json";

/// Path of the image of the mesh at `path`, where it has one: beside it, `.png`.
pub fn texture_path(path: &str) -> String {
    with_ending(path, "png")
}

fn with_ending(path: &str, ending: &str) -> String {
    format!("{}.{ending}", path.strip_suffix(".obj").unwrap_or(path))
}

/// Writes `twin.json`, `diagnosis.json` and every mesh of `model` into `folder`, with its image where it has one.
///
/// # Errors
/// Where a file cannot be written.
pub fn write_twin(folder: &StagedFolder, model: &Model, diagnosis: &Diagnosis) -> Result<()> {
    folder.write(TWIN_FILE, &pretty(&model.twin)?)?;
    folder.write(DIAGNOSIS_FILE, &pretty(diagnosis)?)?;
    for (path, mesh) in &model.meshes {
        let library = with_ending(path, "mtl");
        let image = model.textures.get(path).and_then(|t| Some((t, t.png()?)));
        let textured = image.as_ref().map(|(texture, _)| (*texture, file_name(&library)));
        folder.write(path, write_obj(mesh, textured).as_bytes())?;
        if let Some((_, png)) = &image {
            let picture = texture_path(path);
            folder.write(&library, write_mtl(file_name(&picture)).as_bytes())?;
            folder.write(&picture, png)?;
        }
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
    let (mut meshes, mut textures) = (BTreeMap::new(), BTreeMap::new());
    for (_, link) in twin.links() {
        for path in link.mesh.iter().chain(&link.collision) {
            let (mesh, looks) = read_mesh(&twin_path, folder, path)?;
            meshes.insert(path.clone(), mesh);
            if let Some(texture) = read_texture(folder, path, looks)? {
                textures.insert(path.clone(), texture);
            }
        }
    }
    if folder.join(SCENE_MESH).is_file() {
        meshes.insert(SCENE_MESH.into(), read_mesh(&twin_path, folder, SCENE_MESH)?.0);
    }
    let model = Model { twin, meshes, textures };
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
        meshes.insert(mesh.clone(), read_mesh(path, folder, mesh)?.0);
    }
    Ok((truth, meshes))
}

fn read_mesh(named_in: &Path, folder: &Path, path: &str) -> Result<(Mesh, Looks)> {
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

/// The image that the mesh at `path` names by its library, which must stand beside it.
fn read_texture(folder: &Path, path: &str, looks: Looks) -> Result<Option<Texture>> {
    let Some(library) = looks.library else { return Ok(None) };
    let beside = |name: &str, named_in: &Path| {
        let file = named_in.with_file_name(name);
        if name.contains(['/', '\\']) || !file.is_file() {
            return Err(Error::bad_input(named_in, "material", name, "a file beside it"));
        }
        Ok(file)
    };
    let library = beside(&library, &folder.join(path))?;
    let text = read_text(&library)?;
    let Some(image) = parse_mtl(&text) else {
        return Ok(None);
    };
    let image = beside(image, &library)?;
    let mut texture = looks.texture;
    let png = texture.set_png(&read_bytes(&image)?);
    png.map_err(|e| Error::bad_input(&image, "content", e, "a PNG image"))?;
    Ok(Some(texture))
}

fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
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
