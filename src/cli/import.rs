//! `palpate import`: other people's models and recordings.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::json;

use super::arguments::{Common, Import};
use super::output;
use crate::base::{Error, Result, StagedFolder, read_text};
use crate::capture::{Capture, Interaction, Kind, Noise, PoseStream, write_capture};
use crate::export::{Trust, adopt, export_all};
use crate::stages::diagnosis::Diagnosed;
use crate::twin::write_twin;

/// How far the length of a quaternion may be from one.
const UNIT: f64 = 1e-3;

/// Imports what was asked for.
pub fn import(common: &Common, what: &Import) -> Result<ExitCode> {
    match what {
        Import::Twin { file, out, known } => twin(common, file, out, *known),
        Import::Tum { files, out } => tum(common, files, out),
        Import::Mcap { source, .. } => later("mcap", source),
        Import::Bop { source, .. } => later("bop", source),
    }
}

fn later(format: &str, source: &Path) -> Result<ExitCode> {
    Err(Error::Failed(format!(
        "{}: importing {format} is not built yet; `palpate import twin` and `palpate import tum` are",
        source.display()
    )))
}

fn twin(common: &Common, file: &Path, out: &Path, known: bool) -> Result<ExitCode> {
    let trust = if known { Trust::Known } else { Trust::Assumed };
    let model = adopt(file, trust)?;
    let staged = StagedFolder::create(out, "twin.json")?;
    write_twin(&staged, &model, &Diagnosed::skipped().diagnosis)?;
    export_all(&model, &staged)?;
    staged.commit()?;
    let links: Vec<&str> = model.twin.links().map(|(_, l)| l.name.as_str()).collect();
    let joints: Vec<&str> = model.twin.joints().map(|j| j.name.as_str()).collect();
    let word = if known { "known" } else { "assumed" };
    let mut text = format!("{}: {}", out.display(), links.join(", "));
    if !joints.is_empty() {
        text += &format!("; joints {}", joints.join(", "));
    }
    text += &format!(
        "\nits numbers are {word}; diagnose them: palpate diagnose CAPTURE --model {}",
        out.display()
    );
    let object = json!({ "out": out, "links": links, "joints": joints, "status": word });
    output::result(common, &text, &object)?;
    Ok(ExitCode::SUCCESS)
}

/// Each file is the track of the thing that it is named after.
fn tum(common: &Common, files: &[PathBuf], out: &Path) -> Result<ExitCode> {
    let mut tracks = BTreeMap::new();
    for file in files {
        let name = file
            .file_stem()
            .map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        if tracks.insert(name.clone(), trajectory(file)?).is_some() {
            return Err(Error::bad_input(file, "name", name, "a name that no other file has"));
        }
    }
    let rows: usize = tracks.values().map(PoseStream::len).sum();
    let names: Vec<String> = tracks.keys().cloned().collect();
    let interaction = Interaction {
        name: "recording".into(),
        kind: Kind::Hold,
        action: None,
        tool_name: None,
        tool: None,
        target: None,
        force: None,
        tool_path: None,
        support_path: None,
        tracks,
        frames: None,
        held_out: false,
    };
    let folder = out
        .file_name()
        .map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned());
    let capture = Capture {
        root: out.to_path_buf(),
        name: folder,
        gravity: Vector3::new(0.0, 0.0, -9.80665),
        support: None,
        cameras: Vec::new(),
        views: Vec::new(),
        bodies: Vec::new(),
        noise: Noise::default(),
        interactions: vec![interaction],
        truth: None,
        digest: String::new(),
    };
    write_capture(&capture, out)?;
    let text = format!("{}: {rows} poses of {}", out.display(), names.join(", "));
    output::result(common, &text, &json!({ "out": out, "tracks": names, "rows": rows }))?;
    Ok(ExitCode::SUCCESS)
}

/// A trajectory of the TUM RGB-D benchmark: `timestamp tx ty tz qx qy qz qw` a line, `#` before comments.
fn trajectory(file: &Path) -> Result<PoseStream> {
    let mut stream = PoseStream::default();
    for (number, line) in read_text(file)?.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let bad = |found: &str, expected: &str| Error::bad_input(file, format!("row {}", number + 1), found, expected);
        let parsed: Option<Vec<f64>> = line
            .split([' ', '\t', ','])
            .filter(|w| !w.is_empty())
            .map(|w| w.parse().ok())
            .collect();
        let row = parsed
            .and_then(|r| <[f64; 8]>::try_from(r).ok())
            .filter(|r| r.iter().all(|v| v.is_finite()));
        let Some([t, x, y, z, i, j, k, w]) = row else {
            return Err(bad(line, "eight numbers: time, x, y, z, qx, qy, qz, qw"));
        };
        if stream.time.last().is_some_and(|last| t < *last) {
            return Err(bad(line, "times that do not run backwards"));
        }
        let q = Quaternion::new(w, i, j, k);
        if (q.norm() - 1.0).abs() > UNIT {
            return Err(bad(line, "a unit quaternion"));
        }
        stream.time.push(t);
        stream.position.push(Point3::new(x, y, z));
        stream.rotation.push(Some(UnitQuaternion::from_quaternion(q)));
    }
    if stream.is_empty() {
        return Err(Error::bad_input(file, "rows", "none", "at least one pose"));
    }
    Ok(stream)
}
