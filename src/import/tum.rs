//! Trajectories of the TUM RGB-D benchmark as tracks.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Quaternion, UnitQuaternion};

use super::mcap::empty;
use crate::base::{Error, Result, read_text};
use crate::capture::{Capture, Interaction, Kind, PoseStream};

/// How far the length of a quaternion may be from one.
const UNIT: f64 = 1e-3;

/// A capture at `out`, not written yet, with one recording in which each file is the track of the thing that it is named after.
///
/// # Errors
/// [`Error::BadInput`] that names file and row where a file cannot be read, or two have one name.
pub fn import_tum(files: &[PathBuf], out: &Path) -> Result<Capture> {
    let mut tracks = BTreeMap::new();
    for file in files {
        let name = file
            .file_stem()
            .map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        if tracks.insert(name.clone(), trajectory(file)?).is_some() {
            return Err(Error::bad_input(file, "name", name, "a name that no other file has"));
        }
    }
    let mut capture = empty(out);
    capture.interactions.push(Interaction {
        tracks,
        ..recording(Kind::Hold)
    });
    Ok(capture)
}

/// A recording with nothing in it.
pub(super) fn recording(kind: Kind) -> Interaction {
    Interaction {
        name: "recording".into(),
        kind,
        action: None,
        tool_name: None,
        tool: None,
        target: None,
        force: None,
        tool_path: None,
        support_path: None,
        tracks: BTreeMap::new(),
        frames: None,
        held_out: false,
    }
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
