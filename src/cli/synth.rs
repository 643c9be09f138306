//! `palpate synth`: a synthetic capture with the truth beside it.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::Common;
use super::output;
use crate::base::{Error, Result, Seed};
use crate::capture::write_capture_with;
use crate::lab::{Scene, hide_by_word, read_scene, scene_named, scenes, steps, synthesise};

/// Synthesises the scene, or lists the built-in ones.
pub fn synth(
    common: &Common,
    scene: Option<&str>,
    out: Option<&Path>,
    hide: Option<&str>,
    list: bool,
) -> Result<ExitCode> {
    if list {
        let names: Vec<&str> = scenes().iter().map(|(name, _)| *name).collect();
        output::result(common, &names.join("\n"), &json!({ "scenes": names }))?;
        return Ok(ExitCode::SUCCESS);
    }
    let (Some(scene), Some(out)) = (scene, out) else {
        return Err(Error::Usage("synth: a scene and --out are needed".into()));
    };
    let (mut parsed, base) = match scene.strip_prefix("lab:") {
        Some(name) => (scene_named(name)?, Path::new(".")),
        None => (
            read_scene(Path::new(scene))?,
            Path::new(scene).parent().unwrap_or(Path::new(".")),
        ),
    };
    if let Some(word) = hide {
        parsed.hide = hide_by_word(&parsed, word, Seed(common.seed))?;
    }
    write(common, &parsed, base, out)?;
    let said = json!({ "out": out, "views": parsed.camera.views, "interactions": parsed.action.len() });
    output::result(common, &format!("capture: {}", out.display()), &said)?;
    Ok(ExitCode::SUCCESS)
}

/// Synthesises `scene` (mesh files beside `base`) into the folder `out`.
pub fn write(common: &Common, scene: &Scene, base: &Path, out: &Path) -> Result<()> {
    let progress = output::progress(common, "recording", steps(scene));
    let made = synthesise(scene, base, Seed(common.seed), &progress);
    progress.finish();
    let made = made?;
    write_capture_with(&made.capture, out, &made.files)
}
