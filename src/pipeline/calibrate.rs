//! Calibration from captures: the same segmentation as in a reconstruction, no twin.

use super::Options;
use super::{Pass, assemble, build};
use crate::base::{Error, Notice, Notices, Progress, Result, Seed, Severity};
use crate::capture::Capture;
use crate::stages::estimation::ForceScale;
use crate::stages::snapshots::{LearntPrior, Seen};
use crate::stages::{estimation, interaction, shape};

/// An entry of `calibration/materials.toml` from the tilts of a capture.
pub fn calibrate_friction(capture: &Capture, notices: &mut Notices) -> Result<String> {
    let options = Options::default();
    let model = assemble::model(capture, shape::Shapes::default(), &options);
    let segmented = interaction::segment(capture, &model, &options.interaction, notices)?;
    estimation::calibrate_friction(capture, &segmented, &options.estimation, notices)
}

/// The scale of the force sensor from the lifts of known weights of a capture.
pub fn calibrate_force(capture: &Capture, notices: &mut Notices) -> Result<ForceScale> {
    let options = Options::default();
    let model = assemble::model(capture, shape::Shapes::default(), &options);
    let segmented = interaction::segment(capture, &model, &options.interaction, notices)?;
    estimation::calibrate_force(capture, &segmented, &options.estimation, notices)
}

/// The noise of the range cameras of a capture that looks at a still plane, as text of a file.
pub fn calibrate_camera(capture: &Capture, notices: &mut Notices) -> Result<String> {
    shape::camera_noise_to_toml(&shape::camera_noise(capture, notices)?)
}

/// A prior by shape and material from captures of snapshot pairs, for things of their kind. What a run had to say of its capture
/// is said here too, and captures that tell nothing are named.
///
/// # Errors
/// Where fewer than two things were seen: one alone does not tell what things of a kind have in common.
pub fn learn_snapshots(captures: &[Capture], seed: Seed, notices: &mut Notices) -> Result<LearntPrior> {
    let options = Options {
        seed,
        passes: vec![Pass::Shape, Pass::Physics],
        ..Options::default()
    };
    let mut seen: Vec<Seen> = Vec::new();
    for capture in captures {
        let run = build(capture, &options, &Progress::silent())?;
        let things: Vec<Seen> = run
            .snapshots
            .into_iter()
            .flat_map(|s| s.things)
            .map(|t| t.seen)
            .collect();
        let warnings = run.model.twin.notices.into_iter();
        let warnings = warnings.filter(|n| n.severity == Severity::Warning);
        notices.0.extend(warnings.map(|n| Notice {
            about: format!("{} in {}", n.about, capture.name),
            ..n
        }));
        if things.is_empty() {
            let words = "no snapshot pairs of a thing of known shape that a tool moved: nothing is learnt of it";
            notices.warn("calibrate", &capture.name, words);
        }
        seen.extend(things);
    }
    match seen.len() {
        0 => {
            return Err(Error::Failed(
                "no capture held snapshot pairs of a thing that a tool moved".into(),
            ));
        }
        1 => {
            return Err(Error::Failed(
                "one thing alone does not tell what things of its kind have in common: give the captures of two or more".into(),
            ));
        }
        _ => {}
    }
    Ok(LearntPrior::from_seen(&seen))
}
