//! `palpate explore`: the closed loop; the capture it gathered and the twin beside it.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::Common;
use super::{output, reconstruct};
use crate::base::{Error, Result, Seed, StagedFolder};
use crate::capture::{ProcessRig, read_capture, write_capture_with};
use crate::lab::{LabRig, read_scene, scene_named};
use crate::pipeline::{Exploration, ExploreOptions, Options, explore as run_loop};

/// The file that tells what was done and why.
const RECORD: &str = "explore.json";

/// Explores with the rig and reconstructs what it gathered.
pub fn explore(common: &Common, rig: &str, out: &Path, budget: usize) -> Result<ExitCode> {
    let staged = StagedFolder::create(out, RECORD)?;
    let options = ExploreOptions {
        budget,
        ..ExploreOptions::default()
    };
    let (mut found, files) = gather(common, rig, &options)?;
    if !files.is_empty() {
        found.capture.truth = Some("truth.json".into());
    }
    let folder = staged.path().join("capture");
    write_capture_with(&found.capture, &folder, &files)?;
    staged.write(RECORD, record(rig, budget, &found)?.as_bytes())?;

    output::say(common, "reconstructing what was gathered");
    let capture = read_capture(&folder)?;
    let options = Options {
        seed: Seed(common.seed),
        ..Options::default()
    };
    let mut run = reconstruct::run_passes(common, &capture, &options)?;
    let mut notices = found.notices().0;
    notices.append(&mut run.model.twin.notices);
    run.model.twin.notices = notices;
    let twin = StagedFolder::create(&staged.path().join("twin"), "twin.json")?;
    reconstruct::write(&capture, &run, &options, twin)?;
    staged.commit()?;

    output::notices(common, &run.model.twin.notices);
    let beside = out.join("twin");
    let text = format!("{}\n{}", told(&found), reconstruct::summary(&run, &beside));
    let said = json!({
        "capture": out.join("capture"), "views": found.capture.views.len(),
        "interactions": found.capture.interactions.len(), "looked_enough": found.looked_enough,
        "touched_enough": found.touched_enough, "result": reconstruct::digest(&run, &beside),
    });
    output::result(common, &text, &said)?;
    Ok(ExitCode::SUCCESS)
}

type Files = Vec<(String, Vec<u8>)>;

fn gather(common: &Common, rig: &str, options: &ExploreOptions) -> Result<(Exploration, Files)> {
    let progress = output::progress(common, "exploring", options.budget as u64);
    let found = match rig.split_once(':') {
        Some(("lab", scene)) => {
            let path = Path::new(scene);
            // A name alone is a scene that comes with the lab.
            let known = path.extension().is_none();
            let parsed = if known { scene_named(scene)? } else { read_scene(path)? };
            let base = path.parent().filter(|_| !known).unwrap_or(Path::new("."));
            let mut rig = LabRig::new(&parsed, base, Seed(common.seed))?;
            (run_loop(&mut rig, options, &progress)?, rig.truth_files()?)
        }
        Some(("exec", command)) if !command.trim().is_empty() => {
            let mut rig = ProcessRig::start(command)?;
            (run_loop(&mut rig, options, &progress)?, Vec::new())
        }
        _ => {
            return Err(Error::Usage(format!(
                "--rig {rig}: found neither lab:SCENE.toml nor exec:COMMAND"
            )));
        }
    };
    progress.finish();
    Ok(found)
}

fn record(rig: &str, budget: usize, found: &Exploration) -> Result<String> {
    let record = json!({
        "format": "palpate-explore/1", "rig": rig, "budget": budget, "steps": found.steps,
        "looked_enough": found.looked_enough, "touched_enough": found.touched_enough,
    });
    let text = serde_json::to_string_pretty(&record).map_err(|e| Error::Failed(format!("{RECORD}: {e}")))?;
    Ok(text + "\n")
}

fn told(found: &Exploration) -> String {
    let mut text = String::new();
    for step in &found.steps {
        let outcome = step
            .refused
            .as_ref()
            .map(|why| format!(" REFUSED: {why}"))
            .unwrap_or_default();
        text += &format!("{} {}: {}{outcome}\n", step.action, step.what, step.why);
    }
    text + &format!(
        "no further view: {}\nno further touch: {}",
        found.looked_enough, found.touched_enough
    )
}
