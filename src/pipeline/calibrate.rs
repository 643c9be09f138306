//! Calibration from captures: the same segmentation as in a reconstruction, no twin.

use super::Options;
use super::assemble;
use crate::base::{Notices, Result};
use crate::capture::Capture;
use crate::stages::{estimation, interaction, shape};

/// An entry of `calibration/materials.toml` from the tilts of a capture.
pub fn calibrate_friction(capture: &Capture, notices: &mut Notices) -> Result<String> {
    let options = Options::default();
    let model = assemble::model(capture, shape::Shapes::default(), &options);
    let segmented = interaction::segment(capture, &model, &options.interaction, notices)?;
    estimation::calibrate_friction(capture, &segmented, &options.estimation, notices)
}
