//! `palpate import`: other people's models and recordings.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::{Common, Import, McapOptions};
use super::output;
use crate::base::{Error, Result, StagedFolder};
use crate::capture::{Capture, Kind, write_capture};
use crate::export::{Trust, adopt, export_all};
use crate::import::{BopRequest, McapRequest, import_bop, import_mcap, import_tum};
use crate::stages::diagnosis::Diagnosed;
use crate::twin::write_twin;

/// Imports what was asked for.
pub fn import(common: &Common, what: &Import) -> Result<ExitCode> {
    match what {
        Import::Twin { file, out, known } => twin(common, file, out, *known),
        Import::Tum { files, out } => written(common, &import_tum(files, out)?, &[]),
        Import::Mcap { source, out, options } => {
            let (capture, left_out) = import_mcap(source, &wanted(options)?, out)?;
            written(common, &capture, &left_out)
        }
        Import::Bop {
            source,
            out,
            models,
            world_object,
            moving,
            rate,
        } => {
            if !(rate.is_finite() && *rate > 0.0) {
                return Err(Error::Usage(format!(
                    "--rate {rate}: expected images per second above zero"
                )));
            }
            let request = BopRequest {
                models: models.clone(),
                world_object: *world_object,
                moving: *moving,
                rate: *rate,
            };
            let (capture, left_out) = import_bop(source, &request, out)?;
            written(common, &capture, &left_out)
        }
    }
}

/// The options of `import mcap` as a request.
fn wanted(o: &McapOptions) -> Result<McapRequest> {
    let mut tracks = Vec::new();
    for word in &o.tracks {
        let parts = word
            .split_once('=')
            .filter(|(name, place)| !name.is_empty() && !place.is_empty());
        let (name, place) = parts.ok_or_else(|| Error::Usage(format!("--track {word}: expected NAME=PLACE")))?;
        if tracks.iter().any(|(other, _)| other == name) {
            return Err(Error::Usage(format!(
                "--track {word}: there is a track of {name} already"
            )));
        }
        tracks.push((name.to_owned(), place.to_owned()));
    }
    let kind = |word: &String| {
        let value = serde_json::Value::String(word.clone());
        serde_json::from_value::<Kind>(value).map_err(|e| Error::Usage(format!("--kind {word}: {e}")))
    };
    if let Some(radius) = o.tool_radius.filter(|r| !(r.is_finite() && *r > 0.0)) {
        return Err(Error::Usage(format!(
            "--tool-radius {radius}: expected metres above zero"
        )));
    }
    Ok(McapRequest {
        depth: o.depth.clone(),
        color: o.color.clone(),
        camera_info: o.camera_info.clone(),
        camera: o.camera.clone(),
        tracks,
        tool: o.tool.clone(),
        tool_radius: o.tool_radius,
        force: o.force.clone(),
        reaction: o.reaction,
        world: o.world.clone(),
        kind: o.kind.as_ref().map(kind).transpose()?,
        target: o.target.clone(),
        still: o.still,
        every: o.every,
    })
}

/// Writes what was imported and says what is in it, and what is not.
fn written(common: &Common, capture: &Capture, left_out: &[String]) -> Result<ExitCode> {
    write_capture(capture, &capture.root)?;
    let only = capture.interactions.first();
    let tracks: Vec<&String> = only.map_or_else(Vec::new, |i| i.tracks.keys().collect());
    let rows: usize = only.map_or(0, |i| i.tracks.values().map(crate::capture::PoseStream::len).sum());
    let frames = only.and_then(|i| i.frames.as_ref()).map_or(0, |f| f.time.len());
    let forces = only.and_then(|i| i.force.as_ref()).map_or(0, |f| f.time.len());
    let bodies: Vec<&String> = capture.bodies.iter().map(|b| &b.name).collect();
    let names: Vec<&str> = tracks.iter().map(|n| n.as_str()).collect();
    let mut said = Vec::new();
    if !capture.views.is_empty() {
        said.push(format!("{} views", capture.views.len()));
    }
    if frames > 0 {
        said.push(format!("{frames} images"));
    }
    if !names.is_empty() {
        said.push(format!("{rows} poses of {}", names.join(", ")));
    }
    if forces > 0 {
        said.push(format!("{forces} forces"));
    }
    if !bodies.is_empty() {
        said.push(format!("{} known things", bodies.len()));
    }
    let mut text = format!("{}: {}", capture.root.display(), said.join(", "));
    for one in left_out {
        text += &format!("\nleft out: {one}");
    }
    let object = json!({
        "out": capture.root, "views": capture.views.len(), "images": frames, "tracks": tracks, "rows": rows,
        "forces": forces, "bodies": bodies, "left_out": left_out,
    });
    output::result(common, &text, &object)?;
    Ok(ExitCode::SUCCESS)
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
