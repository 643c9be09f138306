//! `palpate batch`: many captures, on all cores; what is there already is kept.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use rayon::prelude::*;
use serde::Serialize;
use serde_json::json;

use super::arguments::Common;
use super::output;
use super::reconstruct::{Request, is_done, options, write};
use crate::base::{Error, Progress, Result, StagedFolder};
use crate::capture::read_capture;
use crate::pipeline::{Options, build};
use crate::twin::{Diagnosis, Model, Verdict, read_twin};

/// What became of one capture.
#[derive(Serialize)]
struct Row {
    /// The folder of the capture.
    capture: PathBuf,
    /// The folder of its twin.
    twin: PathBuf,
    /// `made`, `kept` or `failed`.
    status: &'static str,
    /// Why it failed.
    why: Option<String>,
    /// How many bodies, links with a measured mass, and joints it has.
    bodies: usize,
    masses: usize,
    joints: usize,
    /// What its diagnosis comes to.
    verdict: Option<Verdict>,
}

/// Reconstructs every capture into a folder of its own below `out`, in parallel; one that fails does not stop the others, and
/// one whose twin was made from the same capture with the same options by this version is kept. Exit code 1 where one failed.
pub fn batch(common: &Common, captures: &[PathBuf], out: &Path, voxel: f64) -> Result<ExitCode> {
    let request = Request {
        passes: &[],
        resume: true,
        voxel,
        timings: false,
        snapshot_prior: None,
        snapshot_search: None,
        snapshot_evaluations: None,
        force_scale: None,
        materials: &[],
        rerun: false,
    };
    let options = options(common, &request)?;
    let named = named(captures)?;
    let progress = output::progress(common, "captures", named.len() as u64);
    let rows: Vec<Row> = named
        .par_iter()
        .map(|(name, capture)| {
            let row = row(capture, &out.join(name), &options);
            progress.advance();
            row
        })
        .collect();
    progress.finish();
    let failed = rows.iter().any(|r| r.status == "failed");
    output::result(common, &table(&rows), &json!({ "captures": rows }))?;
    Ok(ExitCode::from(u8::from(failed)))
}

/// The captures by the names of their folders, in the order in which they were given.
fn named(captures: &[PathBuf]) -> Result<Vec<(String, &PathBuf)>> {
    let mut taken: BTreeMap<String, &PathBuf> = BTreeMap::new();
    let mut named = Vec::new();
    for capture in captures {
        let whole = capture.canonicalize().unwrap_or_else(|_| capture.clone());
        let name = whole.file_name().map(|n| n.to_string_lossy().into_owned());
        let name = name.ok_or_else(|| Error::Usage(format!("{}: a folder without a name", capture.display())))?;
        if let Some(other) = taken.insert(name.clone(), capture) {
            let (a, b) = (other.display(), capture.display());
            return Err(Error::Usage(format!(
                "{a} and {b}: two captures whose twins would go into the same folder"
            )));
        }
        named.push((name, capture));
    }
    Ok(named)
}

fn row(capture: &Path, twin: &Path, options: &Options) -> Row {
    let (status, why, read) = match one(capture, twin, options) {
        Ok(status) => (status, None, read_twin(twin).ok()),
        Err(e) => ("failed", Some(e.to_string()), None),
    };
    let count = |of: fn(&Model) -> usize| read.as_ref().map_or(0, |(m, _)| of(m));
    let measured = |m: &Model| {
        let masses = m.twin.links().filter_map(|(_, l)| l.mass.as_ref());
        masses.filter(|e| e.is_measured()).count()
    };
    Row {
        capture: capture.to_path_buf(),
        twin: twin.to_path_buf(),
        status,
        why,
        bodies: count(|m| m.twin.bodies.len()),
        masses: count(measured),
        joints: count(|m| m.twin.joints().count()),
        verdict: read.map(|(_, Diagnosis { verdict, .. })| verdict),
    }
}

fn one(capture: &Path, twin: &Path, options: &Options) -> Result<&'static str> {
    let capture = read_capture(capture)?;
    if is_done(twin, &capture, options) {
        return Ok("kept");
    }
    let staged = StagedFolder::create(twin, "twin.json")?;
    let run = build(&capture, options, &Progress::silent())?;
    write(&capture, &run, options, staged)?;
    Ok("made")
}

fn table(rows: &[Row]) -> String {
    let name = |r: &Row| {
        r.twin
            .file_name()
            .map_or_else(String::new, |n| n.to_string_lossy().into_owned())
    };
    let width = rows.iter().map(|r| name(r).chars().count()).max().unwrap_or(0).max(7);
    let mut text = format!("{:width$}  status  bodies  masses  joints  diagnosis\n", "capture");
    for row in rows {
        let end = match (&row.why, &row.verdict) {
            (Some(why), _) => why.clone(),
            (None, Some(verdict)) => format!("{verdict:?}").to_lowercase(),
            (None, None) => String::new(),
        };
        let Row {
            status,
            bodies,
            masses,
            joints,
            ..
        } = row;
        let _ = writeln!(
            text,
            "{:width$}  {status:6}  {bodies:6}  {masses:6}  {joints:6}  {end}",
            name(row)
        );
    }
    text
}
