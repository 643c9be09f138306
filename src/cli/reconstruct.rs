//! `palpate reconstruct`: a capture in, a twin's folder out, whole or not at all.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::arguments::Common;
use super::output;
use crate::base::{Error, Result, Seed, StagedFolder, read_text, write_atomically};
use crate::capture::{Capture, read_capture};
use crate::export::export_all;
use crate::pipeline::{Options, Pass, Run, build};
use crate::report;
use crate::stages::estimation::{ForceScale, materials_from_toml};
use crate::stages::snapshots::{Course, Keeper, LearntPrior};
use crate::twin::{Link, read_twin, write_twin};

/// What was asked for beyond the capture.
pub struct Request<'a> {
    pub passes: &'a [String],
    pub resume: bool,
    pub voxel: f64,
    pub timings: bool,
    pub snapshot_prior: Option<&'a Path>,
    pub snapshot_search: Option<&'a Path>,
    pub snapshot_evaluations: Option<usize>,
    pub force_scale: Option<&'a Path>,
    pub materials: &'a [PathBuf],
    pub rerun: bool,
}

/// The recording for the Rerun viewer, in the twin's folder.
const RECORDING: &str = "recording.rrd";

/// Reconstructs and says what came out.
pub fn reconstruct(common: &Common, capture: &Path, out: &Path, request: &Request) -> Result<ExitCode> {
    if request.rerun && !cfg!(feature = "rerun") {
        return Err(Error::Usage(
            "--rerun: this palpate was built without the recording; build it with `cargo build --release --features rerun`".into(),
        ));
    }
    let options = options(common, request)?;
    let capture = read_capture(capture)?;
    let recorded = !request.rerun || out.join(RECORDING).exists();
    if request.resume && recorded && is_done(out, &capture, &options) {
        output::say(
            common,
            &format!("{}: already made from this capture with these options", out.display()),
        );
        return Ok(ExitCode::SUCCESS);
    }
    let staged = StagedFolder::create(out, "twin.json")?;
    let run = run_passes(common, &capture, &options)?;
    #[cfg(feature = "rerun")]
    if request.rerun {
        staged.write(RECORDING, &crate::recording::record(&capture, &run)?)?;
    }
    write(&capture, &run, &options, staged)?;
    output::notices(common, &run.model.twin.notices);
    output::result(common, &summary(&run, out), &digest(&run, out))?;
    Ok(ExitCode::SUCCESS)
}

/// The options that were asked for.
pub fn options(common: &Common, request: &Request) -> Result<Options> {
    let mut options = Options {
        seed: Seed(common.seed),
        timings: request.timings,
        ..Options::default()
    };
    options.shape.voxel = request.voxel;
    options.shape.check()?;
    if let Some(path) = request.snapshot_prior {
        options.snapshots.learnt = Some(LearntPrior::from_toml(&read_text(path)?)?);
    }
    if let Some(evaluations) = request.snapshot_evaluations {
        options.snapshots.evaluations = evaluations;
    }
    options.snapshots.check()?;
    if let Some(path) = request.snapshot_search {
        let begun = path.exists().then(|| read_text(path)).transpose()?;
        let begun = begun.as_deref().map(Course::from_json).transpose()?;
        let to = path.to_owned();
        let keep = move |course: &Course| write_atomically(&to, course.to_json()?.as_bytes());
        options.snapshots.keeper = Some(Keeper::new(begun, keep));
    }
    if let Some(path) = request.force_scale {
        options.estimation.force_scale = Some(ForceScale::from_toml(&read_text(path)?, path)?);
    }
    for path in request.materials {
        options
            .estimation
            .materials
            .extend(materials_from_toml(&read_text(path)?, path)?);
    }
    if !request.passes.is_empty() {
        options.passes = request
            .passes
            .iter()
            .map(|p| Pass::from_name(p))
            .collect::<Result<_>>()?;
        options.passes.sort();
        options.passes.dedup();
    }
    Ok(options)
}

