//! `palpate demo`: the main job on a scene that is built in.

use std::path::Path;
use std::process::ExitCode;

use serde_json::json;

use super::arguments::Common;
use super::{output, reconstruct, synth};
use crate::base::{Error, Result, Seed, StagedFolder, Stopwatch};
use crate::capture::read_capture;
use crate::lab::scene_named;
use crate::pipeline::Options;
use crate::twin::{read_truth, score};

/// Makes a capture, reconstructs it, and compares with the truth.
pub fn demo(common: &Common, out: &Path) -> Result<ExitCode> {
    let watch = Stopwatch::start();
    let scene = scene_named("demo")?;
    let folder = out.join("capture");
    output::say(common, "making a capture of a tabletop in the built-in lab");
    synth::write(common, &scene, Path::new("."), &folder)?;
    let made = watch.seconds();

    output::say(common, "reconstructing it");
    let capture = read_capture(&folder)?;
    let options = Options {
        seed: Seed(common.seed),
        ..Options::default()
    };
    let twin = out.join("twin");
    let staged = StagedFolder::create(&twin, "twin.json")?;
    let run = reconstruct::run_passes(common, &capture, &options)?;
    reconstruct::write(&capture, &run, &options, staged)?;
    output::notices(common, &run.model.twin.notices);

    let truth = capture
        .truth
        .as_ref()
        .ok_or_else(|| Error::Failed("the demo has no truth".into()))?;
    let (truth, meshes) = read_truth(truth)?;
    let score = score(&run.model, &run.diagnosis, &truth, Some(&meshes))?;
    let times: Vec<String> = run.seconds.iter().map(|(pass, s)| format!("{pass} {s:.1} s")).collect();
    let text = format!(
        "{}\nagainst the truth of the lab\n{score}\ntime: capture {made:.1} s, {}, in all {:.1} s",
        reconstruct::summary(&run, &twin),
        times.join(", "),
        watch.seconds(),
    );
    output::result(
        common,
        &text,
        &json!({ "result": reconstruct::digest(&run, &twin), "score": score }),
    )?;
    Ok(ExitCode::SUCCESS)
}