/// Whether the twin in `out` was made from this capture with these options by this version.
pub fn is_done(out: &Path, capture: &Capture, options: &Options) -> bool {
    read_twin(out).is_ok_and(|(model, _)| {
        let made = &model.twin.provenance;
        made.capture_digest == capture.digest
            && made.options == options.record()
            && made.seed == options.seed.0
            && made.version == env!("CARGO_PKG_VERSION")
    })
}

/// Runs the passes under a progress bar.
pub fn run_passes(common: &Common, capture: &Capture, options: &Options) -> Result<Run> {
    let progress = output::progress(common, "reconstructing", 6);
    let run = build(capture, options, &progress);
    progress.finish();
    run
}

/// Writes the twin, its exports and its report into the staged folder and puts it in its place.
pub fn write(capture: &Capture, run: &Run, options: &Options, staged: StagedFolder) -> Result<()> {
    write_twin(&staged, &run.model, &run.diagnosis)?;
    for (path, bytes) in &run.pictures {
        staged.write(path, bytes)?;
    }
    if options.runs(Pass::Export) {
        export_all(&run.model, &staged)?;
    }
    if options.runs(Pass::Report) {
        staged.write("report.html", report::render(capture, run)?.as_bytes())?;
    }
    staged.commit()
}

/// A few lines that say what came out.
pub fn summary(run: &Run, out: &Path) -> String {
    let twin = &run.model.twin;
    let mut text = String::new();
    for (_, link) in twin.links() {
        text += &format!("{}: {}{}\n", link.name, measured(link), surface(link));
    }
    for joint in twin.joints() {
        text += &format!(
            "{} -> {}: {:?} joint, p = {:.2}\n",
            joint.parent, joint.child, joint.kind, joint.probability
        );
    }
    for relation in &twin.relations {
        text += &format!(
            "{} | {}: {:?}, p = {:.2}\n",
            relation.a, relation.b, relation.kind, relation.probability
        );
    }
    text += &format!("diagnosis: {:?}\n", run.diagnosis.verdict);
    text + &format!("report: {}\n", out.join("report.html").display())
}

/// What was measured of a link, in words.
fn measured(link: &Link) -> String {
    let all = [
        ("mass", &link.mass),
        ("friction force", &link.friction_force.kinetic),
        ("static friction", &link.friction.static_),
        ("kinetic friction", &link.friction.kinetic),
        ("stiffness", &link.stiffness),
    ];
    let known: Vec<String> = all
        .iter()
        .filter_map(|(name, estimate)| {
            let e = estimate.as_ref().filter(|e| e.is_measured())?;
            let sd = e.sd.map_or(String::new(), |sd| format!(" ± {sd:.*}", decimals(sd)));
            let digits = decimals(e.sd.unwrap_or(0.01));
            Some(format!("{name} {:.digits$}{sd} {}", e.value, e.unit))
        })
        .collect();
    match known.is_empty() {
        true => "nothing measured but its shape or place".into(),
        false => known.join(", "),
    }
}

/// How much of a link's surface was seen, in words; empty without a mesh.
fn surface(link: &Link) -> String {
    link.surface.map_or(String::new(), |s| {
        let [seen, mirrored, closed] = [s.seen, s.mirrored, s.closed].map(|share| 100.0 * share);
        format!("; surface {seen:.0} % seen, {mirrored:.0} % mirrored, {closed:.0} % closed")
    })
}

/// Digits after the point that show two figures of a spread.
fn decimals(sd: f64) -> usize {
    (1.0 - sd.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize
}

/// The result for `--json`.
pub fn digest(run: &Run, out: &Path) -> serde_json::Value {
    let seconds: serde_json::Map<String, serde_json::Value> = run
        .seconds
        .iter()
        .map(|(pass, s)| ((*pass).to_owned(), json!(s)))
        .collect();
    json!({
        "out": out,
        "bodies": run.model.twin.bodies.iter().map(|b| &b.name).collect::<Vec<_>>(),
        "relations": run.model.twin.relations.len(),
        "surface": run.model.twin.links().map(|(_, l)| (l.name.clone(), json!(l.surface))).collect::<BTreeMap<_, _>>(),
        "verdict": run.diagnosis.verdict,
        "seconds": seconds,
    })
}
